"""What becomes of a motion without the waves: continued from its last state on the smooth wheel."""

from dataclasses import replace

from brakecli.analysis.fate import fate
from brakecli.analysis.regime.answers import Continuation
from brakecli.analysis.regime.measure import Continued
from brakecli.analysis.stability.modes import is_undamped
from brakecli.solver.arrays import Floats
from brakecli.solver.integrate import solve
from brakecli.solver.motion.flow import Orbit
from brakecli.solver.motion.phases import STICK
from brakecli.solver.motion.record import V_X
from brakecli.solver.roughness import surface
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
    end = fate(flat, state, LONGEST * system.sampled_duration)
    if end.lasts is None:
        return Continued()
    if end.orbit is None or end.rate is None or is_undamped(flat.coefficients):  # then none is sure to stay
        return Continued(Continuation.LASTS if end.lasts else Continuation.DIES)
    orbit = end.orbit
    return Continued(
        fate=Continuation.LASTS,
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
