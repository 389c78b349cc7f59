"""What becomes of a motion without the waves: continued from its last state on the smooth wheel."""

from dataclasses import replace

from brakecli.analysis.fate import Fate, fate
from brakecli.analysis.stability.modes import is_undamped
from brakecli.solver.arrays import Floats
from brakecli.solver.roughness import surface
from brakecli.solver.system import System

LONGEST = 16.0
"""Times as long as the run, after which a motion is given up."""


def without_waves(system: System, state: Floats) -> Fate:
    """What the motion from a state (x, y, v_x, v_y) comes to on the smooth wheel, at constant speed and load.

    Where steady sliding is unstable, and it does not come near it, it lasts, whatever it comes to. Without
    dashpots no orbit is sure to stay.
    """
    flat = replace(system, wheel=surface(), tangents=False)
    end = fate(flat, state, LONGEST * system.sampled_duration)
    return end._replace(orbit=None) if is_undamped(system.coefficients) else end
