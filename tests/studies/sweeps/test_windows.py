"""Windows of instability, found by a search, stored, printed and drawn.

The ends of those of `windows.toml` are another integrator's. Those of `TONGUES` come from the equations of motion
in full contact and their derivative, integrated over a period of the wheel by SciPy's DOP853.
"""

import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
import xarray as xr
from scipy.integrate import solve_ivp

from brakecli.analysis.branches.answers import Answers
from brakecli.analysis.branches.bar import Bound
from brakecli.analysis.branches.explore import Explorer, crossing
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.stable_parts import separate
from brakecli.case.system import system_of
from brakecli.solver.integrate import solve
from brakecli.solver.method import Method
from brakecli.solver.period import common_period
from brakecli.solver.system import Initial
from brakecli.studies.sweeps.critical import search
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome, Search
from brakecli.studies.sweeps.windows_of_branch import calm, explored, on_waves
from tests.campaign import campaign
from tests.commands import brakecli
from tests.examples import make
from tests.studies.sweeps.shoes import drawn as opening
from tests.views.plots.helpers import drawn

SHOES: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_name("windows.toml").read_text(encoding="utf-8")
)
TONGUES: dict[str, Any] = {  # a wave of the wheel, whose slope feeds vibration near two speeds
    "shoe": {"mass": 28.0},
    "wheel": {"radius": 0.5, "angular_speed": -18.57},
    "link1": {"stiffness": 5190000.0, "damping": 31.2, "angle_deg": -3.1},
    "link2": {"stiffness": 10100000.0, "damping": 42.8, "angle_deg": -7.55},
    "load": {"force": 15900.0},
    "friction": {"coefficient": 0.305},
    "contact": {"half_length": 0.01, "stiffness": 428000000.0},
    "roughness": {"wheel": {"amplitudes": [0.000398], "wavelengths": [0.041]}},
    "solver": {"duration": 0.05, "step": 2.5e-5},
}


def exact_growth(tables: dict[str, Any], **changes: Any) -> float:
    """ln of the largest multiplier over a period of the wheel (1/s), in a contact that touches everywhere."""
    system = system_of(make(tables, **changes))
    c = system.coefficients
    load = system.load_at_start
    belt = system.belt_speed
    a = system.half_length
    stiffness = system.contact_stiffness
    phi = math.copysign(c.phi, belt)
    g, omega, phase = (np.array(each) for each in (system.wheel.g, system.wheel.omega, system.wheel.phase))
    height = g * np.sinc(omega * a / math.pi)
    period = 2.0 * math.pi / (omega.min() * abs(belt))
    inertia = np.array([[c.b_xx, c.b_xy], [c.b_xy, c.b_yy]])
    links = np.array([[c.c_xx, c.c_xy], [c.c_xy, c.c_yy]])
    pull = np.array([phi, 1.0])

    def slope(t: float, z: Any) -> Any:
        state = z[:4]
        tangent = z[4:].reshape(4, 4)
        angle = omega * (state[0] - belt * t) + phase
        force = stiffness * (height @ np.sin(angle) - state[1])
        by_place = stiffness * np.array([height * omega @ np.cos(angle), -1.0])
        loads = load * np.array([c.sin_beta, c.cos_beta])
        acceleration = (pull * force - inertia @ state[2:] - links @ state[:2] - loads) / c.m
        pulled = (np.outer(pull, by_place) - links) @ tangent[:2] - inertia @ tangent[2:]
        return np.concatenate([state[2:], acceleration, tangent[2:].ravel(), pulled.ravel() / c.m])

    state = np.zeros(4)
    for _ in range(6):
        start = np.concatenate([state, np.eye(4).ravel()])
        end = solve_ivp(slope, (0.0, period), start, "DOP853", rtol=1e-11, atol=1e-15).y[:, -1]
        multipliers = end[4:].reshape(4, 4)
        state = state + np.linalg.solve(np.eye(4) - multipliers, end[:4] - state)
    return math.log(float(np.abs(np.linalg.eigvals(multipliers)).max())) / float(period)


