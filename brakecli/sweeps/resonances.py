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
HIDDEN = 0.7  # of the decay over a period: a window hides where angles change by more
NEARLY = 1.2  # times the change of angles: how far apart multipliers may be that meet on the way


def meetings(
    found: list[Sliding], motions: list[Orbit], values: list[float], noise: float, finest: float
) -> dict[float, float]:
    """Between values of one motion: where multipliers may meet, and one may leave the unit circle and come back.

    Where pairs meet, at 1, at -1 or each other, they part by k in their angles and then in their moduli, by no more
    than k. They leave the circle if k is more than the decay over a period; then their angles, if they passed each
    other, would change by twice that on the way. They change as the natural frequencies do, or as nearby. Growth
    up to `noise` (1/s) counts as none; where a window is less than `finest` wide nothing is looked for.
    """
    gaps, modes = np.diff(values), np.array([motion.modes for motion in motions])
    modes[:, :, 0] += noise * motions[0].segments.time
    turned = np.array([2.0 * math.pi * natural(f) * m.segments.time for f, m in zip(found, motions, strict=True)])
    speeds = np.maximum(
        np.abs(np.diff(modes[:, :, 1], axis=0)), np.abs(np.diff(turned, axis=0)).max(axis=1)[:, None]
    )
    speeds = np.pad(speeds / gaps[:, None], ((1, 1), (0, 0)))
    changes = np.maximum(np.maximum(speeds[:-2], speeds[1:-1]), speeds[2:]) * gaps[:, None]
    (first, second), (one, other) = modes[:, :, 0].T, modes[:, :, 1].T
    decays, rows = list[Floats](), list[Floats]()
    for decay, apart, change in (
        (first, one, changes[:, 0]),
        (first, math.pi - one, changes[:, 0]),
        (second, other, changes[:, 1]),
        (second, math.pi - other, changes[:, 1]),
        (0.5 * (first + second), other - one, changes.sum(axis=1)),
    ):
        near, most = np.minimum(apart[:-1], apart[1:]), np.maximum(decay[:-1], decay[1:])
        least = np.where((least := np.minimum(decay[:-1], decay[1:])) > 0.0, least, 0.5 * most)
        hides = np.where((near <= NEARLY * change) & (least > 0.0), change / least, 0.0)
        part = apart[:-1] / np.maximum(apart[:-1] + apart[1:], 1e-300)
        decays.append(hides)
        rows.append(np.clip(part, 0.25, 0.75))
    hidden, parts = np.array(decays), np.array(rows)
    which, every = hidden.argmax(axis=0), np.arange(len(gaps))
    most, part = hidden[which, every], parts[which, every]
    stable = modes[:, :, 0].min(axis=1) > 0.0
    most[(gaps <= 2.0 * finest) | ~(stable[:-1] | stable[1:])] = 0.0
    return {values[k] + float(part[k] * gaps[k]): float(most[k]) for k in np.flatnonzero(most > HIDDEN)}


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
