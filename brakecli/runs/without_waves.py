"""What becomes of a motion without the waves: continued from its last state on the smooth wheel."""

from dataclasses import replace

import numpy as np

from brakecli.analysis.regime.answers import Fate
from brakecli.analysis.regime.measure import Continued
from brakecli.analysis.stability.modes import growth, is_undamped
from brakecli.branches.begin import UNKNOWN, End, on_smooth_pads
from brakecli.branches.line import Shoe
from brakecli.solver.arrays import Floats
from brakecli.solver.integrate import solve
from brakecli.solver.motion.flow import Orbit
from brakecli.solver.motion.phases import STICK
from brakecli.solver.motion.record import V_X
from brakecli.solver.roughness import surface
from brakecli.solver.steady_sliding import sliding
from brakecli.solver.system import Initial, System

LONGEST = 16.0
"""Times as long as the run, after which a motion is given up."""
SAMPLES = 256
"""Samples of a period, by which its level is found."""


def without_waves(system: System, state: Floats) -> Continued:
    """What the motion from a state (x, y, v_x, v_y) comes to on the smooth wheel, at constant speed and load.

    Where steady sliding is unstable, and it does not come near it, it lasts, whatever it comes to.
    """
    flat = replace(system, wheel=surface(), tangents=False)
    if flat.belt_speed == 0.0:
        return Continued()
    end = (
        _on_a_rough_shoe(flat, state)
        if flat.shoe.g.size
        else on_smooth_pads(Shoe.of(flat), state, LONGEST * system.sampled_duration)
    )
    if end.lasts is None:
        return Continued(Fate.UNKNOWN if end.state is None else Fate.LASTS)
    if end.orbit is None or end.rate is None or is_undamped(flat.coefficients):  # then none is sure to stay
        return Continued(Fate.LASTS if end.lasts else Fate.DIES)
    orbit = end.orbit
    return Continued(
        fate=Fate.LASTS,
        amplitude=orbit.amplitude,
        level=_level(flat, orbit),
        rate=end.rate,
        period=orbit.period,
        sticks=float(orbit.word.count(STICK)),
    )


def _level(flat: System, orbit: Orbit) -> float:
    """Standard deviation (m/s) of vx in a period of a limit cycle."""
    x, y, v_x, v_y = orbit.state
    exact = flat.by(scheme="piecewise-exact", step=orbit.period)
    interval = orbit.period / SAMPLES
    beginning = Initial(x, y, v_x, v_y)
    once = replace(exact, initial=beginning, interval=interval, duration=orbit.period, tracked=False)
    return float(solve(once).rows[1:, V_X].std())


def _on_a_rough_shoe(flat: System, state: Floats) -> End:
    """The end of a motion whose force is a curve of y alone; unknown where no dashpot makes it settle."""
    from brakecli.branches.rough_end import on_rough_pads  # only these wait for its kernels

    if is_undamped(flat.coefficients):
        return UNKNOWN
    if (rest := sliding(flat)) is None:
        return UNKNOWN
    if growth(flat.coefficients, rest.stiffness, flat.coefficients.grip(flat.belt_speed)) > 0.0:
        return End(None, state)
    return on_rough_pads(flat, state, [np.array([rest.x, rest.y, 0.0, 0.0])], LONGEST * flat.sampled_duration)
