"""Records: a motion and what is carried along with it, what either propagator computes, and a pursued orbit."""

from brakecli.solver.records import record

X, Y, V_X, V_Y, BELT, BELT_SLOPE, LOAD, LOAD_SLOPE = range(8)
"""Components of a motion: its state, then U, Q and their slopes."""
SIZE = 8
PHASES = 4
MARGINS = 3
WORKS = 4
TERMS = 18
NODES = 6
"""How many components, phases, margins of a phase, works, terms of a series, nodes of its quadrature."""
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

BLOCK = record(
    "x y v_x v_y",  # motion at the start, or at the sample reached, m and m/s
    "force",  # normal force at the start, N
    "h",  # the step that matrices are made for, or the longest one of Runge-Kutta, s
    "anchor anchor_low",  # x - travel in stick, a sum of two doubles, m
    "base time",  # when the span began, and time since then, s
    "knot",  # time from which on speed or load change otherwise, s
    "span part",  # length of the last step (s), and the part of it that was taken, up to its event
    "events_time",  # since which `crowded` counts, s
    "seconds",  # that a task takes
    "square",  # integral of v_x² over the span, m²/s
    "band",  # of v_x, m/s: rises from below it to above are counted; 0 counts none
    task=int,  # see `motion.tasks`
    propagator=int,  # `MATRICES` or `RUNGE_KUTTA`
    phase=int,
    old=int,  # phase of the last step
    which=int,  # event at its end
    crowded=int,  # events without progress
    started=int,  # 0 before the phase of the start is known
    steady=int,  # 1 where U and Q do not change
    count=int,  # columns
    rounds=int,  # 1 where the first column is the error by rounding
    account=int,  # 1 where works are added up
    measures=int,  # 1 where it is noted how far the motion reaches
    limit=int,  # events that are noted in the word at most; 0 where none is
    events=int,  # in the word
    waiting=int,  # whole steps whose works are not added up yet
    row=(float, 8),  # the sample at the level reached
    z=(float, SIZE),  # motion reached
    begin=(float, SIZE),  # at the begin of the last step
    columns=(float, (COLUMNS, 4)),  # small disturbances of x, y, v_x and v_y, one in each row
    normal=(float, 4),  # gradient of the margin that has run out
    arrives=(float, 4),  # dx/dt, dy/dt, dv_x/dt and dv_y/dt before an event
    leaves=(float, 4),  # and behind it
    worst=(float, 4),  # largest size of the error by rounding at a sample
    largest=(float, 4),  # that of the motion
    start=(float, 4),  # derivative of the state by time at the begin of the span, m/s and m/s²
    velocity=(float, 4),  # and at its end
    word=(int, MOST_EVENTS + 1),  # phases of the span
    times=(float, MOST_EVENTS),  # of the events between them, s
    spent=(float, PHASES),  # time in each phase, s
    low=(float, 4),  # least x, y, v_x and v_y at the ends of steps, and x where it turns, m and m/s
    high=(float, 4),  # the largest
    least=(float, (PHASES, MARGINS)),  # least margins inside of phases, in which they fall and rise again
    margins=(float, 2 * MARGINS),  # at the begin of the last step, and their slopes times the step
    beaten=(int, BANDS),  # rises of v_x from below a band to above it, for a narrow band and a wide one
    side=(int, BANDS),  # 1 where v_x was below the band last
)
"""A motion, its columns, and what is known of the span since `base`."""

EXACT = record(
    "stiffness",  # of the contact, N/m
    before=(float, AHEAD),  # the motion reached, its margins, and their slopes times the step
    after=(float, AHEAD),  # that at the end of a step
    needed=(float, SIZE),  # row whose product with z is the friction force that stick takes, N
    generator=(float, (PHASES, SIZE, SIZE)),  # A
    friction=(float, (PHASES, SIZE)),  # row of the friction force, N
    margins=(float, (PHASES, SIZE, AHEAD)),  # columns of `before`: z, then the margins of a phase
    step=(float, (PHASES, SIZE, AHEAD)),  # the same times exp(A h), which give `after`
    now=(float, (SIZE, AHEAD)),  # those of the present phase: at a fixed place, the compiler makes vectors of them
    works=(float, (PHASES, WORKS, SIZE, SIZE)),  # forms in z that are the works of a step from z on, J
    factors=(float, (5, NODES, SIZE)),  # what powers at the nodes of Gauss' rule are products of
    series=(float, (TERMS, SIZE)),  # of each component over the span of a step
    at=(float, SIZE),  # the motion at a part of the span
    flow=(float, (TERMS, 4, SIZE)),  # the series of exp(A h): its rows for x, y, v_x and v_y
    rows=(float, (4, SIZE)),  # those of exp(A t) at the end of a step, or at a node of Gauss' rule
    drive=(float, AHEAD),  # what U, Q and their slopes add to a step
    noise=(float, 4),  # sizes of these terms in x, y, v_x and v_y
    products=(float, (SIZE, SIZE)),  # of components of z, added up over the steps that wait
    sums=(float, 4),  # x, y, v_x and v_y, added up
    polynomial=(float, (2, TERMS)),  # a margin on the series, and the margin's slope, negative
    made=(int, PHASES),  # 1 where the matrices of a phase are made, 2 where the forms of its works are, too
)
"""The matrices of the phases on smooth pads, z' = A z."""