@campaign
def test_two_windows_of_a_passing_wave_are_found_stored_printed_and_drawn(tmp_path: Path) -> None:
    """More damping closes one of them; a bound of the range cuts that one, which ends there."""
    table = {
        "case": "c.toml",
        "axis": [{"parameter": "link1.damping", "values": [31.2, 300.0]}],
        "critical": {"parameter": "wheel.angular_speed", "lower": -18.08, "upper": -14.9, "tolerance": 0.004},
    }
    (tmp_path / "c.toml").write_text(tomli_w.dumps(TONGUES))
    (tmp_path / "s.toml").write_text(tomli_w.dumps(table))
    printed = brakecli("sweep", "s.toml", "-j", "1", "--json", cwd=tmp_path).json
    with xr.open_dataset(tmp_path / "s.h5", engine="h5netcdf") as result:
        assert result.critical_windows_lower.dims == ("link1_damping", "window")
        lower = result.critical_windows_lower.values
        upper = result.critical_windows_upper.values
    for stored, name in ((lower, "critical_windows_lower"), (upper, "critical_windows_upper")):
        assert printed[name] == [[None if math.isnan(value) else value for value in row] for row in stored]
    np.testing.assert_array_equal(np.isnan(lower), [[False, False], [False, True]])
    assert lower[0, 0] == -18.08
    lost = [(31.2, lower[0, 1]), (300.0, lower[1, 0])]
    regained = [(31.2, upper[0, 0]), (31.2, upper[0, 1]), (300.0, upper[1, 0])]
    ends = [(*end, 1.0) for end in lost] + [(*end, -1.0) for end in regained]
    for damping, end, rises in ends:
        case = {**TONGUES, "link1": {**TONGUES["link1"], "damping": damping}}
        before, after = (exact_growth(case, wheel__angular_speed=end + by) for by in (-0.004, 0.004))
        assert rises * before < 0.0 < rises * after
    axes = drawn(tmp_path / "s.h5").axes[0]
    bars = next(lines for lines in axes.collections if lines.get_label() == "unstable")
    segments = np.array([path.vertices for path in bars.get_paths()])[:, :, 1]
    segments = segments[np.isfinite(segments).all(axis=1)]
    np.testing.assert_allclose(segments[:, 0], lower[np.isfinite(lower)])
    np.testing.assert_allclose(segments[:, -1], upper[np.isfinite(upper)])


def listed_ends(tables: dict[str, Any], key: str, range_: tuple[float, float]) -> tuple[Search, list[float]]:
    """The windows that a search finds, and all special points of the branches that it follows."""
    lower, upper = range_
    name = key.replace("__", ".")
    width = upper - lower
    critical = Critical(parameter=name, lower=lower, upper=upper, tolerance=1e-3 * width)
    answers = Answers(explored(critical, make(tables, **{key: lower})).explored, None)
    return on_waves(critical, answers), [mark.motion.value for base in answers.bases for mark in base.special]


def assert_found(truth: list[float], answer: Search, listed: list[float], range_: tuple[float, float]) -> None:
    """Each end is a window's, within its bar, or listed: where several sheets exist one that is stable counts.

    Ends that another integrator gave are good to 3e-5 of the range. Listed points have no bar; 3e-4 is theirs.
    """
    width = range_[1] - range_[0]
    bars = zip(np.ravel(answer.windows), np.ravel(answer.window_errors), strict=True)
    ends = [*((value, bar + 3e-5 * width) for value, bar in bars), *((value, 3e-4 * width) for value in listed)]
    for true in truth:
        assert any(abs(value - true) <= bar for value, bar in ends), true


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if "quick" in shoe else campaign) for name, shoe in SHOES.items()]
)
def test_the_windows_of_a_shoe_are_those_of_another_integrator(name: str) -> None:
    shoe = SHOES[name]
    answer, listed = listed_ends(shoe["case"], shoe["key"].replace(".", "__"), shoe["range"])
    assert_found(shoe["ends"], answer, listed, shoe["range"])
    assert shoe["ends"] or answer.windows == ()
    assert answer.outcome.value in shoe.get("outcomes", ["found", "found, stable above"])
    assert all(error < shoe.get("most", math.inf) for pair in answer.window_errors for error in pair)
    if answer.value is None or answer.error is None:
        assert not {"critical", "stable_at", "error"} & set(shoe)
        return
    assert abs(answer.value - shoe.get("critical", answer.value)) <= answer.error
    assert answer.error < shoe.get("error", math.inf)
    if "stable_at" in shoe:
        lower, upper = shoe["range"]
        assert shoe["stable_at"] < answer.value
        lost = answer.outcome is Outcome.FOUND
        assert answer.windows[-1] == ((answer.value, upper) if lost else (lower, answer.value))


