"""A case in memory, as a sweep runs it: until what it keeps is known, alone or beside others."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from brakecli.analysis.regime.classify import classify, look, verdicts
from brakecli.analysis.regime.evidence import FEWEST_SAMPLES, Stretch, last_quarter
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.stability.linear import Theory, theories_of
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.errors import BrakecliError
from brakecli.solver.alike import at_once
from brakecli.solver.history import array_history
from brakecli.solver.integrate import Motion
from brakecli.solver.system import System
from brakecli.studies.runs.certificate import Certificate, Certified
from brakecli.studies.runs.judge import in_memory, motion_of, to_judge
from brakecli.studies.runs.limits import Check, check, refuse, within_range
from brakecli.studies.runs.settled import Judged, settle
from brakecli.studies.sweeps.early import Ending, early
from brakecli.studies.sweeps.record import Status

_UNTOLD = ("torque_variation", "settled")  # no number of a sweep, and a column of its own


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
        case_check = check(to_judge(system_of(case)))
        refuse(case_check)
    return case_check


def judged(
    case: Case, case_check: Check, judgement: Judged[Motion] | None, theory: Theory | None = None, *, whole: bool
) -> PointRun:
    """The end of `simulate`, by a motion that is known already with its verdict, or by one that is computed."""

    def run(trial: System) -> Judged[Motion | Ending]:
        if judgement and trial is case_check.system:
            return judgement
        if not whole and (ended := early(trial, theory)) is not None:
            return ended
        motion, certificate = motion_of(trial)
        (verdict,) = classify([in_memory(motion, trial, theory)], in_full=whole)
        return Judged(verdict, motion, certificate)

    with within_range():
        ended = settle(case_check.system, run)
    verdict, motion, certificate = ended.judged
    notes = [note for about, note in verdict.notes.items() if about not in _UNTOLD]
    warnings = [*case_check.warnings, *ended.warnings, *notes]
    work = motion.work
    if work.unconverged_steps and not work.failed:
        warnings.append(f"{work.unconverged_steps} of {work.steps} steps did not converge, as the case allows")
    if certificate is not None and not certificate.certified:
        warnings.append(f"solver.tolerance: {certificate.sentence()}")
    status = Status.FAILED if work.failed else Status.DONE
    reason = "; ".join(verdict.reasons)
    first = next(iter(warnings), "")
    return PointRun(verdict, case, motion, certificate, status, reason, first, len(warnings))


def may_suffice(motion: Motion) -> bool:
    """Whether a motion in a lane may show all that is asked of it, however coarse it is.

    Where the pad opens to the last, it is not linear: `judged_together` would have it computed alone.
    """
    samples = len(motion.rows)
    quarter = Stretch(array_history(motion.system.interval, motion.rows), last_quarter(samples), samples)
    return samples < FEWEST_SAMPLES or quarter.touches()


def judged_together(
    systems: Sequence[System], certified: Sequence[Certified | None]
) -> list[tuple[Judged[Motion] | None, Theory]]:
    """The motions that are certified, with their verdicts, and all theories; None where a point has to run alone.

    It has to where its motion in a lane does not show all that is asked of it. No number of one depends on the
    others, and numbers that no brake has concern none of them.
    """
    theories = theories_of(systems)

    def judge(places: list[int]) -> list[Judged[Motion] | None]:
        lanes = {i: lane for i in places if (lane := certified[i])}
        try:
            shown = look([in_memory(lane.motion, systems[i], theories[i]) for i, lane in lanes.items()])
            enough = {i: looked for i, looked in zip(lanes, shown, strict=True) if looked.enough}
            verdict_at = dict(zip(enough, verdicts([*enough.values()], in_full=False), strict=True))
        except (ArithmeticError, np.linalg.LinAlgError, BrakecliError):
            return [None] if len(places) == 1 else [judgement for i in places for judgement in judge([i])]
        return [Judged(verdict_at[i], *lanes[i]) if i in verdict_at else None for i in places]

    return [*zip(at_once([lane and True for lane in certified], judge), theories, strict=True)]


def verdict_of(case: Case) -> Verdict | None:
    """The verdict on a run in memory, as soon as it is known; None where the run fails."""
    with suppress(BrakecliError):
        outcome = simulate(case, whole=False)
        return None if outcome.motion.work.failed else outcome.verdict
    return None
