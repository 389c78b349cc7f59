"""Critical values read off branches: where the motion that continues steady sliding is stable.

On a rough wheel that motion is the one which grows with the waves. It is followed through the parameter over all
its folds, so that a value is stable where one of its sheets is.
"""

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from brakecli.analysis.branches.answers import Answers
from brakecli.analysis.branches.explore import Explorer, crossing
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.problem import Array
from brakecli.analysis.branches.thresholds import POINTS as SMOOTH_POINTS
from brakecli.analysis.stability.linear import Linear, linear_theory
from brakecli.analysis.stability.margin import Change, between_known, joined
from brakecli.analysis.stability.modes import is_undamped
from brakecli.case.case import Case
from brakecli.solver.links import natural_frequencies
from brakecli.solver.schedules import schedule
from brakecli.solver.system import System
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Search, of_changes

PART = 0.01
"""Bracket of a change by eigenvalues over the requested one, so that it adds nothing to that."""
POINTS = 1500
"""Budget of points of all branches on a rough wheel. A time would make results depend on the machine."""
VALUES = 33
"""Values at which a shoe without dashpots is looked at."""
SLOPE = 1e-3
"""Slopes of waves, in sum, that feed no disturbance."""
LIGHT = 1e-5
"""Damping ratio of the slowest mode that a shoe without dashpots is given: slower growth counts as none. Without
any nothing decays, and passing waves let almost every motion grow a little, over minutes."""


class Piece(NamedTuple):
    """A part of the range, and whether it is unstable; None where nobody knows."""

    low: float
    high: float
    unstable: bool | None


def explored(critical: Critical, case: Case) -> Explorer:
    """The branches of a case along the parameter, at the speed and load of its start."""
    line = Line(case, [critical.parameter], critical.lower, critical.upper, adapted=_adapted)
    points = POINTS if case.roughness.wheel is not None else SMOOTH_POINTS
    explorer = Explorer(line, lambda *_: None, lambda: False, math.inf, points)
    explorer.explore()
    return explorer


def on_waves(critical: Critical, answers: Answers) -> Search:
    """The windows of the motion that a rough wheel forces."""
    line = answers.line
    if is_undamped(line.case_coefficients):
        return without_dashpots(critical, answers)
    width = line.high - line.low
    bounds = {
        line.value(bound.p): (bound, high.p - low.p) for low, high in answers.windows for bound in (low, high)
    }

    def located(low: float, high: float, lost: bool) -> Change:
        if low != high or low not in bounds:
            return Change(0.5 * (low + high), 0.5 * (high - low), lost)
        bound, window = bounds[low]
        return Change(low, width * (bound.bar if bound.known else window), lost, known=bound.known)

    sides = [(end, piece.unstable) for piece in pieces(answers) for end in (piece.low, piece.high)]
    return of_changes(critical, sides[0][1], joined(sides, line.high, located))


def in_full_contact(system: System) -> Linear | None:
    """Theory of the motion that a rough wheel forces, where that surely touches everywhere and only slips.

    The slopes of its waves must move the contact force by less than a thousandth of what compression does.
    """
    wheel = system.wheel
    slopes = wheel.g * wheel.omega * np.sinc(wheel.omega * system.half_length / np.pi)
    theory = linear_theory(system, system.belt_speed) if np.abs(slopes).sum() <= SLOPE else None
    if theory is None or theory.opens:
        return None
    fastest = 2.0 * math.pi * float(np.abs(theory.waves[:, 0] * theory.passing).sum())
    return theory if fastest < abs(system.belt_speed) else None


def without_dashpots(critical: Critical, answers: Answers) -> Search:
    """The windows where nothing damps: by eigenvalues where the motion surely keeps in full contact.

    No branch leads through a resonance then, and a large motion beside may hide what full contact does.
    """
    parts = pieces(answers)
    line = answers.line

    @cache
    def unstable(value: float) -> bool | None:
        theory = in_full_contact(line.system(line.place(value)))
        if theory is not None:
            return theory.mode.growth > theory.known_to
        return next((piece.unstable for piece in parts if piece.low <= value <= piece.high), None)

    def widened(change: Change) -> Change:
        near = change.error + math.ulp(change.value)
        bounds = [bound for window in answers.windows for bound in window]
        bars = [bound.bar for bound in bounds if change.known and abs(line.value(bound.p) - change.value) <= near]
        return change._replace(error=change.error + (line.high - line.low) * max(bars, default=0.0))

    middles = {0.5 * (piece.low + piece.high) for piece in parts}
    values = sorted({*np.linspace(line.low, line.high, VALUES).tolist(), *middles})
    changes = between_known(unstable, values, PART * critical.tolerance)
    return of_changes(critical, unstable(values[0]), map(widened, changes))


def calm(answers: Answers, value: float) -> list[Array]:
    """The states (x, y, v_x, v_y) at t = 0 of the stable motions that a rough wheel forces at a value."""
    p = answers.line.place(value)
    points = [point for followed in answers.bases for point in crossing(followed, p)]
    return [np.array(point.facts.state) for point in points if point.stable]


def pieces(answers: Answers) -> list[Piece]:
    """The range in parts: stable, unstable, or not known. Where nothing slides steadily it counts as unstable."""
    stretches = list[tuple[float, float, bool | None]]()
    last = 0.0
    slides = [slide.p for slide in answers.explored.slides if slide.signs is not None]
    ends = (slides[0], slides[-1]) if slides else (1.0, 0.0)
    spans = [(low.p, high.p, True) for low, high in answers.windows]
    spans += [(low, high, False) for low, high in answers.stable_spans]
    for low, high, unstable in [*sorted(spans), (1.0, 1.0, None)]:
        cuts = sorted({last, low, *(end for end in ends if last < end < low)})
        for a, b in pairwise(cuts):
            stretches.append((a, b, None if ends[0] <= 0.5 * (a + b) <= ends[1] else True))
        if high > low:
            stretches.append((low, high, unstable))
        last = max(last, high)
    value = answers.line.value
    return [Piece(value(low), value(high), unstable) for low, high, unstable in stretches]


def _adapted(system: System) -> System:
    """The system at the speed and load of its start throughout; without dashpots it gets very light ones."""
    belt = schedule((0.0,), (system.belt_speed / system.radius,), system.radius)
    steady = replace(system, belt=belt, load=schedule((0.0,), (system.load_at_start,)))
    c = system.coefficients
    if not is_undamped(c):
        return steady
    slow, fast = natural_frequencies(c, system.contact_stiffness)
    damping = 2.0 * LIGHT * 2.0 * math.pi * (slow or fast) * c.m
    return replace(steady, coefficients=c._replace(b_xx=damping, b_yy=damping))
