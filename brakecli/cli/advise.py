"""`brakecli advise`."""

from functools import partial

from brakecli.api.commands import advise
from brakecli.api.progress import telling
from brakecli.api.records import Advise
from brakecli.api.values import case_of
from brakecli.cli.options import AsJson, Details, Quiet, with_options
from brakecli.cli.output import show_result, warn


@with_options
def command(options: Advise, details: Details = False, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """What moves the critical friction, and what to change."""
    loaded = case_of(options.case, options.settings)
    with telling(quiet) as tell:
        report, warnings = advise(loaded, options, tell)
    warn(*warnings)
    from brakecli.views.stability import of_advice

    view = partial(of_advice, report)
    show_result("advise", report.numbers(), view, as_json=as_json, quiet=quiet, details=details)
