"""A verdict as soon as it is known, on smooth pads at constant speed and load: what a sweep needs of a point.

It is the ordinary verdict on a motion whose fate is known, without samples. The fate says one of two things.

- It slides to one side, and the sum of its modes can neither reach the speed of the wheel nor open the contact
  until the end of the run. All that is to come is linear, and the eigenvalues decide.
- It comes to a limit cycle that attracts it. Floquet's multipliers say when it will have come to it, and the
  verdict is given where a whole run would find it settled.

Where neither is certain, or where a whole run would see something else (too few samples in a cycle or beside
steady sliding, a settled part that is too short), there is no early verdict, and the run goes to its end.
"""

import math
from itertools import groupby
from typing import NamedTuple

import numpy as np

from brakecli.analysis.fate import Fate, fate_on_smooth_pads
from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.decision import Regime, Thresholds
from brakecli.analysis.regime.evidence import FEWEST_SAMPLES, WINDOWS, tenths
from brakecli.analysis.regime.measure import of_fate
from brakecli.analysis.regime.table import decide
from brakecli.analysis.regime.verdict import Verdict, of_orbit
from brakecli.analysis.shoe import Shoe
from brakecli.analysis.stability.linear import Linear, Theory, linear_theory
from brakecli.analysis.stability.modes import is_undamped
from brakecli.solver.arrays import Floats
from brakecli.solver.integrate import Work
from brakecli.solver.motion.events import DONE
from brakecli.solver.motion.flow import Orbit, Pursuit, SmoothFlow
from brakecli.solver.system import System
from brakecli.studies.runs.certificate import ROUNDING, Certificate
from brakecli.studies.runs.settled import Judged


class Ending(NamedTuple):
    """What stands for the motion of a whole run: its system, its last state as a row, its cost."""

    system: System
    rows: Floats
    work: Work


def early(system: System, theory: Theory | None = None) -> Judged[Ending] | None:
    """The verdict on the motion of a system before its end; None where none is certain."""
    linear = _theory(system, theory)
    if linear is None:
        return None
    begin = system.initial.beside(linear.rest)
    modes = linear.values, linear.vectors
    duration = system.sampled_duration
    end = fate_on_smooth_pads(Shoe.of(system), begin, duration, modes, until=duration)
    motion = end.motion
    if motion is None:
        return None
    if end.orbit is not None:
        outcome = _cycle(system, linear, end, end.orbit, motion)
        error = end.orbit.error
    else:
        outcome = _linear(system, linear, motion)
        error = ROUNDING
    if outcome is None:
        return None
    verdict, last = outcome
    work = Work(steps=end.steps, contact_evaluations=motion.evaluations)
    certificate = Certificate(system.method.tolerance, True, error, duration, "the orbit itself")
    ending = Ending(system, np.array([last]), work)
    return Judged(verdict, ending, certificate if system.method.step is None else None)


def may_be_early(system: System) -> bool:
    """Whether a verdict may come early: smooth pads, the piecewise-exact scheme, constant speed and load."""
    return system.smooth and system.method.row.exact and system.steady and system.samples >= FEWEST_SAMPLES


def _theory(system: System, theory: Theory | None) -> Linear | None:
    """The theory of steady sliding, where a verdict may be early and eigenvalues say which way it goes."""
    if not may_be_early(system) or system.coefficients.phi == 0.0:
        return None
    linear = theory() if theory else linear_theory(system, system.belt_speed)
    return linear if linear is not None and linear.direction != 0 else None


