"""The record of a flow on rough pads that is on its way."""

from enum import IntEnum

import numba

from brakecli.solver.records import record
from brakecli.solver.runge_kutta import USED

MOST_EVENTS = 256  # in a span
STAGES = int(USED[1])  # of a step
COLUMNS = 4  # of the derivative
# lanes of sines; of nodes and waves in the tables
EIGHT = 8
FOUR = 4


class Status(IntEnum):
    """How a flow ended."""

    DONE = 0
    TOO_MANY_EVENTS = 1
    NOT_FINITE = 2
    GRAZED = 3  # a margin becomes zero without passing through it: the flow has no derivative
    STOPPED = 4  # by a signal


ROUGH = record(
    "belt",  # U, m/s
    "pull_x pull_y",  # Q_x and Q_y, N
    "stiffness",  # 2ak, N/m
    "half",  # k times half a cell, N/m
    "shoe_mean",  # mean of f1 over the pad, m
    "full_up_to clear_from",  # heights y: up to it all touches for sure, from it on nothing, m
    "since",  # time since the begin of the span, s
    "length",  # of the step that was tried last, s
    "anchor",  # x - U since, in stick, m
    "force slope touching",  # last contact: F_y (N), ∂F_y/∂x and -∂F_y/∂y (N/m)
    "place",  # x - U since, for which sines and heights are known, m
    "before_force before_slope before_touching",  # contact at the begin of the step
    "least_slide least_hold least_pass",  # see `Margins`
    "least_contact most_contact",  # part of the pad that touches
    "open stuck",  # time, s
    "least_x most_x least_y most_y",  # m
    cells=int,
    half_cells=int,  # cells of half a pad
    width=int,  # nodes of half a pad in the tables
    waves=int,
    phase=int,
    tangents=int,  # 1 where the derivative is carried along
    known=int,  # of the place: 0 nothing, 1 sines, 2 heights, 3 also their slopes
    events=int,
    which=int,  # margin that ends the phase
    signals=int,  # where to see that a signal has come, see `compile.stopped`
    omega_at=int,  # where in the tables begin: wavenumbers
    g_at=int,  # amplitudes, with the factor of the cells
    full_at=int,  # F_y of a full contact by the sine of each wave, N
    angles_at=int,  # phases at the begin of the span
    waves_at=int,  # sines and cosines of each wave at the nodes of half a pad
    shoe_at=int,  # f1 at the nodes of the right half, and of the left half
    sines_at=int,  # scratch: g sin and g cos of the angles, and these times ω
    nodes_at=int,  # scratch: f2 at the nodes, the even part and the odd part, then of its slope
    z=(float, 4),  # state at the begin of the step, and at its end
    end=(float, 4),
    w=(float, 4),
    k=(float, (STAGES, 4)),  # rates of the state at the stages
    margin=(float, 2),  # at the begin of the step and at its end, and rates of both; in slip m/s, in stick N
    margin_rate=(float, 2),
    end_margin=(float, 2),
    end_margin_rate=(float, 2),
    rates=(float, 4),  # of the state where the contact was evaluated last for margins
    t=(float, (4, COLUMNS)),  # derivatives of `z` and of `end`
    t_end=(float, (4, COLUMNS)),
    t_w=(float, (4, COLUMNS)),
    t_kept=(float, (4, COLUMNS)),  # of the state at an event, for a fixed length of the step
    late_kept=(float, COLUMNS),
    t_k=(float, (STAGES, 4, COLUMNS)),
    late=(float, COLUMNS),  # derivatives of the time at which the step begins, and of its length
    stretch=(float, COLUMNS),
    times=(float, MOST_EVENTS),  # of events, s
    word=(int, MOST_EVENTS + 1),  # phases
)
"""A flow on its way."""
ROUGH_TYPE = numba.from_dtype(ROUGH)
