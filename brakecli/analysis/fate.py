"""What does a motion come to in the end, at constant speed and load?"""

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from brakecli.analysis.shoe import Shoe
from brakecli.analysis.stability.modes import eigensystem, growth, is_undamped
from brakecli.solver.arrays import Floats
from brakecli.solver.motion.flow import FOREVER, Modes, Orbit, Pursuit
from brakecli.solver.motion.orbit import FOUND, LINEAR
from brakecli.solver.steady_sliding import sliding
from brakecli.solver.system import System
from brakecli.stop import signalled

MOST_STEPS = 5_000_000
"""Steps of a motion on smooth pads after which it is given up: about half a second."""


class Kind(StrEnum):
    """What a motion comes to.

    A *vibration* lasts by itself, and no orbit of it is known. It *locks* where friction leaves no steady sliding,
    and *leaves* where nothing presses the shoe on the wheel.
    """

    STEADY_SLIDING = "steady sliding"
    FORCED = "forced motion"
    LIMIT_CYCLE = "limit cycle"
    VIBRATION = "vibration"
    LOCKS = "locks"
    LEAVES = "leaves"
    UNKNOWN = "unknown"


class Fate(NamedTuple):
    """What a motion comes to: its kind, and what is known of that.

    `orbit` is that of a limit cycle, with the `rate` (1/s) at which its slowest disturbance fades. `state`: x, y,
    v_x and v_y on a vibration, at t = 0 of the waves. `steps`: what it took to know. `motion`: what was followed
    on smooth pads, and can be followed on.
    """

    kind: Kind
    orbit: Orbit | None = None
    rate: float | None = None
    state: Floats | None = None
    steps: int = 0
    motion: Pursuit | None = None

    @property
    def lasts(self) -> bool | None:
        """Whether a vibration by itself lasts; None where that is not known."""
        if self.kind in (Kind.LIMIT_CYCLE, Kind.VIBRATION):
            return True
        return False if self.kind in (Kind.STEADY_SLIDING, Kind.FORCED) else None


def fate(system: System, state: Floats, within: float = math.inf, forced: Sequence[Floats] | None = None) -> Fate:
    """What the motion of a system from a state (x, y, v_x, v_y) comes to, as far as some time (s) shows it.

    On a rough wheel the state is that at t = 0 of the waves. What these force without a vibration has to be known:
    `forced` are states of such stable motions at t = 0.
    """
    if system.belt_speed == 0.0:
        return Fate(Kind.UNKNOWN)
    if system.smooth:
        return fate_on_smooth_pads(Shoe.of(system), state, within)
    equilibrium = sliding(system)
    if equilibrium is None or is_undamped(system.coefficients):  # no dashpot makes it settle
        return Fate(Kind.UNKNOWN)
    waves = bool(system.wheel.g.size)
    c = system.coefficients
    unstable = growth(c, equilibrium.stiffness, c.grip(system.belt_speed)) > 0.0
    if not waves and unstable:
        return Fate(Kind.VIBRATION, state=state)
    calm = forced or []
    if not waves:
        calm = [np.array([equilibrium.x, equilibrium.y, 0.0, 0.0])]
    from brakecli.analysis.rough_fate import lasts_on_rough_pads  # only these wait for its kernels

    lasts, last, steps = lasts_on_rough_pads(system, state, calm, within)
    if lasts is None:
        return Fate(Kind.UNKNOWN, steps=steps)
    if lasts:
        return Fate(Kind.VIBRATION, state=last, steps=steps)
    return Fate(Kind.FORCED if waves else Kind.STEADY_SLIDING, steps=steps)


def fate_on_smooth_pads(
    shoe: Shoe, state: Floats, within: float = math.inf, modes: Modes | None = None, until: float | None = None
) -> Fate:
    """What the motion of a smooth shoe from a state (x, y, v_x, v_y) comes to, within some time (s).

    It fades once its modes can bring about no event any more, and lasts once it nears an orbit that attracts it.
    Where sliding is unstable it cannot fade: one that still vibrates when it is given up lasts. One that comes so
    near to sliding that nothing happens `until` a time (s), or for long, is given up at once.

    `modes`: eigenvalues, and the vectors of position and velocity in columns, where they are known.
    """
    c, stiffness, belt, load = shoe
    if shoe.rest is None:
        return Fate(Kind.LOCKS)
    if not shoe.rest[1] < 0.0:
        return Fate(Kind.LEAVES)
    if modes is None:
        values, shapes = eigensystem(c, stiffness, c.grip(belt))
        modes = values, np.concatenate([shapes, shapes * values])
    rate = float(modes[0].real.max())
    if tuple(state) == (*shoe.rest, 0.0, 0.0):  # only rounding would move it
        return Fate(Kind.UNKNOWN if rate > 0.0 else Kind.STEADY_SLIDING)
    try:
        motion = Pursuit(c, (stiffness, belt, load), state, np.array(shoe.rest), modes, until or FOREVER)
    except np.linalg.LinAlgError:  # modes that are alike
        return Fate(Kind.UNKNOWN)
    while motion.steps < MOST_STEPS and motion.time < within and not signalled():
        if rate > 0.0 and until is None:
            # without an event for as long as disturbances take to grow by a factor of e it nears sliding
            motion.way.duration = motion.time + max(1.0 / rate, 10_000 * motion.path.h)
        outcome = motion.seek()
        if outcome == LINEAR:
            kind = Kind.UNKNOWN if rate > 0.0 else Kind.STEADY_SLIDING
            return Fate(kind, steps=motion.steps, motion=motion)
        if outcome == FOUND and motion.multiplier < 1.0:
            orbit = motion.orbit
            fades = -math.log(max(motion.multiplier, 1e-300)) / orbit.period
            return Fate(Kind.LIMIT_CYCLE, orbit, fades, np.array(orbit.state), motion.steps, motion)
        motion.way.events = 0  # many between two falls are too many for a cycle, not for a motion
    kind = Kind.VIBRATION if rate > 0.0 and not signalled() else Kind.UNKNOWN
    return Fate(kind, state=motion.state if rate > 0.0 else None, steps=motion.steps)
