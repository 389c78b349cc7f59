"""What a sweep costs beside its points: two workers against one, and the overhead of a point.

    python -m benchmarks.sweep

Needs a machine with two idle cores. The points of the first part take about 0.3 s each; one worker and two take
turns, so that a machine that slows down slows both.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

from brakecli.sweep.driver import choose_engine, sweep
from brakecli.sweep.point import compute
from brakecli.sweep.reading import LoadedSweep, read_sweep

CASE = Path(__file__).parents[1] / "cases" / "relaxation.toml"
ROUNDS = 3


def load(folder: Path, points: int, duration: float) -> LoadedSweep:
    path = folder / "sweep.toml"
    path.write_text(
        f'case = "{CASE}"\n[[axis]]\nparameter = "friction.coefficient"\nstart = 0.5\nstop = 0.8\nnum = {points}\n'
    )
    return read_sweep(str(path), [f"solver.duration={duration}"])


def seconds(loaded: LoadedSweep, workers: int, folder: Path) -> float:
    with choose_engine(loaded.plan, workers) as engine:
        return sweep(loaded, folder / "sweep.h5", engine, force=True).seconds


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        probe = load(folder, 1, 1.0)
        compute(probe.plan, 0, 1)
        begin = time.perf_counter()
        compute(probe.plan, 0, 1)
        duration = 0.3 / (time.perf_counter() - begin)
        loaded = load(folder, 200, duration)
        begin = time.perf_counter()
        compute(loaded.plan, 0, 20)
        each = (time.perf_counter() - begin) / 20
        print(f"200 points of {each:.3f} s")
        ratios = []
        for turn in range(ROUNDS):
            one, two = seconds(loaded, 1, folder), seconds(loaded, 2, folder)
            ratios.append(one / two)
            overhead = (one / 200 - each) * 1e3
            print(f"round {turn + 1}: one worker {one:.2f} s, two {two:.2f} s: {ratios[-1]:.3f} times", end="; ")
            print(f"{overhead:.2f} ms a point beside its work, start-up included", flush=True)
        print(f"two workers give {statistics.median(ratios):.3f} times one (median of {ROUNDS})")
        small = load(folder, 20_000, 5e-4)
        begin = time.perf_counter()
        compute(small.plan, 0, 2000)
        alone = (time.perf_counter() - begin) / 2000
        swept = seconds(small, 1, folder) / 20_000
        print(
            f"small points: {alone * 1e3:.2f} ms each alone, {swept * 1e3:.2f} ms in a sweep on one worker",
            end=": ",
        )
        print(f"{(swept - alone) * 1e3:.2f} ms of overhead a point")


if __name__ == "__main__":
    sys.exit(main())
