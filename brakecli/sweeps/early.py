"""A verdict as soon as it is known, on smooth pads at constant speed and load: what a sweep needs of a point.

The motion is followed without samples (`solver.motion.orbit`) until one of two things is
certain.

- It slides to one side, and the sum of its modes can neither reach the speed of the wheel nor open the contact
  until the end of the run. All that is to come is linear, and the eigenvalues decide.
- It comes to a limit cycle that attracts it. Floquet's multipliers say when it will have come to it, and the
  verdict is given where a whole run would find it settled.

Where neither is certain, or where a whole run would see something else (too few samples in a cycle or in a
stick, a settled part that is too short), there is no early verdict, and the run goes to its end.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from brakecli.analysis.regime.answers import Answers, Continuation
from brakecli.analysis.regime.decision import Regime, Thresholds
from brakecli.analysis.regime.evidence import FEWEST_SAMPLES, WINDOWS, tenths
from brakecli.analysis.regime.table import decide
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.stability.linear import Linear, Theory, linear_theory
from brakecli.analysis.stability.modes import is_undamped
from brakecli.runs.certificate import ROUNDING, Certificate
from brakecli.runs.settled import Judged
from brakecli.solver.arrays import Floats
from brakecli.solver.integrate import Work
from brakecli.solver.motion.events import DONE
from brakecli.solver.motion.flow import Pursuit, SmoothFlow
from brakecli.solver.motion.orbit import FOUND, GOING_ON, LINEAR
from brakecli.solver.motion.phases import STICK
from brakecli.solver.system import System

_SETTLED = 0.02  # of the size of a cycle: a motion so near to its orbit is settled
_POWERS = 10.0  # of e, by which what is left then fades until the end: drift is seen no more
_SETTLED_PART = 0.35  # of the run, at least: a quarter and the width of windows
_CYCLES = 5.0  # in a window of its envelope: of fewer, windows differ by where they cut the cycles
_SAMPLES = 40.0  # in a cycle, so that its shape is seen
_SEEN = 1.2  # samples in a stick, or off the wheel: one falls into each, also where the orbit is not reached yet
_GRAZES = 0.01  # of the wheel's speed: nearer to it, samples leave open whether the shoe sticks


class Ending(NamedTuple):
    """What stands for the motion of a whole run: its system, its last state as a row, its cost."""

    system: System
    rows: Floats
    work: Work


def early(system: System, theory: Theory | None = None) -> Judged[Ending] | None:
    """The verdict on the motion of a system before its end; None where none is certain."""
    known = _theory(system, theory)
    if known is None:
        return None
    acting = system.contact_stiffness, system.belt_speed, system.load_at_start
    modes = known.values, known.vectors
    try:
        begin = system.initial.beside(known.rest)
        seconds = system.sampled_duration
        motion = Pursuit(system.coefficients, acting, begin, known.rest, modes, seconds)
    except np.linalg.LinAlgError:  # modes that are alike
        return None
    while (outcome := motion.seek()) == GOING_ON:
        pass
    o = motion.way
    if outcome == LINEAR:
        found = _linear(system, known, motion)
    else:
        found = _cycle(system, known, motion) if outcome == FOUND else None
    if found is None:
        return None
    verdict, end = found
    work = Work(steps=motion.steps, contact_evaluations=motion.evaluations)
    error = max(float(o.error), ROUNDING) if outcome == FOUND else ROUNDING  # not that of an orbit given up
    certificate = Certificate(system.method.tolerance, True, error, system.sampled_duration, "the orbit itself")
    row = np.array([end])
    return Judged(verdict, Ending(system, row, work), certificate if system.method.step is None else None)


def may_be_early(system: System) -> bool:
    """Whether a verdict may come early: smooth pads, the piecewise-exact scheme, constant speed and load."""
    return system.smooth and system.method.row.exact and system.steady and system.samples >= FEWEST_SAMPLES


def _theory(system: System, theory: Theory | None) -> Linear | None:
    """The theory of steady sliding, where a verdict may be early and eigenvalues say which way it goes."""
    if not may_be_early(system) or system.coefficients.phi == 0.0:
        return None
    found = theory() if theory else linear_theory(system, system.belt_speed)
    return found if found is not None and found.direction != 0 else None


def _linear(system: System, theory: Linear, motion: Pursuit) -> tuple[Verdict, list[float]] | None:
    """The verdict on a motion that is linear from its first half on, and its last state."""
    o = motion.way
    start = (system.samples + 1) // 2 * system.interval
    end = system.sampled_duration
    reached = motion.time
    if reached > start:
        return None
    rest = np.array(o.rest)
    values = theory.values
    vectors = theory.vectors
    parts = np.linalg.solve(vectors, motion.state - rest)

    def at(time: float) -> Floats:
        return np.asarray(rest + (vectors @ (parts * np.exp(values * (time - reached)))).real)

    last = at(end)

    def amplitude(begin: float, until: float, *before: float) -> float:
        """Half of peak to peak of x between two times at which the motion is linear, and of what was before."""
        x = float(at(until)[0])
        o.low = min(x, *before, x)
        o.high = max(x, *before, x)
        motion.swing(at(begin), until - begin)
        return 0.5 * float(o.high - o.low)

    fades = np.exp(values * (end - reached)) - np.exp(values * (start - reached))
    height = rest[1] + (vectors[1] @ (parts * fades / values)).real / (end - start)
    force = system.coefficients.grip(theory.belt) * -system.contact_stiffness * float(height)
    answers = Answers(
        duration=end, linear=True, growth_rate=theory.mode.growth, ringing_frequency=theory.mode.frequency
    )
    if theory.direction > 0:
        answers = answers._replace(time_to_limit=theory.seconds_to_limit(end, last))
    decision = decide(answers, Thresholds())
    evidence = {"row": decision.row, "growth_rate": theory.mode.growth}
    numbers: dict[str, Any] = {
        "stick_fraction": 0.0,
        "contact_loss_fraction": 0.0,
        "mean_friction_force": force,
        "braking_torque": system.radius * force,
        "settled_from": start,
        "settled": False,
        "evidence": evidence,
        "left": math.exp(theory.mode.growth * (end - reached)),
    }
    if decision.regime is not Regime.DAMPED:
        return Verdict(decision, amplitude(start, end), **numbers), last.tolist()
    first, late = (place * system.interval for place in tenths(system.samples + 1))
    first -= system.interval  # its last sample
    before = _swung(system, theory, min(reached, first))
    early = amplitude(reached, first, *before) if reached < first else 0.5 * (before[1] - before[0])
    return Verdict(decision, amplitude(late, end), amplitude_first=early, **numbers), last.tolist()


def _swung(system: System, theory: Linear, seconds: float) -> tuple[float, float]:
    """The least and the largest x (m) in the first seconds of a motion."""
    flow = SmoothFlow.of(system)
    state = system.initial.beside(theory.rest)
    least = math.inf
    most = -math.inf
    while True:
        outcome = flow(state, seconds, tangents=False)
        least = min(least, float(flow.path.low[0]))
        most = max(most, float(flow.path.high[0]))
        if outcome == DONE:
            return least, most
        # after many events it stops
        state = flow.state
        seconds = seconds - float(flow.path.time)


def _cycle(system: System, theory: Linear, motion: Pursuit) -> tuple[Verdict, list[float]] | None:
    """The verdict on an orbit that the motion has come to well before the end of the run, and a state on it."""
    o = motion.way
    orbit = motion.orbit
    factor = motion.multiplier
    end = system.sampled_duration
    period = orbit.period
    interval = system.interval
    if not factor < 1.0 or is_undamped(system.coefficients):  # without dashpots no orbit is sure to stay
        return None
    rate = -math.log(max(factor, 1e-300)) / period
    start = float(o.fell[0]) + max(math.log(max(float(o.away), 1e-300) / _SETTLED), 0.0) / rate
    part = end - start
    stick = orbit.stick_fraction * period
    clear = orbit.contact_loss_fraction * period
    limited = period - float(motion.path.spent[o.sliding])
    hidden = (
        part < _SETTLED_PART * end
        or end < _CYCLES * WINDOWS * period
        or period < _SAMPLES * interval
        or min(limited, stick or limited, clear or limited) < _SEEN * interval
        or (stick == 0.0 and abs(motion.fastest - 1.0) < _GRAZES)
        or motion.path.beaten.tolist() != [1, 1]
    )
    if rate * part < _POWERS or hidden:
        return None
    force = float(o.force)
    answers = Answers(
        duration=end,
        growth_rate=theory.mode.growth,
        without_waves=Continuation.LASTS,
        level=1.0,  # the same as on the orbit
        level_without_waves=1.0,
        amplitude_without_waves=orbit.amplitude,
        settled=True,
        period_without_waves=period,
        sticks_without_waves=float(orbit.word.count(STICK)),
        settled_duration=part,
        cycles=part / period,
        samples_per_cycle=period / interval,
    )
    decision = decide(answers, Thresholds())._replace(frequency=orbit.frequency)
    verdict = Verdict(
        decision=decision,
        amplitude=orbit.amplitude,
        stick_fraction=orbit.stick_fraction,
        contact_loss_fraction=orbit.contact_loss_fraction,
        mean_friction_force=force,
        braking_torque=system.radius * force,
        settled_from=start,
        settled=True,
        evidence={"row": decision.row, "rate_without_waves": rate, "largest_multiplier": factor},
    )
    return verdict, list(orbit.state)
