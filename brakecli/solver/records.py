"""What compiled code works on: records with named fields, and what is given to a step."""

from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Annotated, ClassVar, NamedTuple, TypeVar, cast, get_args

import numpy as np

from brakecli.solver.arrays import Floats, Integers

Pair = tuple[float, float]
MOST_KINDS = 8
"""How many kinds of contact a run has counters for."""


class Record:
    """What a record holds: each annotation is a field of 8 bytes, and says the shape of an array.

    What a comment says of a field counts for those below it as well, up to the next comment. Records are scalars
    of NumPy with these fields as attributes, as of `numpy.recarray`, but read in a tenth of the time.
    """

    layout: ClassVar[np.dtype[np.void]]

    def __init_subclass__(cls) -> None:
        """Lay out the fields."""
        cls.layout = _layout(cls)


R = TypeVar("R", bound=Record)


def _layout(described: type) -> np.dtype[np.void]:
    """How records are stored that have the fields of a class; a named tuple is one of doubles."""
    fields = described.__annotations__
    attributes = {name: property(itemgetter(name), _setter(name)) for name in fields}
    scalar = type(described.__name__, (np.void,), {"__slots__": (), **attributes})
    stored = [(name, *_stored(field)) for name, field in fields.items()]
    return np.dtype((scalar, np.dtype(stored, align=True)))


def _setter(name: str) -> Callable[[np.void, float], None]:
    return lambda record, value: record.__setitem__(name, value)


def _stored(field: type) -> tuple[object, ...]:
    """How a field is stored: its type, and of an array its shape."""
    if array := get_args(field):
        return (float if array[0] == Floats else int), array[1]
    if issubclass(field, Record):
        return (field.layout,)
    return (_layout(field) if issubclass(field, tuple) else field,)


def one(type_: type[R]) -> Sequence[R]:
    """An array of one record of zeros."""
    return cast(Sequence[R], np.zeros(1, type_.layout))


def new(type_: type[R]) -> R:
    """A record of zeros. Compiled code that gets it writes into it."""
    return one(type_)[0]


class State(Record):
    """The motion at the level of time that has been reached."""

    x: float  # position at the level reached, m
    y: float
    v_x: float  # velocity that belongs to it or, in a scheme that lags, to the level before, m/s
    v_y: float
    x_old: float  # position at the level before, m
    y_old: float
    force: float  # normal force in the last step, N
    force_before: float  # in the two steps before that: the guess for the next is made of all three, N
    force_earlier: float


class Problem(Record):
    """One step: minimise a11 d²/2 + a12 d e + a22 e²/2 - g1 d - (g2 + F) e + phi F |d - U|, (14) and (25)."""

    load: float  # Q at the weighted time, N
    belt_now: float  # U at the level reached and at the next, m/s
    belt_next: float
    phi: float  # coefficient of friction
    a_11: float  # kg/s
    a_12: float
    a_22: float
    g_1: float  # N, without the normal force
    g_2: float
    belt: float  # U of the friction law, m/s
    x_0: float  # the contact sees the shoe at (x_0 + gain d, y_0 + gain e), m; gain in s
    y_0: float
    gain: float
    d: float  # solution: the velocities, m/s
    e: float
    normal_force: float  # F, N; before the solution the guess
    side: float  # sign of d - U, 0 in stick
    d_slope: float  # derivatives of d and e by F
    e_slope: float
    residual: float  # F_y - F, N


class Contact(Record):
    """What an evaluator finds."""

    normal_force: float  # F_y = k ∫ max(gap, 0) dξ over the pad, N; gap = f2(ξ + x - travel) - f1(ξ) - y
    stiffness: float  # -∂F_y/∂y = k (length that touches) >= 0, N/m
    tangential: float  # ∂F_y/∂x = k Σ [f2] over the touching intervals, N/m
    fraction: float  # part of the pad that touches, 0 to 1
    store: float  # V = k/2 ∫ max(gap, 0)² dξ, J, and ∂V/∂x, N
    store_x: float
    kind: int  # the evaluator that did the work, place in `contact.kinds()`
    valid: int  # 0 where its assumptions do not hold
    reach: float  # given: how far the gap may move before the next evaluation, m
    near: float  # k (length whose gap is within reach of zero), N/m; inf where that is not known
    blur: float  # upper bound of the error of `tangential`, N/m


class Works(Record):
    """What has passed since the start, J, see `solver.energy`."""

    belt: float
    friction: float
    dashpots: float
    load: float
    roughness: float
    scheme: float
    store_x_before: float  # of the contact in the last step, N
    force_before: float


class Counts(Record):
    """What a run counts."""

    stuck: int  # level reached by the last step in which it stuck
    level: int  # level of time that has been reached; of a scheme with steps of its own the sample
    evaluations: int  # of the contact
    unconverged: int  # steps whose iteration did not converge
    rising: int  # steps whose solution need not be unique
    most: int  # evaluations in one step
    kinds: Annotated[Integers, MOST_KINDS]  # steps that each of `contact.kinds()` took


PARTS = 512
"""Parts of a run in which the growth of a disturbance, and the works, are kept apart."""

SPANS = 64
"""Spans of a run, in each of which the largest error is kept."""


class Tangent(Record):
    """A disturbance, and the error of a motion, that are carried along with it, see `solver.tangent`."""

    x: float  # a small disturbance of the motion, m and m/s
    y: float
    v_x: float
    v_y: float
    rate: float  # rad/s, by which places count beside velocities in its size
    unsure: float  # s, from which on the error may be another, as an event may have been missed; or infinite
    moved: float  # what the error moves the margin of slip (m/s) or stick (N) by, at most in the last step
    most: float  # of the error over the largest x, y, vx or vy so far: beyond it the run is not worth going on
    on: int  # 1 where it is carried along
    knows: int  # 1 where the error of the motion is
    beyond: int  # 1 where it is more than the most
    logs: Annotated[Floats, PARTS]  # ln of its growth in each part of the run
    worst: Annotated[Floats, (SPANS, 3, 4)]  # largest errors in each span: by steps, by nodes, and their sum


