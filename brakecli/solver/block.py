"""Records: a motion and what is carried along with it, what either propagator computes, and a pursued orbit."""

from typing import Annotated

from brakecli.solver.arrays import Floats, Integers
from brakecli.solver.records import Record

SIZE = 8
X, Y, V_X, V_Y, BELT, BELT_SLOPE, LOAD, LOAD_SLOPE = range(SIZE)
"""Components of a motion: its state, then U, Q and their slopes."""
PHASES = 4
MARGINS = 3
TERMS = 18
NODES = 6
"""How many phases, margins of a phase, terms of a series, nodes of its quadrature."""
AHEAD = 4 + 2 * MARGINS + 2
"""What an exact step computes: x, y, v_x and v_y, the margins, their slopes times the step, and 2 to fill up
vectors."""
COLUMNS = 4
"""Small disturbances that are carried along, at most: the derivative by the state at the begin."""
BY_STEPS, BY_NODES, KNOWN = range(3)
"""Columns of the motion's error, and how many there are; that of a disturbance lies behind them."""
MOST_EVENTS = 256
"""Events of a span; one with more of them is given up."""
MOST_SMOOTH_EVENTS = 60
"""The same on smooth pads."""
RUNGE_STAGES = 6
STAGES = 16
POWERS = 7
POWERED = 5
"""Stages of a step of DOPRI5, and of any Runge-Kutta step; coefficients of its continuous solution; works that it
adds up."""
BANDS = 2
MOST_TURNS = 6
"""Bands of v_x, and falls of v_x through zero in a cycle, at most."""

RUNGE_KUTTA, MATRICES = range(2)
"""What propagates a motion."""


class Block(Record):
    """A motion, its columns, and what is known of the span since `base`."""

    x: float  # motion at the start, or at the sample reached, m and m/s
    y: float
    v_x: float
    v_y: float
    force: float  # normal force at the start, N
    h: float  # the step that matrices are made for, or the longest one of Runge-Kutta, s
    anchor: float  # x - travel in stick, a sum of two doubles, m
    anchor_low: float
    base: float  # when the span began, s
    time: float  # since then, s
    knot: float  # time from which on speed or load change otherwise, s
    span: float  # length of the last step, s
    taken: float  # of it, up to its event: 1 where there is none
    events_time: float  # since which `crowded` counts, s
    seconds: float  # that a task takes
    square: float  # integral of v_x² over the span, m²/s
    band: float  # of v_x, m/s: rises from below it to above are counted; 0 counts none
    task: int  # see `motion.tasks`
    propagator: int  # `MATRICES` or `RUNGE_KUTTA`
    phase: int  # of `phases`
    old: int  # phase of the last step
    which: int  # event at its end
    crowded: int  # events without progress
    started: int  # 0 before the phase of the start is known
    steady: int  # 1 where U and Q do not change
    count: int  # columns
    rounds: int  # 1 where the first column is the error by rounding
    account: int  # 1 where works are added up
    measures: int  # 1 where it is noted how far the motion reaches
    limit: int  # events that are noted in the word at most; 0 where none is
    events: int  # in the word
    waiting: int  # whole steps whose works are not added up yet
    row: Annotated[Floats, 8]  # the sample at the level reached
    z: Annotated[Floats, SIZE]  # motion reached
    begin: Annotated[Floats, SIZE]  # at the begin of the last step
    columns: Annotated[Floats, (COLUMNS, 4)]  # small disturbances of x, y, v_x and v_y, one in each row
    normal: Annotated[Floats, 4]  # gradient of the margin that has run out
    arrives: Annotated[Floats, 4]  # dx/dt, dy/dt, dv_x/dt and dv_y/dt before an event
    leaves: Annotated[Floats, 4]  # and behind it
    worst: Annotated[Floats, 4]  # largest size of the error by rounding at a sample
    largest: Annotated[Floats, 4]  # that of the motion
    start: Annotated[Floats, 4]  # derivative of the state by time at the begin of the span, m/s and m/s²
    velocity: Annotated[Floats, 4]  # and at its end
    word: Annotated[Integers, MOST_EVENTS + 1]  # phases of the span
    times: Annotated[Floats, MOST_EVENTS]  # of the events between them, s
    spent: Annotated[Floats, PHASES]  # time in each phase, s
    low: Annotated[Floats, 4]  # least x, y, v_x and v_y at the ends of steps, and x where it turns, m and m/s
    high: Annotated[Floats, 4]  # the largest
    least: Annotated[Floats, (PHASES, MARGINS)]  # margins inside of phases, where they fall and rise again
    margins: Annotated[Floats, 2 * MARGINS]  # at the begin of the last step, and their slopes times the step
    beaten: Annotated[Integers, BANDS]  # rises of v_x from below a band to above it: a narrow one, a wide one
    side: Annotated[Integers, BANDS]  # 1 where v_x was below the band last


