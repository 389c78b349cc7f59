"""What compiled code works on: records with named fields, and what is given to a step."""

from collections.abc import Mapping
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from brakecli.solver.coefficients import Coefficients

Pair = tuple[float, float]
MOST_KINDS = 8
"""How many kinds of contact a run has counters for."""


def record(*floats: str, **others: Any) -> np.dtype[Any]:
    """A type of record: the names of its doubles, several in a text, then its other fields of 8 bytes each.

    Fields are attributes, as of `numpy.recarray`, but read in a tenth of the time.
    """
    fields = [(name, float) for names in floats for name in names.split()] + list(others.items())
    type_ = type("Record", (np.void,), {"__slots__": (), **{name: _attribute(name) for name, _ in fields}})
    return np.dtype((type_, np.dtype(fields, align=True)))


def _attribute(name: str) -> property:
    return property(itemgetter(name), lambda record, value: record.__setitem__(name, value))


def one(type_: np.dtype[Any]) -> Any:
    """An array of one record of zeros."""
    return np.zeros(1, type_)


def new(type_: np.dtype[Any]) -> Any:
    """A record of zeros, with its fields as attributes. Compiled code that gets it writes into it."""
    return one(type_)[0]


STATE = record(
    "x y",  # position at the level reached, m
    "v_x v_y",  # velocity that belongs to it or, in a scheme that lags, to the level before, m/s
    "x_old y_old",  # position at the level before, m
    "force",  # normal force in the last step, N
    "force_before force_earlier",  # in the two steps before that: the guess for the next is made of all three, N
)
"""The motion at the level of time that has been reached."""

PROBLEM = record(
    "load",  # Q at the weighted time, N
    "belt_now belt_next",  # U at the level reached and at the next, m/s
    "phi",  # coefficient of friction
    "a_11 a_12 a_22",  # kg/s
    "g_1 g_2",  # N, without the normal force
    "belt",  # U of the friction law, m/s
    "x_0 y_0 gain",  # the contact sees the shoe at (x_0 + gain d, y_0 + gain e), m; gain in s
    "d e",  # solution: the velocities, m/s
    "normal_force",  # F, N; before the solution the guess
    "side",  # sign of d - U, 0 in stick
    "d_slope e_slope",  # derivatives of d and e by F
    "residual",  # F_y - F, N
)
"""One step: minimise a11 d²/2 + a12 d e + a22 e²/2 - g1 d - (g2 + F) e + phi F |d - U|, (14) and (25)."""

CONTACT = record(
    "normal_force",  # F_y = k ∫ max(gap, 0) dξ over the pad, N; gap = f2(ξ + x - travel) - f1(ξ) - y
    "stiffness",  # -∂F_y/∂y = k (length that touches) >= 0, N/m
    "tangential",  # ∂F_y/∂x = k Σ [f2] over the touching intervals, N/m
    "fraction",  # part of the pad that touches, 0 to 1
    "store store_x",  # V = k/2 ∫ max(gap, 0)² dξ, J, and ∂V/∂x, N
    kind=int,  # the evaluator that did the work, place in `contact.kinds()`
    valid=int,  # 0 where its assumptions do not hold
    reach=float,  # given: how far the gap may move before the next evaluation, m
    near=float,  # k (length whose gap is within reach of zero), N/m; inf where that is not known
    blur=float,  # upper bound of the error of `tangential`, N/m
)
"""What an evaluator finds."""

WORK = record(
    "belt friction dashpots load roughness scheme",  # passed since the start, J; see `solver.energy`
    "store_x_before force_before",  # of the contact in the last step, N
)

COUNTS = record(
    stuck=int,  # level reached by the last step in which it stuck
    level=int,  # level of time that has been reached; of a scheme with steps of its own the sample
    evaluations=int,  # of the contact
    unconverged=int,  # steps whose iteration did not converge
    rising=int,  # steps whose solution need not be unique
    most=int,  # evaluations in one step
    kinds=(int, MOST_KINDS),  # steps that each of `contact.kinds()` took
)

PARTS = 512
"""Parts of a run in which the growth of a disturbance, and the works, are kept apart."""

SPANS = 64
"""Spans of a run, in each of which the largest error is kept."""

TANGENT = record(
    "x y v_x v_y",  # a small disturbance of the motion, m and m/s
    "rate",  # rad/s, by which places count beside velocities in its size
    "unsure",  # s, from which on the error may be another, as an event may have been missed; or infinite
    "moved",  # what the error moves the margin of slip (m/s) or stick (N) by, at most in the last step
    "most",  # of the error over the largest x, y, vx or vy so far: beyond it the run is not worth going on
    on=int,  # 1 where it is carried along
    knows=int,  # 1 where the error of the motion is
    beyond=int,  # 1 where it is more than the most
    logs=(float, PARTS),  # ln of its growth in each part of the run
    worst=(float, (SPANS, 3, 4)),  # their largest sizes in each span of the run, and that of the sum of both
)
"""A disturbance, and the error of a motion, that are carried along with it, see `solver.tangent`."""

MOST_EVENTS = 1 << 15
"""Events of a run that are kept, the last ones."""

EVENT = 6
"""Numbers of each: time (s), kind, x (m), then y, v_x and v_y (m and m/s) of all but turning points."""

