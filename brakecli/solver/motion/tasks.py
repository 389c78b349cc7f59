"""What Python has a motion do: an entry for each propagator, as each has its loop compiled again."""

from collections.abc import Sequence

from brakecli.solver.arrays import ROWS, VECTOR, Floats
from brakecli.solver.kernels import entry
from brakecli.solver.motion.advance import fly
from brakecli.solver.motion.between import sampled_between
from brakecli.solver.motion.events import DONE
from brakecli.solver.motion.grid import fly_on_grid
from brakecli.solver.motion.orbit import seek, swing
from brakecli.solver.motion.samples import sampled
from brakecli.solver.plant import Plant

SAMPLE, FLY, SEEK, SWING = range(4)
"""Fill rows with samples; carry the motion over a span; follow it to what becomes of it; see how far it swings."""


@entry(int, [Plant], VECTOR, VECTOR, ROWS, ROWS, int)
def advance(
    plants: Sequence[Plant], tables: Floats, scratch: Floats, rows: Floats, events: Floats, stop: int
) -> int:
    """Do the task of the block by exact propagation, for `seconds` or to the level `stop`.

    How it ends: a `Failure` of samples, a number of `events` of a span, one of `orbit` of a pursuit.
    """
    p = plants[0]
    task = p.block.task
    if task == SAMPLE:
        return sampled(p, scratch, rows, stop)
    if task == FLY:
        return fly(p, scratch, p.block.seconds, p.block.count)
    if task == SEEK:
        return seek(p, scratch, p.way)
    swing(p, scratch, p.way, p.block.seconds)
    return DONE


@entry(int, [Plant], VECTOR, VECTOR, ROWS, ROWS, int)
def step(plants: Sequence[Plant], tables: Floats, scratch: Floats, rows: Floats, events: Floats, stop: int) -> int:
    """Do the task of the block by Runge-Kutta steps: `SAMPLE` or `FLY`."""
    p = plants[0]
    if p.block.task == SAMPLE:
        return sampled_between(p, tables, scratch, rows, stop)
    return fly_on_grid(p, tables, scratch, p.block.seconds)