PURSUIT = record(
    "duration",  # of the run, s
    "period late",  # of the last cycle, or of the orbit, and by how much it has just been corrected, s
    "amplitude",  # half of peak to peak of x in it, m
    "low high",  # least and largest x since the last fall, or of a linear motion, m
    "error",  # of the orbit, in sizes
    "away",  # of the last return from the orbit, in sizes
    "force",  # mean friction force of the orbit, N
    "time",  # to go on at, s
    started=int,
    events=int,  # since the last fall
    falls=int,
    next_try=int,  # fall from which on an orbit is sought again
    way=int,  # how often each phase was entered since the last fall, as one number
    sliding=int,  # phase of steady sliding
    kept=(float, 3),  # the point of return
    saved=(float, 4),  # motion to go on with
    phase=int,  # and its phase
    on_orbit=int,  # 1 where the block has the orbit that was found
    turns=int,  # falls in a cycle
    returns=(float, (MOST_TURNS + 1, 3)),  # the last points of the section, the latest first
    fell=(float, MOST_TURNS + 1),  # when, s
    lows=(float, MOST_TURNS),  # least x before each of them, m
    ways=(int, MOST_TURNS),  # the same before each
    point=(float, 3),  # of the orbit
    map=(float, (3, 3)),  # M
    by_point=(float, 3),  # derivative of the period by it
    rest=(float, 4),  # steady sliding
    into=(float, (2, 4, 4)),  # from a motion beside it to the amplitudes of its modes, real and imaginary parts
    growth=(float, 4),  # of each mode, 1/s
    reach=(float, (4, 3)),  # of a mode of amplitude 1 in x, y (m) and v_x (m/s)
    bound=(float, 3),  # of the motion's distance from steady sliding in them
    room=(float, 2),  # of y and v_x until an event comes
)
"""A motion on its way to its orbit, and what is measured there."""

RUNGE = record(
    "tolerance",  # error of a step, relative to the largest value so far
    "step",  # to try next, s
    "longest",  # that a step may be, s
    "length",  # of the step that the continuous solution belongs to, s
    "base time",  # when that began, as in the block, s
    "lowest",  # what the margin of slip or stick falls to in the last step, and rises again
    "grid",  # step of the grid, s
    "least_slide least_hold least_pass",  # see `rough.Margins`
    "least_contact most_contact",  # part of the pad that touches
    "open",  # time in which nothing touches, s
    steeply=int,  # 1 where the contact's derivative by x is asked for
    on_grid=int,  # 1 where steps lie on a grid, 0 where they keep a tolerance
    pair=int,  # 0: steps of order eight, 1: of order five
    light=int,  # 1 where the contact finds the force alone
    level=int,  # number of the sample interval that has been reached
    switches=int,  # changes of phase without a step in between
    steps=int,  # of the grid
    w=(float, 4),  # state or column at a stage
    outside=(float, SIZE - BELT),  # speed, load and their slopes at the begin of the step
    begin=(float, 4),  # both ends of the step
    end=(float, 4),
    rates=(float, 4),  # slopes of the continuous solution, m and m/s
    slopes=(float, (STAGES, 4)),  # rates of the state at the stages
    k_columns=(float, (RUNGE_STAGES, 4)),  # and of a column
    column=(float, 4),  # at a stage, or at the end
    late=(float, COLUMNS),  # by how much later the step begins in each column: it does at a kink of the force, s
    longer=(float, COLUMNS),  # and by how much longer it is, s
    touch=(float, (STAGES, 3)),  # F_y (N), -∂F_y/∂y and ∂F_y/∂x (N/m) there
    stores=(float, STAGES),  # energy of the contact, J, unless it is found without
    powers=(float, (POWERS, 4)),  # coefficients of the continuous solution
    work_rates=(float, (STAGES, POWERED)),  # powers of the energy account, W
    margin=(float, MARGINS),  # of the phase, m, m/s or N, and their rates
    margin_rate=(float, MARGINS),
    first_margin=(float, MARGINS),  # at the begin of the step, or of a part of it
    first_rate=(float, MARGINS),
    last_margin=(float, MARGINS),  # at the end of that part
    last_rate=(float, MARGINS),
)
"""A Runge-Kutta step."""
