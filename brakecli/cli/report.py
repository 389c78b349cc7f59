"""`brakecli report`."""

from pathlib import Path

from brakecli.api.progress import telling
from brakecli.api.records import Report
from brakecli.cli.options import Quiet, with_options
from brakecli.cli.output import show


@with_options
def command(options: Report, quiet: Quiet = False) -> None:
    """Put results on one page, answer first (needs jinja2)."""
    from brakecli.studies.runs.limits import within_range
    from brakecli.views.reports.page import write_report

    target = Path(options.output or "report.html")
    with telling(quiet) as tell, within_range():
        files = [Path(str(result)) for result in options.results]
        write_report(files, target, full=options.full, force=options.force, progress=tell)
    if not quiet:
        show(f"{target}: written")
