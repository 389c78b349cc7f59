"""One point of a sweep: its run, its verdict, its critical parameter, as a record of fixed size."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.branches.line import Line
from brakecli.analysis.stability.linear import Theory
from brakecli.case.case import Case
from brakecli.case.restart import initial_at
from brakecli.errors import BrakecliError
from brakecli.results import fields
from brakecli.results.field import values_of
from brakecli.solver.integrate import Motion
from brakecli.solver.roughness import TWO_PI, turned
from brakecli.solver.schedules import integral_at
from brakecli.studies.runs.limits import Check, within_range
from brakecli.studies.runs.settled import Judged
from brakecli.studies.runs.together import TOGETHER, certify_together
from brakecli.studies.sweeps.plan import Plan, Settings
from brakecli.studies.sweeps.record import Status, blank, filled, record_type
from brakecli.studies.sweeps.simulate import PointRun, checked, judged, judged_together, may_suffice

OUT_OF_MEMORY = "out of memory; sample less often, or reduce contact.nodes"
FAULTS = (BrakecliError, FloatingPointError, MemoryError)


def compute(plan: Plan, first: int, count: int) -> NDArray[np.void]:
    """The records of some neighbouring units; those of a line stand in the order of the grid.

    Points that do not follow one another are computed side by side as far as they can be, which changes none of
    their numbers.
    """
    if plan.followed is not None:
        return np.concatenate([_line(plan, unit) for unit in range(first, first + count)])
    records = np.zeros(count, record_type(plan))
    for start in range(first, first + count, TOGETHER):
        end = min(start + TOGETHER, first + count)
        points = [begun(plan, plan.settings(number)) for number in range(start, end)]
        ready = [point for point in points if isinstance(point, Begun)]
        systems = [point.check.system for point in ready]
        with within_range():
            judgements = judged_together(systems, certify_together(systems, may_suffice))
        judgement_of = dict(zip(map(id, ready), judgements, strict=True))
        for index, point in enumerate(points, start - first):
            record, _ = computed(plan, point, *judgement_of.get(id(point), ()))
            records[index] = record[0]
    return records


def _line(plan: Plan, unit: int) -> NDArray[np.void]:
    """The records of a line, in the order of the grid."""
    points = line_points(plan, unit)
    records = np.zeros(len(points), record_type(plan))
    places = {point: index for index, point in enumerate(sorted(points))}
    for point, record in zip(points, followed(plan, points), strict=True):
        records[places[point]] = record
    return records


def followed(plan: Plan, points: Sequence[int]) -> Iterator[NDArray[np.void]]:
    """The records of points, each of which starts from the end of the one before.

    The wheel goes on turning: its waves keep the phases that they have come to.
    """
    start = Settings()
    outcome = None
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
    followed = plan.sweep.axis[plan.followed]
    inner = math.prod(plan.shape[plan.followed + 1 :])
    lines = plan.points // followed.size
    outer, offset = divmod(line % lines, inner)
    down = followed.direction == "down" or (followed.direction == "both" and line >= lines)
    places = sorted(range(followed.size), key=followed.value, reverse=down)
    return [(outer * followed.size + index) * inner + offset for index in places]


def next_start(outcome: PointRun) -> Settings:
    """The start of a case where another has ended.

    Its waves go on with the phases that they have come to, also where the next case has other wavelengths.
    """
    system = outcome.motion.system
    wheel = outcome.case.roughness.wheel
    state = outcome.motion.rows[-1, :4]
    case = outcome.case
    end = initial_at(case.wheel, case.initial.wheel_angle, system.sampled_duration, state.tolist())
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
    plan: Plan, point: Begun | Exception, judgement: Judged[Motion] | None = None, theory: Theory | None = None
) -> tuple[NDArray[np.void], PointRun | None]:
    """The record of a point and its run, which is None where it was not possible."""
    try:
        if isinstance(point, Exception):
            raise point
        outcome = judged(point.case, point.check, judgement, theory, whole=False)
        values = values_of(fields.POINT, outcome)
        if (critical := plan.sweep.critical) is not None:
            from brakecli.studies.sweeps.critical import search  # only searches wait for the kernels of branches

            with within_range():
                result = search(critical, Line(point.case, [critical.parameter], critical.lower, critical.upper))
            values |= values_of(fields.CRITICAL, result)
    except FAULTS as error:
        reason = OUT_OF_MEMORY if isinstance(error, MemoryError) else "; ".join(str(error).splitlines())
        return blank(record_type(plan), Status.FAILED, reason), None
    return filled(record_type(plan), values), outcome