class Exact(Record):
    """The matrices of the phases on smooth pads, z' = A z."""

    stiffness: float  # of the contact, N/m
    before: Annotated[Floats, AHEAD]  # the motion reached, its margins, and their slopes times the step
    after: Annotated[Floats, AHEAD]  # that at the end of a step
    needed: Annotated[Floats, SIZE]  # row whose product with z is the friction force that stick takes, N
    generator: Annotated[Floats, (PHASES, SIZE, SIZE)]  # A
    friction: Annotated[Floats, (PHASES, SIZE)]  # row of the friction force, N
    margins: Annotated[Floats, (PHASES, SIZE, AHEAD)]  # columns of `before`: z, then the margins of a phase
    step: Annotated[Floats, (PHASES, SIZE, AHEAD)]  # the same times exp(A h), which give `after`
    now: Annotated[Floats, (SIZE, AHEAD)]  # those of the present phase: the compiler makes vectors of them here
    works: Annotated[Floats, (PHASES, 4, SIZE, SIZE)]  # forms in z that are the works of a step from z on, J
    factors: Annotated[Floats, (5, NODES, SIZE)]  # what powers at the nodes of Gauss' rule are products of
    series: Annotated[Floats, (TERMS, SIZE)]  # of each component over the span of a step
    at: Annotated[Floats, SIZE]  # the motion at a part of the span
    flow: Annotated[Floats, (TERMS, 4, SIZE)]  # the series of exp(A h): its rows for x, y, v_x and v_y
    rows: Annotated[Floats, (4, SIZE)]  # those of exp(A t) at the end of a step, or at a node of Gauss' rule
    drive: Annotated[Floats, AHEAD]  # what U, Q and their slopes add to a step
    noise: Annotated[Floats, 4]  # sizes of these terms in x, y, v_x and v_y
    products: Annotated[Floats, (SIZE, SIZE)]  # of components of z, added up over the steps that wait
    sums: Annotated[Floats, 4]  # x, y, v_x and v_y, added up
    polynomial: Annotated[Floats, (2, TERMS)]  # a margin on the series, and the margin's slope, negative
    made: Annotated[Integers, PHASES]  # 1 where a phase has its matrices, 2 where it has the forms of its works


