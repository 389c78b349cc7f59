"""Windows of instability: resonances of a wheel's wave, found by a search, stored, printed and drawn.

The answers come from the equations of motion in full contact and their derivative, integrated over a period of the
wheel by another program (SciPy's DOP853).
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
import xarray as xr
from scipy.integrate import solve_ivp

from brakecli.branches.answers import Answers
from brakecli.branches.bar import Bound
from brakecli.branches.line import Line
from brakecli.branches.stable_parts import told_apart
from brakecli.case.system import system_of
from brakecli.sweeps.critical import search
from brakecli.sweeps.read_off import explored, on_waves
from brakecli.sweeps.tables import Critical
from brakecli.sweeps.windows import Outcome, Search
from tests.campaign import campaign
from tests.commands import brakecli
from tests.examples import make
from tests.plots.helpers import drawn
from tests.sweeps.shoes import drawn as opening
from tests.sweeps.test_critical import found

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
    c, load, belt, a = system.coefficients, system.load_at_start, system.belt_speed, system.half_length
    stiffness, phi = system.contact_stiffness, math.copysign(c.phi, belt)
    g, omega, phase = (np.array(each) for each in (system.wheel.g, system.wheel.omega, system.wheel.phase))
    height = g * np.sinc(omega * a / math.pi)
    period = 2.0 * math.pi / (omega.min() * abs(belt))
    inertia = np.array([[c.b_xx, c.b_xy], [c.b_xy, c.b_yy]])
    links = np.array([[c.c_xx, c.c_xy], [c.c_xy, c.c_yy]])
    pull = np.array([phi, 1.0])

    def slope(t: float, z: Any) -> Any:
        state, tangent = z[:4], z[4:].reshape(4, 4)
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
        lower, upper = result.critical_windows_lower.values, result.critical_windows_upper.values
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


@campaign
def test_the_third_harmonic_of_a_wave_under_an_opening_pad_is_found() -> None:
    """Multipliers of another integrator pass -1 at 6.2833 and at 6.3431 rad/s, where 3 waves pass in 2 cycles."""
    tables: dict[str, Any] = {
        "shoe": {"mass": 50.12},
        "wheel": {"radius": 0.33, "angular_speed": 7.828},
        "link1": {"stiffness": 3039000.0, "damping": 37.17},
        "link2": {"stiffness": 3442000.0, "damping": 61.76, "angle_deg": 32.63},
        "load": {"force": 821.5},
        "friction": {"coefficient": 2.38},
        "contact": {"half_length": 0.025, "stiffness": 22090000.0},
        "roughness": {"wheel": {"amplitudes": [0.0001216], "wavelengths": [0.076]}},
        "output": {"sample_interval": 0.001},
        "solver": {"duration": 1.2},
    }
    answer = found(tables, 6.262, 6.5, "wheel__angular_speed", tolerance=0.003523)
    assert answer.value is not None
    assert abs(answer.value - 6.2833) < (answer.error or 0.0)
    [window] = answer.windows
    assert abs(window[1] - 6.3431) < (answer.error or 0.0)


FOLDS: dict[str, dict[str, Any]] = {
    "unstable beside": {
        "shoe": {"mass": 5.598},
        "wheel": {"radius": 0.33, "angular_speed": 28.3},
        "link1": {"stiffness": 14970000.0, "damping": 56.26, "angle_deg": 2.715},
        "link2": {"stiffness": 21640000.0, "damping": 44.6, "angle_deg": 25.79},
        "load": {"force": 511.5},
        "friction": {"coefficient": 0.1},
        "contact": {"half_length": 0.015, "stiffness": 113300000.0},
        "roughness": {"wheel": {"amplitudes": [8.465e-06, 1.126e-05], "wavelengths": [0.032, 0.016]}},
        "output": {"sample_interval": 0.00015},
        "solver": {"duration": 0.2, "tolerance": 0.001},
    },
    "resonance": {
        "shoe": {"mass": 0.7835},
        "wheel": {"radius": 0.5, "angular_speed": 30.2},
        "link1": {"stiffness": 6360000.0, "damping": 19.63, "angle_deg": 0.0},
        "link2": {"stiffness": 6736000.0, "damping": 15.07, "angle_deg": 28.45},
        "load": {"force": 6333.0},
        "friction": {"coefficient": 0.1},
        "contact": {"half_length": 0.04, "stiffness": 52460000.0},
        "roughness": {"wheel": {"amplitudes": [6.876e-05], "wavelengths": [0.032], "phases_deg": [77.67]}},
        "output": {"sample_interval": 8.6e-05},
        "solver": {"duration": 0.2},
    },
    "both sides": {
        "shoe": {"mass": 3.727},
        "wheel": {"radius": 0.33, "angular_speed": -27.73},
        "link1": {"stiffness": 6024000.0, "damping": 15.52, "angle_deg": 0.0},
        "link2": {"stiffness": 12400000.0, "damping": 23.47, "angle_deg": -4.105},
        "load": {"force": 503.1},
        "friction": {"coefficient": 1.555},
        "contact": {"half_length": 0.01, "stiffness": 149500000.0},
        "roughness": {"wheel": {"amplitudes": [2.244e-05], "wavelengths": [0.032]}},
        "solver": {"duration": 0.21, "scheme": "two-layer", "step": 3.5e-05, "theta": [0.55, 0.5]},
    },
    "doubling": {
        "shoe": {"mass": 1.179},
        "wheel": {"radius": 0.5, "angular_speed": 17.66},
        "link1": {"stiffness": 926400.0, "damping": 7.885, "angle_deg": -10.35},
        "link2": {"stiffness": 3188000.0, "damping": 4.907, "angle_deg": 17.61},
        "load": {"force": 155.3},
        "friction": {"coefficient": 0.9488},
        "contact": {"half_length": 0.01, "stiffness": 70610000.0},
        "roughness": {"wheel": {"amplitudes": [5.552e-06, 4.644e-06], "wavelengths": [0.062, 0.034]}},
        "output": {"sample_interval": 0.00019},
        "solver": {"duration": 0.22, "scheme": "event-driven"},
    },
    "over a gap": {
        "shoe": {"mass": 5.344},
        "wheel": {"radius": 0.33, "angular_speed": 49.96},
        "link1": {"stiffness": 18350000.0, "damping": 18.92, "angle_deg": 0.0},
        "link2": {"stiffness": 31340000.0, "damping": 35.76, "angle_deg": 15.4},
        "load": {"force": 916.7},
        "friction": {"coefficient": 0.1},
        "contact": {"half_length": 0.055, "stiffness": 46810000.0},
        "roughness": {
            "wheel": {"amplitudes": [1.826e-05], "wavelengths": [0.043]},
            "shoe": {"amplitudes": [3.639e-06], "wavelengths": [0.024]},
        },
        "solver": {"duration": 0.2, "scheme": "three-layer", "step": 4.3e-05, "theta": [0.35, 0.3, 0.35]},
    },
    "never": {
        "shoe": {"mass": 2.991},
        "wheel": {"radius": 0.2, "angular_speed": 49.0},
        "link1": {"stiffness": 4444000.0, "damping": 9.575, "angle_deg": 0.0},
        "link2": {"stiffness": 8549000.0, "damping": 15.32, "angle_deg": 11.14},
        "load": {"force": 172.1},
        "friction": {"coefficient": 0.1},
        "contact": {"half_length": 0.04, "stiffness": 20920000.0},
        "roughness": {"wheel": {"amplitudes": [1.837e-05], "wavelengths": [0.041]}},
        "solver": {"duration": 0.23, "scheme": "three-layer", "step": 1.9e-05, "theta": [0.25, 0.5, 0.25]},
    },
    "stable for a while": {
        "shoe": {"mass": 17.462},
        "wheel": {"radius": 0.39593, "angular_speed": 3.3306},
        "link1": {"stiffness": 4889800.0, "damping": 166.02, "angle_deg": -10.744},
        "link2": {"stiffness": 10687000.0, "damping": 196.64, "angle_deg": 19.845},
        "load": {"force": 75.747},
        "friction": {"coefficient": 0.39},
        "contact": {"half_length": 0.029609, "stiffness": 119700000.0},
        "roughness": {
            "wheel": {
                "amplitudes": [1.77e-06, 7.14e-06, 2.57e-06],
                "wavelengths": [0.02255, 0.0056375, 0.005011111111111111],
            },
            "shoe": {"amplitudes": [4.79e-06, 4.2e-06], "wavelengths": [0.03357, 0.03749]},
        },
        "solver": {"duration": 0.065, "step": 2.7e-05},
    },
    "weights that damp": {
        "shoe": {"mass": 15.76},
        "wheel": {"radius": 0.5, "angular_speed": -16.26},
        "link1": {"stiffness": 2333000.0, "damping": 18.9, "angle_deg": -6.37},
        "link2": {"stiffness": 4897000.0, "damping": 37.4, "angle_deg": -6.827},
        "load": {"force": 340.7},
        "friction": {"coefficient": 1.603},
        "contact": {"half_length": 0.01, "stiffness": 59600000.0},
        "roughness": {
            "wheel": {"amplitudes": [8.238e-05], "wavelengths": [0.064], "phases_deg": [208.3]},
            "shoe": {"amplitudes": [9.225e-06, 2.525e-05], "wavelengths": [0.01, 0.037]},
        },
        "solver": {"duration": 0.69, "scheme": "two-layer", "step": 0.00011, "theta": [0.55, 0.5]},
    },
    "beside": {
        "shoe": {"mass": 22.35},
        "wheel": {"radius": 0.33, "angular_speed": -9.931},
        "link1": {"stiffness": 8091000.0, "damping": 78.07, "angle_deg": -1.199},
        "link2": {"stiffness": 36830000.0, "damping": 120.5, "angle_deg": -18.08},
        "load": {"force": 241.5},
        "friction": {"coefficient": 0.1},
        "contact": {"half_length": 0.015, "stiffness": 531400000.0},
        "roughness": {
            "wheel": {"amplitudes": [4.244e-06, 6.172e-06], "wavelengths": [0.051, 0.008]},
            "shoe": {"amplitudes": [1.872e-06], "wavelengths": [0.037]},
        },
        "solver": {"duration": 0.3, "scheme": "two-layer", "step": 5e-05, "theta": [0.6, 0.5]},
    },
    "narrow": {
        "shoe": {"mass": 16.26},
        "wheel": {"radius": 0.33, "angular_speed": -13.6},
        "link1": {"stiffness": 1959000.0, "damping": 0.0, "angle_deg": 0.0},
        "link2": {"stiffness": 2230000.0, "damping": 0.0, "angle_deg": -4.532},
        "load": {"force": 340.4},
        "friction": {"coefficient": 0.7902},
        "contact": {"half_length": 0.015, "stiffness": 21630000.0},
        "roughness": {
            "wheel": {
                "amplitudes": [5.649e-05, 3.036e-05],
                "wavelengths": [0.021, 0.044],
                "phases_deg": [198.5, 277.9],
            },
            "shoe": {"amplitudes": [1.926e-05], "wavelengths": [0.013]},
        },
        "solver": {"duration": 0.97, "scheme": "two-layer", "step": 8.1e-05, "theta": [0.52, 0.5]},
    },
    "ends": {
        "shoe": {"mass": 34.24},
        "wheel": {"radius": 0.5, "angular_speed": 1.394},
        "link1": {"stiffness": 597800.0, "damping": 0.0, "angle_deg": 0.0},
        "link2": {"stiffness": 2143000.0, "damping": 0.0, "angle_deg": 3.496},
        "load": {"force": 121.9},
        "friction": {"coefficient": 0.1},
        "contact": {"half_length": 0.025, "stiffness": 15220000.0},
        "roughness": {"wheel": {"amplitudes": [2.047e-05, 1.901e-05], "wavelengths": [0.018, 0.017]}},
        "output": {"sample_interval": 0.0013},
        "solver": {"duration": 1.5, "scheme": "event-driven"},
    },
    "strong dashpot": {  # its scheme takes 0.2 1/s less from a mode than dashpots do, as much as sliding loses
        "shoe": {"mass": 23.132},
        "wheel": {"radius": 0.39521, "angular_speed": -2.138},
        "link1": {"stiffness": 15085000.0, "damping": 6247.9, "angle_deg": 4.3122},
        "link2": {"stiffness": 50936000.0, "damping": 1053.3, "angle_deg": -51.048},
        "load": {"force": 4024.0},
        "friction": {"coefficient": 0.6174},
        "contact": {"half_length": 0.03041, "stiffness": 1426500000.0},
        "roughness": {
            "shoe": {"amplitudes": [2.18e-06, 3.72e-06, 1.35e-06], "wavelengths": [0.01802, 0.0452, 0.00988]},
            "wheel": {
                "amplitudes": [3.5e-05, 1.57e-05],
                "wavelengths": [0.171 / 11, 0.171 / 29],
            },
        },
        "output": {"sample_interval": 7.8e-05},
        "solver": {"step": 3.9e-05, "duration": 0.067},
    },
    "stable again": {
        "shoe": {"mass": 1.973},
        "wheel": {"radius": 0.5, "angular_speed": -8.699},
        "link1": {"stiffness": 364800.0, "damping": 1.37, "angle_deg": -13.11},
        "link2": {"stiffness": 1642000.0, "damping": 2.295, "angle_deg": -34.82},
        "load": {"force": 253.7},
        "friction": {"coefficient": 1.211},
        "contact": {"half_length": 0.01, "stiffness": 45170000.0},
        "roughness": {"wheel": {"amplitudes": [0.0001918], "wavelengths": [0.06], "phases_deg": [302.3]}},
        "output": {"sample_interval": 0.00033},
        "solver": {"duration": 0.39, "tolerance": 0.0001},
    },
}


def listed_ends(tables: dict[str, Any], key: str, range_: tuple[float, float]) -> tuple[Search, list[float]]:
    """The windows that a search finds, and all special points of the branches that it follows."""
    lower, upper = range_
    name, width = key.replace("__", "."), upper - lower
    critical = Critical(parameter=name, lower=lower, upper=upper, tolerance=1e-3 * width)
    answers = Answers(explored(critical, make(tables, **{key: lower})).explored, None)
    return on_waves(critical, answers), [mark.value for base in answers.bases for mark in base.special]


def assert_found(truth: list[float], answer: Search, listed: list[float], range_: tuple[float, float]) -> None:
    """Each end is a window's, within its bar, or listed: where several sheets exist one that is stable counts.

    Ends that another integrator gave are good to 3e-5 of the range. Listed points have no bar; 3e-4 is theirs.
    """
    width = range_[1] - range_[0]
    bars = zip(np.ravel(answer.windows), np.ravel(answer.window_errors), strict=True)
    ends = [*((value, bar + 3e-5 * width) for value, bar in bars), *((value, 3e-4 * width) for value in listed)]
    for true in truth:
        assert any(abs(value - true) <= bar for value, bar in ends), true


def followed(name: str, key: str, ends: tuple[float, float]) -> Search:
    """What a search finds, without its runs for the least sustained value."""
    lower, upper = ends
    critical = Critical(
        parameter=key.replace("__", "."), lower=lower, upper=upper, tolerance=1e-3 * (upper - lower)
    )
    return search(critical, Line(make(FOLDS[name]), [critical.parameter], lower, upper))


@pytest.mark.parametrize(
    ("name", "key", "ends", "truth", "least"),
    [
        # at 4.95 another integrator finds it stable still, with a largest multiplier of exp(-4.06 1/s)
        ("unstable beside", "friction__coefficient", (0.0, 7.5), 4.954, 2.7),
        pytest.param("resonance", "friction__coefficient", (0.0, 2.5), 2.326, 1.6, marks=campaign),
        pytest.param("over a gap", "friction__coefficient", (0.0, 2.4), 1.8876, 1.7, marks=campaign),
        pytest.param("both sides", "shoe__mass", (1.491, 9.317), 3.69096, 3.6, marks=campaign),
    ],
)
@campaign
def test_a_stable_motion_is_followed_until_it_ends(
    name: str, key: str, ends: tuple[float, float], truth: float, least: float
) -> None:
    """Another integrator, of fourth order, follows it in small steps to the `truth`. At the `least` value, where
    another motion is unstable, it is stable.
    """
    answer = followed(name, key, ends)
    assert answer.value is not None
    assert answer.error is not None
    assert abs(answer.value - truth) < answer.error
    assert least < answer.value
    assert answer.error < 0.04 * (ends[1] - ends[0])
    lost = answer.outcome is Outcome.FOUND
    assert answer.windows[-1] == ((answer.value, ends[1]) if lost else (ends[0], answer.value))


@pytest.mark.parametrize("ends", [(0.0, 2.5), (1.0, 1.6)])
def test_a_motion_that_full_contact_would_have_does_not_count_where_it_would_open(
    ends: tuple[float, float],
) -> None:
    """By the equations of full contact sliding is unstable from 1.231 on. The wave opens the pad from 1.03 on, and
    another integrator follows the motion that opens, always stable, to 2.5.
    """
    answer = followed("never", "friction__coefficient", ends)
    assert answer.outcome is Outcome.STABLE
    assert answer.windows == ()


@campaign
@pytest.mark.parametrize(
    ("name", "key", "range_", "truth", "most"),
    [  # its weights take away 0.5 1/s, more than the growth; at 17.157 kg that jumps by 0.003 1/s, as where
        # a motion ends: the bar is a 32nd of the range, 1.034 kg, and half the bracket
        (
            "weights that damp",
            "shoe__mass",
            (6.304, 39.4),
            [8.82, 17.35, 28.02, 29.85, 39.4],
            [0.6, 1.06, 0.6, 0.6, 0.6],
        ),
        ("beside", "friction__coefficient", (0.0, 1.1), [0.67342, 0.68719, 0.74487, 1.1], 0.005),
        ("stable again", "link2__stiffness", (8.21e5, 2.791e6), [1.7233e6, 1.8384e6, 1.90733e6], 7e4),
        (  # the last end is a fold; on both sides another motion is followed that is unstable
            "stable for a while",
            "friction__coefficient",
            (0.0, 1.5),
            [0.8768877, 0.9665873, 0.9702961, 1.5],
            [0.003, 0.003, 0.05, 0.003],
        ),
        (  # the seventh end is a fold
            "strong dashpot",
            "load__force",
            (2776.0, 11900.0),
            [3392.982, 3429.524, 3553.108, 4458.478, 4687.264, 6454.39, 6473.367, 6935.641],
            [50.0, 50.0, 50.0, 50.0, 50.0, 50.0, 300.0, 50.0],
        ),
        (  # ends soon after it has doubled its period; the motion that the shoe falls onto is unstable once more
            "doubling",
            "link2__stiffness",
            (1.594e6, 5.42e6),
            [3.463285e6, 3.83164e6, 3.83538e6],
            2e6,
        ),
    ],
)
def test_no_window_of_a_motion_that_is_followed_is_hidden(
    name: str, key: str, range_: tuple[float, float], truth: list[float], most: float | list[float]
) -> None:
    """Another integrator follows it and finds where multipliers pass one."""
    answer, listed = listed_ends(FOLDS[name], key, range_)
    assert_found(truth, answer, listed, range_)
    errors = [error for pair in answer.window_errors for error in pair]
    assert max(errors) < max(most) if isinstance(most, list) else max(errors) < most


@campaign
def test_the_bar_of_a_narrow_window_does_not_reach_for_the_next_one() -> None:
    """Another integrator finds it from 898.018 to 898.873 kN/m, a 4800th of the range wide."""
    answer = followed("narrow", "link1__stiffness", (7.836e5, 4.898e6))
    ends, errors = np.array(answer.windows[0]), np.array(answer.window_errors[0])
    assert (np.abs(ends - [898018.0, 898873.0]) <= errors).all()
    assert (errors < 5e3).all()


def test_a_window_or_gap_narrower_than_its_bars_of_which_one_is_wide_is_none() -> None:
    def left(*bounds: tuple[float, float]) -> list[float]:
        return [bound.p for bound in told_apart([Bound(*each) for each in bounds])]

    assert left((0.2, 0.002), (0.201, 0.4), (0.21, 0.01)) == [0.21]
    assert left((0.2, 0.002), (0.203, 0.4), (0.21, 0.01)) == [0.2]
    assert left((0.2, 0.002), (0.203, 0.4), (0.22, 0.01)) == [0.2, 0.203, 0.22]


LOST = 60241
"""A pad whose forced motion is lost at 4.5777 and at 4.7034, while one stable sheet goes on to a fold at 4.7175.

