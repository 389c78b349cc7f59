"""`brakecli advise`."""

from dataclasses import replace
from functools import partial
from typing import Annotated

from brakecli.cli.options import AsJson, CaseArgument, Details, Overrides, Quiet, option
from brakecli.cli.output import show_result, warn
from brakecli.front.inputs import load_case, load_study
from brakecli.front.progress import telling

KEYS = "Keys that may be advised, with * for any part; masses, stiffnesses, dampings, angles and load if left out."
STUDY = "Rank by the squeal that is left where keys scatter as in a study."
MARGIN = "Part of its friction by which the case is to stay stable above it."


def command(
    case: CaseArgument,
    overrides: Overrides = None,
    keys: Annotated[str | None, option(KEYS, "KEY,…")] = None,
    margin: Annotated[float, option(MARGIN, "PART", min=0.0, max=10.0)] = 0.2,
    scatter: Annotated[str | None, option(STUDY, "STUDY.toml", "--scatter")] = None,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """What moves the critical friction, and what to change."""
    loaded = load_case(case, overrides)
    study = replace(load_study(scatter, None), base=loaded) if scatter is not None else None
    from brakecli.analysis.stability.advice import KEYS as USUAL
    from brakecli.runs.advise import advise
    from brakecli.runs.limits import within_range
    from brakecli.runs.run import load_kernels
    from brakecli.views.stability import of_advice

    load_kernels(loaded)
    with telling(quiet) as show_progress, within_range():
        report = advise(loaded, keys.split(",") if keys is not None else USUAL, margin, show_progress)
        from brakecli.scattering.advised import under_scatter, under_tolerance

        if study is None:
            report = under_tolerance(report, loaded.case)
        else:
            from brakecli.scattering.scatter import engine_for

            report = under_scatter(report, loaded, study, engine_for, show_progress)
            warn(*study.beside(loaded.case))
    view = partial(of_advice, report)
    show_result("advise", report.numbers(), view, as_json=as_json, quiet=quiet, details=details)
