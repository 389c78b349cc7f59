"""Everything that a motion works with, in one record; tables and scratch are two arrays beside it."""

from brakecli.solver.block import Block, Exact, Runge, Way
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.records import (
    Counts,
    Drive,
    Grid,
    Layer,
    Notes,
    Problem,
    Record,
    State,
    Tangent,
    Weights,
    Works,
)


class Plant(Record):
    """What is given to a run, and what its loop changes.

    The tables are those of the pad, which many motions share. The scratch is the motion's own: what the contact
    keeps, phases of the wheel, knots of speed and load.
    """

    c: Coefficients  # given
    s: Weights
    grid: Grid
    drive: Drive
    layer: Layer
    state: State  # the motion of a difference scheme
    block: Block  # that of one with events, and what goes along with it
    exact: Exact  # its matrices
    runge: Runge  # its Runge-Kutta step
    way: Way  # to its orbit
    problem: Problem  # that the step of a difference scheme comes down to
    work: Works  # what is kept along with each of them
    counts: Counts
    tangent: Tangent
    track: Notes