So says a Runge-Kutta integrator of its own with Newton's method, with 600 and with 1,200 cells.
"""


@campaign
def test_nothing_is_claimed_of_a_window_in_which_a_branch_is_lost() -> None:
    tables, key, lower, upper, tolerance = opening(LOST, "opening")
    key = key.replace("__", ".")
    critical = Critical(parameter=key, lower=lower, upper=upper, tolerance=tolerance)
    answers = Answers(explored(critical, make(tables)).explored, None)
    (_, first), *_, (last, _) = answers.windows
    assert not first.known
    assert not last.known
    assert on_waves(critical, answers).outcome is Outcome.UNDECIDED


@campaign
def test_a_branch_that_others_go_on_with_is_not_lost() -> None:
    """Two ends of branches run along a third one, and close the gap between them."""
    tables, *_ = opening(60297, "opening")
    case = make(tables, friction__coefficient=2.372)
    low, high = 0.7 * case.link1.stiffness, 1.5 * case.link1.stiffness
    critical = Critical(parameter="link1.stiffness", lower=low, upper=high, tolerance=1e-3 * (high - low))
    answers = Answers(explored(critical, case).explored, None)
    answer = on_waves(critical, answers)
    assert answer.outcome is Outcome.FOUND
    assert len(answer.windows) == 1
    assert answers.sentence.startswith("squeals by itself from 4.463e+06 to 7.958e+06;")