def _linear(system: System, theory: Linear, motion: Pursuit) -> tuple[Verdict, list[float]] | None:
    """The verdict on a motion that is linear from its first half on, and its last state."""
    o = motion.way
    start = (system.samples + 1) // 2 * system.interval
    end = system.sampled_duration
    reached = motion.time
    if reached > start:
        return None
    equilibrium = np.array(o.equilibrium)
    values = theory.values
    vectors = theory.vectors
    parts = np.linalg.solve(vectors, motion.state - equilibrium)

    def at(time: float) -> Floats:
        return np.asarray(equilibrium + (vectors @ (parts * np.exp(values * (time - reached)))).real)

    last = at(end)

    def amplitude(begin: float, until: float, *before: float) -> float:
        """Half of peak to peak of x between two times at which the motion is linear, and of what was before."""
        x = float(at(until)[0])
        o.low = min(x, *before, x)
        o.high = max(x, *before, x)
        motion.swing(at(begin), until - begin)
        return 0.5 * float(o.high - o.low)

    fades = np.exp(values * (end - reached)) - np.exp(values * (start - reached))
    height = equilibrium[1] + (vectors[1] @ (parts * fades / values)).real / (end - start)
    force = system.coefficients.grip(theory.belt) * -system.contact_stiffness * float(height)
    answers = Answers(
        duration=end, linear=True, growth_rate=theory.mode.growth, ringing_frequency=theory.mode.frequency
    )
    if theory.direction > 0:
        answers = answers._replace(time_to_limit=theory.seconds_to_limit(end, last))
    decision = decide(answers, Thresholds())

    def verdict(size: float, first: float | None = None) -> Verdict:
        return Verdict(
            decision,
            amplitude=size,
            stick_fraction=0.0,
            contact_loss_fraction=0.0,
            mean_friction_force=force,
            braking_torque=system.radius * force,
            settled_from=start,
            settled=False,
            evidence={"row": decision.row, "growth_rate": theory.mode.growth},
            amplitude_first=first,
            remaining=math.exp(theory.mode.growth * (end - reached)),
        )

    if decision.regime is not Regime.DAMPED:
        return verdict(amplitude(start, end)), last.tolist()
    first, late = (index * system.interval for index in tenths(system.samples + 1))
    first -= system.interval  # its last sample
    before = _swung(system, theory, min(reached, first))
    early = amplitude(reached, first, *before) if reached < first else 0.5 * (before[1] - before[0])
    return verdict(amplitude(late, end), early), last.tolist()


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


def _cycle(
    system: System, theory: Linear, end: Fate, orbit: Orbit, motion: Pursuit
) -> tuple[Verdict, list[float]] | None:
    """The verdict on an orbit that the motion has come to well before the end of the run, and a state on it."""
    way = motion.way
    rate = end.rate or 0.0
    duration = system.sampled_duration
    interval = system.interval
    fades = math.log(max(float(way.away) / 0.02, 1.0)) / rate  # until it is so near to its orbit, over its size
    start = float(way.fell[0]) + fades
    lasting = duration - start
    hidden = (
        rate * lasting < 10.0  # powers of e by which what is left then fades until the end: else drift is seen
        or lasting < 0.35 * duration  # a quarter, and the width of windows
        or duration < 5.0 * WINDOWS * orbit.period  # windows differ by where they cut the cycles
        or orbit.period < 40.0 * interval  # its shape is not seen
        # one sample falls into each time beside steady sliding, also where the orbit is not reached yet
        or _longest_away(orbit, int(way.sliding)) < 1.2 * interval
        # so near to the wheel's speed rounding may decide whether the shoe sticks
        or (orbit.stick_fraction == 0.0 and abs(motion.fastest - 1.0) < 0.01)
        or motion.path.beaten.tolist() != [1, 1]  # more than one fall of vx that counts
        or is_undamped(system.coefficients)  # no motion is sure to stay
    )
    if hidden:
        return None
    answers = Answers(
        duration=duration,
        growth_rate=theory.mode.growth,
        level=orbit.level,
        settled=True,
        settled_duration=lasting,
        cycles=lasting / orbit.period,
        samples_per_cycle=orbit.period / interval,
        **of_fate(end),
    )
    decision = decide(answers, Thresholds())._replace(frequency=orbit.frequency)
    evidence = {"row": decision.row, "rate_without_waves": rate, "largest_multiplier": motion.multiplier}
    numbers = of_orbit(orbit, system.radius)
    verdict = Verdict(decision, settled_from=start, settled=True, evidence=evidence, **numbers)
    return verdict, list(orbit.state)


def _longest_away(orbit: Orbit, sliding: int) -> float:
    """The longest time (s) in which a motion on an orbit does not slide as it would steadily."""
    spans = np.diff([0.0, *orbit.times, orbit.period]).tolist()
    phases = zip(2 * orbit.word, 2 * spans, strict=True)  # the last one goes on in the first
    groups = groupby(phases, key=lambda phase: phase[0] == sliding)
    return max((sum(span for _, span in group) for slides, group in groups if not slides), default=0.0)
