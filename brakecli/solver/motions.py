"""The motions of schemes that find their steps themselves: records that they step, and the order of components."""

import numba

from brakecli.solver.records import record

X, Y, V_X, V_Y = range(4)
"""Components of an event-driven motion, the last index of its arrays."""

STAGES = 16
POWERS = 7
POWERED = 5
"""Stages of its steps, coefficients of its continuous solution, works that it adds up."""

MOTION = record(
    "x y v_x v_y",  # motion reached, at which the next step begins, m and m/s
    "force",  # normal force at the start, N
    "time tau",  # when the sample interval that has been reached began, and time since then, s
    "belt belt_slope",  # U, m/s, and its slope, m/s²
    "travel travel_low",  # of the wheel, a sum of two doubles, m
    "load load_slope",  # Q, N, and its slope, N/s
    "anchor anchor_low",  # x - travel in stick, a sum of two doubles, m
    "tolerance",  # of a step
    "pressed_x pressed_y pressed",  # where full contact has been computed in this step, and its force, N
    "step",  # to try next, s
    "lowest",  # what the margin of slip or stick falls to in the last step, and rises again
    "events_time",  # since which `events` are counted, s
    "step_done time_done tau_done",  # the step of the continuous solution and its begin,
    "belt_done belt_slope_done load_done load_slope_done",  # what acted from outside at its begin,
    phase_done=int,  # and its phase
    phase=int,  # flight: the pad is clear of the wheel for sure
    pair=int,  # 0: steps of order eight, 1: of order five
    light=int,  # 1 where the contact finds the force alone
    started=int,  # 0 before the phase of the start is known
    level=int,  # number of the sample interval that has been reached
    switches=int,  # changes of phase without a step in between
    events=int,  # events without progress
    row=(float, 8),  # the sample at the level that counts
    largest=(float, 4),  # of each component so far
    begin=(float, 4),  # both ends of the step
    end=(float, 4),
    slopes=(float, (STAGES, 4)),  # derivatives of the components by time, at each stage
    touch=(float, (STAGES, 2)),  # stiffness of the contact and ∂F_y/∂x, N/m
    stores=(float, STAGES),  # energy of the contact, J, unless it is found without
    powers=(float, (POWERS, 4)),  # coefficients of the continuous solution
    work_rates=(float, (STAGES, POWERED)),  # powers of the energy account, W
)
"""An event-driven motion and its last step."""

BELT, BELT_SLOPE, LOAD, LOAD_SLOPE = range(4, 8)
"""Further components of a piecewise-exact motion, beside those of an event-driven one: U, Q and their slopes."""

SIZE = 8
PHASES = 4
MARGINS = 3
WORKS = 4
TERMS = 18
NODES = 6
"""Its components, phases, margins of a phase, works, terms of its series, nodes of its quadrature."""
PAIRS = SIZE * (SIZE + 1) // 2
"""Products of two components."""
AHEAD = 4 + 2 * MARGINS + 2
"""What a step computes: x, y, v_x and v_y, the margins, their slopes times the step, and 2 to fill up vectors."""

FLOW = record(
    "x y v_x v_y",  # motion at the level reached, m and m/s
    "force",  # normal force at the start, N
    "stiffness",  # of the contact, N/m
    "anchor anchor_low",  # x - travel in stick, a sum of two doubles, m
    "knot",  # time from which on speed or load change otherwise, s
    "events_time",  # since which `events` are counted, s
    "beyond",  # time that the motion is beyond the level reached, s; 0 at samples
    phase=int,
    started=int,  # 0 before the phase of the start is known
    events=int,  # events without progress
    made=(int, PHASES),  # 1 where the matrices of a phase are made, 2 where the forms of its works are, too
    row=(float, 8),  # the sample at the level reached
    z=(float, SIZE),  # motion reached
    error=(float, 4),  # of x, y, v_x and v_y by the rounding of all steps so far
    worst=(float, 4),  # its largest size at a sample
    largest=(float, 4),  # that of the motion
    before=(float, AHEAD),  # the motion reached with its margins
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
    flow=(float, (TERMS, 4, SIZE)),  # the series of exp(A h): its rows for x, y, v_x and v_y
    rows=(float, (4, SIZE)),  # those of exp(A t) at the end of a step, or at a node of Gauss' rule
    at=(float, SIZE),  # the motion at a part of the span
    sums=(float, PAIRS),  # products of components of z, added up over the steps that wait
    polynomial=(float, (2, TERMS)),  # a margin on it, and the margin's slope, negative
    waiting=int,  # 1 where works of whole steps do; further up, it would push vectors across lines of the cache
)
"""A piecewise-exact motion with the matrices of its phases."""

MOTION_TYPE = numba.from_dtype(MOTION)
FLOW_TYPE = numba.from_dtype(FLOW)
