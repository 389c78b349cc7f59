"""What lanes hold: the record of a block of lanes, and what its runs have in common."""

from typing import Any

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.kernels import FAST
from brakecli.solver.records import record
from brakecli.solver.schemes import NUMEROV

LANES = 16
WAVES = 5
"""Runs side by side, and waves of the wheel, at most."""
ALIKE = FAST - {"reassoc"}
"""What lanes allow. With sums in any order the compiler would choose another one for each half of the lanes: a run
would depend on its lane."""
PAIR = 2 * LANES
"""Gaps of all lanes at two opposite nodes."""
THETA_1, THETA_2, THETA_3 = NUMEROV
STEPS, NODES, DISTURBED = range(3)
"""What is carried along: the errors by steps and by nodes, and a disturbance."""


def _lanes(names: str, *shape: int) -> dict[str, Any]:
    return dict.fromkeys(names.split(), (float, (*shape, LANES)))


LANE = record(
    **_lanes(" ".join(Coefficients._fields) + " load belt"),  # given: Q, N, and U, m/s
    **_lanes("side grip k"),  # sign of the sliding velocity, F_x/F_y, stiffness of the layer, N/m²
    **_lanes("i_11 i_12 i_22 limit"),  # inverse of a, s/kg; change of the force (N) at which (13) goes on
    **_lanes("answer"),  # what a force of 1 N in a step takes off the force of a pad that touches everywhere, N
    **_lanes("x y x_old y_old d e d_old e_old"),  # the motion, as in `records.STATE`
    **_lanes("force before earlier touching touched"),  # at x, x_old and the level before; parts that touch
    **_lanes("g_1 g_2"),  # a step, as in `records.PROBLEM`
    **_lanes("v_x v_y friction state"),  # a sample
    **_lanes("at_x at_y found touches partly"),  # where the contact is evaluated, its force, the part that touches
    **_lanes("guess done out evaluations closed"),  # of the force; 1 where it is right; 1 without a result; counts
    rate=(float, (WAVES, LANES)),  # waves that pass in a second
    sine=(float, (WAVES, LANES)),  # of a wave at the middle of the pad
    cosine=(float, (WAVES, LANES)),
    **_lanes("t_x t_y t_x_old t_y_old t_d t_e t_d_old t_e_old", 3),  # what is carried, a level behind the motion
    **_lanes("t_force t_before", 3),  # its part of the normal force, at the same levels as t_x and t_x_old
    **_lanes("tangential stiffness feedback"),  # of the contact there, as `carried.carry` needs them
    **_lanes("t_kept"),  # part of a disturbance that is left at a sample
    **_lanes("even_x even_y even_force even_d even_e", 3),  # at the last even levels, the youngest first
    **_lanes("source_x source_y missing"),  # what steps miss of (6) and (7), and nodes of the force, N
    **_lanes("change"),  # of d in the last step
    **_lanes("unsure"),  # 1 where a stick may have been missed
    worst=(float, (3, 4, LANES)),  # largest errors of x, y, vx and vy: by steps, by nodes, and both
)


SHARED = record(
    "h",  # s
    "interval",  # between samples, s
    "length",  # of the pad, m
    "full_up_to clear_from shoe_mean",  # as in `records.PAD`, m
    per_sample=int,
    nodes=int,
    signals=int,
    first=int,  # kind of what is carried along
    beyond=int,  # the kind behind the last one that is
    gaps_at=int,  # where the gaps begin in the tables
    waves=(float, 3 * WAVES),  # of each: wavenumber, phase, its part of the force in full contact over k sin, m²
)
"""What the runs have in common: their grid of time, surfaces and nodes.

The tables have of each node of the first half f1, f1 opposite, and g sin(ωξ), g cos(ωξ) of all waves; then the
gaps (m), by pairs, where nodes were summed last, with two pairs of zeros before, and room for one behind.
"""
Shared = Any  # a record of SHARED
