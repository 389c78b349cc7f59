"""Random damped shoes on smooth pads, and their branches of limit cycles from flutter."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import islice
from typing import Any

import numpy as np

from brakecli.analysis.branches.cycles import Chart, Cycles
from brakecli.analysis.branches.follow import follow
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.newton import Newton, Settings
from brakecli.analysis.branches.point import Branch, Point
from brakecli.analysis.branches.sliding import Change, Sliding
from brakecli.solver.motion.flow import Orbit
from tests.analysis.branches.phasewise import Phasewise
from tests.analysis.shoes import Array, Shoe, Tables, random_shoes
from tests.examples import make

FRICTION = "friction.coefficient"
LARGE = 3e3  # times the first amplitude: a vibration that grows without bound
SETTINGS = Settings(longest=0.25, points=2500, seconds=math.inf)


def drawn(seed: int) -> Iterator[tuple[Tables, float]]:
    """Shoes with dashpots on a turning wheel, and the least friction at which they slide unstably."""
    for tables in random_shoes("smooth", seed):
        shoe = Shoe.of(tables)
        critical = shoe.critical
        if critical and shoe.belt != 0.0 and shoe.b.any():
            yield tables, critical


@cache
def numbered(seed: int, number: int) -> Tables:
    """One of the random shoes on smooth pads; those before it are drawn as well, 30 in a second."""
    return next(islice(random_shoes("smooth", seed), number, None))


def changed(tables: Tables, key: str, value: float) -> Tables:
    """The tables with another value of a key."""
    table, name = key.split(".")
    return {**tables, table: {**tables[table], name: value}}


@dataclass
class Followed:
    """A branch from a flutter."""

    tables: Tables
    line: Line
    cycles: Cycles
    flutter: Change
    branch: Branch

    def shoe(self, p: float) -> Shoe:
        """The numbers of the shoe at p, read from its tables."""
        return Shoe.of(changed(self.tables, self.line.keys[0], self.line.value(p)))

    def motion(self, p: float) -> Phasewise:
        """Its motion by another scheme."""
        return Phasewise(self.shoe(p))

    def cycle(self, point: Point) -> tuple[Array, float, Array]:
        """A state on the cycle of a point, its period, and the scales of its chart."""
        chart = point.chart
        assert isinstance(chart, Chart)
        rest = np.append(self.shoe(point.p).rest, [0.0, 0.0])
        return rest + point.z[:4] * chart.scales, float(point.z[4]) * chart.time, chart.scales

    def refined(self, point: Point) -> Point | None:
        """The same point, corrected until nothing changes."""
        self.cycles.use(point.chart)
        newton = Newton(self.cycles, Settings(exact=1e-12, iterations=12))
        return newton.solve(point.z, point.tangent, point.tangent, point.s, exact=True)

    @property
    def inner(self) -> list[Point]:
        """The points beyond the family of linear vibrations: those with more than one phase."""
        return [point for point in self.branch.points[1:] if len(set(word_of(point))) > 1]


def word_of(point: Point) -> tuple[int, ...]:
    """The phases of a cycle."""
    return cycle_of(point).word


def cycle_of(point: Point) -> Orbit:
    """What a point shows."""
    facts: Any = point.facts
    assert isinstance(facts, Orbit)
    return facts


def followed(
    tables: Tables, key: str, low: float, high: float, settings: Settings = SETTINGS, which: int = 0
) -> Followed | None:
    """The branch of limit cycles from a flutter along a key; None without a flutter."""
    line = Line(make(tables), [key], low, high)
    sliding = Sliding(line)
    cycles = Cycles(line)
    flutters = [change for change in sliding.changes(sliding.along()) if change.kind == "flutter"]
    if len(flutters) <= which:
        return None
    first = sliding.vibration(cycles, flutters[which])
    assert first is not None
    begin = cycle_of(first).amplitude
    vibrates = False

    def until(point: Point) -> str | None:
        nonlocal vibrates
        slides = len(set(word_of(point))) == 1
        if slides and vibrates:
            return "steady sliding"
        vibrates = vibrates or not slides
        return "it grows without bound" if cycle_of(point).amplitude > LARGE * begin else None

    return Followed(tables, line, cycles, flutters[which], follow(cycles, first, None, settings, until))


def branches(seed: int, number: int) -> Iterator[Followed]:
    """Branches of that many shoes from flutter in friction, up to twice the critical one."""
    for tables, critical in drawn(seed):
        if number == 0:
            return
        found = followed(tables, FRICTION, 0.0, 2.0 * critical)
        if found is not None:
            number -= 1
            yield found
