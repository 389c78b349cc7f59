"""A motion that repeats, as all say it that find one: along a branch, forced by waves, or on the way of a run."""

from typing import NamedTuple


class Orbit(NamedTuple):
    """A motion that repeats (SI units)."""

    period: float
    amplitude: float  # half of peak to peak of x
    stick_fraction: float
    contact_loss_fraction: float
    state: tuple[float, ...]  # x, y, v_x and v_y at a place of it; at t = 0 of the waves where they force it
    word: tuple[int, ...]  # phases, from there
    times: tuple[float, ...]  # when they change, from there

    @property
    def frequency(self) -> float:
        """Hz."""
        return 1.0 / self.period
