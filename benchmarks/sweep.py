"""What a sweep costs: two workers against one, the overhead of a point, and points that end early.

    python -m benchmarks.sweep

Needs a machine with two idle cores. The points of the first part take about 0.3 s each; one worker and two take
turns, so that a machine that slows down slows both.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

from brakecli.api.inputs import load_sweep
from brakecli.studies.sweeps.driver import choose_engine, sweep
from brakecli.studies.sweeps.plan import LoadedSweep
from brakecli.studies.sweeps.point import compute

CASE = Path(__file__).parents[1] / "cases" / "relaxation.toml"
ROUNDS = 3


def load(folder: Path, points: int, duration: float) -> LoadedSweep:
    path = folder / "sweep.toml"
    path.write_text(
        f'case = "{CASE}"\n[[axis]]\nparameter = "friction.coefficient"\nstart = 0.5\nstop = 0.8\nnum = {points}\n'
    )
    return load_sweep(str(path), [f"solver.duration={duration}"])


def seconds(loaded: LoadedSweep, workers: int, folder: Path) -> float:
    with choose_engine(loaded.plan, workers) as engine:
        return sweep(loaded, folder / "sweep.h5", engine, force=True).seconds


def alone(loaded: LoadedSweep, chunks: int, size: int) -> float:
    """Seconds of a point without a sweep, of chunks spread over all points, which are not equally expensive."""
    points = loaded.plan.points
    begin = time.perf_counter()
    for first in range(0, points, points // chunks):
        compute(loaded.plan, first, size)
    return (time.perf_counter() - begin) / (chunks * size)


MAP = f"""\
case = "{CASE}"
[[axis]]
parameter = "friction.coefficient"
start = 0.3
stop = 0.9
num = 100
[[axis]]
parameter = "wheel.angular_speed"
start = 0.04
stop = 2.0
num = 100
"""
SEARCH = f"""\
case = "{CASE}"
[critical]
parameter = "friction.coefficient"
lower = 0.0
upper = 2.0
"""


def early(folder: Path) -> None:
    """A map of regimes and a search on smooth pads, whose verdicts are known before the runs end."""
    (folder / "map.toml").write_text(MAP)
    (folder / "search.toml").write_text(SEARCH)
    overrides = ["solver={tolerance=1e-3, duration=2.0}"]
    loaded = load_sweep(str(folder / "map.toml"), overrides)
    for what, plan, chunks, size in (
        ("a point of a map of regimes", loaded.plan, range(0, 10_000, 230), 50),
        ("both critical values", load_sweep(str(folder / "search.toml"), overrides).plan, (0,), 1),
    ):
        times = []
        for _ in range(5):
            begin = time.process_time()
            for first in chunks:
                compute(plan, first, min(size, plan.points - first))
            times.append((time.process_time() - begin) / (len(chunks) * size))
        print(f"{what}: {1e3 * min(times):.2f} ms of a core (least of 5)")
    report_seconds = seconds(loaded, 2, folder)
    size = (folder / "sweep.h5").stat().st_size
    print(f"10,000 points on two workers: {report_seconds:.1f} s, {size / 10_000:.0f} bytes a point in the file")


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        probe = load(folder, 200, 1.0)
        compute(probe.plan, 0, 1)
        loaded = load(folder, 200, 0.3 / alone(probe, 10, 1))
        print(f"200 points of {alone(loaded, 20, 1):.3f} s")
        ratios = []
        for turn in range(ROUNDS):
            one = seconds(loaded, 1, folder)
            two = seconds(loaded, 2, folder)
            ratios.append(one / two)
            print(f"round {turn + 1}: one worker {one:.2f} s, two {two:.2f} s: {ratios[-1]:.3f} times", flush=True)
        print(f"two workers give {statistics.median(ratios):.3f} times one (median of {ROUNDS})")
        small = load(folder, 20_000, 5e-4)
        each = alone(small, 20, 100) * 1e3
        swept = seconds(small, 1, folder) / 20_000 * 1e3
        print(f"small points: {each:.2f} ms each alone, {swept:.2f} ms in a sweep on one worker", end=": ")
        print(f"{swept - each:.2f} ms of overhead a point")
        early(folder)


if __name__ == "__main__":
    sys.exit(main())
