"""The files that a command is given: of which kind they are, what they hold, and where their results go."""

import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.errors import CaseError, UsageError

if TYPE_CHECKING:
    from brakecli.case.read import LoadedCase
    from brakecli.sweeps.plan import LoadedSweep


def load_case(source: str, overrides: list[str] | None) -> "LoadedCase":
    """The case of a case file, or the one that a result file holds."""
    from brakecli.case.read import parse_case, read_case

    if not _is_result(source):
        try:
            return read_case(source, overrides or ())
        except CaseError as error:
            if is_sweep(source):
                raise UsageError(f"{source}: this is a sweep; compute it with: brakecli sweep {source}") from error
            raise
    from brakecli.files.read import open_result

    with open_result(Path(source), kind="run") as result:
        text, resolved = result.attributes["case_toml"], result.attributes["resolved_toml"]
    return replace(parse_case(resolved, f"{source} (its resolved case)", overrides or ()), text=text)


def load_sweep(source: str, overrides: list[str] | None) -> "LoadedSweep":
    """The sweep of a sweep file."""
    from brakecli.sweeps.plan import kind_of, read_sweep

    try:
        return read_sweep(source, overrides or ())
    except CaseError as error:
        if source != "-" and kind_of(source) == "case":
            raise UsageError(f"{source}: this is a case; simulate it with: brakecli run {source}") from error
        raise


def is_sweep(source: str) -> bool:
    """Whether a file is meant to be a sweep; standard input can be read only once, and holds a case."""
    from brakecli.sweeps.plan import kind_of

    return source != "-" and not _is_result(source) and kind_of(source) == "sweep"


def result_path(output: Path | None, source: str, kind: str = "case", ending: str = ".h5") -> Path:
    """Where a result goes: to `output`, or into the current directory under the name of its source.

    Raises UsageError if that is the source itself; a result file may be replaced by the same run again.
    """
    target = output or Path((kind if source == "-" else Path(source).stem) + ending)
    if source != "-" and not _is_result(source):
        with suppress(OSError, ValueError):  # one of them does not exist, or cannot
            if target.samefile(source):
                raise UsageError(f"{target}: this is the {kind} itself; choose another output with -o")
    return target


def _is_result(source: str) -> bool:
    """Whether this is a result file, or was one: by its name, or by its content."""
    if source == "-" or Path(source).suffix == ".toml":
        return False
    from brakecli.files.read import is_hdf5

    named = Path(source).suffix == ".h5" and os.path.isfile(source)  # noqa: PTH113 - pathlib's may raise
    return named or is_hdf5(Path(source))
