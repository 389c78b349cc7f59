"""Arguments and options of the shell: those of a command's record, and how its answer is printed."""

import inspect
from collections.abc import Callable
from functools import partial, wraps
from typing import Annotated

import typer

from brakecli.api.options import Description, described
from brakecli.cli.output import warn
from brakecli.errors import printable
from brakecli.solver import compiling

_UNITS = {"HZ": "Hz", "KG": "kg", "N": "N", "M/S": "m/s", "N/M": "N/m", "S": "s", "SECONDS": "s"}  # by metavar


def with_options(command: Callable[..., None]) -> Callable[..., None]:
    """A command with the fields of its record in the place of its parameter `options`."""
    own = inspect.signature(command).parameters
    record = own["options"].annotation
    fields = inspect.signature(record).parameters
    shared = [_as_in_typer(fields[name], said) for name, said in described(record).items() if said.in_shell]
    beside = [
        parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for name, parameter in own.items()
        if name != "options"
    ]

    @wraps(command)
    def called(**arguments: object) -> None:
        options = record(**{parameter.name: arguments.pop(parameter.name) for parameter in shared})
        command(options, **arguments)

    called.__signature__ = inspect.Signature([*shared, *beside])  # type: ignore[attr-defined]
    return called


def _as_in_typer(field: inspect.Parameter, said: Description) -> inspect.Parameter:
    """The field of a record as typer has an option, of the type that the shell gives."""
    required = field.default is inspect.Parameter.empty
    meaning = f"{said.meaning}  [default: {said.default}]" if said.default else said.meaning
    if said.by_place:
        shown = typer.Argument(metavar=said.metavar, help=meaning, show_default=False)
    else:
        shown = typer.Option(
            *(said.names or (f"--{field.name.replace('_', '-')}",)),
            metavar=said.metavar,
            help=meaning,
            min=said.least,
            max=said.most,
            show_default=not required,
        )
    kind = said.shell or _plain_type(field.annotation.__origin__)
    if kind is float and not said.by_place and said.least is None and said.most is None:
        shown.parser = partial(_number, _UNITS.get(said.metavar or "", ""))
    optional = kind | None if field.default is None else kind
    return field.replace(kind=field.KEYWORD_ONLY, annotation=Annotated[optional, shown])


def _number(unit: str, text: str) -> float:
    """The number of a text in its unit, which the text does not name."""
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"{printable(text)} is no number{f' in {unit}' if unit else ''}") from None


def _plain_type(annotation: object) -> type:
    """The first type of an annotation that the shell has; it gives anything else as text."""
    return next((kind for kind in (bool, int, float) if annotation in (kind, kind | None)), str)


def _compile_in_silence(quiet: bool) -> bool:
    if quiet:
        compiling.set_notice(lambda trouble: warn(*filter(None, [trouble])))
        compiling.set_progress(None)
    return quiet


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output, nothing else.")]
Details = Annotated[
    bool, typer.Option("--details", help="Print all: evidence, scheme, model, account of energies, every row.")
]
Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Print nothing but warnings and errors.", callback=_compile_in_silence),
]
