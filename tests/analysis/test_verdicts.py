"""Verdicts that rest on theory: linear motion, what roughness forces in full contact, and no friction."""

import re
from typing import Any

import numpy as np
import pytest
import tomli_w

from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.analysis.stability.linear import linear_theory, parts
from brakecli.analysis.stability.report import stability
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.solver.history import array_history
from brakecli.solver.quantities import ContactState
from brakecli.studies.runs.judge import inputs_of
from tests.analysis.found import SHOES
from tests.analysis.histories import verdict_of
from tests.campaign import counts
from tests.commands import ROOT
from tests.examples import SQUEAL, make, simulate

UNDAMPED: dict[str, Any] = {"link1__damping": 0.0, "link2__damping": 0.0}
DRUM: dict[str, Any] = {  # swings once per turn of 3 m
    "shoe": {"mass": 10.0},
    "wheel": {"radius": 0.5, "angular_speed": 8.0},
    "link1": {"stiffness": 2e7, "damping": 300.0},
    "link2": {"stiffness": 6e7, "damping": 300.0, "angle_deg": 15.0},
    "load": {"force": 15e3},
    "friction": {"coefficient": 0.3},
    "contact": {"half_length": 0.05, "stiffness": 2e8},
    "roughness": {"wheel": {"amplitudes": [30e-6, 10e-6], "wavelengths": [3.0, 1.5]}},
    "solver": {"duration": 6.0, "step": 2e-5},
    "output": {"sample_interval": 1e-4},
}


@pytest.mark.parametrize("friction", [0.3, 0.574, 0.5765])
def test_a_slow_motion_is_judged_by_its_eigenvalues(friction: float) -> None:
    case = make(SQUEAL, friction__coefficient=friction, wheel__angular_speed=1.0)
    verdict = verdict_of(case)
    mode = stability(system_of(case)).modes[0]
    assert verdict.regime is (Regime.DAMPED if mode.growth < 0.0 else Regime.UNDECIDED)
    assert verdict.excitation is Excitation.NONE
    assert (verdict.growth_rate, verdict.ringing_frequency) == (mode.growth, mode.frequency)
    assert ("still growing" in verdict.reasons[0]) == (mode.growth > 0.0)
    assert verdict.settled is False


def test_amplitude_and_variation_of_what_dies_out_are_those_of_the_same_time() -> None:
    """Of a single mode y is x times its shape, and the torque varies by R φ 2ak as much as y."""
    case = make(SQUEAL, friction__coefficient=0.55, wheel__angular_speed=1.0, solver__duration=2.0)
    verdict = verdict_of(case)
    system = system_of(case)
    mode = stability(system).modes[0]
    assert verdict.regime is Regime.DAMPED
    assert mode.shape is not None
    y = 2.0 * verdict.amplitude * abs(mode.shape)
    expected = system.radius * system.coefficients.phi * system.contact_stiffness * y
    assert verdict.torque_variation == pytest.approx(expected, rel=0.02)  # a quarter of a cycle decays by 0.6 %


def test_growth_that_the_steps_damp_is_not_waited_for() -> None:
    """It grows at 0.16 1/s; weights of 0.6 take 0.1 ω² h away, 1.2 1/s at 174 Hz in steps of 10 µs."""
    for weights, remedy in (
        ((0.6, 0.6), "but the scheme's steps damp it; take theta = [0.5, 0.5]"),
        ((), "run at"),
    ):
        theta = {"solver__theta": weights} if weights else {}
        case = make(SQUEAL, friction__coefficient=0.5765, wheel__angular_speed=1.0, **theta)
        verdict = verdict_of(case)
        assert verdict.regime is Regime.UNDECIDED
        assert remedy in verdict.reasons[0]


def test_a_shoe_that_nothing_holds_along_the_wheel_is_told_of_its_links() -> None:
    turned = make(SQUEAL, link1__angle_deg=0.0, link2__angle_deg=90.0, solver__duration=0.05)
    assert "no link holds it along the wheel; incline a link" in verdict_of(turned).reasons[0]


