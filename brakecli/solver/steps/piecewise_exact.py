"""The piecewise-exact scheme, for smooth surfaces: between two events the motion is linear, a step is a matrix."""

from brakecli.solver import own_steps
from brakecli.solver.block import TERMS, Block
from brakecli.solver.motion.tasks import advance as advance
from brakecli.solver.records import Record, Weights

STATE: type[Record] = Block
KEPT = "block"
LAG = own_steps.LAG
MEMORY = own_steps.MEMORY
VELOCITIES = own_steps.VELOCITIES
begin = own_steps.begin
weighted_time = own_steps.weighted_time
mechanical_energy = own_steps.mechanical_energy


def order(s: Weights, start: str) -> int:
    """The order of the series that steps with events follow; all others are exact."""
    return TERMS - 1
