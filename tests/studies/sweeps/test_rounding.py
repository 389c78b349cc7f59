"""Error bars of what eigenvalues say on smooth pads, held against fifty digits."""

import math
from itertools import islice
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.branches.line import Line
from brakecli.analysis.stability.certain import Rounded
from brakecli.studies.sweeps.critical import SCANNED_BY_EIGENVALUES, search
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome, Search
from tests.analysis.shoes import random_shoes
from tests.campaign import campaign, counts
from tests.examples import make
from tests.studies.sweeps.independent import Tables, held_by, mpmath, smooth_is_unstable

pytestmark = pytest.mark.usefixtures("without_runs")

KEYS = [
    *(
        "friction__coefficient",
        "friction__coefficient",
        "link2__angle_deg",
        "link1__angle_deg",
        "link2__stiffness",
    ),
    *("contact__stiffness", "contact__half_length", "link1__damping", "shoe__mass"),
]
RANGES = {
    "friction__coefficient": (0.0, 10.0),
    "link2__angle_deg": (-85.0, 85.0),
    "link1__angle_deg": (-60.0, 60.0),
}


def drawn(rng: np.random.Generator) -> tuple[Tables, str, float, float]:
    """A shoe on smooth surfaces, soft or stiff, with dashpots, hardly any or none; a key and its range."""

    def spread(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(math.log10(low), math.log10(high)))

    m = spread(1.0, 100.0)
    c1 = spread(1e5, 1e8)
    half = spread(0.005, 0.1)
    c2 = c1 * spread(1e-4, 1e2)
    contact = c1 * spread(1e-2, 1e3)
    low, high = [(1e-4, 0.3), (1e-9, 1e-5), (0.0, 0.0)][rng.choice(3, p=[0.5, 0.25, 0.25])]
    b1, b2 = (2.0 * spread(low, high) * math.sqrt(c * m) if high else 0.0 for c in (c1, c2))
    tables: Tables = {
        "shoe": {"mass": m},
        "wheel": {"radius": 0.5, "angular_speed": float(rng.choice([1.0, -1.0]))},
        "link1": {"stiffness": c1, "damping": b1, "angle_deg": float(rng.choice([0.0, rng.uniform(-40.0, 40.0)]))},
        "link2": {"stiffness": c2, "damping": b2, "angle_deg": rng.uniform(-60.0, 60.0)},
        "load": {"force": 1e3},
        "friction": {"coefficient": spread(0.05, 3.0)},
        "contact": {"half_length": half, "stiffness": contact / (2.0 * half)},
        "solver": {"duration": 0.1},
        "output": {"sample_interval": 1e-4},
    }
    key = str(rng.choice(KEYS))
    table, name = key.split("__")
    own = tables[table][name] or 10.0
    return tables, key, *RANGES.get(key, (0.05 * own, 5.0 * own))


def at(tables: Tables, key: str, value: Any) -> Tables:
    table, name = key.split("__")
    return {**tables, table: {**tables[table], name: value}}


def answer(tables: Tables, key: str, lower: float, upper: float, **more: Any) -> Search:
    critical = Critical(parameter=key.replace("__", "."), lower=lower, upper=upper, **more)
    return search(critical, Line(make(tables), [critical.parameter], lower, upper))


def unstable(tables: Tables) -> bool:
    """Whether steady sliding is unstable or has ended: by friction, or as the load presses no more."""
    with mpmath.workdps(50):
        _, (cxx, cxy, _), _, _, (along, across), _ = held_by(tables, mpmath.mpf, mpmath)
        return bool(smooth_is_unstable(tables) or cxx * across <= cxy * along)


def held_and_bars(
    found: Search, tables: Tables, key: str, lower: float, upper: float
) -> tuple[list[bool], list[float]]:
    """Whether stability changes within the bar of each end of a window that no bound cuts, and the bars."""
    held = []
    bars = []
    with mpmath.workdps(50):
        for value, bar in zip(
            np.ravel(found.windows).tolist(), np.ravel(found.window_errors).tolist(), strict=True
        ):
            if bar:
                low, high = (mpmath.mpf(value) + by * mpmath.mpf(bar) for by in (-1, 1))
                ends = max(low, mpmath.mpf(lower)), min(high, mpmath.mpf(upper))
                below, above = (unstable(at(tables, key, end)) for end in ends)
                held.append(below is not above)
                bars.append(bar)
    return held, bars


@pytest.mark.parametrize("shoes", counts(0, 80, 1000))
def test_every_bar_of_an_end_of_a_window_holds_the_truth_and_is_narrow(shoes: int) -> None:
    rng = np.random.default_rng(29)
    tried = 0
    ends = 0
    narrow = list[bool]()
    while tried < shoes:
        shoe = drawn(rng)
        tolerance = 1e-6 * (shoe[3] - shoe[2])
        found = answer(*shoe, method="eigenvalue", tolerance=tolerance)
        if found.value is None:
            continue
        held, bars = held_and_bars(found, *shoe)
        assert all(held), shoe
        tried = tried + 1
        ends = ends + len(bars)
        narrow += [bar < 1e-9 * tolerance + 1e-12 * (shoe[3] - shoe[2]) for bar in bars]
    assert ends >= tried
    # One shoe in ten is badly conditioned: hardly any dashpots, links so soft beside the pad that they cancel.
    assert np.mean(narrow) > 0.9