@pytest.mark.parametrize("name", ["rough-partly-open", "rough-full-contact"])
def test_a_run_of_a_few_samples_has_a_verdict(name: str) -> None:
    text = (ROOT / "cases" / f"{name}.toml").read_text()
    for samples in range(1, 7):
        case = parse_case(text, name, ["output.sample_interval=2e-4", f"solver.duration={samples * 2e-4}"]).case
        assert verdict_of(case).regime is Regime.UNDECIDED


def test_a_growing_motion_has_settled_after_the_time_that_is_told() -> None:
    changes: dict[str, Any] = {"wheel__angular_speed": 1.0, "friction__coefficient": 0.6}
    growing = verdict_of(make(SQUEAL, **changes, solver__duration=0.2))
    needed = re.search(r"run at least ([\d.e+]+) s", growing.reasons[0])
    assert growing.regime is Regime.UNDECIDED
    assert needed is not None
    later = verdict_of(make(SQUEAL, **changes, solver__duration=float(needed[1])))
    assert (later.regime, later.settled) == (Regime.QUASI_HARMONIC, True)
    assert later.growth_rate is None


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_without_dashpots_and_below_flutter_a_motion_is_neutral(friction: float) -> None:
    case = make(SQUEAL, friction__coefficient=friction, wheel__angular_speed=4.0, **UNDAMPED)
    verdict = verdict_of(case)
    assert verdict.regime is Regime.UNDECIDED
    assert "neither grows nor decays" in verdict.reasons[0]
    assert verdict.growth_rate == 0.0


def test_the_amplitude_of_what_dies_out_is_what_is_left_and_that_of_its_first_tenth_stands_beside_it() -> None:
    """Of one mode, x is the real part of V exp(λ t): half of its peak to peak over both tenths."""
    changes: dict[str, Any] = {"friction__coefficient": 0.4, "solver__duration": 0.2}
    system = system_of(make(SQUEAL, **changes))
    theory = linear_theory(system, system.belt_speed)
    assert theory is not None
    slow = int(np.argmax(theory.values.real))
    value = theory.values[slow]
    vector = 1e-7 * theory.vectors[:, slow] / theory.vectors[0, slow]
    start = dict(zip(("x", "y", "vx", "vy"), vector.real.tolist(), strict=True))
    start = {f"initial__{name}": each for name, each in {"at": "equilibrium", **start}.items()}
    verdict = verdict_of(make(SQUEAL, **changes, **start))
    assert verdict.regime is Regime.DAMPED
    tenth = np.linspace(0.0, 0.02, 20_001)
    first, last = (0.5 * np.ptp((vector[0] * np.exp(value * (tenth + begin))).real) for begin in (0.0, 0.18))
    assert first > 2.0 * last  # it dies out while one looks
    assert verdict.amplitude_first == pytest.approx(first, rel=2e-3)
    assert verdict.amplitude == pytest.approx(last, rel=2e-3)


@pytest.mark.parametrize("damping", [300.0, 3000.0])
def test_a_drum_that_swings_once_per_turn_is_forced_with_the_amplitude_that_lasts(damping: float) -> None:
    case = make(DRUM, link1__damping=damping, link2__damping=damping)
    verdict = verdict_of(case)
    assert (verdict.regime, verdict.excitation) == (Regime.DAMPED, Excitation.FORCED)
    assert verdict.settled
    # So slow a wave forces the static displacement under the force that it adds: S z = (φ, 1) 2ak g sin, with both
    # waves from the same phase; inertia adds less than 1e-3. sinc(ωa) is 1 within 0.7 %.
    c = system_of(case).coefficients
    k = 2e7
    s = np.array([[c.c_xx, c.c_xy + c.phi * k], [c.c_xy, c.c_yy + k]])
    turn = np.linspace(0.0, 2.0 * np.pi, 10_001)
    swing = np.linalg.solve(s, [c.phi, 1.0]) * k * 0.5 * np.ptp(30e-6 * np.sin(turn) + 10e-6 * np.sin(2.0 * turn))
    assert verdict.amplitude == pytest.approx(abs(swing[0]), rel=0.01)
    assert verdict.amplitude_forced == pytest.approx(abs(swing[0]), rel=0.01)
    assert verdict.amplitude_own is not None
    assert verdict.amplitude_own < 0.05 * verdict.amplitude
    # R φ times the change of F_y = 2ak (g sin - y)
    force = c.phi * (
        2.0 * k * 0.5 * np.ptp(30e-6 * np.sin(turn) + 10e-6 * np.sin(2.0 * turn)) - 2.0 * k * swing[1]
    )
    assert verdict.torque_variation == pytest.approx(0.5 * force, rel=0.02)


