"""`brakecli scatter`."""

from dataclasses import replace
from functools import partial

from brakecli.api.commands import scatter
from brakecli.api.inputs import result_path
from brakecli.api.progress import telling
from brakecli.api.records import Scatter
from brakecli.api.values import study_of
from brakecli.cli.options import AsJson, Details, Quiet, with_options
from brakecli.cli.output import show_result, warn


@with_options
def command(options: Scatter, details: Details = False, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """How likely brakes squeal whose numbers scatter."""
    loaded = study_of(options.source, options.settings)
    target = result_path(options.output, options.source, kind="study")
    from brakecli.studies.sweeps.driver import keeping_points
    from brakecli.views.stability import of_scatter

    with telling(quiet) as tell, keeping_points(target):
        report, warnings = scatter(replace(options, source=loaded, settings=None), target, tell)
    warn(*warnings)
    numbers = {**report.numbers(), "output": str(report.output)}
    view = partial(of_scatter, numbers, report.loaded.title)
    show_result("scatter", numbers, lambda show: view(), as_json=as_json, quiet=quiet, details=details)
