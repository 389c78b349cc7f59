"""One point of a sweep: its run, its verdict, its critical parameter, as a record of fixed size."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.stability.linear import Theory, theories_of
from brakecli.branches.line import Line
from brakecli.case.case import Case
from brakecli.case.read import key_path
from brakecli.case.restart import initial_at
from brakecli.case.system import system_of
from brakecli.errors import BrakecliError
from brakecli.files import fields
from brakecli.files.field import values_of
from brakecli.files.valid import LARGEST
from brakecli.runs.certificate import Certificate, Certified
from brakecli.runs.judge import asked, in_memory, motion_of
from brakecli.runs.limits import Check, check, refuse, within_range
from brakecli.runs.settled import Judged, settled
from brakecli.runs.together import TOGETHER, certify_together
from brakecli.solver.alike import at_once
from brakecli.solver.motion import Motion
from brakecli.solver.roughness import TWO_PI, turned
from brakecli.solver.schedules import integral_at
from brakecli.solver.system import System
from brakecli.sweeps.early import Ending, early
from brakecli.sweeps.plan import Plan, Settings

OUT_OF_MEMORY = "out of memory; sample less often, or reduce contact.nodes"
_UNTOLD = ("torque_variation", "settled")  # no number of a sweep, and a column of its own
FAULTS = (BrakecliError, FloatingPointError, MemoryError)


class Status(StrEnum):
    """How the computation of a point has ended."""

    DONE = "done"
    FAILED = "failed"
    CRASHED = "crashed"


_KNOWN: dict[str, type[StrEnum]] = {"status": Status, "regime": Regime, "excitation": Excitation}


@lru_cache(maxsize=4)
def record_type(plan: Plan) -> np.dtype[Any]:
    """The record of a point of the sweep."""
    return np.dtype([(field.name, field.kind) for field in plan.fields])


def unsound(plan: Plan, records: bytes, units: int) -> str:
    """Why these are not the records of so many units, wherever they come from; empty where they are."""
    kind, size = record_type(plan), len(records)
    if size != units * plan.unit_length * kind.itemsize:
        return f"{size} bytes in place of {units * plan.unit_length} records of {kind.itemsize}"
    found = np.frombuffer(records, kind)
    return next((f"a {name} that no point has" for name in kind.names or () if not _fits(name, found[name])), "")


def _fits(name: str, values: NDArray[Any]) -> bool:
    """Whether points may have these values; numbers may be missing, counts not."""
    if values.dtype.kind != "S":
        return bool((values >= 0).all()) if values.dtype.kind == "i" else not (np.abs(values) > LARGEST).any()
    with suppress(UnicodeDecodeError):
        texts = {each.decode() for each in np.unique(values).tolist()}
        return texts <= {*_KNOWN.get(name, texts)}
    return False


@dataclass(frozen=True)
class PointRun:
    """A run in memory, as far as a sweep is interested in it. `fields.POINT` says where each number is."""

    verdict: Verdict
    case: Case
    motion: Motion | Ending
    certificate: Certificate | None  # where the case gives no step
    status: Status
    reason: str
    warning: str  # the first one
    warning_count: int


def simulate(case: Case, *, whole: bool = True) -> PointRun:
    """Run a case in memory, to its end or, unless `whole`, only until what a sweep keeps is known.

    Raises RefusedError, and CaseError where it has no start.
    """
    return judged(case, checked(case), None, whole=whole)


def checked(case: Case) -> Check:
    """What is known of a case before it runs; raises RefusedError where it should not."""
    with within_range():
        found = check(asked(system_of(case)))
        refuse(found, timed=False)  # the same sweep gives the same bytes
    return found


def judged(
    case: Case, found: Check, known: Judged[Motion] | None, theory: Theory | None = None, *, whole: bool
) -> PointRun:
    """The end of `simulate`, by a motion that is known already with its verdict, or by one that is computed."""

    def run(part: System) -> Judged[Motion | Ending]:
        if known and part is found.system:
            return known
        if not whole and (ended := early(part, theory)) is not None:
            return ended
        motion, certificate = motion_of(part)
        (verdict,) = classify([in_memory(motion, part, theory)], in_full=whole)
        return Judged(verdict, motion, certificate)

    with within_range():
        ended = settled(found.system, run)
    verdict, motion, certificate = ended.judged
    notes = [note for about, note in verdict.notes.items() if about not in _UNTOLD]
    warnings, work = [*found.warnings, *ended.warnings, *notes], motion.work
    if work.unconverged_steps and not work.failed:
        warnings.append(f"{work.unconverged_steps} of {work.steps} steps did not converge, as the case allows")
    if certificate is not None and not certificate.certified:
        warnings.append(f"solver.tolerance: {certificate.sentence()}")
    status, reason = Status.FAILED if work.failed else Status.DONE, "; ".join(verdict.reasons)
    first = next(iter(warnings), "")
    return PointRun(verdict, case, motion, certificate, status, reason, first, len(warnings))


def blank(kind: np.dtype[Any], status: Status, reason: str) -> NDArray[Any]:
    """The record of a point without a result."""
    return _filled(kind, {"status": status, "reason": reason, "regime": "undecided", "excitation": "none"})


def compute(plan: Plan, first: int, count: int) -> NDArray[Any]:
    """The records of some neighbouring units; those of a line stand in the order of the grid.

    Points that do not follow one another are computed side by side as far as they can be, which changes none of
    their numbers.
    """
    if plan.followed is not None:
        return np.concatenate([_line(plan, unit) for unit in range(first, first + count)])
    records = np.zeros(count, record_type(plan))
    for start in range(first, first + count, TOGETHER):
        points = [begun(plan, plan.settings(each)) for each in range(start, min(start + TOGETHER, first + count))]
        ready = [each for each in points if isinstance(each, Begun)]
        systems = [each.check.system for each in ready]
        with within_range():
            found = judged_together(systems, certify_together(systems))
        known = dict(zip(map(id, ready), found, strict=True))
        for place, each in enumerate(points, start - first):
            record, _ = computed(plan, each, *known.get(id(each), ()))
            records[place] = record[0]
    return records


def judged_together(
    systems: Sequence[System], certified: Sequence[Certified | None]
) -> list[tuple[Judged[Motion] | None, Theory]]:
    """The motions that are certified, with their verdicts, and all theories; None where a point has to run alone.

    No number of one depends on the others, and numbers that no brake has concern none of them.
    """
    theories = theories_of(systems)

    def verdicts(places: list[int]) -> list[Judged[Motion] | None]:
        known = [each for i in places if (each := certified[i])]
        try:
            given = zip(known, places, strict=True)
            found = classify([in_memory(each.motion, systems[i], theories[i]) for each, i in given], in_full=False)
        except (ArithmeticError, np.linalg.LinAlgError, BrakecliError):
            return [None] if len(places) == 1 else [each for i in places for each in verdicts([i])]
        return [Judged(verdict, *each) for verdict, each in zip(found, known, strict=True)]

    return [*zip(at_once([each and True for each in certified], verdicts), theories, strict=True)]


def _line(plan: Plan, unit: int) -> NDArray[Any]:
    """The records of a line, in the order of the grid."""
    points = line_points(plan, unit)
    found = np.zeros(len(points), record_type(plan))
    places = {point: place for place, point in enumerate(sorted(points))}
    for point, record in zip(points, followed(plan, points), strict=True):
        found[places[point]] = record
    return found


def followed(plan: Plan, points: Sequence[int]) -> Iterator[NDArray[Any]]:
    """The records of points, each of which starts from the end of the one before.

    The wheel goes on turning: its waves keep the phases that they have come to.
    """
    start, outcome = Settings(), None
    for point in points:
        if outcome is not None and not outcome.motion.work.failed:
            start = next_start(outcome)
        record, outcome = computed(plan, begun(plan, {**plan.settings(point), **start}))
        yield record


def line_points(plan: Plan, line: int) -> list[int]:
    """The points of a unit: of a line along the followed axis, in the order in which the motion passes them.

    With `direction = "both"` the first half of the lines goes up, the second down.
    """
    if plan.followed is None:
        return [line]
    followed, inner = plan.sweep.axis[plan.followed], math.prod(plan.shape[plan.followed + 1 :])
    lines = plan.points // followed.size
    outer, rest = divmod(line % lines, inner)
    down = followed.direction == "down" or (followed.direction == "both" and line >= lines)
    places = sorted(range(followed.size), key=followed.value, reverse=down)
    return [(outer * followed.size + place) * inner + rest for place in places]


def next_start(outcome: PointRun) -> Settings:
    """The start of a case where another has ended.

    Its waves go on with the phases that they have come to, also where the next case has other wavelengths.
    """
    system, wheel, state = outcome.motion.system, outcome.case.roughness.wheel, outcome.motion.rows[-1, :4]
    end = initial_at(outcome.case, system, system.sampled_duration, state.tolist())
    start: Settings = {("initial",): end}
    if wheel is not None:
        end["wheel_angle"] = 0.0
        phases = iter(turned(system.wheel, *integral_at(system.belt, system.sampled_duration, 0.0)).phase)
        sines = wheel.sines()  # a wave without amplitude has no phase in a system
        degrees = [math.degrees(next(phases) % TWO_PI) if g else 0.0 for g in sines["amplitudes"]]
        if wheel.profile is None:
            start["roughness", "wheel", "phases_deg"] = degrees
        else:
            start["roughness", "wheel"] = {**sines, "phases_deg": degrees}
    return start


def verdict_of(case: Case) -> Verdict | None:
    """The verdict on a run in memory, as soon as it is known; None where the run fails."""
    with suppress(BrakecliError):
        outcome = simulate(case, whole=False)
        return None if outcome.motion.work.failed else outcome.verdict
    return None


class Begun(NamedTuple):
    """A point that may be computed: what is set there, its case, and what is known of it."""

    settings: Settings
    case: Case
    check: Check


def begun(plan: Plan, settings: Settings) -> Begun | Exception:
    """A point, or why it cannot be computed."""
    try:
        case = plan.case(settings)
        return Begun(settings, case, checked(case))
    except FAULTS as error:
        return error


def computed(
    plan: Plan, point: Begun | Exception, known: Judged[Motion] | None = None, theory: Theory | None = None
) -> tuple[NDArray[Any], PointRun | None]:
    """The record of a point and its run, which is None where it was not possible."""
    try:
        if isinstance(point, Exception):
            raise point
        outcome = judged(point.case, point.check, known, theory, whole=False)
        values = values_of(fields.POINT, outcome)
        if (critical := plan.sweep.critical) is not None:
            from brakecli.sweeps.critical import search  # only searches wait for the kernels of branches

            path = key_path(critical.parameter)
            with within_range():
                own = Line(point.case, [critical.parameter], critical.lower, critical.upper).own
                found = search(critical, lambda value: plan.case({**point.settings, path: value}), verdict_of, own)
            values |= values_of(fields.CRITICAL, found)
        if large := [name for name, each in values.items() if isinstance(each, float) and abs(each) > LARGEST]:
            raise FloatingPointError(f"{large[0]} is too large for a result")
    except FAULTS as error:
        reason = OUT_OF_MEMORY if isinstance(error, MemoryError) else "; ".join(str(error).splitlines())
        return blank(record_type(plan), Status.FAILED, reason), None
    return _filled(record_type(plan), values), outcome


def _filled(kind: np.dtype[Any], values: Mapping[str, Any]) -> NDArray[Any]:
    """A record of some values; missing numbers are NaN."""
    return np.array([tuple(_fitted(kind[name], values.get(name)) for name in kind.names or ())], kind)


def _fitted(kind: np.dtype[Any], value: Any) -> Any:
    """A value as its place in a record takes it."""
    if isinstance(value, str):  # as many whole characters as fit
        value = value.encode()
        return value if len(value) <= kind.itemsize else value[: kind.itemsize].decode(errors="ignore").encode()
    if isinstance(value, list):  # as many as there are, the rest missing
        return np.resize(value + [math.nan] * kind.shape[0], kind.shape)
    if value is None:
        return b"" if kind.kind == "S" else math.nan if kind.base.kind == "f" else 0
    return value
