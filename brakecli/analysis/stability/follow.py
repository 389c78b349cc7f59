"""The two modes of steady sliding, followed by continuity along a parameter."""

import math
from collections.abc import Iterable, Iterator

import numpy as np

from brakecli.analysis.stability.modes import Complex, Mode

Pair = tuple[Mode, Mode]


def followed(along: Iterable[tuple[Mode, ...]]) -> Iterator[Pair | None]:
    """The two modes at each value of a parameter, in the order of those before; None where there are none.

    The first ones stand by frequency. Where two modes have met, the order behind is a matter of choice: as they
    part, the one that grows comes first.
    """
    before: Pair | None = None
    for modes in along:
        if not modes:
            yield None
            continue
        pairs = _pairs(modes)
        if before is None or any(mode.frequency for mode in before):
            pairs = pairs[:1]
        pairs += [(other, one) for one, other in pairs]
        costs = [sum(map(_distance, before, pair)) if before else 0.0 for pair in pairs]
        before = pairs[np.argmin(np.round(costs, 9))]  # where modes have just met, both orders are as near
        yield before


def _pairs(modes: tuple[Mode, ...]) -> list[Pair]:
    """One mode for each pair of eigenvalues, by frequency. Of two real ones that grow or decay it is the larger.

    The largest of four real eigenvalues may belong together with any other one; the likeliest is the one with the
    most similar shape, whose pairs come first.
    """
    real, moving = ([mode for mode in modes if (mode.frequency > 0.0) == moves] for moves in (False, True))
    real.sort(key=lambda mode: -mode.growth)
    choices = [[*moving, *real[:1]]] if len(real) < 4 else [[real[0], real[1]], [real[0], real[2]]]
    if len(real) == 4 and max(real[1:], key=lambda other: _likeness(real[0], other)) is real[1]:
        choices.reverse()
    scale = max(mode.frequency for mode in modes) or 1.0  # modes that have met differ in rounding
    for choice in choices:
        choice.sort(key=lambda mode: (round(mode.frequency / scale, 9), -mode.growth))
    return [(one, other) for one, other in choices]


def _distance(one: Mode, other: Mode) -> float:
    """How far two modes are from being the same: their eigenvalues and their shapes."""
    first, second = (complex(mode.growth, 2.0 * math.pi * mode.frequency) for mode in (one, other))
    size = abs(first) + abs(second)
    return (abs(first - second) / size if size else 0.0) + 1.0 - _likeness(one, other)


def _likeness(one: Mode, other: Mode) -> float:
    """1 for modes of the same shape, 0 for orthogonal ones."""
    return float(abs(np.vdot(_shape(one), _shape(other))) ** 2)


def _shape(mode: Mode) -> Complex:
    """Motion in x and y, of length 1."""
    if mode.shape is None or mode.shape_phase is None:
        return np.array([0.0, 1.0], complex)
    vector = np.array([1.0, mode.shape * np.exp(1j * math.radians(mode.shape_phase))])
    return np.asarray(vector / np.linalg.norm(vector))
