"""A verdict as soon as it is known, on smooth pads at constant speed and load: what a sweep needs of a point.

The motion is followed without samples (`solver.flow.seek`) until one of two things is
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

from brakecli.analysis.regime.evidence import FEWEST_SAMPLES, WINDOWS
from brakecli.analysis.regime.forced import QUARTER
from brakecli.analysis.regime.linear import Linear, linear_theory
from brakecli.analysis.regime.verdict import Excitation, Regime
from brakecli.analysis.stability.modes import slowest_of_cycles
from brakecli.runs.certificate import ROUNDING, Certificate
from brakecli.solver.automaton import BACKWARD, FORWARD, OPEN, STICK
from brakecli.solver.compile import Floats
from brakecli.solver.flow.orbit import ORBIT
from brakecli.solver.flow.seek import FOUND, GOING_ON, LINEAR, seek, swing
from brakecli.solver.flow.smooth import PATH
from brakecli.solver.motion import Work
from brakecli.solver.records import BELT, FLOW, LOAD, new
from brakecli.solver.system import System

_SETTLED = 0.02  # of the size of a cycle: a motion so near to its orbit is settled
_POWERS = 10.0  # of e, by which what is left then fades until the end: drift is seen no more
_SETTLED_PART = 0.35  # of the run, at least: a quarter and the width of windows
_CYCLES = 5.0  # in a window of its envelope: of fewer, windows differ by where they cut the cycles
_SAMPLES = 40.0  # in a cycle, so that its shape is seen
_SEEN = 1.2  # samples in a stick, or off the wheel: one falls into each, also where the orbit is not reached yet
_GRAZES = 0.01  # of the wheel's speed: nearer to it, samples leave open whether the shoe sticks
_WINDOW = 0.05  # of the run, by which a whole run may see the settled part begin earlier or later


class Known(NamedTuple):
    """A verdict on the motion itself: numbers of its orbit, or of its linear motion (SI units)."""

    regime: Regime
    excitation: Excitation
    reasons: tuple[str]
    frequency: float | None  # Hz
    amplitude: float  # m
    stick_fraction: float
    contact_loss_fraction: float
    mean_friction_force: float  # N
    braking_torque: float  # N m
    settled: bool
    settled_from: float  # s
    evidence: dict[str, Any] = {}  # noqa: RUF012


class Ending(NamedTuple):
    """What stands for the motion of a whole run: its system, its last state as a row, its cost."""

    system: System
    rows: Floats
    work: Work


class Early(NamedTuple):
    """An early verdict, with what a sweep goes on with."""

    verdict: Known
    motion: Ending
    certificate: Certificate | None


def early(system: System, *, seen: bool = True) -> Early | None:
    """The verdict on the motion of a system before its end; None where none is certain.

    Unless it has to be `seen` by a whole run, too, an orbit counts however its samples would show it.
    """
    theory = _theory(system)
    if theory is None:
        return None
    c, flow, path = system.coefficients, new(FLOW), new(PATH)
    try:
        o = _prepared(system, theory)
    except np.linalg.LinAlgError:  # modes that are alike
        return None
    rest, start = theory.rest if system.initial.from_equilibrium else (0.0, 0.0), system.initial
    flow.x, flow.y, flow.v_x, flow.v_y = start.x + rest[0], start.y + rest[1], start.vx, start.vy
    flow.stiffness, flow.z[BELT], flow.z[LOAD] = system.contact_stiffness, system.belt_speed, system.load_at_start
    path.h = system.longest_step
    while (outcome := seek(c, flow, path, o)) == GOING_ON:
        pass
    if outcome == LINEAR:
        found = _linear(system, theory, flow, path, o)
    else:
        found = _cycle(system, theory, flow, o, seen) if outcome == FOUND else None
    if found is None:
        return None
    verdict, end = found
    work = Work(steps=int(path.steps), contact_evaluations=int(path.evaluations))
    error = max(float(o.error), ROUNDING) if outcome == FOUND else ROUNDING  # not that of an orbit given up
    certificate = Certificate(system.method.tolerance, True, error, system.sampled_duration, "the orbit itself")
    row = np.array([end])
    return Early(verdict, Ending(system, row, work), certificate if system.method.step is None else None)


def may_be_early(system: System) -> bool:
    """Whether a verdict may come early: smooth pads, the piecewise-exact scheme, constant speed and load."""
    return system.smooth and system.method.row.exact and system.steady and system.samples >= FEWEST_SAMPLES


def _theory(system: System) -> Linear | None:
    """The theory of steady sliding, where a verdict may be early and eigenvalues say which way it goes."""
    if not may_be_early(system) or system.coefficients.phi == 0.0:
        return None
    theory = linear_theory(system, system.belt_speed)
    return theory if theory is not None and theory.direction != 0 else None


def _prepared(system: System, theory: Linear) -> Any:
    """The record that a motion is followed with."""
    o, inverse = new(ORBIT), np.linalg.inv(theory.vectors)
    o.duration = system.sampled_duration
    o.sliding = BACKWARD if theory.belt > 0.0 else FORWARD
    o.rest[:2], o.room[:] = theory.rest, (theory.depth, abs(theory.belt))
    o.into[0], o.into[1], o.growth[:] = inverse.real, inverse.imag, theory.values.real
    o.reach[:] = np.abs(theory.vectors[:3]).T
    return o


def _linear(system: System, theory: Linear, flow: Any, path: Any, o: Any) -> tuple[Known, list[float]] | None:
    """The verdict on a motion that is linear from its first half on, and its last state."""
    start, end = (system.samples + 1) // 2 * system.interval, system.sampled_duration
    if o.time > start:
        return None
    rest, values, vectors = np.array(o.rest), theory.values, theory.vectors
    parts = np.linalg.solve(vectors, np.array(flow.z[:4]) - rest)

    def at(time: float) -> Floats:
        return np.asarray(rest + (vectors @ (parts * np.exp(values * (time - o.time)))).real)

    last = at(end)
    o.low = o.high = float(last[0])
    flow.z[:4] = at(start)
    swing(system.coefficients, flow, path, o, end - start)
    fades = np.exp(values * (end - o.time)) - np.exp(values * (start - o.time))
    height = rest[1] + (vectors[1] @ (parts * fades / values)).real / (end - start)
    force = math.copysign(system.coefficients.phi, theory.belt) * -system.contact_stiffness * float(height)
    reason = theory.sentence
    if theory.direction > 0:
        more = theory.seconds_to_limit(end, last) + 3.0 / theory.mode.growth
        reason += f"; run at least {QUARTER * (end + more):.3g} s"
    regime, amplitude = Regime.DAMPED if theory.direction < 0 else Regime.UNDECIDED, 0.5 * float(o.high - o.low)
    torque = system.radius * force
    slope = {"envelope_slope": theory.mode.growth}
    numbers = amplitude, 0.0, 0.0, force, torque
    return Known(regime, Excitation.NONE, (reason,), None, *numbers, False, start, slope), last.tolist()


def _cycle(system: System, theory: Linear, flow: Any, o: Any, seen: bool) -> tuple[Known, list[float]] | None:
    """The verdict on an orbit that the motion has come to well before the end of the run, and a state on it."""
    end, period, interval = system.sampled_duration, float(o.period), system.interval
    factor = float(np.abs(np.linalg.eigvals(o.map)).max())
    if not factor < 1.0:
        return None
    rate = -math.log(max(factor, 1e-300)) / period
    start = float(o.fell[0]) + max(math.log(max(float(o.away), 1e-300) / _SETTLED), 0.0) / rate
    part, slow = end - start, min(abs(theory.mode.growth), slowest_of_cycles(system.coefficients))
    stick, clear = float(o.spent[STICK]), float(o.spent[OPEN])
    limited = period - float(o.spent[o.sliding])
    hidden = (
        part < _SETTLED_PART * end
        or end < _CYCLES * WINDOWS * period
        or period < _SAMPLES * interval
        or min(limited, stick or limited, clear or limited) < _SEEN * interval
        or (stick == 0.0 and abs(float(o.fastest) - 1.0) < _GRAZES)
        or o.beaten.tolist() != [1, 1]
    )
    if rate * part < _POWERS or (seen and hidden):
        return None
    lasts = slow * (part - _WINDOW * end) >= 1.0
    if seen and not lasts and (theory.direction < 0 or slow * end >= 1.0):
        return None  # whether the vibration lasts depends on where exactly a whole run sees it settled
    c, how = system.coefficients, "with" if stick > 0.0 else "without"
    force = (c.c_xx * float(o.mean_x) + c.c_xy * float(o.mean_y)) / period + system.load_at_start * c.sin_beta
    reason = f"sustained: a limit cycle {how} stick; a disturbance keeps {factor:.2g} of its size in a cycle"
    regime = Regime.RELAXATION if stick > 0.0 else Regime.QUASI_HARMONIC
    numbers = float(o.amplitude), stick / period, clear / period, force, system.radius * force
    excited, shown = (regime, Excitation.SELF_EXCITED, (reason,), 1.0 / period), {"largest_multiplier": factor}
    x, y, v_y = o.point.tolist()
    return Known(*excited, *numbers, lasts, start, shown), [x, y, 0.0, v_y]