class Way(Record):
    """A motion on its way to its orbit, and what is measured there."""

    duration: float  # of the run, s
    period: float  # of the last cycle, or of the orbit, s
    late: float  # by how much it has just been corrected, s
    amplitude: float  # half of peak to peak of x in it, m
    low: float  # least and largest x since the last fall, or of a linear motion, m
    high: float
    error: float  # of the orbit, in sizes
    away: float  # of the last return from the orbit, in sizes
    force: float  # mean friction force of the orbit, N
    time: float  # to go on at, s
    started: int  # 0 before the first call
    events: int  # since the last fall
    falls: int  # of v_x through zero
    next_try: int  # fall from which on an orbit is sought again
    way: int  # how often each phase was entered since the last fall, as one number
    sliding: int  # phase of steady sliding
    image: Annotated[Floats, 3]  # of the point, one period later
    saved: Annotated[Floats, 4]  # motion to go on with
    phase: int  # and its phase
    on_orbit: int  # 1 where the block has the orbit that was found
    turns: int  # falls in a cycle
    returns: Annotated[Floats, (MOST_TURNS + 1, 3)]  # the last points of the section, the latest first
    fell: Annotated[Floats, MOST_TURNS + 1]  # when, s
    lows: Annotated[Floats, MOST_TURNS]  # least x before each of them, m
    ways: Annotated[Integers, MOST_TURNS]  # the same before each
    point: Annotated[Floats, 3]  # of the orbit
    map: Annotated[Floats, (3, 3)]  # M
    by_point: Annotated[Floats, 3]  # derivative of the period by it
    equilibrium: Annotated[Floats, 4]  # steady sliding
    into: Annotated[Floats, (2, 4, 4)]  # from a motion beside it to amplitudes of its modes, complex
    growth: Annotated[Floats, 4]  # of each mode, 1/s
    reach: Annotated[Floats, (4, 3)]  # of a mode of amplitude 1 in x, y (m) and v_x (m/s)
    bound: Annotated[Floats, 3]  # of the motion's distance from steady sliding in them
    room: Annotated[Floats, 2]  # of y and v_x until an event comes


class Runge(Record):
    """A Runge-Kutta step."""

    tolerance: float  # error of a step, relative to the largest value so far
    step: float  # to try next, s
    longest: float  # that a step may be, s
    length: float  # of the step that the continuous solution belongs to, s
    base: float  # with `time` when that began, as in the block, s
    time: float
    lowest: float  # what the margin of slip or stick falls to in the last step, and rises again
    grid: float  # step of the grid, s
    least_slide: float  # see `rough.Margins`
    least_hold: float
    least_pass: float
    least_contact: float  # fraction of the pad that touches
    most_contact: float
    open: float  # time in which nothing touches, s
    steeply: int  # 1 where the contact's derivative by x is asked for
    on_grid: int  # 1 where steps lie on a grid, 0 where they keep a tolerance
    pair: int  # 0: steps of order eight, 1: of order five
    light: int  # 1 where the contact finds the force alone
    level: int  # number of the sample interval that has been reached
    switches: int  # changes of phase without a step in between
    steps: int  # of the grid
    w: Annotated[Floats, 4]  # state or column at a stage
    outside: Annotated[Floats, SIZE - BELT]  # speed, load and their slopes at the begin of the step
    begin: Annotated[Floats, 4]  # both ends of the step
    end: Annotated[Floats, 4]
    rates: Annotated[Floats, 4]  # slopes of the continuous solution, m and m/s
    slopes: Annotated[Floats, (STAGES, 4)]  # rates of the state at the stages
    k_columns: Annotated[Floats, (RUNGE_STAGES, 4)]  # and of a column
    column: Annotated[Floats, 4]  # at a stage, or at the end
    late: Annotated[
        Floats, COLUMNS
    ]  # by how much later the step begins in each, as it does at a kink of the force, s
    longer: Annotated[Floats, COLUMNS]  # and by how much longer it is, s
    touch: Annotated[Floats, (STAGES, 3)]  # F_y (N), -∂F_y/∂y and ∂F_y/∂x (N/m) there
    stores: Annotated[Floats, STAGES]  # energy of the contact, J, unless it is found without
    powers: Annotated[Floats, (POWERS, 4)]  # coefficients of the continuous solution
    work_rates: Annotated[Floats, (STAGES, POWERED)]  # powers of the energy account, W
    margin: Annotated[Floats, MARGINS]  # of the phase, m, m/s or N, and their rates
    margin_rate: Annotated[Floats, MARGINS]
    first_margin: Annotated[Floats, MARGINS]  # at the begin of the step, or of a part of it
    first_rate: Annotated[Floats, MARGINS]
    last_margin: Annotated[Floats, MARGINS]  # at the end of that part
    last_rate: Annotated[Floats, MARGINS]
