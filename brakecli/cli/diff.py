"""`brakecli diff`."""

from functools import partial
from pathlib import Path

from brakecli.api.commands import diff
from brakecli.api.records import Diff
from brakecli.cli.options import AsJson, Details, Quiet, with_options
from brakecli.cli.output import show_result


@with_options
def command(options: Diff, details: Details = False, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """How two results differ: case, numbers, curves."""
    from brakecli.results.contents import DIFFERENCE_OF_TWO
    from brakecli.results.field import values_of
    from brakecli.views.file import of_difference

    target = None if options.output is None else Path(options.output)
    differences = diff(options, Path(str(options.first)), Path(str(options.second)), target)
    numbers = values_of(DIFFERENCE_OF_TWO, differences)
    files = {"a": str(options.first), "b": str(options.second), "output": str(options.output or "")}
    shown = {**files, "output": options.output and str(options.output), **numbers}
    view = partial(of_difference, numbers, files)
    show_result("diff", shown, view, as_json=as_json, quiet=quiet, details=details)
