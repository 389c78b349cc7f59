"""The automaton of a motion: its phases, the margins that keep each up, and the phase that follows an event.

A phase is a side of the friction law, stick or slip in one direction, on a pad that may touch the wheel; or it is
flight, in which the pad is clear of the wheel. A margin is positive while the phase lasts, and the first one that
runs out is the event that ends it. Two propagators carry a motion through a phase and find that event: matrix
exponentials on smooth pads (`advance`), and Runge-Kutta steps on any, which keep a tolerance (`steps`) or lie on a
grid (`grid`). What all do at an event stands in `events`.
"""

from brakecli.solver.double_double import two_sum
from brakecli.solver.kernels import kernel

BACKWARD, STICK, FORWARD, OPEN = range(4)
"""The phases: the sign of the sliding velocity plus one, and flight."""
HEIGHT, PULL, PUSH = range(3)
SLIDING = PULL
"""The margins. Of each phase: how far the pad is from being clear, or is clear (m). Of slip: the sliding speed
(m/s). Of stick: how far the force that it takes is within the friction cone (N), on the side where friction would
have to pull harder, so that backward slip follows, and on the side where it would have to push."""
UNDECIDED = -1
"""Not a phase: the shoe touches at the velocity of the wheel, and the forces decide (`stick_or_slip`)."""

SOONER = 0.125
"""Part of a time in which a margin that begins at zero is sought above it, and of that part, and so on."""


@kernel
def side_of(phase: int) -> float:
    """The sign of the sliding velocity in a phase; 0 in stick, and in flight."""
    return float(phase - STICK) if phase != OPEN else 0.0


@kernel
def sliding_phase(velocity: float) -> int:
    """The phase of a touching shoe with this sliding velocity; at 0 it is undecided."""
    if velocity == 0.0:
        return UNDECIDED
    return FORWARD if velocity > 0.0 else BACKWARD


@kernel
def stick_or_slip(pull: float, push: float, pull_rounding: float, push_rounding: float) -> int:
    """The phase of a touching shoe at the wheel's velocity, by its margins in stick, Eqs. (3)-(5).

    `pull` is φ F_y - needed and `push` φ F_y + needed. It sticks if friction can hold it, up to rounding.
    Otherwise it slips the way that friction cannot prevent.
    """
    if pull < -pull_rounding:
        return BACKWARD
    return FORWARD if push < -push_rounding else STICK


@kernel
def following(phase: int, which: int, velocity: float) -> int:
    """The phase after a margin has run out at a sliding velocity (m/s); `UNDECIDED` where the forces decide."""
    if which == HEIGHT:
        return sliding_phase(velocity) if phase == OPEN else OPEN
    if phase == STICK:
        return BACKWARD if which == PULL else FORWARD
    return UNDECIDED


@kernel
def anchored(x: float, travel: float, travel_low: float) -> tuple[float, float]:
    """Where a shoe holds on to the wheel: x less what the wheel has travelled, as a sum of two doubles (m)."""
    anchor, low = two_sum(x, -travel)
    return anchor, low - travel_low


@kernel
def carried(anchor: float, anchor_low: float, travel: float, travel_low: float) -> float:
    """The place x (m) of a shoe in stick: its anchor plus what the wheel has travelled, without any drift."""
    return (anchor + travel) + (anchor_low + travel_low)


@kernel
def counted(since: float, events: int, time: float, step: float) -> tuple[float, int]:
    """Since when events are counted, and how many there are, after one more: those within 1e-6 of a step."""
    return (time, 1) if time - since > 1e-6 * step else (since, events + 1)


@kernel
def stalled(events: int) -> bool:
    """Whether so many events came without progress that they will never end."""
    return events > 1000
