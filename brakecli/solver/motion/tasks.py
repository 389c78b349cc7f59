"""What Python has a motion do: one entry, as each has the loop compiled again."""

from typing import Any

from brakecli.solver.arrays import ROWS, VECTOR, Floats
from brakecli.solver.kernels import entry
from brakecli.solver.motion.advance import DONE, fly
from brakecli.solver.motion.orbit import seek, swing
from brakecli.solver.motion.samples import sampled
from brakecli.solver.plant import PLANT

SAMPLE, FLY, SEEK, SWING = range(4)
"""Fill rows with samples; carry the motion over a span; follow it to what becomes of it; see how far it swings."""


@entry(int, [PLANT], VECTOR, VECTOR, ROWS, ROWS, int)
def advance(plants: Any, tables: Floats, scratch: Floats, rows: Floats, events: Floats, stop: int) -> int:
    """Do the task of the block, which takes `seconds` or goes to the level `stop`; how it ends."""
    p = plants[0]
    task = p.block.task
    if task == SAMPLE:
        return sampled(p, tables, scratch, rows, stop)
    if task == FLY:
        return fly(p, tables, scratch, p.block.seconds, p.block.count)
    if task == SEEK:
        return seek(p, tables, scratch, p.way)
    swing(p, tables, scratch, p.way, p.block.seconds)
    return DONE
