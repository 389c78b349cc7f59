"""Where waves of the wheel may feed a vibration of the shoe, by resonance, in narrow ranges of a parameter."""

import math
from collections.abc import Callable
from itertools import combinations, pairwise

import numpy as np

from brakecli.analysis.stability.search import bisect
from brakecli.sweeps.growth import Sliding
from brakecli.sweeps.periodic import Floats, Orbit, natural, shift

MOST_RESONANCES, HALVINGS = 32, 12  # places where values are put, and how exactly
BESIDE = 0.01  # of a frequency: how far beside such a place others are put
STRONGEST = 6  # waves of the wheel of which two may act together
HIDDEN = 0.7  # of the decay over a period: least change of angles where a window may hide; it would be twice that
NEARLY = 1.2  # times that change: how far apart multipliers may be that meet on the way


def meetings(found: list[Sliding], motions: list[Orbit], values: list[float], finest: float) -> dict[float, float]:
    """Between values of one motion: where multipliers may meet, and one leave the unit circle; and how likely.

    Where pairs meet, at 1, at -1 or each other, their angles stand still and their moduli part, by k at most. One
    leaves the circle only if k is more than the decay over a period. The angles that natural frequencies give
    change by 2 k on the way past. Angles change as natural frequencies do, or as they do beside.
    Nothing is looked for between values as near as two of the `finest`.
    """
    gaps, modes = np.diff(values), np.array([motion.modes for motion in motions])
    decays, angles = modes[:, :, 0], modes[:, :, 1]
    cycles = [natural(at) * motion.segments.time for at, motion in zip(found, motions, strict=True)]
    expected = 2.0 * math.pi * np.abs(np.diff(cycles, axis=0)).max(axis=1)
    speeds = np.maximum(np.abs(np.diff(angles, axis=0)), expected[:, None]) / gaps[:, None]
    beside = np.pad(speeds, ((1, 1), (0, 0)))
    changes = np.maximum(np.maximum(beside[:-2], speeds), beside[2:]) * gaps[:, None]
    # Columns: each pair at 1, each at -1, and both.
    apart = np.column_stack([angles, math.pi - angles, angles[:, 1] - angles[:, 0]])
    decay = np.column_stack([decays, decays, decays.mean(axis=1)])
    change = np.column_stack([changes, changes, changes.sum(axis=1)])
    least, most = np.minimum(decay[:-1], decay[1:]), np.maximum(decay[:-1], decay[1:])
    least = np.where(least > 0.0, least, 0.5 * most)  # on the way to an end of a window
    meet = (np.minimum(apart[:-1], apart[1:]) <= NEARLY * change) & (least > 0.0)
    likely = np.where(meet, change / np.where(meet, least, 1.0), 0.0)
    parts = np.clip(apart[:-1] / np.maximum(apart[:-1] + apart[1:], 1e-300), 0.25, 0.75)
    stable = decays.min(axis=1) > 0.0
    looked = (gaps > 2.0 * finest) & (stable[:-1] | stable[1:]) & (likely.max(axis=1) > HIDDEN)
    rows = [(k, likely[k].argmax()) for k in np.flatnonzero(looked)]
    return {values[k] + float(parts[k, which] * gaps[k]): float(likely[k, which]) for k, which in rows}


def resonances(
    sliding_at: Callable[[float], Sliding | None], orbits: dict[float, Orbit], values: list[float]
) -> list[float]:
    """Between the values: where a wave of the wheel, its second or third harmonic, or the sum or difference of
    two waves passes at twice a natural frequency, or at the sum or the difference of both.

    There it may feed a vibration, in a narrow range of the parameter. An opening pad makes the harmonics. Its
    stiffness is not quite the mean one: natural frequencies are those of the motions at the values.
    """
    followed = [(value, sliding_at(value)) for value in orbits]
    shifts = [(value, shift(each, orbits[value])) for value, each in followed if each]
    known = [(value, *ratios) for value, ratios in shifts if ratios is not None]

    def away(value: float) -> Floats | None:
        """Ratios, less one: of the waves first, of what two of the strongest make, of third harmonics."""
        if (found := sliding_at(value)) is None:
            return None
        where, *faster = zip(*known, strict=True) if known else ((value,), (1.0,), (1.0,))
        first, second = natural(found) * [np.interp(value, where, each) for each in faster]
        wheel, speed = found.system.wheel, abs(found.system.belt_speed)
        strongest = speed * wheel.turns[np.argsort(-np.abs(wheel.g))[:STRONGEST]]
        pairs = [made for a, b in combinations(strongest, 2) for made in (a + b, abs(a - b))]
        drives = [*np.outer([1.0, 2.0], speed * wheel.turns).ravel(), *pairs, *(3.0 * speed * wheel.turns)]
        vibrating = np.array([2.0 * first, 2.0 * second, first + second, second - first])
        ratios: Floats = np.outer(drives, 1.0 / np.maximum(vibrating, 1e-9)).ravel() - 1.0
        return ratios

    rows = [away(value) for value in values]

    def places(beside: float) -> list[float]:
        changes = [
            (int(which), low, high)
            for (low, high), (before, after) in zip(pairwise(values), pairwise(rows), strict=True)
            if before is not None and after is not None and before.size == after.size
            for which in np.flatnonzero((before - beside) * (after - beside) < 0.0)
        ]
        found = []
        for which, low, high in sorted(changes)[:MOST_RESONANCES]:

            def above(value: float, which: int = which) -> bool | None:
                return None if (there := away(value)) is None else bool(there[which] > beside)

            rising = above(low) is False
            ends = bisect(lambda v: (above(v) is False) == rising, low, high, halvings=HALVINGS)  # noqa: B023
            found.append(0.5 * sum(ends))
        return found

    found = places(0.0)
    return found if 3 * len(found) > MOST_RESONANCES else [*found, *places(-BESIDE), *places(BESIDE)]
