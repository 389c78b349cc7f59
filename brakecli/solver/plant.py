"""Everything that a motion works with, in one record; tables and scratch are two arrays beside it."""

from typing import Any

from brakecli.solver.block import BLOCK, EXACT, PURSUIT, RUNGE
from brakecli.solver.records import (
    COEFFICIENTS,
    COUNTS,
    DRIVE,
    GRID,
    LAYER,
    PROBLEM,
    STATE,
    TANGENT,
    TRACK,
    WEIGHTS,
    WORK,
    record,
)

PLANT = record(
    c=COEFFICIENTS,  # given
    s=WEIGHTS,
    grid=GRID,
    drive=DRIVE,
    layer=LAYER,
    state=STATE,  # the motion of a difference scheme
    block=BLOCK,  # that of one with events, and what goes along with it
    exact=EXACT,  # its matrices
    runge=RUNGE,  # its Runge-Kutta step
    way=PURSUIT,  # to its orbit
    problem=PROBLEM,
    work=WORK,
    counts=COUNTS,
    tangent=TANGENT,
    track=TRACK,
)
"""What is given to a run, and what its loop changes. The tables are those of the pad, which many motions
share; the scratch is the motion's own: what the contact keeps, phases of the wheel, knots of speed and load.
"""

Plant = Any  # a record of PLANT
