"""What a run is likely to cost; rough guesses that tell minutes from days."""

import numpy as np

from brakecli.solver.system import System

# Seconds, measured with `make cases` on one core.
_STEP_SECONDS = 1.5e-7
_NODE_SECONDS = 1.2e-9  # per node, and again per node and wave of the wheel:
_NODE_WAVE_SECONDS = 4e-10
_EXACT_SECONDS = 5e-6  # per wave on the pad
_EVALUATIONS = 3.0  # of the contact in a step
_OWN_STEPS = 25.0  # in a period, of a scheme that finds them itself, at a tolerance of 1e-10
_OWN_STEP_SECONDS = 4e-6
_OWN_EVALUATIONS = 27.0


def own_steps(system: System) -> tuple[int, float]:
    """Steps of a scheme that finds them itself, and the cost of all its runs over that of the last."""
    method, c, frequency = system.method, system.coefficients, system.natural_frequencies[1]
    alone = method.step is not None
    tolerance = method.tolerance if alone else max(min(1e-5 * method.tolerance, 1e-8), 1e-13)
    rate = frequency * _OWN_STEPS * (1e-10 / tolerance) ** 0.125
    rate += 8.0 * system.passing_frequency + 0.25 * (c.b_xx + c.b_yy) / c.m
    return 1 + int(min(system.sampled_duration * rate, 1e300)), 1.0 if alone else 1.6


def seconds_per_step(system: System) -> float:
    """A rough guess at the time of one step."""
    own, n_2 = system.method.own_steps, len(system.wheel.g)
    if own:
        return _OWN_STEP_SECONDS * (1.0 + n_2**2 / 20.0) + (
            _OWN_EVALUATIONS * _open_part(system) * evaluation_seconds(system)
            if system.evaluator == "exact"
            else 0.0
        )
    if system.evaluator == "exact" or system.nodes:
        return _STEP_SECONDS + _EVALUATIONS * evaluation_seconds(system)
    return _STEP_SECONDS * (1.0 + n_2**2 / 20.0)


def _open_part(system: System) -> float:
    """Part of the time in which rough surfaces may be open in part: little if the load presses them together."""
    heights = float(np.abs(system.shoe.g).sum() + np.abs(system.wheel.g).sum())
    spring = system.coefficients.c_yy + system.contact_stiffness
    return 0.04 if heights * spring < float(np.abs(system.load["value"]).min()) else 0.12


def evaluation_seconds(system: System) -> float:
    """A rough guess at the time that one evaluation of a contact which is open in part takes."""
    if system.evaluator == "exact":
        return _EXACT_SECONDS * (1.0 + 2.0 * system.half_length * system.most_turns)
    return system.nodes * (_NODE_SECONDS + _NODE_WAVE_SECONDS * len(system.wheel.g))


def duration_text(seconds: float) -> str:
    """A time in the unit that people would say it in."""
    for unit, size in (("years", 3.156e7), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.2g} s"
