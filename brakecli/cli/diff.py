"""`brakecli diff`."""

from functools import partial
from pathlib import Path
from typing import Annotated

from brakecli.cli.options import AsJson, Details, Force, Quiet, option, output_option, source_argument
from brakecli.cli.output import show_result

VARIABLE = "What is drawn of two runs, vx if left out, or of two other results."


def command(
    first: Annotated[Path, source_argument("A.h5", "Result of any kind.")],
    second: Annotated[Path, source_argument("B.h5", "Result of the same kind.")],
    output: Annotated[Path | None, output_option("Picture of both", "none")] = None,
    variable: Annotated[str | None, option(VARIABLE, "NAME")] = None,
    force: Force = False,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """How two results differ: case, numbers, curves."""
    from brakecli.files.contents import DIFFERENCE_OF_TWO, difference
    from brakecli.files.field import values_of
    from brakecli.files.read import open_result
    from brakecli.views.file import of_difference

    with open_result(first) as a, open_result(second) as b:
        numbers = values_of(DIFFERENCE_OF_TWO, difference(a, b))
    if output is not None:
        from brakecli.plots.result import plot_two

        plot_two(first, second, output, force=force, variable=variable or "")
    files = {"a": str(first), "b": str(second), "output": str(output or "")}
    view = partial(of_difference, numbers, files)
    show_result(
        "diff",
        {**files, "output": output and str(output), **numbers},
        view,
        as_json=as_json,
        quiet=quiet,
        details=details,
    )
