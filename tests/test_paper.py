"""The paper's claims: what the cases of cases/paper give, and what docs/paper-claims.md says of them."""

import importlib
import math
import random
import re

import numpy as np
import pytest
from scipy.optimize import brentq

from brakecli.analysis.branches.line import Line
from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.analysis.stability.modes import crossings, growth, stiffness_matrix
from brakecli.analysis.stability.report import stability
from brakecli.api.inputs import load_sweep
from brakecli.case.case import Case
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.solver.roughness import TWO_PI
from brakecli.studies.sweeps.critical import search
from brakecli.studies.sweeps.plan import kind_of
from brakecli.studies.sweeps.simulate import simulate
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome, Search
from tests.campaign import campaign, differences, statistics
from tests.commands import ROOT

FOLDER = ROOT / "cases" / "paper"
PAGE = (ROOT / "docs" / "paper-claims.md").read_text()
C1 = 1e7
TAN5 = math.tan(math.radians(5.0))
NO_DASHPOTS = {"link1.damping": 0.0, "link2.damping": 0.0}
PRINTED = 0.6e-4
"""Half of the last printed digit, and a little."""


def case(name: str, settings: dict[str, float]) -> Case:
    text = (FOLDER / f"{name}.toml").read_text()
    return parse_case(text, name, [f"{key}={float(value)!r}" for key, value in settings.items()]).case


def critical(name: str, settings: dict[str, float]) -> float:
    """The critical friction coefficient by eigenvalues; on smooth surfaces without the scheme's own."""
    system = system_of(case(name, settings))
    if not system.smooth:
        found = stability(system).critical
        return math.nan if found is None else found.friction
    changes = crossings(system.coefficients, system.contact_stiffness, system.belt_speed)
    return next((change.friction for change in changes if change.lost), math.nan)


def simulated(name: str, settings: dict[str, float], upper: float) -> Search:
    wanted = Critical(parameter="friction.coefficient", lower=0.0, upper=upper)
    found = search(wanted, Line(case(name, settings), [wanted.parameter], 0.0, upper))
    assert found.outcome is Outcome.FOUND
    return found


def tables(heading: str) -> list[list[str]]:
    """The rows of the first table after a line of the page, without its head."""
    lines = PAGE.split(heading, 1)[1].splitlines()
    rows = [line for line in lines if line.startswith("|")]
    first = lines.index(rows[0])
    length = next((n for n, line in enumerate(lines[first:]) if not line.startswith("|")), len(lines) - first)
    return [[cell.strip() for cell in line.strip("| ").split("|")] for line in lines[first + 2 : first + length]]


def test_every_file_beside_the_cases_reads() -> None:
    kinds = {True: 0, False: 0}
    for path in sorted(FOLDER.glob("*.toml")):
        text = path.read_text()
        kinds[(kind_of(text) == "sweep")] += 1
        if kind_of(text) == "sweep":
            assert load_sweep(str(path), None).plan.points > 1
        else:
            system_of(parse_case(text, path.name).case)
    assert kinds[True] >= 10
    assert kinds[False] == 3


@campaign
def test_without_dashpots_flutter_begins_least_where_both_directions_are_equally_stiff() -> None:
    sp = importlib.import_module("sympy")  # which has no types
    c1, c2, k, alpha = sp.symbols("c1 c2 K alpha", positive=True)
    pull = c2 * sp.sin(2 * alpha) / 2
    apart = c2 * sp.cos(2 * alpha) - c1 - k
    phi = (pull + apart**2 / (4 * pull)) / k
    assert sp.simplify(phi.diff(c2).subs(c2, c1 + k)) == 0
    assert sp.simplify(phi.diff(c2, 2) * 2 * c2**3 * k * pull / c2 - (c1 + k) ** 2) == 0  # positive: a least value
    least = phi.subs(c2, c1 + k) / (1 + c1 / k)
    assert sp.simplify(sp.expand_trig(least * sp.cos(alpha)) - sp.sin(alpha)) == 0