TRACK = record(
    "way",  # sign of the last velocity v_x that was not 0
    "since",  # latest time of an event that is no longer kept, s
    on=int,  # 1 where the loop notes anything
    phase=int,  # of `phases`; without contact that of flight
    marks=int,  # that have been made
    next=int,  # sample at which the next one is due
    events=int,  # that have been noted
    counts=(int, 7),  # of each kind
    times=(float, PARTS + 1),  # of the marks, s
    works=(float, (PARTS + 1, 6)),  # passed up to there, as in `WORK`, J
    states=(
        float,
        (PARTS + 1, 7),
    ),  # there: x, y, v_x, v_y, x_old and y_old (m and m/s), energy of the contact (J)
    events_at=int,  # where in the scratch they are kept
)
"""What a loop notes of a motion beside its samples, see `solver.track`."""

PAD = record(
    "k",  # stiffness per length, N/m²
    "half_length",  # a, m
    "full_up_to clear_from",  # heights: up to it all touches for sure, from it on nothing, m
    "shoe_bound wheel_bound",  # upper bounds of |f1| and |f2|, m
    "steep curved",  # upper bounds of |f2'| and of |f2''|, 1/m
    "rise_error",  # upper bound of the error of f2' by differences between nodes
    "shoe_mean shoe_square",  # means of f1 (m) and ∫ f1² dξ (m³) over the pad
    "cell",  # widest interval in which roots are sought, m
    "crest",  # upper bound of |f2 - f1|, m
    cells=int,  # intervals in which they are sought
    edges_at=int,  # where in the scratch what is known of them begins
    shoe_terms=int,  # harmonics
    wheel_terms=int,
    nodes=int,  # cells, an even number; 0 without their tables
    columns=int,  # edges of cells in one half of the tables, in whole tiles
    parts_at=int,  # where in the scratch begin: even and odd parts of heights, or rises, behind the heights
    sines_at=int,  # sines and cosines of the phases of the waves
    signals=int,  # where to see that a signal has come, see `kernels.stopped`
    gap_at=int,  # where in the tables begin: amplitudes, wavenumbers, phases of f2 - f1
    wheel_at=int,  # amplitudes and wavenumbers of the wheel
    full_at=int,  # ∂(k ∫ f2 dξ)/∂(sin) of each of its harmonics, N
    ss_at=int,  # integrals of products, see `contact.pad`
    cc_at=int,
    pr_at=int,
    nodes_at=int,  # f1 at the edges of cells and beside them
    rises_at=int,  # f1' times a cell at the edges, m
    nothing_at=int,  # zeros, as many as edges in a tile
    waves_at=int,  # g sin(ωξ) and g cos(ωξ) of the wheel at those from the middle on, tile by tile
    turns_at=int,  # phases (rad) and waves per metre of the wheel, the latter as sums of two doubles
    rows=int,  # points of a window's grid to a cell, a power of two; 0 where sums of waves are as fast
)

WINDOW = record(
    "spacing",  # of the grid, m
    "points travel",  # that the wheel has travelled: points of the grid, a whole number, and the rest, m
    rows=int,  # points to a cell; 0 where there is no window
    shift=int,  # their binary logarithm
    width=int,  # cells, in whole tiles
    at=int,  # where in the scratch it begins, row by row; weights lie before it
    origin=int,  # its first tile
    first=int,  # the tiles that are filled, from this one on
    end=int,
)
"""The wheel's surface below the pad and ahead of it, see `solver.contact.heights`."""


class Weights(NamedTuple):
    """Step h (s) and weights of a difference scheme; theta_3 is unused by a two-layer scheme."""

    h: float
    theta_1: float
    theta_2: float
    theta_3: float


COEFFICIENTS = record(*Coefficients._fields)
"""The constants of (6)-(7), as in `Coefficients`."""

WEIGHTS = record(*Weights._fields)

GRID = record(
    "interval",  # between samples, s
    "weighted",  # time at which a scheme takes its forces, see `solver.schemes`
    "tolerance",  # error that a scheme with steps of its own keeps
    per_sample=int,  # steps from one to the next
    lag=int,  # levels that its velocity lies behind
    most=int,  # evaluations of one step
    go_on=int,  # 1 where steps that did not converge are counted and do not end the run
    samples=int,  # number of the last sample
    scheme=int,  # place in `schemes.SCHEMES`
    iteration=int,  # place in `method.MOST_EVALUATIONS`
)
"""The grid of time, and what bounds the work of a step."""

DRIVE = record(belt_at=int, belt_end=int, load_at=int, load_end=int)
"""Where in the scratch the knots of the speed U of the wheel's surface and of the load Q begin and end."""

LAYER = record(
    "place",  # x (m) that the heights in the scratch belong to
    known=int,  # of that place: 0 nothing, 1 phases of the waves, 2 heights, 3 also their rises
    evaluator=int,  # place in `contact.EVALUATORS`
    angles_at=int,  # where in the scratch the phases of the wheel's harmonics begin, rad
    pad=PAD,
    window=WINDOW,
    contact=CONTACT,  # the force found last
)
"""The springs between shoe and wheel. Their tables are those of the pad; what is found is kept in the scratch."""

Layer = Any  # a record of LAYER


def filled(type_: np.dtype[Any], values: Mapping[str, float]) -> Any:
    """A record of these numbers."""
    made = new(type_)
    for name, value in values.items():
        made[name] = value
    return made
