"""What a sweep will cost, before anything is computed."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace

from brakecli.case.read import key_path
from brakecli.case.system import system_of
from brakecli.errors import CaseError, RefusedError, key_text
from brakecli.runs.cost import duration_text, steps_and_seconds
from brakecli.runs.limits import MOST_BYTES, check, refuse, within_range
from brakecli.runs.together import TOGETHER, seconds_together
from brakecli.sweeps.early import may_be_early
from brakecli.sweeps.growth import sliding, with_step
from brakecli.sweeps.periodic import common_period, exponent_length
from brakecli.sweeps.plan import Plan, Settings, label
from brakecli.sweeps.tables import Critical

MOST_POINTS = 10_000_000
MOST_SECONDS = 30 * 86400.0

# Seconds and bytes, measured with `make bench-sweep`; rough guesses that tell minutes from days.
_POINT_SECONDS = 5e-3  # of a run, beside its steps
_SAMPLE_SECONDS = 1e-7
_SEARCH_RUNS = 12.0  # for the least sustained value
_SEARCH_GROWTHS = 20.0
_GROWTH_SECONDS = 0.03
_FORCED_RUNS = 1000.0  # over a period of the wheel, in a search that follows a forced motion
_EXPONENT_RUNS = 200.0  # of as long as an exponent needs
_EIGENVALUE_SECONDS = 0.1
_WORKER_BYTES = 1.8e8
_SAMPLE_BYTES = 8.0 * 24
_EARLY_SECONDS = 1e-3  # of a point whose verdict comes before the end of its run
_RECORD_BYTES = 150.0  # of a point in the journal, and in the result
_POINT_BYTES, _FOLLOWED_BYTES = 20.0, 400.0  # in the parent, which writes lines that are followed all at once


@dataclass(frozen=True)
class Estimate:
    """Points, time (s, all workers together), memory and size of the result (bytes) of a sweep."""

    points: int
    workers: int
    seconds: float
    memory: float
    file_size: float
    at_least: bool = False  # motions may have to be looked for many times
    together: int = 1  # points that a task should hold, as they are computed side by side
    refused: tuple[str, ...] = ()  # points that were looked at and will fail, each with its reason

    def sentence(self) -> str:
        """The estimate in words."""
        noun, crew = ("point" if self.points == 1 else "points"), ("worker" if self.workers == 1 else "workers")
        about = "at least" if self.at_least else "about"
        return (
            f"{self.points} {noun} on {self.workers} {crew}: {about} {duration_text(self.seconds)}, "
            f"{self.memory / 1e6:.0f} MB of memory, a file of {self.file_size / 1e6:.2g} MB"
        )


def estimate(plan: Plan, workers: int) -> Estimate:
    """Estimate a sweep by two corners of its grid."""
    times, samples, forced, together, failing = [], 0, 0.0, 1, list[str]()
    for point in sorted({0, plan.points - 1}):
        with _noted(plan, point, failing), within_range():
            system = system_of(plan.case(plan.settings(point)))
            checked = check(system, written=False)
            refuse(checked)
            in_lanes, seconds = seconds_together(system) if plan.followed is None else None, checked.seconds
            if in_lanes is not None:
                seconds = in_lanes
                together = max(1, min(TOGETHER, plan.units // workers))
            seconds += _SAMPLE_SECONDS * system.samples
            times.append(_EARLY_SECONDS - _POINT_SECONDS if may_be_early(system) else seconds)
            samples = max(samples, system.samples)
            if (critical := plan.sweep.critical) is not None and critical.method == "simulation":
                forced = max(forced, _forced_seconds(plan, plan.settings(point), critical))
    run = sum(times) / max(len(times), 1) + _POINT_SECONDS
    each = run
    if (critical := plan.sweep.critical) is not None:
        each += _EIGENVALUE_SECONDS
        if critical.method == "simulation":
            each += _SEARCH_RUNS * run + _SEARCH_GROWTHS * _GROWTH_SECONDS + forced
    records, in_parent = plan.passes * plan.points, _POINT_BYTES if plan.followed is None else _FOLLOWED_BYTES
    return Estimate(
        points=records,
        workers=workers,
        seconds=2.0 + records * each / min(workers, records),
        memory=_WORKER_BYTES * (workers + 1) + _SAMPLE_BYTES * samples * workers * together + in_parent * records,
        file_size=_RECORD_BYTES * records + 1e5,
        at_least=forced > 0.0,
        together=together,
        refused=tuple(failing),
    )


@contextmanager
def _noted(plan: Plan, point: int, failing: list[str]) -> Iterator[None]:
    """Within the block a point that fails when its turn comes is added to a list, with its reason."""
    try:
        yield
    except (CaseError, RefusedError) as error:
        where = ", ".join(f"{key_text(path)} = {label(value)}" for path, value in plan.settings(point).items())
        failing.append(f"point {point}{f' ({where})' if where else ''} will fail: {error}")


def _forced_seconds(plan: Plan, settings: Settings, critical: Critical) -> float:
    """The time (s) of a search that follows the motion which a rough wheel forces; 0 where it forces none."""
    seconds = 0.0
    for value in (critical.lower, critical.upper):
        with suppress(CaseError):
            case = plan.case({**settings, key_path(critical.parameter): value})
            found = sliding(with_step(system_of(case)))
            if found is not None and found.forced:
                period = common_period(found.system)
                length, runs = (period, _FORCED_RUNS) if period else (exponent_length(found), _EXPONENT_RUNS)
                seconds = max(seconds, runs * steps_and_seconds(replace(found.system, duration=length))[1])
    return seconds


def refuse_sweep(found: Estimate, free_bytes: float) -> None:
    """Raise RefusedError where a sweep would be too large."""
    if found.points > MOST_POINTS or found.seconds > MOST_SECONDS:
        raise RefusedError(f"the sweep is too large: {found.sentence()}; take fewer points, or shorter runs")
    if 2.0 * found.file_size > min(MOST_BYTES, free_bytes):  # finished points and the result, side by side
        free = f"{free_bytes / 1e6:.3g} MB are free"
        raise RefusedError(f"the file would be too large, {free}: {found.sentence()}; take fewer points")
    with suppress(ValueError, OSError):  # systems that do not say how much memory they have
        if found.memory > os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"):
            remedy = "take fewer --jobs, or sample less often"
            raise RefusedError(f"the sweep needs more memory than there is: {found.sentence()}; {remedy}")