RINGS: dict[str, Any] = {
    "shoe": {"mass": 2.1},
    "wheel": {"radius": 0.1, "angular_speed": 1.575},
    "link1": {"stiffness": 5.1374e5, "damping": 38.6, "angle_deg": -41.8},
    "link2": {"stiffness": 5.0972e4, "damping": 7.69, "angle_deg": 20.05},
    "load": {"force": 2514.7},
    "friction": {"coefficient": 0.479},
    "contact": {"half_length": 0.01, "stiffness": 1.375e8},
    "roughness": {"wheel": {"amplitudes": [2e-5], "wavelengths": [0.05]}},
    "initial": {"at": "rest", "vx": 0.03, "vy": 0.003},
    "solver": {"duration": 2.0, "step": 1e-4},
    "output": {"sample_interval": 2e-4},
}


@pytest.mark.parametrize("duration", [2.0, 5.0])
def test_the_variation_of_the_torque_waits_for_the_force_where_y_rings_longer_than_x(duration: float) -> None:
    case = make(RINGS, solver__duration=duration)
    verdict = verdict_of(case)
    system = system_of(case)
    assert verdict.settled
    if duration < 4.0:
        assert verdict.torque_variation is None
        assert any("the friction force still rings" in each for each in verdict.reasons)
        return
    # (S + iωB - ω²m) z = (φ, 1) K w, and F_y = K (w - y)
    c = system.coefficients
    k = system.contact_stiffness
    s = np.array([[c.c_xx, c.c_xy + c.phi * k], [c.c_xy, c.c_yy + k]])
    omega = 2.0 * np.pi * 0.1 * 1.575 / 0.05
    s = s - c.m * omega**2 * np.eye(2) + 1j * omega * np.array([[c.b_xx, c.b_xy], [c.b_xy, c.b_yy]])
    wave = 2e-5 * np.sinc(2.0 * 0.01 / 0.05)  # in the mean over the pad
    lasting = 2.0 * 0.1 * c.phi * k * abs(wave - np.linalg.solve(s, [c.phi, 1.0])[1] * k * wave)
    assert verdict.torque_variation == pytest.approx(lasting, rel=0.05)  # settled_within


@pytest.mark.parametrize("duration", [0.3, 1.0])
def test_a_run_of_few_turns_says_how_long_it_must_be(duration: float) -> None:
    short = verdict_of(make(DRUM, solver__duration=duration))
    needed = re.search(r"run at least ([\d.]+) s", " ".join(short.reasons))
    assert short.settled is False
    assert (short.regime is Regime.UNDECIDED) == (duration < 0.75)  # a turn
    assert needed is not None
    assert verdict_of(make(DRUM, solver__duration=float(needed[1]))).settled


@pytest.mark.parametrize("duration", [0.003, 0.05, 1.0])
def test_a_forced_swing_is_one_within_its_time(duration: float) -> None:
    """64 runs, by a scan of all of their time.

    The last place may lie a quarter of a fast wave, 0.4 ms, beyond it. The slow one changes by 0.6 % there.
    """
    wheel = {"amplitudes": [2e-6, 3e-6, 1e-6], "wavelengths": [2.0, 0.008, float(np.sqrt(2e-4))]}
    system = system_of(make(SQUEAL | {"roughness": {"wheel": wheel}}, wheel__angular_speed=10.0))
    theory = linear_theory(system, system.belt_speed)
    assert theory is not None
    time = np.linspace(0.0, 64.0 * duration, 400_000)
    x = np.imag(theory.waves[:, 0] @ np.exp(2j * np.pi * np.outer(theory.passing, time)))
    swing = parts([theory], np.zeros((1, 2)), np.array([0.0, duration]))[0]
    assert swing == pytest.approx(0.5 * np.ptp(x), rel=6e-3)


