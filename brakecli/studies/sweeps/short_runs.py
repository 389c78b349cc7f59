"""Where a motion is followed through runs that are too short: its loop then differs from that of long ones."""

import math
from collections.abc import Iterator

import numpy as np

from brakecli.analysis.regime.answers import FADED, QUARTER
from brakecli.analysis.stability.advice import rounded
from brakecli.analysis.stability.certain import EPSILON
from brakecli.analysis.stability.linear import Linear, linear_theory
from brakecli.analysis.stability.modes import is_undamped
from brakecli.case.system import system_of
from brakecli.errors import BrakecliError
from brakecli.studies.runs.limits import within_range
from brakecli.studies.sweeps.journal import Journal
from brakecli.studies.sweeps.plan import Plan, label


def on_short_runs(journal: Journal) -> Iterator[str]:
    """Where runs of a followed motion are too short, and how long they should be; on smooth pads.

    A point begins where the one before has ended. Its loop is that of the branches if every motion comes to what
    attracts it within its run. Where sliding grows at a rate s > 0, by eigenvalues, it attracts nothing. A
    disturbance grows like exp(s t) as long as the motion is linear, that is, until it reaches the speed of the
    wheel or opens the pad. A motion smaller than that is not a vibration yet: it begins later than it should, or
    never. One disturbance is there however long the runs are: from point to point steady sliding moves by e. From
    e to the size A that ends the linear motion it takes ln(A/e) / s.

    A regime that is decided has been shown by its run. An undecided one in a longer run has another reason.
    """
    plan = journal.plan
    if plan.followed is None or not plan.sweep.axis[plan.followed].numeric:
        return
    undecided = (journal.column("regime") == b"undecided") & (journal.column("status") == b"done")
    amplitudes = journal.column("amplitude").ravel()
    growing = list[tuple[float, float]]()
    for index in np.flatnonzero(undecided.ravel())[:1000].tolist():  # some milliseconds each
        point = index % plan.points
        theory = _theory(plan, point)
        if theory is None:
            continue
        rate = theory.mode.growth
        value = plan.sweep.axis[plan.followed].value(plan.places(point)[plan.followed])
        if rate > 0.0 and amplitudes[index] < _reach(theory):
            before = _theory(plan, _before(plan, point, down=index >= plan.points))
            seconds = _growing(theory, before or theory) + FADED / rate
            growing.append((value, QUARTER * seconds))
    if growing:
        late = "sliding is unstable, but the runs end before a vibration has grown"
        loop = "the loop seems to begin too late, or not at all"
        yield f"{_where(plan, growing)} {late}: {loop}; {_remedy(growing)}"


def _theory(plan: Plan, point: int) -> Linear | None:
    """Small motions about steady sliding at a point; None where they are not known."""
    try:
        with within_range():
            system = system_of(plan.case(plan.settings(point)))
            applies = system.smooth and system.steady and not is_undamped(system.coefficients)
            theory = linear_theory(system, system.belt_speed) if applies else None
    except BrakecliError:
        return None
    return theory if theory and theory.direction and theory.slip is not None else None


def _before(plan: Plan, point: int, *, down: bool) -> int:
    """The point from which a point is reached; of the first point of a line, the second."""
    assert plan.followed is not None
    axis = plan.sweep.axis[plan.followed]
    index = plan.places(point)[plan.followed]
    order = sorted(range(axis.size), key=axis.value, reverse=down)
    k = order.index(index)
    other = order[k - 1] if k else order[min(1, axis.size - 1)]
    return point + (other - index) * math.prod(plan.shape[plan.followed + 1 :])


def _reach(theory: Linear) -> float:
    """Half of peak to peak of x (m) with which the mode that grows reaches the wheel's speed, or opens the pad."""
    x, y, v_x, _ = np.abs(theory.vectors[:, int(np.argmax(theory.values.real))])
    limits = ((abs(theory.belt), v_x), (theory.depth, y))
    bounds = [limit / component for limit, component in limits if component > 0.0]
    return float(x) * min(bounds, default=math.inf)


def _growing(theory: Linear, before: Linear) -> float:
    """Seconds in which what steady sliding has moved by grows until the motion is no longer linear.

    Where it has not moved, rounding is what grows.
    """
    shift = before.rest - theory.rest
    least = EPSILON * np.abs(theory.rest)
    shift = np.where(np.abs(shift) < least, least, shift)
    return theory.seconds_to_limit(0.0, np.append(theory.rest + shift, [0.0, 0.0]))


def _where(plan: Plan, growing: list[tuple[float, float]]) -> str:
    """How many points, and from which value to which."""
    assert plan.followed is not None
    values = sorted({value for value, _ in growing})
    span = label(values[0]) if len(values) == 1 else f"{label(values[0])} to {label(values[-1])}"
    count = "1 point" if len(growing) == 1 else f"{len(growing)} points"
    return f"at {count}, {', '.join(plan.sweep.axis[plan.followed].parameter)} = {span},"


def _remedy(growing: list[tuple[float, float]]) -> str:
    """The duration that is long enough for all of the points, and that for the first if it is clearly shorter."""
    least, most = (pick(seconds for _, seconds in growing) for pick in (min, max))
    some = f"; {rounded(least, True)} s is enough for some" if least < 0.9 * most else ""
    return f"a solver.duration of {rounded(most, True)} s is enough for all{some}"