@campaign
@pytest.mark.parametrize("part", [1e-13, -2e-13])
def test_rounding_moves_no_end_of_a_window_by_more_than_the_bars(part: float) -> None:
    """A shoe that bounces, and the same with a change of its mass that is rounding, have the same ends.

    Sheets nearly meet at 3.376, 3.383, 3.452 and 3.464 MN/m. So a walk follows a sheet, or crosses it, by
    rounding; what it crosses is followed as well. One of these alone is stable from 3.06749 to 3.06769 MN/m, see
    below.
    """
    shoe = SHOES["doubling"]
    changed = {**shoe["case"], "shoe": {"mass": shoe["case"]["shoe"]["mass"] * (1.0 + part)}}
    key = shoe["key"].replace(".", "__")
    one, other = (listed_ends(case, key, shoe["range"])[0] for case in (shoe["case"], changed))
    errors = np.array(one.window_errors) + np.array(other.window_errors)
    assert np.shape(one.windows) == np.shape(other.windows) == (2, 2)
    assert np.all(np.abs(np.array(one.windows) - np.array(other.windows)) <= errors)


@campaign
@pytest.mark.parametrize(("value", "number"), [(3.457e6, 2), (3.06759e6, 1)])
def test_motions_of_all_sheets_where_those_nearly_meet_last(value: float, number: int) -> None:
    """So says the exact contact, in steps to 1e-9 over 600 periods: no window lies there."""
    shoe = SHOES["doubling"]
    lower, upper = shoe["range"]
    critical = Critical(parameter=shoe["key"], lower=lower, upper=upper)
    changed = make(shoe["case"], **{shoe["key"].replace(".", "__"): lower})
    answers = Answers(explored(critical, changed).explored, None)
    states = calm(answers, value)
    assert len(states) >= number
    system = answers.line.system(answers.line.place(value))
    method = Method("event-driven", tolerance=1e-9, automatic=True, evaluator="exact")
    period = common_period(system)
    assert period is not None
    places = list[float]()
    for state in states[:number]:
        x, y, vx, vy = state.tolist()
        begun = replace(system, initial=Initial(x=x, y=y, vx=vx, vy=vy), method=method)
        rows = solve(replace(begun, duration=600.0 * period, interval=period / 640.0)).rows[:, :4]
        # the branch has it of cells, and between points by a cubic
        assert np.all(np.abs(rows[640 * 599] - rows[0]) <= 1e-3 * np.abs(rows).max(axis=0))
        assert rows[640 * 599] == pytest.approx(rows[640 * 300], rel=1e-5)
        places.append(x)
    if number > 1:
        assert abs(places[0] - places[1]) > 0.2 * abs(places[0])


def test_nothing_is_claimed_of_a_window_in_which_a_sheet_was_not_followed() -> None:
    """A motion beside a branch, for which no budget was left."""
    shoe = SHOES["resonance"]
    low, high = shoe["range"]
    critical = Critical(parameter=shoe["key"], lower=low, upper=high)
    whole = explored(critical, make(shoe["case"])).explored
    (window,) = Answers(whole, None).windows
    assert window[0].known
    middle = 0.5 * (window[0].p + window[1].p)
    cut = Answers(replace(whole, unfollowed=[middle]), None)
    assert not cut.windows[0][0].known
    assert on_waves(critical, cut).outcome is Outcome.UNDECIDED


def test_a_window_or_gap_narrower_than_both_its_bars_is_none() -> None:
    def left(*bounds: tuple[float, float]) -> list[float]:
        return [bound.p for bound in separate([Bound(*each) for each in bounds])]

    assert left((0.2, 0.002), (0.201, 0.4), (0.21, 0.01)) == [0.21]
    assert left((0.2, 0.002), (0.203, 0.4), (0.21, 0.01)) == [0.2]
    assert left((0.2, 0.002), (0.203, 0.4), (0.22, 0.01)) == [0.2, 0.203, 0.22]
    assert left((0.2, 0.002), (0.201, 0.003), (0.21, 0.001)) == [0.21]


