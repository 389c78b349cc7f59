"""The automaton's table: which phase follows which event, as set-valued friction and one-sided contact demand."""

import pytest

from brakecli.solver.phases import (
    BACKWARD,
    FORWARD,
    HEIGHT,
    OPEN,
    PULL,
    PUSH,
    SLIDING,
    STICK,
    UNDECIDED,
    counted,
    following,
    side_of,
    sliding_phase,
    stalled,
    stick_or_slip,
)

TOUCHING = (BACKWARD, STICK, FORWARD)


@pytest.mark.parametrize("phase", TOUCHING)
@pytest.mark.parametrize("velocity", [-1.0, 0.0, 1.0])
def test_a_pad_that_is_pressed_no_more_flies_however_it_slides(phase: int, velocity: float) -> None:
    assert following(phase, HEIGHT, velocity) == OPEN


@pytest.mark.parametrize(("velocity", "phase"), [(-1e-300, BACKWARD), (0.0, UNDECIDED), (1e-300, FORWARD)])
def test_a_pad_that_lands_slides_as_it_moves(velocity: float, phase: int) -> None:
    assert following(OPEN, HEIGHT, velocity) == sliding_phase(velocity) == phase


def test_a_slip_that_ends_leaves_it_to_the_forces() -> None:
    assert following(BACKWARD, SLIDING, 0.0) == following(FORWARD, SLIDING, 0.0) == UNDECIDED


def test_stick_ends_in_the_slip_that_friction_cannot_prevent() -> None:
    """Friction that would have to pull the shoe along harder than it can leaves it behind the wheel."""
    assert following(STICK, PULL, 0.0) == stick_or_slip(-1.0, 5.0, 0.0, 0.0) == BACKWARD
    assert following(STICK, PUSH, 0.0) == stick_or_slip(5.0, -1.0, 0.0, 0.0) == FORWARD


def test_friction_holds_to_the_edge_of_its_cone_and_by_the_rounding_beyond_it() -> None:
    assert (
        stick_or_slip(0.0, 2.0, 0.0, 0.0)
        == stick_or_slip(-1e-9, 2.0, 1e-9, 0.0)
        == stick_or_slip(2.0, -1e-9, 0.0, 1e-9)
        == STICK
    )
    assert stick_or_slip(-1.1e-9, 2.0, 1e-9, 0.0) == BACKWARD
    assert stick_or_slip(2.0, -1.1e-9, 0.0, 1e-9) == FORWARD


def test_the_side_is_the_sign_of_the_sliding_velocity_and_none_in_flight() -> None:
    assert [side_of(phase) for phase in (BACKWARD, STICK, FORWARD, OPEN)] == [-1.0, 0.0, 1.0, 0.0]


def test_events_without_progress_stall_a_motion_and_those_with_progress_do_not() -> None:
    since = 0.0
    events = 0
    for _ in range(1000):
        since, events = counted(since, events, 1e-12, 1.0)
    assert (since, events, stalled(events)) == (0.0, 1000, False)
    assert stalled(counted(since, events, 1e-12, 1.0)[1])
    assert counted(since, events, 1e-5, 1.0) == (1e-5, 1)
