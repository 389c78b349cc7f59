"""The two modes of steady sliding, followed by continuity along a parameter."""

import math
from collections.abc import Iterable, Iterator

import numpy as np

from brakecli.analysis.stability.modes import Complex, Mode

Pair = tuple[Mode, Mode]
_TIE = 1e-9  # of a cost: where modes have just met, both orders are as near


def followed(found: Iterable[tuple[Mode, ...]]) -> Iterator[Pair | None]:
    """The two modes at each value of a parameter, in the order of those before; None where there are none.

    The first ones stand by frequency. Where two modes have met, the order behind is a matter of choice: as they
    part, the one that grows comes first.
    """
    before: Pair | None = None
    for modes in found:
        pair = _two(modes) if modes else None
        if pair and before:
            kept, swapped = (sum(map(_distance, before, each)) for each in (pair, pair[::-1]))
            if swapped < kept - _TIE:
                pair = pair[1], pair[0]
        before = pair or before
        yield pair


def _two(modes: tuple[Mode, ...]) -> Pair:
    """One mode for each pair of eigenvalues, by frequency. Of two real ones that grow or decay it is the larger.

    Of four real eigenvalues those of the same mode have the most similar shapes.
    """
    real, moving = ([mode for mode in modes if (mode.frequency > 0.0) == moves] for moves in (False, True))
    if len(real) == 4:
        first, *others = real
        partner = max(others, key=lambda other: _likeness(first, other))
        others.remove(partner)
        moving = [max(pair, key=lambda mode: mode.growth) for pair in ((first, partner), others)]
    elif real:
        moving.append(max(real, key=lambda mode: mode.growth))
    scale = max(mode.frequency for mode in moving) or 1.0  # modes that have met differ in rounding
    one, other = sorted(moving, key=lambda mode: (round(mode.frequency / scale, 9), -mode.growth))
    return one, other


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
