"""What can go wrong, and the exit code that each kind of failure ends the command with.

Every message reads *where: what is wrong, what was found; what to do*.
"""

from collections.abc import Sequence
from dataclasses import dataclass


class BrakecliError(Exception):
    """A failure that is told to the user in one or more plain sentences, never as a traceback."""

    exit_code = 1


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with an input file.

    `where` is ``FILE:LINE`` (or ``FILE`` where no line can be named, ``--set key.path=VALUE`` for an
    override), `key` the
    dotted key path or "" for the file as a whole.
    """

    where: str
    key: str
    what: str
    remedy: str

    def __str__(self) -> str:
        """`FILE:LINE: key.path: what is wrong (found VALUE); remedy`."""
        return ": ".join(part for part in (self.where, self.key, f"{self.what}; {self.remedy}") if part)


class UsageError(BrakecliError):
    """The command line asks for something that cannot be done: exit code 2."""

    exit_code = 2


class CaseError(BrakecliError):
    """A case or sweep file is wrong: exit code 2. Holds every problem that was found."""

    exit_code = 2

    def __init__(self, problems: Sequence[Problem]) -> None:
        """Tell every problem, a line each."""
        super().__init__("\n".join(str(problem) for problem in problems))
        self.problems = tuple(problems)


class RefusedError(BrakecliError):
    """The work is too large, or lies beyond a limit of the method: exit code 3."""

    exit_code = 3


class UnreadableResultError(BrakecliError):
    """A result file cannot be read, or must not be trusted: exit code 4."""

    exit_code = 4


class CannotWriteError(BrakecliError):
    """An output cannot be written: exit code 74 (EX_IOERR of sysexits.h)."""

    exit_code = 74
