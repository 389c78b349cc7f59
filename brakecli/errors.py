"""What can go wrong, and the exit code that each kind of failure ends the command with.

Every message reads *where: what is wrong (what was found); what to do*.
"""

import json
import os
import re
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

# characters of a value in a message, and entries of a list
_LONGEST = 80
_SHOWN = 5
_ODD = {"Cc", "Cf", "Cn", "Co", "Cs", "Zl", "Zp"}  # categories of Unicode
KeyPath = tuple[str | int, ...]
"""The names of the tables and of the key, from the top of a file on; a number is a place in a list."""


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with what a user gave."""

    path: KeyPath  # of the key; empty for the text as a whole
    what: str
    remedy: str
    source: str = ""  # the file, or the override as ``--set key.path=VALUE``
    line: int = 0  # 0 where no line can be named
    instead: tuple[str, ...] = ()  # of what is missing: other keys of its table that may be meant

    @property
    def where(self) -> str:
        """``FILE:LINE``, or the source alone."""
        source = escaped(self.source)
        return f"{source}:{self.line}" if self.line else source

    @property
    def key(self) -> str:
        """The key path as TOML writes it."""
        return key_text(self.path)

    def __str__(self) -> str:
        """`FILE:LINE: key.path: what is wrong (found VALUE); remedy`."""
        return ": ".join(text for text in (self.where, self.key, f"{self.what}; {self.remedy}") if text)


class BrakecliError(Exception):
    """A failure that is reported to the user in one or more plain sentences, never as a traceback."""

    exit_code = 1

    def __init_subclass__(cls, exit_code: int) -> None:
        """Every kind of failure has its exit code."""
        cls.exit_code = exit_code

    def __str__(self) -> str:
        """The sentences, a line each, without what a terminal would take for a command."""
        return escaped(super().__str__(), allowed="\n")


class UsageError(BrakecliError, exit_code=2):
    """The command line asks for something that cannot be done."""


class CaseError(BrakecliError, exit_code=2):
    """A case or sweep file is wrong. Holds every problem that was found."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        """Report every problem in a line of its own."""
        super().__init__("\n".join(map(str, problems)))
        self.problems = tuple(problems)


class RefusedError(BrakecliError, exit_code=3):
    """The work is too large, or lies beyond a limit of the method."""


class UnreadableResultError(BrakecliError, exit_code=4):
    """A result file cannot be read, or is not as it was written."""


class OtherKindError(UnreadableResultError, exit_code=4):
    """A result file is of another kind than the one that is needed."""


class CannotWriteError(BrakecliError, exit_code=os.EX_IOERR):
    """An output cannot be written."""


@contextmanager
def installed(*packages: str) -> Iterator[None]:
    """Within the block libraries are imported; raises UsageError where one is missing."""
    try:
        yield
    except ImportError as error:
        what = f"{error.name or 'a library'} cannot be imported ({error})"
        raise UsageError(f"{what}; install it with: python -m pip install {' '.join(packages)}") from error


def key_text(path: KeyPath) -> str:
    """A key path as TOML writes it, with places in a list in brackets: `roughness.wheel.amplitudes[2]`."""
    text = ""
    for step in path:
        if isinstance(step, str):
            is_bare = re.fullmatch(r"[\w-]+", step, re.ASCII)
            text += "." + (step if is_bare else json.dumps(step, ensure_ascii=False))
        else:
            text += f"[{step}]"
    return printable(text.removeprefix("."))


def found_text(value: object) -> str:
    """The part of a message that shows the value which was found."""
    return f" (found {value_text(value)})"


def value_text(value: object) -> str:
    """A value as TOML writes it, shortened to fit into a message."""
    match value:
        case bool():
            text = str(value).lower()
        case str():
            text = json.dumps(value[:_LONGEST], ensure_ascii=False)
        case int() if value.bit_length() > 250:
            text = "an integer of more than 75 digits"
        case dict():
            text = "a table"
        case list() | tuple():
            shown = ["[…]" if isinstance(item, list) else value_text(item) for item in value[:_SHOWN]]
            text = f"[{', '.join([*shown, '…'] if len(value) > _SHOWN else shown)}]"
        case _:
            text = str(value)
    return printable(text)


def printable(text: str) -> str:
    """A text in one line of at most `_LONGEST` characters that a terminal shows as they are."""
    return escaped(text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…")


def escaped(text: str, allowed: str = "") -> str:
    """A text for a terminal: control characters, and those that turn its direction, are written as in JSON."""
    if text.isprintable():
        return text
    odd = {char for char in text if unicodedata.category(char) in _ODD and char not in allowed}
    return text.translate({ord(char): json.dumps(char)[1:-1] for char in odd})
