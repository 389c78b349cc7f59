"""One point of a sweep: its run, its verdict, its critical parameter, as a record of fixed size."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.of_run import RunVerdict, context, failed
from brakecli.analysis.regime.rules import Verdict, classify
from brakecli.case.case import Case
from brakecli.case.system import set_up
from brakecli.errors import BrakecliError
from brakecli.files import fields
from brakecli.runs.limits import check, refuse, within_range
from brakecli.runs.run import failure_sentence
from brakecli.runs.tolerance import Certificate, certify
from brakecli.solver.history import ArrayHistory
from brakecli.solver.motion import Motion, Work
from brakecli.solver.quantities import Failure
from brakecli.solver.roughness import TWO_PI, wheel_angles
from brakecli.solver.schedules import integral_at
from brakecli.sweeps.critical import search
from brakecli.sweeps.plan import Plan
from brakecli.sweeps.tables import Direction


class Status(StrEnum):
    """How the computation of a point has ended."""

    DONE = "done"
    FAILED = "failed"
    CRASHED = "crashed"


Recall = Callable[[], None]


def record_type(plan: Plan) -> np.dtype[Any]:
    """The record of a point of the sweep."""
    return np.dtype([(field.name, field.kind) for field in fields_of(plan)])


def fields_of(plan: Plan) -> tuple[fields.Field, ...]:
    """What is known of each point of the sweep."""
    return fields.POINT + (fields.CRITICAL if plan.sweep.critical is not None else ())


@dataclass(frozen=True)
class Outcome(RunVerdict):
    """A run in memory, as far as a sweep is interested in it."""

    work: Work
    certificate: Certificate | None  # where the case gives no step
    warnings: tuple[str, ...]
    end: NDArray[np.float64]  # x, y, ẋ, ẏ

    @property
    def status(self) -> Status:
        """How the computation of the point has ended."""
        return Status.DONE if self.work.failure is Failure.NONE else Status.FAILED

    @property
    def reason(self) -> str:
        """Why the regime is as it is."""
        return "; ".join(self.verdict.reasons)

    @property
    def warning(self) -> str:
        """The first warning, empty if there is none."""
        return self.warnings[0] if self.warnings else ""

    @property
    def warning_count(self) -> int:
        """The number of warnings."""
        return len(self.warnings)


def simulate(case: Case) -> Outcome:
    """Run a case in memory; raises RefusedError, and CaseError where it has no start."""
    with within_range():
        setup = set_up(case)
        found = check(setup)
        refuse(setup, found, math.inf)
        certificate = None
        if case.solver.promise is None:
            blocks: list[NDArray[np.float64]] = []
            work, _ = Motion(setup).run(lambda rows: blocks.append(rows.copy()))
            rows = np.concatenate(blocks)
        else:
            motion = certify(case)
            setup, rows, work, certificate = motion.setup, motion.rows, motion.work, motion.certificate
        if not np.isfinite(rows).all():
            raise FloatingPointError("a force overflows")
        verdict = classify(ArrayHistory(setup.timing.interval, rows), context(setup))
    warnings = list(found.warnings)
    if work.failure is not Failure.NONE:
        verdict = failed(verdict, failure_sentence(work))
    elif work.unconverged_steps:
        warnings.append(f"{work.unconverged_steps} of {work.steps} steps did not converge, as the case allows")
    if certificate is not None and not certificate.certified:
        warnings.append(f"solver.tolerance: {certificate.sentence()}")
    return Outcome(setup, verdict, work, certificate, tuple(warnings), rows[-1, :4])


def blank(kind: np.dtype[Any], status: Status, reason: str) -> NDArray[Any]:
    """The record of a point without a result."""
    record = np.zeros(1, kind)
    for name in kind.names or ():
        if kind[name].kind == "f":
            record[name] = math.nan
    record["status"], record["reason"], record["regime"] = status.encode(), _clipped(reason), b"undecided"
    record["excitation"] = b"none"
    return record


def compute(plan: Plan, first: int, count: int) -> NDArray[Any]:
    """The records of some neighbouring points, each computed for itself."""
    return np.concatenate([_point(plan, index) for index in range(first, first + count)])


def follow(plan: Plan, line: int) -> NDArray[Any]:
    """The records of one line of points, in the order of the grid, each started from the end of the one before.

    The wheel goes on turning from one point to the next: its waves keep the phases that they have come to.
    """
    records = []
    start: dict[tuple[str, ...], Any] = {}
    for point in line_points(plan, line):
        kind = record_type(plan)
        try:
            outcome = simulate(plan.case(plan.settings(point) | start))
        except (BrakecliError, FloatingPointError, MemoryError) as error:
            records.append((point, blank(kind, Status.FAILED, _sentence(error))))
            continue
        records.append((point, _filled(kind, outcome)))
        if outcome.work.failure is Failure.NONE:
            start = _continued(outcome)
    return np.concatenate([record for _, record in sorted(records, key=lambda pair: pair[0])])


def line_points(plan: Plan, line: int) -> list[int]:
    """The points of a line along the followed axis, in the order in which the motion passes them.

    With `direction = "both"` the first half of the lines goes up, the second down.
    """
    axis = plan.followed
    assert axis is not None
    shape = plan.shape
    lines = plan.points // shape[axis]
    inner = math.prod(shape[axis + 1 :])
    outer, rest = divmod(line % lines, inner)
    points = [(outer * shape[axis] + place) * inner + rest for place in range(shape[axis])]
    direction = plan.sweep.axis[axis].direction
    down = direction is Direction.DOWN or (direction is Direction.BOTH and line >= lines)
    value = plan.sweep.axis[axis].value
    return sorted(points, key=lambda point: value(plan.places(point)[axis]), reverse=down)


def _continued(outcome: Outcome) -> dict[tuple[str, ...], Any]:
    """The start of a case where another has ended."""
    x, y, v_x, v_y = (float(value) for value in outcome.end)
    start: dict[tuple[str, ...], Any] = {("initial",): {"x": x, "y": y, "vx": v_x, "vy": v_y}}
    wheel = outcome.setup.case.roughness.wheel
    if wheel is not None:
        setup = outcome.setup
        angles = np.zeros(setup.wheel.g.size)
        travel = integral_at(setup.belt, setup.timing.samples * setup.timing.interval, 0.0)
        wheel_angles(setup.wheel, *travel, angles)
        phases = iter(angles)  # a wave of no amplitude has none
        turned = [math.degrees(next(phases) % TWO_PI) if g else 0.0 for g in wheel.amplitudes]
        start["roughness", "wheel", "phases_deg"] = turned
    return start


def _point(plan: Plan, point: int) -> NDArray[Any]:
    kind = record_type(plan)
    settings = plan.settings(point)
    try:
        record = _filled(kind, simulate(plan.case(settings)))
        critical = plan.sweep.critical
        if critical is not None:
            from brakecli.case.read import key_path

            path = key_path(critical.parameter)
            with within_range():
                found = search(critical, lambda value: plan.case({**settings, path: value}), _verdict)
            _fill(record, fields.values(fields.CRITICAL, found))
    except (BrakecliError, FloatingPointError, MemoryError) as error:
        return blank(kind, Status.FAILED, _sentence(error))
    return record


def _verdict(case: Case) -> Verdict | None:
    try:
        outcome = simulate(case)
    except BrakecliError:
        return None
    return outcome.verdict if outcome.work.failure is Failure.NONE else None


def _filled(kind: np.dtype[Any], outcome: Outcome) -> NDArray[Any]:
    record = blank(kind, outcome.status, outcome.reason)
    _fill(record, fields.values(fields.POINT, outcome))
    return record


def _fill(record: NDArray[Any], values: Mapping[str, Any]) -> None:
    for name, value in values.items():
        record[name] = _clipped(value) if isinstance(value, str) else math.nan if value is None else value


def _sentence(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return "out of memory; sample less often, or reduce contact.nodes"
    return "; ".join(str(error).splitlines())


def _clipped(text: str) -> bytes:
    """As much of a text as a record holds, in whole characters."""
    return text.encode()[: int(fields.SENTENCE[1:])].decode(errors="ignore").encode()
