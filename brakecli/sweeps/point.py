"""One point of a sweep: its run, its verdict, its critical parameter, as a record of fixed size."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.of_run import braking_torque, context, failed
from brakecli.analysis.regime.rules import Verdict, classify
from brakecli.case.case import Case
from brakecli.case.read import key_path
from brakecli.case.system import system_of
from brakecli.errors import BrakecliError
from brakecli.runs.limits import check, refuse, within_range
from brakecli.runs.tolerance import certify
from brakecli.solver.history import ArrayHistory
from brakecli.solver.motion import Motion, solve
from brakecli.solver.roughness import TWO_PI, wheel_angles
from brakecli.solver.schedules import integral_at
from brakecli.sweeps.critical import search
from brakecli.sweeps.plan import Plan, Settings
from brakecli.sweeps.tables import Direction


class Status(StrEnum):
    """How the computation of a point has ended."""

    DONE = "done"
    FAILED = "failed"
    CRASHED = "crashed"


class Field(NamedTuple):
    """A variable of the result: its type in a record, its unit, and what it is. A float may be missing: NaN."""

    kind: str
    units: str
    long_name: str


TEXT = "S240"
FIELDS = {
    "status": Field("S8", "", "how the computation of the point has ended"),
    "reason": Field(TEXT, "", "why the regime is as it is, or why the point failed"),
    "warning": Field(TEXT, "", "first warning of the run, empty if there is none"),
    "warning_count": Field("i8", "1", "number of warnings"),
    "regime": Field("S16", "", "regime of the motion"),
    "excitation": Field("S16", "", "where the energy of a sustained motion comes from"),
    "frequency": Field("f8", "Hz", "fundamental frequency of vx of a sustained motion"),
    "amplitude": Field("f8", "m", "half of peak to peak of x, settled part"),
    "stick_fraction": Field("f8", "1", "part of the time in stick, settled part"),
    "contact_loss_fraction": Field("f8", "1", "part of the time without contact, settled part"),
    "mean_friction_force": Field("f8", "N", "mean friction force on the shoe, settled part"),
    "braking_torque": Field("f8", "N m", "mean torque of the friction force, settled part"),
    "settled": Field("i8", "1", "whether a settled part was found (0, 1)"),
    "settled_from": Field("f8", "s", "begin of the settled part"),
    "steps": Field("i8", "1", "time steps"),
    "contact_evaluations": Field("i8", "1", "evaluations of the contact force"),
    "unconverged_steps": Field("i8", "1", "steps that did not converge"),
    "estimated_error": Field("f8", "1", "relative error of the histories, where a tolerance was given"),
}
CRITICAL_FIELDS = {
    "critical_status": Field("S24", "", "what the search for the critical value has come to"),
    "critical": Field("f8", "", "critical value: steady sliding loses its stability there"),
    "critical_lower": Field("f8", "", "lower end of the bracket of the critical value"),
    "critical_upper": Field("f8", "", "upper end of the bracket of the critical value"),
    "critical_error": Field("f8", "", "error bar of the critical value, bias of the scheme included"),
    "critical_bias": Field("f8", "", "critical value of the scheme at its step less the exact one"),
    "critical_eigenvalue": Field("f8", "", "critical value by eigenvalues"),
    "critical_sustained": Field("f8", "", "least value at which vibration lasts from the case's own start"),
    "sustained_status": Field("S24", "", "what the search for the least sustained value has come to"),
}


def record_type(plan: Plan) -> np.dtype[Any]:
    """The record of a point of the sweep."""
    fields = FIELDS | (CRITICAL_FIELDS if plan.sweep.critical is not None else {})
    return np.dtype([(name, field.kind) for name, field in fields.items()])


@dataclass(frozen=True)
class Outcome:
    """A run in memory, as far as a sweep is interested in it."""

    case: Case
    motion: Motion
    verdict: Verdict
    warnings: tuple[str, ...]
    estimated_error: float  # of the histories, relative; NaN where the case gives a step


def simulate(case: Case) -> Outcome:
    """Run a case in memory; raises RefusedError, and CaseError where it has no start."""
    with within_range():
        system = system_of(case)
        found = check(system)
        refuse(system, found, math.inf)
        certificate = None
        if system.method.step is not None:
            motion = solve(system)
        else:
            certified = certify(system)
            motion, certificate = certified.motion, certified.certificate
        if not np.isfinite(motion.rows).all():
            raise FloatingPointError("a force overflows")
        verdict = classify(ArrayHistory(system.interval, motion.rows), context(motion.system))
    warnings, work = list(found.warnings), motion.work
    if work.failure_sentence is not None:
        verdict = failed(verdict, work.failure_sentence)
    elif work.unconverged_steps:
        warnings.append(f"{work.unconverged_steps} of {work.steps} steps did not converge, as the case allows")
    if certificate is not None and not certificate.certified:
        warnings.append(f"solver.tolerance: {certificate.sentence()}")
    error = math.nan if certificate is None else certificate.estimated_error
    return Outcome(case, motion, verdict, tuple(warnings), error)


def blank(kind: np.dtype[Any], status: Status, reason: str) -> NDArray[Any]:
    """The record of a point without a result."""
    record = np.zeros(1, kind)
    for name in kind.names or ():
        if kind[name].kind == "f":
            record[name] = math.nan
    for name, text in {"status": status, "reason": reason, "regime": "undecided", "excitation": "none"}.items():
        record[name] = _clipped(text)
    return record


def compute(plan: Plan, first: int, count: int) -> NDArray[Any]:
    """The records of some neighbouring points, each computed for itself."""
    return np.concatenate([_record(plan, point, {})[0] for point in range(first, first + count)])


def follow(plan: Plan, line: int) -> NDArray[Any]:
    """The records of one line of points, in the order of the grid, each started from the end of the one before.

    The wheel goes on turning from one point to the next: its waves keep the phases that they have come to.
    """
    records: dict[int, NDArray[Any]] = {}
    start: Settings = {}
    for point in line_points(plan, line):
        records[point], outcome = _record(plan, point, start)
        if outcome is not None and not outcome.motion.work.failed:
            start = next_start(outcome)
    return np.concatenate([records[point] for point in sorted(records)])


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


def next_start(outcome: Outcome) -> Settings:
    """The start of a case where another has ended."""
    x, y, v_x, v_y = (float(value) for value in outcome.motion.rows[-1, :4])
    start: dict[tuple[str, ...], Any] = {("initial",): {"x": x, "y": y, "vx": v_x, "vy": v_y}}
    wheel = outcome.case.roughness.wheel
    if wheel is not None:
        system = outcome.motion.system
        angles = np.zeros(system.wheel.g.size)
        wheel_angles(system.wheel, *integral_at(system.belt, system.sampled_duration, 0.0), angles)
        phases = iter(angles)  # a wave without amplitude has no phase
        turned = [math.degrees(next(phases) % TWO_PI) if g else 0.0 for g in wheel.amplitudes]
        start["roughness", "wheel", "phases_deg"] = turned
    return start


def verdict_of(case: Case) -> Verdict | None:
    """The verdict on a run in memory; None where it fails."""
    try:
        outcome = simulate(case)
    except BrakecliError:
        return None
    return None if outcome.motion.work.failed else outcome.verdict


def _record(plan: Plan, point: int, start: Settings) -> tuple[NDArray[Any], Outcome | None]:
    """The record of a point and its run, which is None where it was not possible."""
    settings = {**plan.settings(point), **start}
    try:
        outcome = simulate(plan.case(settings))
        record = _filled(record_type(plan), outcome)
        if (critical := plan.sweep.critical) is not None:
            path = key_path(critical.parameter)
            with within_range():
                found = search(critical, lambda value: plan.case({**settings, path: value}), verdict_of)
            for name, value in zip(CRITICAL_FIELDS, found, strict=True):
                record[name] = math.nan if value is None else value
    except (BrakecliError, FloatingPointError, MemoryError) as error:
        return blank(record_type(plan), Status.FAILED, _sentence(error)), None
    return record, outcome


def _filled(kind: np.dtype[Any], outcome: Outcome) -> NDArray[Any]:
    verdict, system, work = outcome.verdict, outcome.motion.system, outcome.motion.work
    record = blank(kind, Status.FAILED if work.failed else Status.DONE, "; ".join(verdict.reasons))
    values: dict[str, Any] = {
        **vars(verdict),
        **vars(work),
        "frequency": math.nan if verdict.frequency is None else verdict.frequency,
        "braking_torque": braking_torque(verdict, system),
        "settled_from": verdict.settled_from * system.interval,
        "warning": _clipped(outcome.warnings[0]) if outcome.warnings else b"",
        "warning_count": len(outcome.warnings),
        "estimated_error": outcome.estimated_error,
    }
    for name in FIELDS.keys() - {"status", "reason"}:
        record[name] = values[name]
    return record


def _sentence(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return "out of memory; sample less often, or reduce contact.nodes"
    return "; ".join(str(error).splitlines())


def _clipped(text: str) -> bytes:
    """As much of a text as a record holds, in whole characters."""
    return text.encode()[: int(TEXT[1:])].decode(errors="ignore").encode()
