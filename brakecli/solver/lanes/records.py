"""What lanes hold: the record of a block of lanes, and what its runs have in common."""

from typing import Annotated

from brakecli.solver.arrays import Floats
from brakecli.solver.kernels import FAST
from brakecli.solver.records import Record

LANES = 16
WAVES = 5
"""Runs side by side, and waves of the wheel, at most."""
ALIKE = FAST - {"reassoc"}
"""What lanes allow. With sums in any order the compiler would choose another one for each half of the lanes: a run
would depend on its lane."""


PerLane = Annotated[Floats, LANES]
PerWave = Annotated[Floats, (WAVES, LANES)]


class Levels(Record):
    """What is moved by steps."""

    x: PerLane  # position at the level reached, m
    y: PerLane
    d: PerLane  # velocity at the level before, m/s
    e: PerLane
    x_old: PerLane  # a level earlier
    y_old: PerLane
    d_old: PerLane
    e_old: PerLane
    force: PerLane  # normal force at x and at x_old, N
    before: PerLane
    source_x: PerLane  # other forces in the step, N
    source_y: PerLane
    g_1: PerLane  # all that is known of the step, N
    g_2: PerLane


class Lane(Record):
    """A block of lanes."""

    m: PerLane  # given, as in `Coefficients`
    b_xx: PerLane
    b_xy: PerLane
    b_yy: PerLane
    c_xx: PerLane
    c_xy: PerLane
    c_yy: PerLane
    sin_beta: PerLane
    cos_beta: PerLane
    phi: PerLane
    belt: PerLane  # U, m/s
    side: PerLane  # sign of the sliding velocity
    grip: PerLane  # F_x/F_y
    k: PerLane  # stiffness of the layer, N/m²
    i_11: PerLane  # inverse of a, s/kg
    i_12: PerLane
    i_22: PerLane
    limit: PerLane  # change of the force at which (13) goes on, N
    answer: PerLane  # what a force of 1 N in a step takes off the force of a pad that touches everywhere, N
    motion: Levels  # at the level reached
    coarse: Levels  # every second level of the motion
    by_steps: Levels  # error of the motion by steps, and by nodes, a level behind it
    by_nodes: Levels
    disturbed: Levels  # a disturbance of the motion, a level behind it
    earlier: PerLane  # force before `before`, N
    touching: PerLane  # part that touches at x, and at x_old
    touched: PerLane
    at_x: PerLane  # where the contact is evaluated, m
    at_y: PerLane
    at_force: PerLane  # its force there, N
    touches: PerLane  # and the part that touches
    partly: PerLane  # 1 where that may be a part of the pad alone
    guess: PerLane  # of the force, N
    waits: PerLane  # 1 until it is right
    alive: PerLane  # 1 with a result
    evaluations: PerLane  # of the contact
    sine: PerWave  # of a wave at the middle of the pad
    cosine: PerWave
    turns: PerWave  # waves that pass in a second
    tangential: PerLane  # of the contact at x_old, as `carried` needs them
    stiffness: PerLane
    feedback: PerLane
    sample: Annotated[Floats, (8, LANES)]  # as `loop.sample` has it
    missing: PerLane  # what nodes leave out of the force, N
    change: PerLane  # of d in the last step, m/s
    unsure: PerLane  # 1 where a stick may have been missed
    shrink: PerLane  # what disturbances are multiplied by at a sample
    worst: Annotated[Floats, (3, 4, LANES)]  # largest errors of x, y, vx and vy: by steps, by nodes, and both


class Shared(Record):
    """What the runs have in common: their grid of time, surfaces and nodes.

    Beside them stands the table, with a row of each node of the first half: f1, f1 opposite, and g sin(ωξ) and
    g cos(ωξ) of all waves; and the gaps (m) where nodes were summed last: of all lanes at a node, then at the one
    opposite, behind two rows of zeros, and room for one more.
    """

    h: float  # s
    rate: float  # 1/h
    length: float  # of the pad, m
    full_up_to: float  # as in `PadNumbers`, m
    clear_from: float
    shoe_mean: float
    per_sample: int  # steps
    nodes: int  # of the pad
    signals: int  # see `kernels.stopped`
    waves: Annotated[Floats, (3, WAVES)]  # wavenumbers, phases, and force in full contact over k sin, m²
