"""The event-driven scheme: Runge-Kutta steps of order eight within a phase, and every event located.

Its steps are its own. Each component keeps the tolerance, relative to the largest value that it has had. Stick,
slip, lift-off and touch-down end a step: nothing is smoothed, nothing stepped over.
"""

from brakecli.solver import own_steps
from brakecli.solver.block import Block
from brakecli.solver.motion import tasks
from brakecli.solver.records import Record, Weights

STATE: type[Record] = Block
KEPT = "block"
LAG = own_steps.LAG
MEMORY = own_steps.MEMORY
VELOCITIES = own_steps.VELOCITIES
begin = own_steps.begin
weighted_time = own_steps.weighted_time
advance = tasks.step
mechanical_energy = own_steps.mechanical_energy


def order(s: Weights, start: str) -> int:
    """The order of the steps, through all events, on smooth surfaces."""
    return 8
