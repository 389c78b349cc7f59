"""Where along a number steady sliding loses its stability, or has it again: one search for whoever asks.

A margin says at each value what is positive where sliding is stable, with the rounding of each: the conditions of
Routh and Hurwitz, the load that is left on the contact, or how far a scheme's factor is below one. Of motions that
are measured, or followed, each value has only a side: unstable, stable, or not known.
"""

import math
import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from brakecli.analysis.stability.certain import EPSILON, Rounded
from brakecli.analysis.stability.search import HALVINGS, bisect
from brakecli.solver.roots import bracketed_root

Margin = Callable[[float], Sequence[Rounded] | None]
"""What is positive where sliding is stable; None where there is no steady sliding."""

DIVERGENCE = 0
FLUTTER = 1
"""Places of both conditions in a margin."""


class Change(NamedTuple):
    """A value at which stability is lost as it grows, or regained.

    Beyond the error its side is sure, whatever rounding does. `which` of the margin passes zero; None where steady
    sliding itself ends, or only sides are known. What is not `known` may be anywhere within the error, or nowhere.
    """

    value: float
    error: float
    lost: bool
    which: int | None = None
    known: bool = True


def grows(signs: Sequence[Rounded] | None) -> bool:
    """Whether disturbances surely grow, or there is no steady sliding."""
    return signs is None or any(sign.negative for sign in signs)


def changes(margin: Margin, values: Sequence[float], width: float = 0.0) -> Iterator[Change]:
    """Every change of stability along rising values, each in a bracket of a width."""
    return between(margin, places(margin, values), width)


def places(margin: Margin, values: Sequence[float]) -> list[float]:
    """The values, and those between where something that keeps its sign is nearest to zero, or beyond it.

    Beside the ends a value more is looked at: what falls there may be least before the next one.
    """
    if len(values) < 2:
        return list(values)
    beside = 1e-3  # of the distance of two values; a choice
    first = values[0] + beside * (values[1] - values[0])
    last = values[-1] - beside * (values[-1] - values[-2])
    return sorted({*values, *_extremes(margin, [values[0], first, *values[1:-1], last, values[-1]])})


def between(margin: Margin, values: Sequence[float], width: float = 0.0) -> Iterator[Change]:
    """The changes between neighbours of rising values, each in a bracket of a width; beyond the last that is
    taken nothing is asked.
    """
    sides = ((value, grows(margin(value))) for value in values)

    def locate(low: float, high: float, lost: bool) -> Change:
        return _locate(margin, low, high, lost, width, values[0] if lost else values[-1])

    return joined(sides, values[-1], locate)


def between_known(
    unstable: Callable[[float], bool | None], values: Sequence[float], width: float, halvings: int = HALVINGS
) -> Iterator[Change]:
    """The changes between neighbours of rising values, by what may say None of a value: that it is not known.

    Each bracket goes from the last known value before a change to the first one after it. It is a width wide, or
    so many halvings are made towards both ends of what is not known.
    """

    def locate(low: float, high: float, lost: bool) -> Change:
        def as_below(value: float) -> bool | None:
            return None if (side := unstable(value)) is None else side is not lost

        low, high = bisect(as_below, low, high, width=width)
        middle = 0.5 * (low + high)  # it is not known, where that is still wider
        low, _ = bisect(lambda value: as_below(value) is True, low, middle, width=width, halvings=halvings)
        _, high = bisect(lambda value: as_below(value) is not False, middle, high, width=width, halvings=halvings)
        return Change(0.5 * (low + high), 0.5 * (high - low), lost)

    return joined(((value, unstable(value)) for value in values), values[-1], locate)


def joined(
    sides: Iterable[tuple[float, bool | None]], last: float, locate: Callable[[float, float, bool], Change]
) -> Iterator[Change]:
    """The changes along rising values up to the last, each with whether it is unstable; None where nobody knows.

    `locate` finds the one between two known ones, at which stability is lost, or not. Stability may be lost where
    nothing is known: a window may then begin, or end, anywhere there. Where no side is known there is no change.
    """
    neighbours = iter(sides)
    low, before = next(neighbours)
    hidden = before is None
    for high, after in neighbours:
        hidden = hidden or after is None
        if after is None and high != last:
            continue
        if {before, after} == {False, True}:
            yield locate(low, high, after is True)
        elif hidden and {before, after} != {None}:
            if not before:
                yield Change(low, high - low, lost=True, known=False)
            if not after and (before, after) != (False, None):  # otherwise the bound cuts it
                yield Change(high, high - low, lost=False, known=False)
        low = high
        before = after
        hidden = False


