"""`brakecli report`."""

from pathlib import Path
from typing import Annotated

from brakecli.cli.options import Force, Quiet, option, output_option, source_argument
from brakecli.cli.output import show
from brakecli.front.progress import telling

RESULTS = "Results of any kind; two or three of one kind stand beside each other."
FULL = "Add the case, the evidence, accuracy, warnings, and how to repeat it."


def command(
    results: Annotated[list[Path], source_argument("FILE.h5…", RESULTS)],
    output: Annotated[
        Path | None, output_option("Page, .html, or .pdf with weasyprint", "report.html, here")
    ] = None,
    full: Annotated[bool, option(FULL, None, "--full")] = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Put results on one page, answer first (needs jinja2)."""
    from brakecli.reports.page import write_report
    from brakecli.runs.limits import within_range

    target = output or Path("report.html")
    with telling(quiet) as show_progress, within_range():
        write_report(results, target, full=full, force=force, progress=show_progress)
    if not quiet:
        show(f"{target}: written")
