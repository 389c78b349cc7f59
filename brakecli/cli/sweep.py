"""`brakecli sweep`."""

from dataclasses import replace
from functools import partial

from brakecli.api.commands import sweep
from brakecli.api.inputs import result_path
from brakecli.api.progress import say, telling
from brakecli.api.records import Sweep
from brakecli.api.values import sweep_of_options
from brakecli.cli.options import AsJson, Details, Quiet, with_options
from brakecli.cli.output import show_result, warn
from brakecli.errors import BrakecliError


@with_options
def command(options: Sweep, details: Details = False, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Simulate a grid of cases, or search for critical values.

    The same command continues an interrupted sweep.
    """
    loaded = sweep_of_options(options)
    target = result_path(options.output, options.source, kind="sweep")
    from brakecli.studies.sweeps.driver import keeping_points
    from brakecli.studies.sweeps.size import Size
    from brakecli.views.points import of_sweep

    def begin(size: Size, resumed: int) -> None:
        if not quiet:
            say(size.sentence() + (f"; {resumed} of them are there already" if resumed else ""))

    with telling(quiet) as tell, keeping_points(target):
        report = sweep(replace(options, source=loaded, settings=None), target, tell, begin=begin)
    findings = report.findings
    warn(*report.notes)
    warn(*findings.warnings)
    numbers = {"output": str(report.output), **report.numbers()}
    show_result("sweep", numbers, partial(of_sweep, report), as_json=as_json, quiet=quiet, details=details)
    for failure in findings.failures:
        where = ", ".join(f"{key} = {value}" for key, value in failure["parameters"].items())
        say(f"point {failure['point']}{f' ({where})' if where else ''}: {failure['reason']}")
    if findings.failed:
        failed = f"{findings.failed} of {findings.points} points failed; all others were written"
        if findings.failed == findings.points:
            which = "its only point" if findings.points == 1 else f"all {findings.points} points"
            failed = f"{which} failed; correct the case, the sweep or the machine, as the reasons above say"
        raise BrakecliError(f"{report.output}: {failed}")