def _locate(margin: Margin, low: float, high: float, lost: bool, width: float, bound: float) -> Change:
    """The change between two values, in a bracket at whose ends its side is sure, whatever rounding does.

    Where rounding hides the side of the stable end as well, the bracket reaches on, up to a bound.
    """
    low, high = _narrowed(margin, low, high, lost, width)
    low, high = bisect(lambda value: grows(margin(value)) is not lost, low, high, width=width)
    stable = low if lost else high
    passing = _negative(margin(high if lost else low))

    def hidden(value: float) -> bool:
        """Whether rounding may hide what passes zero; where steady sliding ends that may be anything.

        It was not surely negative at the end of the bracket: there its true value is above -2 errors, and rounding
        alone takes none nearby below -4.
        """
        signs = [sign for k, sign in enumerate(margin(value) or ()) if k in passing or not passing]
        return any(-4.0 * sign.error <= sign.value <= sign.error for sign in signs)

    stride = math.copysign(max(high - low, EPSILON * abs(stable)), bound - stable)
    while hidden(stable) and stable != bound:
        stable = (max if lost else min)(stable + stride, bound)
        stride = 2.0 * stride
    low, high = (stable, high) if lost else (low, stable)
    value = 0.5 * (low + high)
    return Change(value, 0.5 * (high - low) + math.ulp(value), lost, passing[0] if passing else None)


def left_open(
    margin: Margin, windows: Sequence[Margin], summed: Margin, change: Change, near: float
) -> float | None:
    """How far a change may lie off, as the mean contact is interpolated, by cells, and over few waves.

    `windows`: the margin by each stretch of the waves alone; `summed`: by finer cells, and not interpolated. One
    that is higher by δ passes zero by δ over the slope farther on. They are asked at a stable value `near` it,
    where the slope is the margin over the distance. None where one of them has no steady sliding there, and where
    steady sliding itself ends.
    """
    signs = [ask(near) for ask in (margin, summed, *windows)]
    if change.which is None or change.value == near or any(sign is None for sign in signs):
        return None
    here, exact, *others = (sign[change.which].value for sign in signs if sign is not None)
    off = abs(exact - here) + left_by_windows(others)
    return off * abs(change.value - near) / abs(here) if off else 0.0


def left_by_windows(values: Sequence[float]) -> float:
    """By how much the mean of what the windows say is surely not off, three standard errors; 0 without windows."""
    return 3.0 * statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else 0.0


def _negative(signs: Sequence[Rounded] | None) -> list[int]:
    return [k for k, sign in enumerate(signs or ()) if sign.negative]


def _narrowed(margin: Margin, low: float, high: float, lost: bool, width: float) -> tuple[float, float]:
    """A bracket about the root of what passes zero, so that few halvings are left."""
    unstable = margin(high if lost else low)
    passing = _negative(unstable)
    if unstable is None or not passing or margin(low if lost else high) is None:
        return low, high

    def least(value: float) -> float:
        signs = margin(value)
        return -1.0 if signs is None else min(-signs[k].value / unstable[k].value for k in passing)

    if not least(low) * least(high) < 0.0:
        return low, high
    root = bracketed_root(least, low, high, absolute=width)
    apart = max(width, 4.0 * EPSILON * abs(root))  # a few units of rounding
    while apart < high - low:
        below = max(low, root - apart)
        above = min(high, root + apart)
        if grows(margin(below)) is not lost and grows(margin(above)) is lost:
            return below, above
        apart = 8.0 * apart
    return low, high


def _extremes(margin: Margin, values: Sequence[float]) -> list[float]:
    """Where something that keeps its sign between three values is nearest to zero, or beyond it."""
    nearest = list[float]()
    for low, middle, high in zip(values, values[1:], values[2:], strict=False):
        around = [margin(value) for value in (low, middle, high)]
        if any(signs is None for signs in around):
            continue
        for which, (a, b, c) in enumerate(zip(*around, strict=True)):
            sign = math.copysign(1.0, b.value)
            alike = sign == math.copysign(1.0, a.value) == math.copysign(1.0, c.value)
            if alike and abs(b.value) < min(abs(a.value), abs(c.value)):
                nearest.append(_extreme(margin, which, sign, low, high))
    return nearest


def _extreme(margin: Margin, which: int, sign: float, low: float, high: float) -> float:
    """The value between two at which something is nearest to zero, or beyond it; by the golden section."""

    def height(value: float) -> float:
        signs = margin(value)
        return sign * signs[which].value if signs is not None else math.inf

    golden = 0.3819660112501051
    a = low + golden * (high - low)
    b = high - golden * (high - low)
    at_a = height(a)
    at_b = height(b)
    for _ in range(30):
        if min(at_a, at_b) < 0.0:
            break
        if at_a < at_b:
            high = b
            b = a
            at_b = at_a
            a = low + golden * (high - low)
            at_a = height(a)
        else:
            low = a
            a = b
            at_a = at_b
            b = high - golden * (high - low)
            at_b = height(b)
    return a if at_a < at_b else b
