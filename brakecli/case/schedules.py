"""Speed and load over time as the solver has them."""

from functools import lru_cache

from brakecli.case.parts import Load, Wheel
from brakecli.solver.schedules import Schedule, schedule

_shared = lru_cache(maxsize=4096)(schedule)
"""Schedules that the points of a sweep have in common; nobody changes them."""


def belt_of(wheel: Wheel) -> Schedule:
    """The speed of the wheel's surface over time, m/s."""
    return _shared(wheel.times or (0.0,), wheel.angular_speeds or (wheel.angular_speed or 0.0,), wheel.radius)


def load_of(load: Load) -> Schedule:
    """The load over time, N."""
    return _shared(load.times or (0.0,), load.forces or (load.force or 0.0,))
