"""The motion of the event-driven scheme: the record that it steps."""

from brakecli.solver.records import record

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
