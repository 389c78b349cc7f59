"""How fine a run begins that is to keep a tolerance."""

import math

from brakecli.solver.contact import EVALUATORS
from brakecli.solver.contact.pad import NODES, fewest_nodes
from brakecli.solver.system import System

FIRST = 0.2  # tolerance of the first run that knows its own error, over the requested one
FIRST_PER_WAVE = 8.0  # first steps to a passing wave, at least
ORDER_OF_NODES = 3  # power of the spacing of nodes with which errors of cells fall


def first_step(system: System) -> float:
    """The step (s) that a difference scheme begins with: it shows how large its error is.

    In it the fastest motion turns by an angle (rad) whose square is 15 times the tolerance, but by 0.4 at most.
    """
    fastest = 2.0 * math.pi * max(system.natural_frequencies[1], 1e-300)
    turn = min(0.4, math.sqrt(15.0 * system.method.tolerance))
    return min(turn / fastest, 1.0 / (FIRST_PER_WAVE * max(system.passing_frequency, 1e-300)))


def first_nodes(system: System, order: int = 1 + ORDER_OF_NODES) -> int:
    """The nodes that a run begins with, which hardly tell the shortest wave; 0 where none are needed.

    The error that they make falls with a power of their spacing: that of few cells with the fourth. From a
    tolerance of 0.0016 on the fewest are enough.
    """
    if system.smooth or not EVALUATORS[system.method.evaluator].needs_nodes:
        return 0
    fewest = fewest_nodes(system.half_length, system.shoe, system.wheel)
    finer = max(0, int(math.log2(1.6e-3 / system.method.tolerance) / order))
    return max(NODES, fewest) << finer
