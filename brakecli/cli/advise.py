"""`brakecli advise`."""

from dataclasses import replace
from functools import partial
from typing import Annotated

from brakecli.cli.options import AsJson, CaseArgument, Details, Overrides, Quiet, option
from brakecli.cli.output import show_result, warn
from brakecli.front.asked import advice_on, slips_in
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
    from brakecli.scattering.scatter import engine_for
    from brakecli.views.stability import of_advice

    patterns = keys.split(",") if keys is not None else None
    with telling(quiet) as show_progress:
        report = advice_on(loaded, patterns, margin, study, engine_for, show_progress)
    warn(*slips_in(loaded), *(study.beside(loaded.case) if study else ()))
    view = partial(of_advice, report)
    show_result("advise", report.numbers(), view, as_json=as_json, quiet=quiet, details=details)