LONG = 60267
"""A pad whose branch of forced motions is longer than the budget of a search."""
FOLDED = 60241
"""A pad whose forced motion is stable up to 4.7175, behind many folds.

So says a Runge-Kutta integrator of its own with Newton's method, with 600 and with 1,200 cells.
"""


@campaign
def test_nothing_is_claimed_of_a_window_in_which_a_branch_is_lost() -> None:
    tables, key, lower, upper, tolerance = opening(LONG, "opening")
    key = key.replace("__", ".")
    critical = Critical(parameter=key, lower=lower, upper=upper, tolerance=tolerance)
    answers = Answers(explored(critical, make(tables)).explored, None)
    assert not answers.windows[0][0].known
    assert not answers.windows[-1][1].known
    assert on_waves(critical, answers).outcome is Outcome.UNDECIDED


@campaign
def test_a_branch_is_followed_through_many_folds() -> None:
    tables, key, lower, upper, tolerance = opening(FOLDED, "opening")
    critical = Critical(parameter=key.replace("__", "."), lower=lower, upper=upper, tolerance=tolerance)
    answer = on_waves(critical, Answers(explored(critical, make(tables)).explored, None))
    assert answer.outcome is Outcome.FOUND
    assert answer.value is not None
    assert answer.error is not None
    assert answer.value == pytest.approx(4.7175, abs=answer.error)
    assert answer.error < 1e-3 * (upper - lower)


@campaign
def test_a_branch_that_others_go_on_with_is_not_lost() -> None:
    """Two ends of branches run along a third one, and close the gap between them."""
    tables, *_ = opening(60297, "opening")
    case = make(tables, friction__coefficient=2.372)
    low = 0.7 * case.link1.stiffness
    high = 1.5 * case.link1.stiffness
    critical = Critical(parameter="link1.stiffness", lower=low, upper=high, tolerance=1e-3 * (high - low))
    answers = Answers(explored(critical, case).explored, None)
    answer = on_waves(critical, answers)
    assert answer.outcome is Outcome.FOUND
    assert len(answer.windows) == 1
    assert answers.sentence == "squeals by itself from 4.463e+06 to 7.958e+06"


@campaign
def test_a_value_is_stable_where_one_sheet_of_the_branch_is_and_all_ends_are_listed() -> None:
    """By another integrator the small motion is unstable from 1.71369 to 1.74247, and it ends at 1.76694. One of
    twice its amplitude is stable there. At 1.73 the largest multipliers are 0.99452 for it and 1.00356.
    """
    line = Line(make(SHOES["two sheets"]["case"]), ["friction.coefficient"], 0.0, 7.1)
    found = Answers(Explorer(line, lambda *_: None, lambda: False).explore(), None)
    assert found.critical == pytest.approx(1.76694, abs=2e-4)
    [base] = found.bases
    listed = {mark.kind: mark.motion.value for mark in base.special[:4]}
    assert base.special[1].motion.value == pytest.approx(1.71369, abs=2e-4)
    assert base.special[2].motion.value == pytest.approx(1.74247, abs=2e-4)
    assert {"torus", "fold"} <= set(listed)
    largest = sorted(float(np.abs(each.multipliers).max()) for each in crossing(base, line.place(1.73)))
    assert largest[:2] == pytest.approx([0.99452, 1.00356], abs=1e-4)


@campaign
def test_where_no_motion_was_found_a_window_ends_anywhere_and_a_note_says_so(
    tmp_path: Path, without_runs: None
) -> None:
    """Growth of up to 557 1/s lasts to the end of the range."""
    shoe = SHOES["lost"]
    (tmp_path / "case.toml").write_text(tomli_w.dumps(shoe["case"]))
    lower, upper = shoe["range"]
    key = shoe["key"]
    table = {"parameter": key, "lower": lower, "upper": upper, "tolerance": 1e-3}
    (tmp_path / "s.toml").write_text(tomli_w.dumps({"case": "case.toml", "critical": table}))
    printed = brakecli("sweep", "s.toml", "--json", cwd=tmp_path).json
    assert any("a window of instability ends anywhere from" in each for each in printed["findings"])
    found = search(Critical(**table), Line(make(shoe["case"]), [key], lower, upper))
    [(begin, end)] = found.windows
    [(_, error)] = found.window_errors
    assert begin == pytest.approx(shoe["critical"], abs=found.error)
    assert end == upper
    assert 1.0 < error < end - begin
