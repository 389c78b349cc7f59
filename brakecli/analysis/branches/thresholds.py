"""Both thresholds of friction: where sliding loses its stability, and from where on a vibration can exist."""

from collections.abc import Callable
from dataclasses import dataclass, field

from brakecli.analysis.branches.answers import Answers, metres
from brakecli.analysis.branches.explore import Explorer
from brakecli.analysis.branches.islands import Search
from brakecli.analysis.branches.line import Line
from brakecli.analysis.stability.modes import is_undamped
from brakecli.analysis.stability.report import StabilityReport
from brakecli.case.case import Case
from brakecli.solver.system import System

FRICTION = "friction.coefficient"
POINTS = 500
"""Motions of a branch. Nine branches of ten need fewer; a thousand may take most of a minute if cycles are long.
It is a count and not a time, so that the same case gives the same answer."""


@dataclass(frozen=True)
class Thresholds:
    """From which friction on a vibration can exist beside stable sliding, and how hard a push it needs."""

    critical: float | None  # friction at which sliding loses its stability
    kind: str  # by flutter or divergence; empty without a critical friction
    coexists_from: float | None = None
    barrier: float | None = None  # m, half of peak to peak of x of the unstable cycle at the case's own friction
    beside: str = ""  # what there is beside stable sliding, in words
    search: Search = field(default_factory=Search)  # for vibrations that no branch from flutter reaches

    @property
    def sentence(self) -> str | None:
        """Both thresholds in words; None where sliding does not lose its stability."""
        if self.critical is None:
            return None
        locks = ", and the shoe locks there" if self.kind == "divergence" else ""
        return "; ".join(filter(None, [f"sliding loses stability at {self.critical:.4g}{locks}", self.beside]))


def thresholds(
    case: Case,
    system: System,
    report: StabilityReport,
    tell: Callable[[str, int, int], None] = lambda what, done, total: None,
    pushes: int = 0,
) -> Thresholds:
    """Both thresholds of a case along friction, by the limit cycles that begin where sliding flutters.

    Vibrations to which none of these branches leads are sought by five times so many `pushes`.
    On smooth pads alone: rough ones take seconds to a minute, and `brakecli branch` follows these.
    """
    lost = report.critical
    if lost is None or report.belt_speed == 0.0:
        return Thresholds(None, "")
    limits = Thresholds(lost.friction, lost.instability)
    if lost.instability != "flutter" or not lost.friction > 0.0:
        return limits
    if not system.smooth:
        return _without_branches(
            limits, "`brakecli branch` says from where on a vibration can exist on rough pads"
        )
    if is_undamped(system.coefficients):
        return _without_branches(limits, "no dashpot damps the shoe, so that no vibration is followed below that")
    if not system.steady:
        return _without_branches(limits, "speed or load change, so that no vibration is followed below that")
    own = report.friction
    # A branch may first lead up from flutter, turn there, and come down below it: the range reaches as far above
    # the critical friction as there is room below. Branches get through to there (`make bench-branch`).
    highest = 2.0 * lost.friction
    if report.stable:
        highest = max(highest, 1.05 * own)  # where sliding is stable again
    explorer = Explorer(Line(case, [FRICTION], 0.0, highest), tell, lambda: False, points=POINTS)
    explored = explorer.explore(pushes=pushes)
    answers = Answers(explored, own if own <= highest else None)
    return Thresholds(
        critical=lost.friction,
        kind=lost.instability,
        coexists_from=answers.coexists_from,
        barrier=answers.barrier,
        beside="; ".join(filter(None, [_beside(answers, lost.friction), answers.sought])),
        search=explored.search,
    )


def _without_branches(limits: Thresholds, why: str) -> Thresholds:
    return Thresholds(limits.critical, limits.kind, beside=why)


def _beside(answers: Answers, critical: float) -> str:
    """What vibrates beside stable sliding."""
    line = answers.line
    coexisting = answers.coexisting
    further = {"budget": "; `brakecli branch` follows it further"}
    cut = [
        f"the branch is cut at {mark.motion.value:.4g}: {mark.reason}{further.get(mark.kind, '')}"
        for _, mark in answers.cut[:1]
    ]
    cut += answers.explored.notes[:1]
    if not coexisting:
        if cut:
            return f"whether a vibration can exist below that is not known: {cut[0]}"
        return "the vibration that begins there does not exist below it"
    low, high = (line.value(p) for p in (coexisting[0][0], max(end for _, end, _ in coexisting)))
    edges = [line.high, critical, *answers.critical_windows_lower]
    reaches = any(abs(high - edge) <= 1e-6 * line.high for edge in edges)
    until = "on" if reaches else f"to {high:.4g}{' at least' if cut else ''}"
    words = f"a vibration{answers.pushed} can exist from {low:.4g} {until}"
    if answers.barrier is not None:
        cycle = f"an unstable cycle of {metres(answers.barrier)} lies between the two"
        words += f"; at the case's {answers.own:.4g} {cycle}"
    return f"{words}; it may begin lower, as {cut[0]}" if cut else words
