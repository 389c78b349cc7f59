"""Cases at the edge: each ends in a regime with its reason, a warning with key and number, or a refusal."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.commands import attributes, left_in, variants

pytestmark = pytest.mark.usefixtures("compiled")


def test_extreme_speeds_and_frictions_end_in_a_regime_with_its_reason(here: Path) -> None:
    speeds = ["0.0", "-0.1", "1e-9", "1e4"]
    frictions = ["0.0", "5.0", "50.0"]
    done = variants(
        here,
        *([f"wheel.angular_speed={speed}", "solver.duration=0.05"] for speed in speeds),
        *([f"friction.coefficient={friction}", "solver.duration=0.05"] for friction in frictions),
    )
    results = dict(zip([*speeds, *(f"φ {friction}" for friction in frictions)], done, strict=True))
    strange = {  # on purpose
        "1e4": "wheel.angular_speed: a surface speed of 5000 m/s is more than 100 m/s;",
        "φ 5.0": "friction.coefficient: 5 is more than 2;",
        "φ 50.0": "friction.coefficient: 50 is more than 2;",
    }
    for name, result in results.items():
        told = result.told(0).splitlines()
        if name in ("1e-9", "φ 50.0"):  # friction there outruns the wheel within a step
            assert "stick and slip are not resolved" in told.pop(0), name
        if name in strange:
            assert told.pop().startswith(f"brakecli: warning: {strange[name]}"), name
        assert told == [], name
        numbers = result.json
        assert numbers["reasons"][0]
    still = results["0.0"].json
    assert still["regime"] == "damped"
    assert "come to rest" in still["reasons"][0]
    assert "carried along" in results["1e-9"].json["reasons"][0]
    for n, sign in ((1, -1.0), (3, 1.0)):  # the wheel drags the shoe along its own motion
        with h5py.File(here / f"{n}.h5") as file:
            assert sign * file["history/friction_force"][-100:].mean() > 0.0
    with h5py.File(here / "4.h5") as file:
        assert not np.any(file["history/friction_force"][:])


def test_an_explicit_scheme_beyond_its_step_is_refused_with_the_limit_which_then_holds(here: Path) -> None:
    weights = "solver.theta=[0.0, 0.0]"
    coarse = ["solver.step=1e-3", "output.sample_interval=1e-3", "solver.duration=0.1"]
    two_layer, three_layer = variants(
        here,
        [weights, *coarse],
        [
            "solver.scheme='three-layer'",
            "solver.theta=[0.0, 1.0, 0.0]",
            *coarse[2:],
            *(s.replace("1e", "3e") for s in coarse[:2]),
        ],
    )
    limits = []
    for done in (two_layer, three_layer):
        told = done.told(3, "solver.theta: at this step the scheme is unstable: it multiplies disturbances by")
        limits.append(float(told.split("take a solver.step of at most ")[1].split()[0]))
    # Leapfrog is stable up to 2/ω of the highest frequency, 181.8 Hz (dashpots lower it a little).
    assert limits[1] == pytest.approx(2.0 / (2.0 * np.pi * 181.8), rel=0.05)
    assert left_in(here) == {"tiny.toml"}
    (below,) = variants(here, [weights, f"solver.step={limits[0]}", "output.sample_interval=1e-3", coarse[2]])
    below.told(0)
    assert below.json["amplitude"] < 1.0


def test_a_motion_beyond_all_bounds_is_a_failure_that_is_written(here: Path) -> None:
    (done,) = variants(here, ["load.force=1e25"])
    done.told(1, "the motion grew beyond all bounds", "0.h5: the history up to the failure was written")
    assert done.json["status"] == "failed"
    assert done.json["regime"] == "undecided"
    assert attributes(here / "0.h5")["status"] == "failed"


def test_an_implicit_step_that_does_not_resolve_is_told_with_its_number(here: Path) -> None:
    (done,) = variants(here, ["solver.step=1e-3", "output.sample_interval=1e-3", "solver.duration=0.2"])
    assert "Traceback" not in done.err
    assert "warning: solver.step: 5.5 steps per period of the fastest motion (181.8 Hz)" in done.err
    assert done.json["warnings"][0].startswith("solver.step: 5.5 steps per period")


def test_steps_that_do_not_converge_end_the_run_unless_allowed_and_are_kept(here: Path) -> None:
    diverging = ["solver.iteration='fixed-point'", "solver.step=2e-3", "output.sample_interval=2e-3"]
    diverging += ["solver.duration=0.2", "contact.stiffness=2e9"]
    strict, allowed = variants(here, diverging, [*diverging, "solver.allow_unconverged=true"])
    strict.told(
        1, "solver.iteration: the fixed-point iteration may diverge (the bound of its contraction factor is "
    )
    strict.told(1, "the iteration of a step did not converge", "0.h5: the history up to the failure was written")
    assert strict.json["unconverged_steps"] == 1
    assert strict.json["status"] == "failed"
    assert allowed.json["unconverged_steps"] > 1
    count = allowed.json["unconverged_steps"]
    allowed.told(1, f"warning: {count} of {allowed.json['steps']} steps did not converge, as the case allows")
    allowed.told(1, "the motion grew beyond all bounds")
    for name, steps in (("0.h5", 1), ("1.h5", count)):
        with h5py.File(here / name) as file:
            residuals = file["unconverged/residual"]
            times = file["unconverged/time"]
            assert residuals.shape == times.shape == (steps,)
            assert residuals.attrs["units"] == "N"
            assert np.all(np.abs(residuals[:]) > 0.0)
            assert np.all((times[:] >= 0.0) & (times[:] <= 0.2))
    assert attributes(here / "1.h5")["unconverged_steps"] == count


def test_unconverged_steps_that_do_little_harm_are_allowed_with_a_warning(here: Path) -> None:
    # The contraction is 1.004: the evaluations of a step run out, but at small residuals.
    close = ["solver.iteration='fixed-point'", "solver.step=1e-2", "output.sample_interval=1e-2"]
    close += ["solver.duration=0.2", "contact.stiffness=1e8", "wheel.angular_speed=2.0"]
    strict, allowed = variants(here, close, [*close, "solver.allow_unconverged=true"])
    strict.told(1, "did not converge")
    count = allowed.json["unconverged_steps"]
    assert count > 0
    allowed.told(0, f"warning: {count} of 20 steps did not converge, as the case allows")


def test_what_is_not_resolved_is_told_with_key_and_number(here: Path) -> None:
    wave = "roughness.wheel={amplitudes=[1e-6], wavelengths=[1e-3]}"
    nodes, passing = variants(
        here,
        [wave, "contact.evaluator='midpoint'", "contact.nodes=64", "wheel.angular_speed=0.0"],
        [wave, "contact.evaluator='midpoint'", "wheel.angular_speed=40.0"],
    )
    # The pad of 0.1 m holds 100 waves; 20 m/s over a wave of 1 mm is 20 kHz.
    nodes.told(0, "contact.nodes: 0.64 nodes per shortest wavelength; take at least ")
    told = passing.told(
        passing.code, "solver.step: 5 steps per passing wave of the wheel (2e+04 Hz); take a step of"
    )
    assert (
        "output.sample_interval: the shortest wave of the wheel at 2e+04 Hz lies above half the sampling" in told
    )
    assert "(5000 Hz)" in told


@pytest.mark.parametrize(
    "overrides",
    [
        ["link2.stiffness=1e100", "initial.at='equilibrium'"],
        ["contact.stiffness=1e100", "contact.half_length=1e100"],
        ["shoe.mass=1e-100", "link1.damping=1e100", "contact.stiffness=1e100"],
        ["shoe.mass=1e100", "solver.step=1e-100", "output.sample_interval=1e100", "solver.scheme='three-layer'"],
    ],
)
def test_numbers_that_no_brake_has_are_refused_or_run(here: Path, overrides: list[str]) -> None:
    for done in variants(here, overrides):
        assert "Traceback" not in done.err
        assert "RuntimeWarning" not in done.err
        assert done.code in (0, 1, 3)
        if done.code == 3:
            done.told(3, "; ")
    assert left_in(here) <= {"tiny.toml", "0.h5"}
