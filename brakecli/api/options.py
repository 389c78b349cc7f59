"""Options of a command: the fields of one record, described once for `--help`, docstrings and signatures."""

import inspect
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import wraps
from textwrap import fill
from typing import Any, ForwardRef, ParamSpec, TypeVar

_P = ParamSpec("_P")
_Options = TypeVar("_Options")
_Answer = TypeVar("_Answer")


@dataclass(frozen=True)
class Description:
    """What an option is for, and how the shell writes it; a field of a record is annotated with it."""

    meaning: str
    metavar: str | None = None
    _: KW_ONLY
    names: tuple[str, ...] = ()  # in the shell, where they are not that of the field
    shell: Any = None  # type of what the shell gives, where it is not that of the field, or a text
    least: float | None = None
    most: float | None = None
    default: str = ""  # what the shell does without it, in words
    python: str = ""  # what is said in Python, where it is not the meaning
    by_place: bool = False  # whether the shell takes it by its place,
    in_shell: bool = True  # or at all


def described(record: Any) -> dict[str, Description]:
    """What is said of each field of a record, by its name, in the order of its signature."""
    parameters = inspect.signature(record).parameters.items()
    return {name: parameter.annotation.__metadata__[0] for name, parameter in parameters}


def takes(record: Callable[_P, _Options]) -> Callable[[Callable[[_Options], _Answer]], Callable[_P, _Answer]]:
    """Make a function of a record one of its fields; its docstring describes them where it says {options}."""

    def of_fields(function: Callable[[_Options], _Answer]) -> Callable[_P, _Answer]:
        @wraps(function)
        def called(*arguments: _P.args, **options: _P.kwargs) -> _Answer:
            return function(record(*arguments, **options))

        called.__doc__ = docstring(function.__doc__, record)
        called.__signature__ = signature(record, function)  # type: ignore[attr-defined]
        return called

    return of_fields


def signature(record: Any, function: Callable[..., Any]) -> inspect.Signature:
    """The fields of a record as parameters, and what a function returns."""
    own = inspect.signature(record)
    parameters = [
        parameter.replace(annotation=_type(parameter.annotation.__origin__))
        for parameter in own.parameters.values()
    ]
    return own.replace(parameters=parameters, return_annotation=inspect.signature(function).return_annotation)


def docstring(text: str | None, record: Any) -> str:
    """A docstring whose {options} are those of a record."""
    lines = []
    for name, option in described(record).items():
        meaning = option.python or option.meaning[:1].lower() + option.meaning[1:]
        lines.append(fill(f"{name}: {meaning}", 100, initial_indent=" " * 8, subsequent_indent=" " * 12))
    return (text or "").replace("        {options}", "\n".join(lines))


def _type(annotation: Any) -> Any:
    """An annotation as it is written in code, where its names are imported for type checkers only."""
    return annotation.__forward_arg__ if isinstance(annotation, ForwardRef) else annotation