@pytest.mark.parametrize("share", [0.02, 0.05, 0.2, 1.0])
def test_eigenvalues_give_the_least_critical_friction_at_c1_plus_k(share: float) -> None:
    stiffness = (1.0 + share) * C1
    for angle in (1.0, 5.0, 30.0):
        settings = {**NO_DASHPOTS, "contact.stiffness": share * C1 / 0.1, "link2.angle_deg": angle}

        def at(c2: float, settings: dict[str, float] = settings) -> float:
            return critical("flat", {**settings, "link2.stiffness": c2})

        def slope(c2: float, at: object = at) -> float:
            assert callable(at)
            return float(at(c2 * 1.001) - at(c2 / 1.001))

        place = float(brentq(slope, 0.9 * stiffness, 1.1 * stiffness, rtol=1e-12))
        assert place == pytest.approx(stiffness, rel=1e-6)
        assert at(stiffness) == pytest.approx((1.0 + 1.0 / share) * math.tan(math.radians(angle)), rel=1e-6)
        assert at(stiffness) < min(at(0.99 * stiffness), at(1.01 * stiffness))


@pytest.mark.usefixtures("without_runs")
@pytest.mark.parametrize("share", [0.05, 0.2, 1.0])
def test_simulation_gives_the_least_critical_friction_at_c1_plus_k(share: float) -> None:
    least = (1.0 + 1.0 / share) * TAN5
    settings = {**NO_DASHPOTS, "contact.stiffness": share * C1 / 0.1}
    found = [
        simulated("flat", {**settings, "link2.stiffness": part * (1.0 + share) * C1}, 2.0 * least)
        for part in (0.97, 1.0, 1.03)
    ]
    values = [each.value for each in found if each.value is not None]
    errors = [each.error for each in found if each.error is not None]
    assert len(values) == len(errors) == 3
    assert abs(values[1] - least) <= errors[1] <= 1e-3
    assert values[0] - errors[0] > values[1] + errors[1] < values[2] - errors[2]


@pytest.mark.usefixtures("without_runs")
@pytest.mark.parametrize(
    ("damping", "speed"), [(0.0, 4.0), (300.0, 4.0), pytest.param(300.0, 0.4, marks=campaign)]
)
def test_roughness_in_full_contact_does_not_move_the_critical_friction(damping: float, speed: float) -> None:
    settings = {"link1.damping": damping, "link2.damping": damping, "wheel.angular_speed": speed}
    smooth, rough = (simulated(name, settings, 1.0) for name in ("flat", "rough"))
    assert smooth.value is not None
    assert rough.value is not None
    assert rough.lower is not None
    assert rough.upper is not None
    assert rough.lower <= smooth.value <= rough.upper

    # The waves leave a slope of the force along x that changes as a sine: stiffness that is modulated by at most
    # `swing`, which moves a growth rate by no more than swing/(2mω), times the condition of the modes.
    system = system_of(case("rough", settings))
    c = system.coefficients
    wheel = system.wheel
    phi = smooth.value
    waves = TWO_PI * np.asarray(wheel.turns)
    slope = float(np.sum(np.abs(wheel.g * waves * np.sinc(waves * 0.05 / math.pi))))
    k = system.contact_stiffness
    swing = slope * k * math.hypot(1.0, phi)
    step = 1e-3
    rise = growth(c, k, phi + step) - growth(c, k, phi + 0.5 * step)
    squares, shapes = np.linalg.eig(stiffness_matrix(c, k, phi + 0.5 * step) / c.m)
    shift = np.linalg.cond(shapes) * swing / (2.0 * c.m * math.sqrt(abs(squares[0]))) * 0.5 * step / rise
    narrowed = 2.0 * 0.05 * 1e-3  # each root
    assert abs(rough.value - smooth.value) <= shift + narrowed
    assert shift < 5e-4


