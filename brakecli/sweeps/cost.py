"""What a sweep will cost, before anything is computed."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from brakecli.case.read import key_path
from brakecli.case.system import system_of
from brakecli.errors import CaseError, RefusedError, key_text
from brakecli.faces import argument
from brakecli.runs.cost import duration_text
from brakecli.runs.limits import FILE_BYTES, MOST_BYTES, check, refuse, within_range
from brakecli.runs.plausible import implausible
from brakecli.solver.period import common_period
from brakecli.sweeps.early import may_be_early
from brakecli.sweeps.pilot import UNEVEN, WORKER_SECONDS, Pilot
from brakecli.sweeps.plan import Plan, Settings, label
from brakecli.sweeps.tables import Critical

MOST_POINTS = 10_000_000
MOST_SECONDS = 30 * 86400.0

# Of a search by simulation on surfaces that force a motion or whose runs go to their end; rough guesses that tell
# minutes from days.
_SEARCH_RUNS = 12.0  # for the least sustained value
_SMOOTH_SECONDS = 0.15  # of the branches on a smooth wheel
_FORCED_PERIODS = 500.0  # over which motions are carried that a rough wheel forces
_EXPONENTS = 50.0  # where they have no period
_STEP_SECONDS = 1.1e-5  # of a motion on rough pads, with its derivative
# Bytes, measured with `make bench-sweep`.
_WORKER_BYTES = 1.8e8
_SAMPLE_BYTES = 8.0 * 24
_RECORD_BYTES = 150.0  # of a point in the journal, and in the result
# in the parent, which writes lines that are followed all at once
_POINT_BYTES = 20.0
_FOLLOWED_BYTES = 400.0


@dataclass(frozen=True)
class Estimate:
    """Points, time (s, all workers together), memory and size of the result (bytes) of a sweep.

    Without workers, the process that asks computes the points itself.
    """

    points: int
    workers: int
    seconds: float
    memory: float
    file_size: float
    at_least: bool = False  # points that were not computed, or their searches, may well take longer
    together: int = 1  # points that a task should hold, as they are computed side by side
    refused: tuple[str, ...] = ()  # points that were looked at and will fail, each with its reason
    implausible: tuple[str, ...] = ()  # warnings of those points that a number is out of the range of brakes

    def sentence(self) -> str:
        """The estimate in words."""
        noun = "point" if self.points == 1 else "points"
        crew = "worker" if self.workers == 1 else "workers"
        about = "at least" if self.at_least else "about"
        on = f" on {self.workers} {crew}" * bool(self.workers)
        return (
            f"{self.points} {noun}{on}: {about} {duration_text(self.seconds)}, "
            f"{self.memory / 1e6:.0f} MB of memory, a file of {self.file_size / 1e6:.2g} MB"
        )


def estimate(plan: Plan, workers: int, *, spare: bool = False) -> Estimate:
    """Estimate a sweep by computing some of its points; the first and the last one are looked at.

    `spare`: there are no workers where they would take longer to start than the points take. Searches are computed
    with them where verdicts come early, or eigenvalues answer; others take too long, and are guessed.
    """
    samples = 0
    tables = 0.0
    forced = 0.0
    dearest = 0.0
    early = True
    failing = list[str]()
    strange = dict[str, None]()  # each said once
    critical = plan.sweep.critical
    by_simulation = critical is not None and critical.method == "simulation"
    for point in sorted({0, plan.points - 1}):
        with _noted(plan, point, failing), within_range():
            system = system_of(plan.case(plan.settings(point)))
            strange |= dict.fromkeys(implausible(system))
            refuse(found := check(system))
            dearest = max(dearest, found.seconds)
            samples = max(samples, system.samples)
            early = early and may_be_early(system)
            tables = max(tables, system.table_bytes)
            if critical is not None and by_simulation:
                forced = max(forced, _forced_seconds(plan, plan.settings(point), critical))
    guessed = by_simulation and (forced > 0.0 or not early)
    pilot = Pilot(plan, workers, with_searches=not guessed)
    pilot.look()
    each = pilot.seconds
    samples = max(samples, pilot.samples)
    at_least = guessed or pilot.at_least or dearest > UNEVEN * pilot.guess
    if guessed:
        each += _SEARCH_RUNS * each + _SMOOTH_SECONDS + forced
    records = plan.passes * plan.points
    in_parent = _POINT_BYTES if plan.followed is None else _FOLLOWED_BYTES
    if spare and not at_least and plan.units * plan.unit_length * each < WORKER_SECONDS:
        workers = pilot.workers = 0
    held = _SAMPLE_BYTES * samples * max(workers, 1) * pilot.together
    return Estimate(
        points=records,
        workers=workers,
        seconds=pilot.sweep_seconds(each),
        memory=(_WORKER_BYTES + tables) * (workers + 1) + held + in_parent * records,
        file_size=_RECORD_BYTES * records + FILE_BYTES,
        at_least=at_least,
        together=pilot.together,
        refused=tuple(failing),
        implausible=tuple(strange),
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
    """The time (s) of a search along what a rough wheel forces; 0 where it forces nothing."""
    from brakecli.solver.motion.rough import default_steps  # only searches wait for its kernels
    from brakecli.sweeps.lyapunov import exponent_length

    seconds = 0.0
    for value in (critical.lower, critical.upper):
        with suppress(CaseError):
            system = system_of(plan.case({**settings, key_path(critical.parameter): value}))
            if system.wheel.g.size and system.belt_speed:
                period = common_period(system)
                span, runs = (period, _FORCED_PERIODS) if period else (exponent_length(system), _EXPONENTS)
                seconds = max(seconds, runs * default_steps(system, span) * _STEP_SECONDS)
    return seconds


def refuse_sweep(found: Estimate, free_bytes: float) -> None:
    """Raise RefusedError where a sweep would be too large."""
    if found.points > MOST_POINTS or found.seconds > MOST_SECONDS:
        raise RefusedError(f"the sweep is too large: {found.sentence()}; take fewer points, or shorter runs")
    if 2.0 * found.file_size > min(MOST_BYTES, free_bytes):  # finished points and the result, side by side
        free = f"{free_bytes / 1e6:.3g} MB are free"
        remedy = "free some space, or take fewer points"
        raise RefusedError(f"the file would be too large, {free}: {found.sentence()}; {remedy}")
    with suppress(ValueError, OSError):  # systems that do not say how much memory they have
        if found.memory > os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"):
            remedy = f"take fewer {argument('jobs')}, or sample less often"
            raise RefusedError(f"the sweep needs more memory than there is: {found.sentence()}; {remedy}")
