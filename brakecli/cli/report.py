"""`brakecli report`."""

from pathlib import Path

from brakecli.cli.options import Quiet, with_options
from brakecli.cli.output import show
from brakecli.front.progress import telling
from brakecli.front.records import Report


@with_options
def command(options: Report, quiet: Quiet = False) -> None:
    """Put results on one page, answer first (needs jinja2)."""
    from brakecli.reports.page import write_report
    from brakecli.runs.limits import within_range

    target = Path(options.output or "report.html")
    with telling(quiet) as tell, within_range():
        files = [Path(str(result)) for result in options.results]
        write_report(files, target, full=options.full, force=options.force, progress=tell)
    if not quiet:
        show(f"{target}: written")
