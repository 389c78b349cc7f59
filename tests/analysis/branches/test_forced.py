"""Forced motions of rough pads, and cycles of rough shoes, against the event-driven scheme and closed forms."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.branches.follow import both_ways, follow
from brakecli.analysis.branches.forced import Forced
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.newton import Settings
from brakecli.analysis.branches.point import Branch, Point
from brakecli.analysis.branches.rough_cycles import RoughCycles
from brakecli.analysis.branches.sliding import Sliding
from brakecli.analysis.branches.switch import switch
from brakecli.analysis.stability.linear import linear_theory
from brakecli.case.case import Case
from brakecli.errors import CaseError
from brakecli.solver.phases import BACKWARD, FORWARD, STICK
from brakecli.solver.system import System
from tests.analysis.shoes import Shoe
from tests.campaign import campaign, counts
from tests.examples import SQUEAL, make
from tests.solver.test_rough_flow import event_driven, scales
from tests.studies.sweeps.shoes import drawn

Tables = dict[str, Any]
FRICTION = "friction.coefficient"
DOUBLES = 9001
"""The seed of a shoe whose forced motion doubles its period at a friction of 0.79997."""


def line_of(seed: int) -> tuple[Tables, Line]:
    """A shoe whose pad opens in part, and a range of one of its keys."""
    tables, key, low, high, _ = drawn(seed, "opening")
    return tables, Line(Case.model_validate(tables), [key.replace("__", ".")], low, high)


def gap(system: System, state: tuple[float, ...], period: float) -> float:
    """How far (in depths) the event-driven scheme comes from a state after a period."""
    end = event_driven(system, np.array(state), period, 10).rows[-1, :4]
    return float(np.abs((end - state) / scales(system)).max())


def stretch(point: Point) -> float:
    """How much a disturbance may grow in a period, at least 1."""
    return max(1.0, float(abs(point.multipliers[0])))


def some(branch: Branch, count: int) -> Iterator[Point]:
    """Points spread over a branch, its ends left out."""
    points = branch.points
    yield from (points[len(points) * k // (count + 1)] for k in range(1, count + 1))


def begun(problem: Forced) -> Point:
    """A motion that has grown with the waves, at the first place where one does."""
    point = next((found for p in (0.0, 1.0, 0.5) if (found := problem.grow(p)) is not None), None)
    assert point is not None
    return point


@pytest.mark.parametrize("many", counts(3, 10))
def test_motions_close_and_disturbances_grow_as_in_the_event_driven_scheme(many: int) -> None:
    """Runs of that scheme end where they begin, and their differences have the same multipliers.

    The largest error is that of the cells in which contact begins or ends: of order c³ in the force for a cell c,
    and of order c² in its slope. A wave has 24 cells and more, so these are 7e-5 and 2e-3, times the growth of
    disturbances over the period.
    """
    stable = unstable = 0
    for seed in range(9000, 9000 + many):
        _, line = line_of(seed)
        problem = Forced.along(line)
        branch = both_ways(problem, begun(problem), Settings(points=40, insertions=0, seconds=math.inf))
        for point in some(branch, 2):
            if stretch(point) > 100.0:
                continue
            system = line.system(point.p)
            motion = point.facts
            assert gap(system, motion.state, motion.period) < 1e-4 * stretch(point), (seed, point.p)
            stable = stable + point.stable
            unstable = unstable + (not point.stable)
            ends = [
                [
                    event_driven(system, np.array(motion.state) + change, motion.period, 1).rows[-1, :4]
                    for change in pair
                ]
                for pair in ((step, -step) for step in 1e-5 * np.diag(scales(system)))
            ]
            size = scales(system)
            matrix = np.array([(one - other) / size / 2e-5 for one, other in ends]).T
            expected = np.poly(np.linalg.eigvals(matrix))
            # coefficients are smooth where two multipliers meet, as multipliers are not
            np.testing.assert_allclose(
                np.poly(point.multipliers), expected, atol=3e-3 * stretch(point) ** 2, err_msg=str((seed, point.p))
            )
    assert stable
    assert unstable


def test_the_motion_of_twice_the_period_is_that_of_a_run() -> None:
    """Between two flips the motion of the single period is unstable."""
    _, line = line_of(DOUBLES)
    problem = Forced.along(line)
    branch = both_ways(problem, begun(problem))
    flip = next(each for each in branch.specials if each.kind == "flip")
    double = problem.of_periods(2)
    first = switch(double, flip.point)
    assert first is not None
    assert first.facts.period == pytest.approx(2.0 * flip.point.facts.period)
    further = follow(double, first, None, Settings(points=5, longest=0.01, insertions=0))
    point = further.points[-1]
    system = line.system(point.p)
    assert gap(system, point.facts.state, point.facts.period) < 1e-4 * stretch(point)
    assert gap(system, point.facts.state, 0.5 * point.facts.period) > 1e-3
    assert point.stable
    run = problem.settle(point.p, np.array(point.facts.state) + 1e-4 * scales(system), waited=400)
    assert run is not None
    assert run[0].periods == 2
    same, later = (np.abs(run[1].u - each).max() for each in (point.u, np.roll(point.u, 4)))
    assert min(same, later) < 1e-4


def test_a_run_settles_on_the_motion_that_has_grown() -> None:
    _, line = line_of(DOUBLES)
    problem = Forced.along(line)
    grown = problem.grow(0.1)
    assert grown is not None
    assert grown.stable
    run = problem.settle(0.1, np.array(grown.facts.state) + 0.1 * scales(line.system(0.1)), waited=600)
    assert run is not None
    assert run[0].periods == 1
    np.testing.assert_allclose(run[1].u, grown.u, atol=1e-6)


def test_a_branch_passes_borders_of_stick() -> None:
    """In resonance the shoe becomes as fast as the wheel, is held by it, and slips ahead of it before."""
    tables: Tables = {name: dict(table) for name, table in SQUEAL.items()}
    tables["contact"] = {"half_length": 0.00024, "stiffness": 2e6 / 0.00048}
    tables["friction"] = {"coefficient": 0.2}
    tables["roughness"] = {"wheel": {"amplitudes": [1e-4], "wavelengths": [0.0012]}}
    line = Line(Case.model_validate(tables), ["wheel.angular_speed"], 0.35, 0.45)
    problem = Forced.along(line)
    point = problem.grow(0.0)
    assert point is not None
    branch = follow(problem, point, 1.0)
    assert branch.ended[1].kind == "range"
    assert [each.name for each in branch.specials if each.kind == "grazing"] == [
        "grazing stick",
        "sequence of events changes",
        "sequence of events changes",
        "grazing stick",
    ]
    assert {point.word for point in branch.points} == {
        (BACKWARD,),
        (BACKWARD, STICK),
        (BACKWARD, FORWARD, STICK),
    }
    sticking = [point for point in branch.points if STICK in point.facts.word]
    for point in sticking[:: len(sticking) // 4]:
        motion = point.facts
        assert 0.0 < motion.stick_fraction < 0.05
        assert gap(line.system(point.p), motion.state, motion.period) < 1e-4
        # what lies along the velocity is lost as stick begins
        assert abs(point.multipliers[-1]) < 1e-9


def test_a_branch_ends_where_cases_are_no_longer_valid() -> None:
    tables, _ = line_of(9000)
    line = Line(Case.model_validate(tables), [FRICTION], -0.2, 0.6)
    problem = Forced.along(line)
    assert problem.grow(0.0) is None
    point = problem.grow(1.0)
    assert point is not None
    branch = follow(problem, point, -1.0)
    assert branch.ended[1].kind == "lost"
    assert "friction.coefficient" in branch.ended[1].reason
    assert line.value(branch.points[-1].p) == pytest.approx(0.0, abs=1e-5)


def test_waves_without_a_common_period_are_refused() -> None:
    tables, _ = line_of(9000)
    tables["roughness"]["wheel"] = {"amplitudes": [1e-5, 1e-5], "wavelengths": [0.02, 0.02 * math.sqrt(2.0)]}
    with pytest.raises(CaseError, match=r"roughness\.wheel: the waves of the wheel have no common period"):
        Forced.along(Line(Case.model_validate(tables), [FRICTION], 0.0, 1.0))


def test_changing_speed_and_invalid_ranges_are_refused() -> None:
    tables, _ = line_of(9000)
    with pytest.raises(CaseError, match=r"friction\.coefficient"):
        Forced.along(Line(Case.model_validate(tables), [FRICTION], -2.0, -1.0))
    tables["load"] = {"times": [0.0, 1.0], "forces": [1000.0, 1100.0]}
    with pytest.raises(CaseError, match="changes in time"):
        Forced.along(Line(Case.model_validate(tables), [FRICTION], 0.0, 1.0))


# --- rough shoes on smooth wheels -----------------------------------------------------------------------------


def rough_shoe(amplitude: float) -> Line:
    """The shoe of the pages, rough, on a faster wheel."""
    tables: Tables = {name: dict(table) for name, table in SQUEAL.items()}
    tables["wheel"] = {"radius": 0.5, "angular_speed": 1.0}
    tables["roughness"] = {"shoe": {"amplitudes": [amplitude], "wavelengths": [0.03]}}
    return Line(Case.model_validate(tables), [FRICTION], 0.0, 1.2)


@pytest.mark.parametrize("amplitude", [6e-5, 8e-4])
@campaign
def test_cycles_of_a_rough_shoe_begin_at_flutter_and_close(amplitude: float) -> None:
    """It touches everywhere in steady sliding, or in part. Where it touches everywhere flutter is that of modes.

    The error of the flow is about 1e-5 depths.
    """
    line = rough_shoe(amplitude)
    sliding = Sliding(line)
    change = next(each for each in sliding.changes(sliding.along()) if each.lost)
    if amplitude < 1e-4:
        shoe = Shoe.of({**SQUEAL, "wheel": {"radius": 0.5, "angular_speed": 1.0}})
        assert shoe.critical == pytest.approx(line.value(change.p), abs=1e-8)
    cycles = RoughCycles(line)
    first = sliding.vibration(cycles, change)
    assert first is not None
    assert first.facts.frequency == pytest.approx(change.frequency, rel=1e-2)
    branch = follow(cycles, first, None, Settings(seconds=math.inf, points=400))
    assert branch.ended[1].kind == "range"
    for point in some(branch, 4):
        motion = point.facts
        assert gap(line.system(point.p), motion.state, motion.period) < 1e-4 * stretch(point)
    assert any(STICK in point.facts.word for point in branch.points)


def test_a_rough_wheel_has_no_cycles_of_its_own() -> None:
    _, line = line_of(9000)
    with pytest.raises(CaseError, match="the wheel is rough"):
        RoughCycles(line)


SMALL: Tables = {
    "shoe": {"mass": 46.129521795716045},
    "wheel": {"radius": 0.7410608363731757, "angular_speed": 0.0017932722653984268},
    "link1": {"stiffness": 22405785.378138486, "damping": 118.65562481872233, "angle_deg": -10.344508228088703},
    "link2": {"stiffness": 156125774.89717624, "damping": 1590.8735919957098, "angle_deg": 32.924093907981344},
    "load": {"force": 79.95868511312914},
    "friction": {"coefficient": 0.3678336553553474},
    "contact": {"half_length": 1.2109011771019828e-05, "stiffness": 9857782109640.273},
    "roughness": {
        "wheel": {
            "amplitudes": [1.67178158691992e-09],
            "wavelengths": [1.118702378400082e-05],
            "phases_deg": [7.834480612458514],
        }
    },
    "solver": {"duration": 1.0, "step": 1e-5},
}
"""What the wave forces is a three thousandth of the depth that the load presses the shoe in by."""


def test_the_amplitude_of_a_small_forced_motion_is_that_of_the_linear_one() -> None:
    """Of one wave in full contact: |x| of (S + iωB - ω²m) z = f, by another program's formula."""
    line = Line(make(SMALL), [FRICTION], 0.05 * 0.3678, 0.7 * 0.3678)
    problem = Forced.along(line)
    first = problem.begin(0.0)
    assert first is not None
    branch = follow(problem, first, 1.0)
    assert len(branch.points) > 5
    for point in branch.points:
        theory = linear_theory(line.system(point.p), line.system(point.p).belt_speed)
        assert theory is not None
        assert point.facts.amplitude == pytest.approx(abs(theory.waves[0, 0]), rel=2e-4)