@pytest.mark.parametrize("shoes", counts(6, 30))
def test_without_friction_nothing_is_self_excited(shoes: int) -> None:
    rng = np.random.default_rng(3)
    for _ in range(shoes):
        speed = rng.uniform(1.0, 6.0)
        waves = rng.uniform(0.02, 0.06, int(rng.integers(1, 4)))
        rough = {"amplitudes": [float(rng.uniform(1e-4, 1e-3))] * len(waves), "wavelengths": waves.tolist()}
        changes: dict[str, Any] = {"friction__coefficient": 0.0, "wheel__angular_speed": speed}
        case = make(SQUEAL | {"roughness": {"wheel": rough}}, **changes, solver__duration=0.5, contact__nodes=128)
        verdict = verdict_of(case)
        assert verdict.excitation is not Excitation.SELF_EXCITED, verdict.reasons
        assert verdict.regime in (Regime.DAMPED, Regime.UNDECIDED)


def test_a_failed_run_is_neither_forced_nor_settled() -> None:
    case = make(DRUM, solver__duration=2.0)
    motion = array_history(1e-4, simulate(case).rows)
    (verdict,) = classify([inputs_of(motion, system_of(case), "it broke")])
    assert (verdict.regime, verdict.excitation, verdict.settled) == (Regime.UNDECIDED, Excitation.NONE, False)
    assert verdict.growth_rate is None


def test_what_waves_force_whose_phase_x_shifts_is_taken_from_the_history() -> None:
    """Its fourth harmonic, at a natural frequency, is not in the closed form, which is 27 % low."""
    verdict = verdict_of(parse_case(tomli_w.dumps(SHOES["waves whose phase x shifts"]), "case").case)
    assert (verdict.excitation, verdict.settled) == (Excitation.FORCED, True)
    assert verdict.amplitude_spread is not None
    assert abs(verdict.amplitude - 5.090e-6) <= verdict.amplitude_spread < 3e-7  # by another integrator


@pytest.mark.parametrize("omega", [0.1, 2.0])
def test_a_settled_vibration_has_the_numbers_of_its_limit_cycle(omega: float) -> None:
    """By stick, and by loss of contact. At a given step it keeps those of its samples, within their spread.

    The samples of the motion itself, 574 a cycle, miss (π/574)²/2 of an amplitude and a sample of a stick.
    """
    changes: dict[str, Any] = {
        "friction__coefficient": 0.7,
        "wheel__angular_speed": omega,
        "solver__duration": 2.0,
    }
    exact: dict[str, Any] = {"solver__scheme": "piecewise-exact", "solver__step": None, "solver__tolerance": 1e-3}
    fine = make(SQUEAL, **changes, **exact, output__sample_interval=1e-5)
    coarse = verdict_of(make(SQUEAL, **changes, **exact, output__sample_interval=5e-4))
    verdict = verdict_of(fine)
    assert (verdict.settled, coarse.settled) == (True, True)
    late = simulate(fine).rows[-100_000:]
    assert coarse.amplitude == pytest.approx(verdict.amplitude, rel=1e-10)  # both have closed it to 1e-11
    assert verdict.amplitude == pytest.approx(0.5 * float(np.ptp(late[:, 0])), rel=2e-5)
    assert verdict.frequency is not None
    sample = 1e-5 * verdict.frequency
    assert verdict.stick_fraction == pytest.approx(float(np.mean(late[:, 7] == ContactState.STICK)), abs=sample)
    assert verdict.mean_friction_force == pytest.approx(float(late[:, 4].mean()), rel=1e-3)
    assert verdict.amplitude_spread == pytest.approx(1e-11 * verdict.amplitude)
    stepped = verdict_of(make(SQUEAL, **changes))
    assert stepped.amplitude_spread is not None
    assert abs(stepped.amplitude - verdict.amplitude) <= stepped.amplitude_spread
    assert stepped.amplitude_spread > 1e-6 * verdict.amplitude
