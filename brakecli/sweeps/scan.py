"""The values of a parameter between which changes of stability are looked for."""

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from brakecli.sweeps.floquet import Disturbances
from brakecli.sweeps.growth import Growth
from brakecli.sweeps.resonances import meetings, resonances

SCANNED = 9  # values of the parameter, both ends among them, between which a change is looked for by runs
PARTS = 4  # of each interval between them, where surfaces open in a run
REFINED = 4  # times that values are added beside one at which stability is nearly lost or regained
BUMP = 20.0  # how much nearer to zero that rate may be than it changes there
SAME, FINE = 1e-3, 1e-4  # of the range: nearer to a value no other one is put; least width of a window
ROUNDS, MOST = 12, 400  # of narrowing down where multipliers may meet, and of values that this may take


def scanned(
    at: Disturbances, lower: float, upper: float, tolerance: float, windows: Iterable[tuple[float, float]]
) -> list[float]:
    """The values between which changes are looked for.

    Where surfaces open they lie closer, and closest beside values where stability is nearly lost or regained.
    Otherwise the `windows` that eigenvalues show have one value each.
    """
    values: list[float] = np.linspace(lower, upper, PARTS * (SCANNED - 1) + 1).tolist()
    at.periodic = any(found.forced for found in map(at.sliding_at, values) if found)
    at.least = SAME * (upper - lower)
    finest = max(min(0.5 * tolerance, at.least), FINE * (upper - lower))
    at.scan(values[::PARTS])
    if not (at.periodic or any(each and each.opened for each in map(at.at, values[::PARTS]))):
        return sorted({*values[::PARTS], *between(lower, upper, windows)})
    at.scan(values)
    at.go_on(values)
    for turn in range(ROUNDS):
        added = set(_meetings(at, finest)[: max(MOST - len(values), 0)])
        if turn < REFINED:
            known = np.array(values)
            followed = {value: at.orbits[value] for value in values if value in at.branches}
            places = resonances(at.sliding_at, followed, values)
            added |= {place for place in places if np.abs(known - place).min() > at.least}
            for triple in zip(values, values[1:], values[2:], strict=False):
                rates = [measured.rate - measured.noise for measured in map(at.at, triple) if measured]
                if len(rates) < len(triple) or min(rates) * max(rates) <= 0.0:
                    continue
                least = min(map(abs, rates))
                if least == abs(rates[1]) and least < BUMP * np.ptp(rates):
                    added |= {0.5 * (low + high) for low, high in pairwise(triple)}
        if not added:
            break
        values = sorted({*values, *added})
        at.scan(sorted(added))
    at.go_on(values)
    hidden = {place for pair in pairwise(values) for place in _hidden(at, *pair)}
    for place in hidden:
        at.known.setdefault(place, Growth(at.orbits[place].rate, 0.0, 0.0, opened=True))
    for end in (lower, upper):
        if not _sure(at, end):
            at.known[end] = None
    return [value for value in sorted({*values, *hidden}) if _sure(at, value)]


def _sure(at: Disturbances, value: float) -> bool:
    """Whether the answer at a value is certain: beside where stability is lost it may be rounding."""
    measured = at.at(value)
    return not measured or measured.exact or value not in at.branches or at.orbits[value].sure


def _meetings(at: Disturbances, finest: float) -> list[float]:
    """Values at which multipliers of a motion may meet, the likeliest to hide a window first."""
    places: dict[float, float] = {}
    for own in at.motions:  # of shoes with dashpots; without, all meetings open windows
        slides = {value: found for value in own if (found := at.sliding_at(value))}
        if len(slides) > 1:
            places |= meetings([*slides.values()], [at.orbits[value] for value in slides], [*slides], finest)
    return sorted((place for place in places if place not in at.known), key=lambda place: -places[place])


def _hidden(at: Disturbances, low: float, high: float) -> list[float]:
    """What was seen of a motion that loses its stability between two values, if not at its end, by a fold."""
    found = []
    for branch in {at.branches.get(low), at.branches.get(high)} - {None}:
        own = sorted(place for place in at.branches if low <= place <= high and at.branches[place] == branch)
        stable = [place for place in own if at.orbits[place].rate <= 0.0] or [math.nan]
        lost = (place for place in own if at.orbits[place].rate > 0.0)
        if any(stable[0] < place < stable[-1] or not at.orbits[place].folds for place in lost):
            found += own
    return found


def between(lower: float, upper: float, windows: Iterable[Iterable[float]]) -> list[float]:
    """The middle of each of the windows within a range, and of what lies between them."""
    ends = [lower, *(end for window in windows for end in window), upper]
    return [0.5 * (low + high) for low, high in pairwise(ends)]
