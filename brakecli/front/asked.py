"""What the commands and Python ask alike of a case."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from brakecli.case.read import LoadedCase
    from brakecli.runs.advise import AdviceReport
    from brakecli.scattering.study import LoadedStudy
    from brakecli.solver.integrate import Counted


def slips_in(loaded: LoadedCase) -> list[str]:
    """Warnings of numbers that no brake has, such as masses in grams."""
    from brakecli.case.system import system_of
    from brakecli.runs.plausible import implausible

    return [*implausible(system_of(loaded.case))]


def stability_of(loaded: LoadedCase, tell: Counted, pushes: int | None) -> dict[str, Any]:
    """Critical friction, modes and growth of steady sliding, by the names of `--json`.

    Also from which friction on a vibration can exist, which so many `pushes` seek; not if None.
    """
    from brakecli.analysis.stability.report import stability
    from brakecli.branches.thresholds import thresholds
    from brakecli.case.system import system_of
    from brakecli.files.field import values_of
    from brakecli.files.stability_fields import STABILITY, THRESHOLDS
    from brakecli.runs.limits import within_range

    with within_range():
        system = system_of(loaded.case)
        report = stability(system)
        found = values_of(STABILITY, report)
        if pushes is not None:
            found |= values_of(THRESHOLDS, thresholds(loaded.case, system, report, tell, pushes))
    return found


def advice_on(
    loaded: LoadedCase,
    keys: Sequence[str] | None,
    margin: float,
    study: LoadedStudy | None,
    engine_of: Callable[..., Any],
    tell: Counted,
) -> AdviceReport:
    """What moves the critical friction, and what to change, under the scatter of a study or under a usual one.

    `keys` may be advised, the usual ones if None; `engine_of` makes what computes the samples of the study.
    """
    from brakecli.analysis.stability.advice import KEYS
    from brakecli.runs.advise import advise
    from brakecli.runs.limits import within_range
    from brakecli.runs.run import load_kernels
    from brakecli.scattering.advised import under_scatter, under_tolerance

    load_kernels(loaded)
    with within_range():
        report = advise(loaded, KEYS if keys is None else keys, margin, tell)
        if study is None:
            return under_tolerance(report, loaded.case)
        return under_scatter(report, loaded, study, engine_of, tell)