def test_one_dashpot_alone_leaves_a_mode_that_it_does_not_reach() -> None:
    draw = random.Random(12)
    for _ in range(20):
        angle = draw.uniform(1.0, 30.0)
        c2 = draw.uniform(0.5e7, 3e7)
        k = draw.uniform(2e5, 1e7)
        settings = {"link2.angle_deg": angle, "link2.stiffness": c2, "contact.stiffness": k / 0.1}
        alpha = math.radians(angle)
        b = draw.uniform(10.0, 3000.0)
        alone = [critical("flat", {**settings, "link1.damping": b1, "link2.damping": b - b1}) for b1 in (b, 0.0)]
        assert alone[0] == pytest.approx(c2 * math.sin(2.0 * alpha) / (2.0 * k), rel=1e-8)
        assert alone[1] == pytest.approx((1.0 + C1 / k) * math.tan(alpha), rel=1e-8)
        undamped = critical("flat", {**settings, **NO_DASHPOTS})
        assert max(alone) <= undamped * (1.0 + 1e-8)


def test_equal_dashpots_at_right_angles_add_their_closed_form() -> None:
    draw = random.Random(3)
    for _ in range(20):
        angle = draw.uniform(1.0, 30.0)
        c2 = draw.uniform(1.05e7, 3e7)
        b = draw.uniform(0.0, 1000.0)
        settings = {"link1.angle_deg": angle, "link2.angle_deg": angle, "link2.stiffness": c2}
        with_dashpots = {**settings, "link1.damping": b, "link2.damping": b}
        system = system_of(case("flat", with_dashpots))
        c = system.coefficients
        k = system.contact_stiffness
        added = b**2 / c.m * 0.5 * (c.c_xx + c.c_yy + k) / (k * abs(c.c_xy))
        expected = critical("flat", {**settings, **NO_DASHPOTS}) + added
        assert critical("flat", with_dashpots) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("name", ["flat", "rough"])
@pytest.mark.parametrize(
    ("friction", "speed", "regime"),
    [(0.5, 0.1, Regime.DAMPED), (0.7, 0.1, Regime.RELAXATION), (0.7, 4.0, Regime.QUASI_HARMONIC)],
)
def test_the_three_regimes(name: str, friction: float, speed: float, regime: Regime) -> None:
    verdict = simulate(case(name, {"friction.coefficient": friction, "wheel.angular_speed": speed})).verdict
    assert verdict.regime is regime
    assert (verdict.excitation is Excitation.SELF_EXCITED) == (regime is not Regime.DAMPED)


def test_the_prose_of_the_page_is_that_of_its_template() -> None:
    template = (ROOT / "docs" / "paper-claims.template.md").read_text()
    pieces = [piece.strip("\n") for piece in re.split(r"\{[a-z0-9_]+\}", template)]
    assert len(pieces) > 15
    assert [piece for piece in pieces if piece not in PAGE] == []


def determined(page: str) -> str:
    """The page without the critical values of shoes without dashpots on surfaces that open.

    Their narrow windows of instability come and go with the last digits, which differ between processors.
    """
    lines = []
    column = 0
    for line in page.splitlines():
        cells = line.split("|")
        if "open, no dashpots, simulation" in line:
            column = cells.index(" open, no dashpots, simulation ")
        elif not line.startswith("|"):
            column = 0
        if column:
            cells[column] = ""
        if not line.startswith("| `alpha-open` | `link1_damping 0,"):
            lines.append("|".join(cells))
    return "\n".join(lines)


@statistics
def test_the_page_is_what_the_sweeps_of_the_paper_give(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")  # where `make paper` finds these modules
    results = importlib.import_module("paper_results").compute()
    again = importlib.import_module("paper_page")
    page = again.page(results, again.touching_by_load(results))
    assert differences(determined(page), determined(PAGE)) == []


def test_the_page_tells_the_eigenvalues_by_the_angle_of_link_2() -> None:
    rows = tables("Smooth surfaces, c2 = c1 + K:")
    assert len(rows) == 16
    for row in rows:
        alpha = {"link2.angle_deg": float(row[0])}
        assert float(row[3]) == pytest.approx(critical("flat", {**alpha, **NO_DASHPOTS}), abs=PRINTED)
        assert float(row[5]) == pytest.approx(critical("flat", alpha), abs=PRINTED)
