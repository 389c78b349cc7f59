"""What `check` says that random runs cost, against what they do: python -m benchmarks.statistics.prices."""

import argparse
import math
import multiprocessing
import os
import pickle
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.statistics.cases import KINDS, draw
from benchmarks.statistics.page import PAGE
from benchmarks.statistics.reference import Tables, rate_of, shoe_of
from brakecli.case.case import Case, resolved_toml
from brakecli.case.read import LoadedCase, parse_case
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.runs.limits import check
from brakecli.runs.run import run

CASES = 200
SEED = 5
FACTOR = 3.0
RIGHT = 0.9
"""By which a price may be wrong, and the part of all runs of which it is not."""
LEAST = 0.3
MOST = 3.0
LONGEST = 60.0
"""Seconds of a run that is priced, at most by intention, and after which it is ended."""
MOST_TRIES = 10
HEAD = "## What a run is said to cost"
METHODS = (
    "two-layer",
    "three-layer",
    "event-driven",
    "a tolerance",
    "a tolerance, two-layer",
    "a tolerance, three-layer",
)


@dataclass(frozen=True)
class Priced:
    """A run: the processor time (s) that it was said to take and that it took, and whether "at least" was said."""

    kind: str
    method: str
    number: int
    said: float
    took: float
    at_least: bool

    @property
    def ratio(self) -> float:
        """The price over the cost."""
        return self.said / self.took

    @property
    def right(self) -> bool:
        """Whether they agree."""
        return 1.0 / FACTOR <= self.ratio <= FACTOR


def drawn(number: int, seed: int) -> tuple[str, str, Tables]:
    """A kind, a method and a case of both, as short as the statistics of errors have it."""
    rng = np.random.default_rng((seed, number))
    kind = KINDS[number % len(KINDS)]
    tables = draw(kind, seed, number).tables
    if "roughness" in tables and rng.uniform() < 0.4:
        for surface in tables["roughness"].values():
            waves = int(10.0 ** rng.uniform(1.0, 2.0))
            height = sum(surface["amplitudes"])
            surface["amplitudes"] = [float(each) for each in height / waves * rng.uniform(0.2, 1.8, waves)]
            surface["wavelengths"] = [float(each) for each in 0.03 * 10.0 ** -rng.uniform(0.0, 1.2, waves)]
            surface.pop("phases_deg", None)
    method = METHODS[int(rng.integers(len(METHODS)))]
    step = 2.0 * math.pi / rate_of(shoe_of(tables)) / 10.0 ** rng.uniform(1.5, 2.5)
    step = min(step, tables["output"]["sample_interval"])
    tolerance = float(10.0 ** rng.uniform(-5.0 if "layer" in method else -8.0, -2.0))
    promised = method.startswith("a tolerance")
    scheme = method.rpartition(" ")[2]
    if scheme == "event-driven" and "roughness" not in tables and rng.uniform() < 0.5:
        method = scheme = "piecewise-exact"
    solver: dict[str, Any] = {"tolerance": tolerance} if promised else {"step": step}
    if scheme != "tolerance":
        solver["scheme"] = scheme
    return kind, method, tables | {"solver": solver | {"duration": tables["solver"]["duration"]}}


def longer(tables: Tables, factor: float) -> Tables:
    """A case that goes on for so many times as long, with its schedules."""
    found = {name: dict(table) for name, table in tables.items()}
    found["solver"]["duration"] *= factor
    for table in (found["wheel"], found["load"]):
        if "times" in table:
            table["times"] = [factor * time for time in table["times"]]
    return found


def loaded(tables: Tables) -> LoadedCase:
    """A case, as it is read of its file."""
    return parse_case(resolved_toml(Case.model_validate(tables)), "case")


def cost(tables: Tables, folder: Path) -> float:
    """The processor time (s) of a run; infinite where it is more than `LONGEST`."""
    begin = time.process_time()

    def late(what: str, done: int, total: int) -> None:
        if time.process_time() - begin > LONGEST:
            raise TimeoutError

    try:
        run(loaded(tables), folder / "r.h5", force=True, progress=late)
    except TimeoutError:
        return math.inf
    return time.process_time() - begin


def priced(work: tuple[int, int]) -> Priced | None:
    """A case that takes long enough to be priced; None where it cannot start, or where none is found."""
    number, seed = work
    kind, method, tables = drawn(number, seed)
    target = LEAST * (MOST / LEAST) ** np.random.default_rng((seed, number, 1)).uniform(0.2, 1.0)
    with tempfile.TemporaryDirectory() as folder, suppress(CaseError):
        for _ in range(MOST_TRIES):
            cost(tables, Path(folder))  # kernels are loaded
            if LEAST <= (took := cost(tables, Path(folder))) <= LONGEST:
                said = check(system_of(loaded(tables).case), begin=True)
                return Priced(kind, method, number, said.seconds, took, said.at_least)
            tables = longer(tables, min(max(target / took, 1.3), 30.0) if took < LEAST else 0.1)
    return None


def main() -> None:
    """Draw, price and run, and write the part of the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=int, nargs="?", default=CASES)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--save", type=Path, default=None, help="a file for all that was found, instead of the page"
    )
    given = parser.parse_args()
    found = list[Priced]()
    work = [(number, given.seed) for number in range(given.cases)]
    with multiprocessing.get_context("spawn").Pool(given.workers) as pool:
        for number, each in enumerate(pool.imap_unordered(priced, work), 1):
            if each is not None:
                found.append(each)
            if each is None or not each.right:
                print(f"# {number} of {len(work)}: {each}", file=sys.stderr, flush=True)
    found.sort(key=lambda each: each.number)
    if given.save:
        given.save.write_bytes(pickle.dumps(found))
        print(section(found))
        return
    before = PAGE.read_text(encoding="utf-8").partition(HEAD)[0].rstrip()
    PAGE.write_text(f"{before}\n\n{section(found)}", encoding="utf-8")


def section(found: Sequence[Priced]) -> str:
    """The part of the page that says how well runs are priced."""
    text = f"""{HEAD}

`make statistics` also prices {len(found)} random runs as `brakecli check` does, and makes them as `brakecli run`
does. Cases are drawn as above, and in places with up to 100 waves; the method is drawn, too. Each case is made
longer, with its schedules, until the run takes {LEAST:g} s or more of processor time. A price is **right** if it
is within a factor of {FACTOR:g} of that.

{_table(found, "kind", KINDS)}
{_table(found, "method", tuple(sorted({each.method for each in found})))}
"""
    return text.rstrip() + "\n"


def _table(found: Sequence[Priced], head: str, names: Sequence[str]) -> str:
    """A row for each kind or method, and one for all of them."""
    lines = [f'| {head} | runs | right | "at least" | price / cost: 5 % | 50 % | 95 % |', "|---" * 7 + "|"]
    for name in (*names, "all"):
        rows = [each for each in found if name in ("all", getattr(each, head))]
        if rows:
            ratios = np.quantile([each.ratio for each in rows], (0.05, 0.5, 0.95))
            counts = len(rows), sum(each.right for each in rows), sum(each.at_least for each in rows)
            lines.append(
                f"| {name} | " + " | ".join([*map(str, counts), *(f"{each:.2g}" for each in ratios)]) + " |"
            )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
