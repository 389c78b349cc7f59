"""Arguments and options, and those that several commands share."""

from typing import Annotated, Any

import typer

from brakecli.branches.pushes import MOST_PUSHES
from brakecli.cli.output import warn
from brakecli.solver import compiling


def source_argument(metavar: str, content: str) -> Any:
    """The file that a command reads."""
    return typer.Argument(metavar=metavar, help=content, show_default=False)


def option(description: str, metavar: str | None = None, *names: str, **more: Any) -> Any:
    """An option, named like its parameter if no names are given."""
    return typer.Option(*names, metavar=metavar, help=description, **more)


def output_option(content: str, default: str) -> Any:
    """The file that a command writes."""
    return option(f"{content}  [default: {default}]", "PATH", "--output", "-o")


CaseArgument = Annotated[str, source_argument("CASE.toml", 'Case file, or "-" for standard input.')]
SET = "KEY.PATH=VALUE", "--set"
Overrides = Annotated[list[str] | None, option("Set a key of the case, the value in TOML; repeatable.", *SET)]
PUSHED = "Five times as many pushes seek further vibrations; 0 for none."
Pushes = Annotated[int, option(PUSHED, "N", min=0, max=MOST_PUSHES)]
AsJson = Annotated[bool, option("Print one JSON object on standard output, nothing else.", None, "--json")]


def _compile_in_silence(quiet: bool) -> bool:
    if quiet:
        compiling.set_notice(lambda trouble: warn(*filter(None, [trouble])))
        compiling.set_progress(None)
    return quiet


Details = Annotated[
    bool, option("Print all: evidence, scheme, model, account of energies, every row.", None, "--details")
]
QUIET = option("Print nothing but warnings and errors.", None, "--quiet", "-q", callback=_compile_in_silence)
Quiet = Annotated[bool, QUIET]
Force = Annotated[bool, option("Replace an existing output.", None, "--force")]