MOST_EVENTS = 1 << 15
"""Events of a run that are kept, the last ones."""

EVENT = 6
"""Numbers of each: time (s), kind, x (m), then y, v_x and v_y (m and m/s) of all but turning points."""


class Notes(Record):
    """What a loop notes of a motion beside its samples, see `solver.track`."""

    way: float  # sign of the last velocity v_x that was not 0
    since: float  # latest time of an event that is no longer kept, s
    on: int  # 1 where the loop notes anything
    phase: int  # of `phases`; without contact that of flight
    marks: int  # that have been made
    next: int  # sample at which the next one is due
    events: int  # that have been noted
    counts: Annotated[Integers, 7]  # of each kind
    times: Annotated[Floats, PARTS + 1]  # of the marks, s
    works: Annotated[Floats, (PARTS + 1, 6)]  # passed up to there, as in `Works`, J
    states: Annotated[Floats, (PARTS + 1, 7)]  # there: x to y_old as in `State`, and the energy of the contact, J
    events_at: int  # where in the scratch they are kept


class PadNumbers(Record):
    """The constants of a pad on its wheel, and where in the array beside it each of its tables begins."""

    k: float  # stiffness per length, N/m²
    half_length: float  # a, m
    full_up_to: float  # heights: up to it all touches for sure, from it on nothing, m
    clear_from: float
    shoe_bound: float  # upper bounds of |f1| and |f2|, m
    wheel_bound: float
    steep: float  # upper bounds of |f2'| and of |f2''|, 1/m
    curved: float
    rise_error: float  # upper bound of the error of f2' by differences between nodes
    shoe_mean: float  # means of f1 (m) and ∫ f1² dξ (m³) over the pad
    shoe_square: float
    cell: float  # widest interval in which roots are sought, m
    crest: float  # upper bound of |f2 - f1|, m
    cells: int  # intervals in which they are sought
    edges_at: int  # where in the scratch begins what has been proved of them
    shoe_terms: int  # harmonics
    wheel_terms: int
    nodes: int  # cells, an even number; 0 without their tables
    columns: int  # edges of cells in one half of the tables, in whole tiles
    parts_at: int  # where in the scratch begin: even and odd parts of heights, or rises, behind the heights
    sines_at: int  # sines and cosines of the phases of the waves
    signals: int  # where to see that a signal has come, see `kernels.stopped`
    gap_at: int  # where in the tables begin: amplitudes, wavenumbers, phases of f2 - f1
    wheel_at: int  # amplitudes and wavenumbers of the wheel
    full_at: int  # ∂(k ∫ f2 dξ)/∂(sin) of each of its harmonics, N
    ss_at: int  # integrals of products, see `contact.pad`
    cc_at: int
    pr_at: int
    nodes_at: int  # f1 at the edges of cells and beside them
    rises_at: int  # f1' times a cell at the edges, m
    nothing_at: int  # zeros, as many as edges in a tile
    waves_at: int  # g sin(ωξ) and g cos(ωξ) of the wheel at those from the middle on, tile by tile
    turns_at: int  # phases (rad) and waves per metre of the wheel, the latter as sums of two doubles
    rows: int  # points of a window's grid to a cell, a power of two; 0 where sums of waves are as fast


class Window(Record):
    """The wheel's surface below the pad and ahead of it, see `solver.contact.heights`."""

    spacing: float  # of the grid, m
    points: float  # that the wheel has travelled, a whole number
    travel: float  # and what it has travelled beyond them, m
    rows: int  # points to a cell; 0 where there is no window
    shift: int  # their binary logarithm
    width: int  # cells, in whole tiles
    at: int  # where in the scratch it begins, row by row; weights lie before it
    origin: int  # its first tile
    first: int  # the tiles that are filled, from this one on
    end: int


class Weights(NamedTuple):
    """Step h (s) and weights of a difference scheme; theta_3 is unused by a two-layer scheme."""

    h: float
    theta_1: float
    theta_2: float
    theta_3: float


class Grid(Record):
    """The grid of time, and what bounds the work of a step."""

    interval: float  # between samples, s
    weighted: float  # time at which a scheme takes its forces, see `solver.schemes`
    tolerance: float  # error that a scheme with steps of its own keeps
    per_sample: int  # steps from one to the next
    lag: int  # levels that its velocity lies behind
    most: int  # evaluations of one step
    go_on: int  # 1 where steps that did not converge are counted and do not end the run
    samples: int  # number of the last sample
    scheme: int  # place in `schemes.SCHEMES`
    iteration: int  # place in `method.MOST_EVALUATIONS`


class Drive(Record):
    """Where in the scratch the knots of the speed U of the wheel's surface and of the load Q begin and end."""

    belt_at: int
    belt_end: int
    load_at: int
    load_end: int


class Layer(Record):
    """The springs between shoe and wheel. Their tables are those of the pad, their heights lie in the scratch."""

    x: float  # where the shoe is for which the scratch holds them, m
    level: int  # what it holds: 0 nothing, 1 phases of the waves, 2 heights, 3 also their rises
    evaluator: int  # place in `contact.EVALUATORS`
    angles_at: int  # where in the scratch the phases of the wheel's harmonics begin, rad
    pad: PadNumbers  # its constants
    window: Window  # of the wheel's surface
    contact: Contact  # the force found last
