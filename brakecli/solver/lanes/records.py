"""What lanes hold: the record of a block of lanes, and what its runs have in common."""

from typing import Any

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.kernels import FAST
from brakecli.solver.records import record

LANES = 16
WAVES = 5
"""Runs side by side, and waves of the wheel, at most."""
ALIKE = FAST - {"reassoc"}
"""What lanes allow. With sums in any order the compiler would choose another one for each half of the lanes: a run
would depend on its lane."""


def _lanes(names: str, *shape: int) -> dict[str, Any]:
    return dict.fromkeys(names.split(), (float, (*shape, LANES)))


LEVELS = record(
    **_lanes("x y d e"),  # position at the level reached, m; velocity at the level before, m/s
    **_lanes("x_old y_old d_old e_old"),  # a level earlier
    **_lanes("force before"),  # normal force at x and at x_old, N
    **_lanes("source_x source_y"),  # other forces in the step, N
    **_lanes("g_1 g_2"),  # all that is known of the step, N
)
"""What is moved by steps."""


LANE = record(
    **_lanes(" ".join(Coefficients._fields) + " belt"),  # given: U, m/s
    **_lanes("side grip k"),  # sign of the sliding velocity, F_x/F_y, stiffness of the layer, N/m²
    **_lanes("i_11 i_12 i_22 limit"),  # inverse of a, s/kg; change of the force (N) at which (13) goes on
    **_lanes("answer"),  # what a force of 1 N in a step takes off the force of a pad that touches everywhere, N
    motion=LEVELS,
    coarse=LEVELS,  # every second level of the motion
    by_steps=LEVELS,  # error of the motion, a level behind it
    by_nodes=LEVELS,
    disturbed=LEVELS,  # a disturbance of the motion, a level behind it
    **_lanes("earlier touching touched"),  # force before `before`, N; parts that touch at x and at x_old
    **_lanes("at_x at_y found touches partly"),  # where the contact is evaluated, its force, the part that touches
    **_lanes("guess waits alive evaluations"),  # of the force; 1 until it is right; 1 with a result; their number
    **_lanes("sine cosine", WAVES),  # of a wave at the middle of the pad
    **_lanes("turns", WAVES),  # waves that pass in a second
    **_lanes("tangential stiffness feedback"),  # of the contact at x_old, as `carried` needs them
    **_lanes("sample", 8),
    **_lanes("missing"),  # what nodes leave out of the force, N
    **_lanes("change"),  # of d in the last step, m/s
    **_lanes("unsure"),  # 1 where a stick may have been missed
    **_lanes("kept"),  # part of a disturbance that is left at a sample
    worst=(float, (3, 4, LANES)),  # largest errors of x, y, vx and vy: by steps, by nodes, and both
)


SHARED = record(
    "h rate",  # s, and 1/h
    "length",  # of the pad, m
    "full_up_to clear_from shoe_mean",  # as in `records.PAD`, m
    per_sample=int,
    nodes=int,
    signals=int,
    waves=(float, (3, WAVES)),  # wavenumbers, phases, and the part of the force in full contact over k sin, m²
)
"""What the runs have in common: their grid of time, surfaces and nodes.

Beside them stands the table, with a row of each node of the first half: f1, f1 opposite, and g sin(ωξ), g cos(ωξ)
of all waves; and the gaps (m) where nodes were summed last: of all lanes at a node, then at the one opposite,
behind two rows of zeros, and room for one more.
"""
Shared = Any  # a record of SHARED
