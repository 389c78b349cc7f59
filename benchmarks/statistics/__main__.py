"""Draw, judge, and write docs/statistics.md: python -m benchmarks.statistics."""

import argparse
import multiprocessing
import os
import pickle
import sys
import time
from functools import partial
from pathlib import Path

from benchmarks.statistics.cases import KINDS
from benchmarks.statistics.judging import Judged, judged
from benchmarks.statistics.page import PAGE, by_tolerance, page

RUNS = 4000
SEED = 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", type=int, nargs="?", default=RUNS)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", choices=KINDS, default=None)
    parser.add_argument(
        "--save", type=Path, default=None, help="a file for all that was found, instead of the page"
    )
    parser.add_argument(
        "--lanes",
        action="store_true",
        help="as points of a map, as many as stay in a lane: a table, instead of the page",
    )
    given = parser.parse_args()
    kinds = [given.only] if given.only else KINDS
    task = partial(judged, lanes=given.lanes)
    work = [(kinds[n % len(kinds)], given.seed, n // len(kinds)) for n in range(given.runs)]
    found = list[Judged]()
    unknown = 0
    begin = time.perf_counter()
    task((KINDS[3], given.seed, 0))  # kernels are compiled here: workers on a cold cache would each do it
    with multiprocessing.get_context("spawn").Pool(given.workers) as pool:
        for number, one in enumerate(pool.imap_unordered(task, work), 1):
            if one is None:
                unknown += 1
            else:
                found.append(one)
                if one.faulty:
                    print(f"# {one}", file=sys.stderr, flush=True)
            if number % 20 == 0 or number == len(work):
                seconds = time.perf_counter() - begin
                print(f"# {number} of {len(work)}, {seconds:.0f} s", file=sys.stderr, flush=True)
    found.sort(key=lambda each: (KINDS.index(each.drawn.kind), each.drawn.seed))
    if given.save:
        given.save.write_bytes(pickle.dumps(found))
    elif given.lanes:
        print(by_tolerance(found), f"\n{unknown} of {len(work)} left their lanes.")
    else:
        PAGE.write_text(page(found, unknown), encoding="utf-8")


if __name__ == "__main__":
    main()
