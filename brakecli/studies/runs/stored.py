"""The verdict on the run in a result file: what `brakecli classify RESULT.h5` does."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from brakecli.analysis.over_time import over_time
from brakecli.analysis.regime.answers import RENAMED, Answers
from brakecli.analysis.regime.decision import Excitation, Regime, Thresholds
from brakecli.analysis.regime.table import decide
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import CaseError, UnreadableResultError
from brakecli.results import fields
from brakecli.results.field import plain, values_of
from brakecli.results.read import open_result
from brakecli.solver.history import History
from brakecli.solver.system import System
from brakecli.studies.runs.judge import motion_of, to_judge, verdict_in_memory
from brakecli.studies.runs.work import work_of

MOST_WORK = 60.0
"""Work, as `runs.work` counts it, up to which the case of a file without a record of answers is run again."""


class Stored(NamedTuple):
    """A stored run."""

    system: System
    history: History
    attributes: Mapping[str, object]
    evidence: Mapping[str, object]


def classify_result(path: Path, thresholds: Thresholds) -> dict[str, Any]:
    """Names and values of the verdict on a stored run; raises UnreadableResultError for anything else.

    The record of answers that the run has stored decides, with these thresholds. The numbers are those of the run.
    """
    with stored_run(path) as run:
        failure = run.attributes.get("failure")
        system = run.system
        numbers = {field.name: plain(run.attributes.get(field.name)) for field in fields.VERDICT}
        evidence = {RENAMED.get(name, name): plain(value) for name, value in run.evidence.items()}
        changing = over_time(run.history, system) if not failure and not system.steady else None
        shown = {field.name: run.attributes.get(field.name) for field in fields.EXPONENT}
        shown |= {"failure": failure, "vibrations": fields.VIBRATIONS.read({"over_time": changing})}
        if _older(evidence):
            if failure is None and work_of(system).amount <= MOST_WORK:
                motion, _ = motion_of(to_judge(system))
                verdict = verdict_in_memory(motion, system, thresholds)
                return values_of(fields.VERDICT, {"verdict": verdict}) | shown
            evidence = {"unasked": f"brakecli run {path.name} -o NEW.h5"}
    answers = Answers.of(evidence)
    decision = decide(answers, thresholds)
    own = decision.excitation is Excitation.SELF_EXCITED
    notes = (numbers["reasons"] or [])[1:]
    return (
        numbers
        | shown
        | {
            "regime": str(decision.regime),
            "excitation": str(decision.excitation),
            "frequency": answers.known().get("frequency") if own else None,
            "settled": int(bool(numbers["settled"]) and decision.regime is not Regime.UNDECIDED),
            "reasons": [decision.sentence, *notes],
            "evidence": evidence | {"row": decision.row},
            "thresholds": plain(thresholds),
        }
    )


def _older(evidence: Mapping[str, object]) -> bool:
    """Whether a record lacks answers that rows ask for: all of them, or what powers leave open."""
    return "row" not in evidence or ("power_of_friction" in evidence and "power_stored" not in evidence)


@contextmanager
def stored_run(path: Path) -> Iterator[Stored]:
    """A stored run; raises UnreadableResultError for anything else."""
    with open_result(path, kind="run") as result:
        try:
            system = system_of(parse_case(result.text("resolved_toml"), str(path)).case)
        except (CaseError, KeyError) as error:
            raise UnreadableResultError(f"{path}: holds no case of this version; run its case again") from error
        if not (samples := result.variables("history")["time"].shape[0]):
            raise UnreadableResultError(f"{path}: has no history; run its case again")
        history = History(system.interval, samples, partial(result.read, "history"))
        yield Stored(system, history, result.attributes, result.group_attributes("regime/evidence"))
