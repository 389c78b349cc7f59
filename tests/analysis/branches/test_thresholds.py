"""Both thresholds of friction, as `stability` and `advise` name them: against branches, and against runs."""

from typing import Any

import pytest

from brakecli.analysis.branches import thresholds as module
from brakecli.analysis.branches.explore import Explorer
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.thresholds import FRICTION, Thresholds, thresholds
from brakecli.analysis.stability.report import stability
from brakecli.case.system import system_of
from brakecli.studies.sweeps.point import next_start
from brakecli.studies.sweeps.simulate import PointRun, simulate
from tests.analysis.branches.smooth_shoes import changed, numbered
from tests.analysis.shoes import Tables
from tests.campaign import campaign
from tests.examples import make

pytestmark = pytest.mark.usefixtures("compiled")

SEED = 2500
SUBCRITICAL = 79  # of the shoes that it draws: it comes to rest within 4,000 cycles,
MORE = [17, 41, 43, 77, 86, 114, 136]  # and so do these
CYCLES = 4000
SUPERCRITICAL = 2  # of the same shoes


def shoe(number: int) -> Tables:
    return numbered(SEED, number)


def found_of(tables: Tables) -> Thresholds:
    case = make(tables)
    system = system_of(case)
    return thresholds(case, system, stability(system))


def motion(tables: Tables, friction: float, frequency: float, start: dict[str, Any]) -> PointRun:
    """A run of the piecewise-exact scheme, which knows nothing of branches."""
    solver = {"scheme": "piecewise-exact", "duration": CYCLES / frequency}
    sampled = {"sample_interval": 0.02 / frequency}
    return simulate(
        make({**changed(tables, FRICTION, friction), "initial": start, "solver": solver, "output": sampled})
    )


@pytest.mark.parametrize("number", [SUBCRITICAL, *(pytest.param(each, marks=campaign) for each in MORE)])
def test_a_strong_push_dies_out_below_and_lasts_above(number: int) -> None:
    """The push is the state of the shoe as it squeals, 5 % above its critical friction."""
    tables = shoe(number)
    system = system_of(make(tables))
    report = stability(system)
    assert report.critical is not None
    found = thresholds(make(tables), system, report)
    assert found.coexists_from is not None
    assert found.coexists_from < 0.97 * report.critical.friction
    frequency = report.critical.frequency
    beside = {"at": "equilibrium", "vx": -0.5 * abs(system.belt_speed)}
    squeal = motion(tables, 1.05 * report.critical.friction, frequency, beside)
    assert squeal.verdict.regime == "relaxation"
    ((_, start),) = next_start(squeal).items()
    below, above = (motion(tables, part * found.coexists_from, frequency, start) for part in (0.97, 1.03))
    assert below.verdict.regime == "damped"
    assert above.verdict.regime == "relaxation"


def test_of_a_supercritical_shoe_a_squeal_dies_out_below_the_critical_friction() -> None:
    tables = shoe(SUPERCRITICAL)
    system = system_of(make(tables))
    lost = stability(system).critical
    assert lost is not None
    beside = {"at": "equilibrium", "vx": -0.5 * abs(system.belt_speed)}
    squeal = motion(tables, 1.05 * lost.friction, lost.frequency, beside)
    assert squeal.verdict.regime in ("relaxation", "quasi-harmonic")
    ((_, start),) = next_start(squeal).items()
    assert motion(tables, 0.9 * lost.friction, lost.frequency, start).verdict.regime == "damped"


def test_where_sliding_does_not_lose_its_stability_there_is_none() -> None:
    tables = shoe(SUBCRITICAL)
    for case in (changed(tables, "wheel.angular_speed", 0.0), throughout(tables)):
        found = found_of(case)
        assert found == Thresholds(None, "")
        assert found.sentence is None


def throughout(tables: Tables) -> Tables:
    """With links at right angles nothing couples both directions, and no friction makes sliding unstable."""
    return changed(changed(tables, "link1.angle_deg", 0.0), "link2.angle_deg", 0.0)


def test_a_shoe_that_locks_has_no_vibration_beside_it() -> None:
    tables = shoe(SUBCRITICAL)
    turned = changed(tables, "wheel.angular_speed", -tables["wheel"]["angular_speed"])
    found = found_of(turned)
    assert found.kind == "divergence"
    assert (found.coexists_from, found.barrier, found.beside) == (None, None, "")
    assert str(found.sentence).endswith("and the shoe locks there")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"roughness": {"wheel": {"amplitudes": [1e-9], "wavelengths": [0.01]}}}, "`brakecli branch` says"),
        ({"roughness": {"shoe": {"amplitudes": [1e-9], "wavelengths": [0.01]}}}, "`brakecli branch` says"),
        ({"link1": {"damping": 0.0}, "link2": {"damping": 0.0}}, "no dashpot damps the shoe"),
        ({"load": {"times": [0.0, 1.0], "forces": [500.0, 600.0]}}, "speed or load change"),
    ],
)
def test_where_no_branch_is_followed_the_sentence_says_why(more: Tables, words: str) -> None:
    tables = shoe(SUBCRITICAL)
    kept = {name: table for name, table in tables.items() if name != "load" or name not in more}
    found = found_of({**kept, **{name: {**kept.get(name, {}), **table} for name, table in more.items()}})
    assert (found.coexists_from, found.barrier) == (None, None)
    assert words in str(found.sentence)


@pytest.mark.parametrize(("points", "words"), [(60, "at least; it may begin lower"), (4, "is not known")])
def test_a_branch_that_is_cut_is_said_to_be(points: int, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "POINTS", points)
    found = found_of(shoe(SUBCRITICAL))
    assert words in str(found.sentence)
    assert "the branch is cut at " in str(found.sentence)


def test_the_range_reaches_to_twice_the_critical_friction_and_to_the_case_where_that_is_stable(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    highest = list[float]()

    class Noting(Explorer):
        def __init__(self, line: Line, *others: Any, **more: Any) -> None:
            highest.append(line.high)
            super().__init__(line, *others, **more)

    monkeypatch.setattr(module, "Explorer", Noting)
    tables = shoe(SUBCRITICAL)
    critical = found_of(tables).critical
    assert critical is not None
    found_of(changed(tables, FRICTION, 3.0 * critical))  # unstable there
    assert highest == [pytest.approx(2.0 * critical)] * 2
