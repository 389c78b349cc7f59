"""Costs of branches, and how many get through: `make bench-branch` prints both, for docs/branches.md.

Smooth shoes with dashpots on a turning wheel, friction from nothing to twice the critical value. A branch gets
through where it reaches an end of the range, or closes. Start-up and steady sliding are left out.
"""

import sys
import time
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from brakecli.analysis.branches.explore import Explorer
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.rows import LIMIT_CYCLE
from brakecli.analysis.branches.sliding import Sliding
from tests.analysis.shoes import Shoe, random_shoes
from tests.examples import make

SHOES = 200
SEED = 2500


def drawn(number: int, seed: int) -> Iterator[tuple[int, dict[str, Any], float]]:
    """Tables of so many shoes that flutter, and their critical friction."""
    found = 0
    for index, tables in enumerate(random_shoes("smooth", seed)):
        shoe = Shoe.of(tables)
        if shoe.critical is not None and shoe.belt != 0.0 and shoe.b.any():
            yield index, tables, shoe.critical
            found += 1
            if found == number:
                return


def main(number: int = SHOES, seed: int = SEED) -> None:
    """Follow the branches of so many shoes, and print times and ends."""
    seconds = list[float]()
    points = list[int]()
    ends = Counter[str]()
    for index, tables, critical in drawn(number, seed):
        begin = time.perf_counter()
        line = Line(make(tables), ["friction.coefficient"], 0.0, 2.0 * critical)
        explored = Explorer(line, lambda what, done, total: None, lambda: False).explore()
        spent = time.perf_counter() - begin
        begin = time.perf_counter()
        sliding = Sliding(Line(make(tables), ["friction.coefficient"], 0.0, 2.0 * critical))
        sliding.changes(sliding.along())
        spent -= time.perf_counter() - begin  # of the cycles alone
        cycles = [branch for branch in explored.branches if branch.kind == LIMIT_CYCLE]
        if not cycles:
            flutters = any(change.kind == "flutter" for change in explored.changes)
            ends["no cycle found at flutter" if flutters else "does not flutter in the range"] += 1
            continue
        seconds.append(spent)
        points.append(len(cycles[0].points))
        last = cycles[0].special[-1]
        through = last.reason.startswith(("it reaches", "it is closed")) or last.kind == "flutter"
        ends["gets through" if through else last.reason] += 1
        if not through:
            where = f"at {last.motion.value:.6g} ({len(cycles[0].points)} points, {spent:.2f} s)"
            print(f"shoe {index}: {last.reason}, {where}")
    median = np.median(seconds)
    most = max(seconds)
    size = np.median(points)
    print(f"{len(seconds)} branches: median {1e3 * median:.0f} ms, most {most:.2f} s; median {size:.0f} points")
    for what, count in ends.most_common():
        print(f"{count}: {what}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