UNDAMPED: Tables = {  # least critical friction (1 + c1/K) tan(α), where c2 = c1 + K: along c2 a window opens there
    "shoe": {"mass": 10.0},
    "wheel": {"radius": 0.5, "angular_speed": 1.0},
    "link1": {"stiffness": 1e6, "damping": 0.0, "angle_deg": 0.0},
    "link2": {"stiffness": 3e6, "damping": 0.0, "angle_deg": 10.0},
    "load": {"force": 1e3},
    "friction": {"coefficient": 1.5 * math.tan(math.radians(10.0))},
    "contact": {"half_length": 0.05, "stiffness": 2e7},
    "solver": {"duration": 0.1},
    "output": {"sample_interval": 1e-4},
}


@pytest.mark.parametrize("beyond", [1e-6, 1e-10, 1e-13])
@pytest.mark.parametrize("method", ["eigenvalue", "simulation"])
def test_the_bars_of_a_window_that_hardly_opens_hold_both_of_its_ends(beyond: float, method: str) -> None:
    """Along c2 the slope of the growth vanishes with the width of the window, as the root of what is beyond."""
    friction = UNDAMPED["friction"]["coefficient"] * (1.0 + beyond)
    shoe = at(UNDAMPED, "friction__coefficient", friction), "link2__stiffness", 2e6, 4e6
    found = answer(*shoe, method=method, tolerance=1.0)
    assert found.outcome is Outcome.FOUND
    held, bars = held_and_bars(found, *shoe)
    assert held == [True, True]
    # Half the width of the window: with g = c2 - c1 - K, apart = (g cos²α)² less its change with friction.
    half = math.sqrt(beyond) * 3e6 * math.tan(math.radians(10.0)) * 2.0
    assert max(bars) < 0.5 * half or beyond == 1e-13


def test_rounding_that_hides_a_window_leaves_none() -> None:
    friction = UNDAMPED["friction"]["coefficient"] * (1.0 + 1e-16)
    found = answer(
        at(UNDAMPED, "friction__coefficient", friction), "link2__stiffness", 2e6, 4e6, method="eigenvalue"
    )
    assert (found.outcome, found.windows) == (Outcome.STABLE, ())


def test_the_bracket_of_exact_steps_is_no_narrower_than_the_bar_of_the_eigenvalues() -> None:
    tables = at(UNDAMPED, "friction__coefficient", UNDAMPED["friction"]["coefficient"] * (1.0 + 1e-13))
    found = answer(tables, "link2__stiffness", 2e6, 4e6, tolerance=1e-5)
    assert found.error is not None
    assert found.error == found.window_errors[0][0] > 1e-5
    assert found.upper - found.lower == pytest.approx(2.0 * found.error, rel=1e-6)


def test_the_error_of_a_rounded_number_holds_that_of_exact_arithmetic() -> None:
    rng = np.random.default_rng(37)
    with mpmath.workdps(60):
        for _ in range(300):
            numbers = [float(each) for each in rng.normal(size=4) * 10.0 ** rng.uniform(-3.0, 3.0, 4)]
            a, b, c, d = map(Rounded, numbers)
            exact = [mpmath.mpf(each) for each in numbers]
            found = (a * b - c**2) * (a + d) - b * (c - d) ** 2
            truth = (exact[0] * exact[1] - exact[2] ** 2) * (exact[0] + exact[3])
            truth -= exact[1] * (exact[2] - exact[3]) ** 2
            assert abs(mpmath.mpf(found.value) - truth) <= found.error
            sizes = [abs(each) for each in numbers]
            most = (sizes[0] * sizes[1] + sizes[2] ** 2) * (sizes[0] + sizes[3]) + sizes[1] * (
                sizes[2] + sizes[3]
            ) ** 2
            assert (
                found.error <= 10.0 * 2.3e-16 * most
            )  # at most eight roundings in a product of three, and no more


def test_a_search_may_begin_where_there_is_no_steady_sliding() -> None:
    """Self-locking, until stability is regained; the scheme of smooth pads finds its own steps."""
    tables = at(UNDAMPED, "friction__coefficient", 1.0)
    found = answer(tables, "link2__angle_deg", -60.0, -5.0, method="eigenvalue")
    assert (found.outcome, found.bias) == (Outcome.REGAINED, 0.0)
    assert held_and_bars(found, tables, "link2__angle_deg", -60.0, -5.0)[0] == [True]


@pytest.mark.parametrize(
    ("place", "key", "low", "high"),
    [(94, "link2", -4.25, -4.24), pytest.param(118, "link1", -13.0, -12.0, marks=campaign)],
)
def test_a_window_between_two_of_the_values_that_are_looked_at_is_found(
    place: int, key: str, low: float, high: float
) -> None:
    """Of 129 values between -85° and 85°, or -60° and 60°, none lies in it."""
    tables = next(islice(random_shoes("smooth", 11), place, None))
    key = f"{key}__angle_deg"
    found = answer(tables, key, *RANGES[key], method="eigenvalue", tolerance=1e-3)
    begin, end = found.windows[0]
    assert low < begin < end < high
    values = np.linspace(*RANGES[key], SCANNED_BY_EIGENVALUES)
    assert not any((begin <= values) & (values <= end))
    sides = [unstable(at(tables, key, value)) for value in (begin - 1e-9, begin + 1e-9, end - 1e-9, end + 1e-9)]
    assert sides == [False, True, True, False]
