"""`brakecli new`."""

from pathlib import Path
from typing import Annotated

import typer

from brakecli.cli.inputs import as_argument
from brakecli.cli.options import Force, Quiet, output_option
from brakecli.cli.output import show
from brakecli.errors import UsageError
from brakecli.files.os_signals import unwinding


def command(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the file, with or without .toml.")] = "case",
    output: Annotated[Path | None, output_option("File to write", "NAME.toml")] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Write a commented starter case that runs."""
    from brakecli.case.read import starter_text
    from brakecli.files.atomic import new_output

    if not name:
        raise UsageError("the name is empty; give one, or leave it out for case.toml")
    path = output or Path(name if name.endswith(".toml") else f"{name}.toml")
    with unwinding(), new_output(path, force=force) as file:
        file.write(starter_text().encode())
        file.publish()
    if not quiet:
        show(f"{path}: written; run it with: brakecli run {as_argument(path)}")
