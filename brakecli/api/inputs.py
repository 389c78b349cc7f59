"""The files that a command is given: of which kind they are, what they hold, and where their results go."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from brakecli.errors import CaseError, UnreadableResultError, UsageError
from brakecli.faces import argument, command
from brakecli.results.atomic import follow_link, refuse_source
from brakecli.results.opening import is_hdf5

if TYPE_CHECKING:
    from brakecli.case.read import LoadedCase
    from brakecli.studies.scattering.study import LoadedStudy
    from brakecli.studies.sweeps.plan import LoadedSweep

_Loaded = TypeVar("_Loaded")
COMMANDS = {"sweep": "sweep", "study": "scatter"}
_OWN = {
    "sweep": {"axis", "critical", "points"},
    "study": {"parameter", "samples"},
}  # keys that tell what was meant
"""What computes a file that is no case."""


def load_case(source: str, overrides: list[str] | None) -> "LoadedCase":
    """The case of a case file, or the one that a result file holds."""
    from brakecli.case.read import parse_case, parse_resolved

    if not is_result(source):
        text = _text(source)
        try:
            return parse_case(*text, overrides or ())
        except CaseError as error:
            if (kind := kind_of_file(source)) in COMMANDS:
                remedy = f"compute it with: {command(COMMANDS[kind], source)}"
                raise UsageError(f"{text[1]}: this is a {kind}; {remedy}") from error
            raise
    from brakecli.results.read import open_result

    with open_result(Path(source), kind="run") as result:
        case_toml = result.text("case_toml")
        resolved = result.text("resolved_toml")
    label = f"{source} (its resolved case)"
    try:
        parse_case(resolved, label)
    except CaseError as error:
        what = f"{source}: the case in it is not valid: {error.problems[0]}"
        raise UnreadableResultError(f"{what}; name an intact result file") from error
    return replace(parse_resolved(resolved, label, overrides or ()), text=case_toml)


def load_sweep(source: str, overrides: list[str] | None) -> "LoadedSweep":
    """The sweep of a sweep file."""
    from brakecli.studies.sweeps.plan import parse_sweep

    return _over_a_case(source, overrides, parse_sweep, "sweep")


def load_study(source: str, overrides: list[str] | None) -> "LoadedStudy":
    """The study of a study file."""
    from brakecli.studies.scattering.study import parse_study

    return _over_a_case(
        source, overrides, parse_study, "study", ", or write a study of it with: brakecli new scatter"
    )


def _over_a_case(
    source: str,
    overrides: list[str] | None,
    parse: Callable[[str, str, Path, Sequence[str]], _Loaded],
    wanted: str,
    more: str = "",
) -> _Loaded:
    """What a file holds that names its case, a sweep or a study as is `wanted`.

    `more` is what else to do where it is a case itself.
    """
    from brakecli.studies.sweeps.plan import keys_at_top, kind_of

    text, name = _text(source)
    try:
        folder = Path(source).parent if os.path.isfile(source) else Path()  # noqa: PTH113 - pathlib's may raise
        return parse(text, name, folder, overrides or ())
    except CaseError as error:
        kind = kind_of(text) if keys_at_top(text) != {"case"} else wanted
        if kind == "case":
            remedy = f"simulate it with: {command('run', source)}{more}"
            raise UsageError(f"{name}: this is a case; {remedy}") from error
        if kind in COMMANDS and kind != wanted and not keys_at_top(text) & _OWN[wanted]:
            raise UsageError(
                f"{name}: this is a {kind}; compute it with: {command(COMMANDS[kind], source)}"
            ) from error
        raise


def kind_of_file(source: str) -> str:
    """What a file is meant to be: "case", "sweep", "study", or none of them, as a result."""
    from brakecli.studies.sweeps.plan import kind_of

    return "" if is_result(source) else kind_of(_text(source)[0])


def _text(source: str) -> tuple[str, str]:
    """The text of a source and its name; a pipe can be read only once."""
    from brakecli.case.read import read_text

    return read_text(source) if os.path.isfile(source) else _of_pipe(source)  # noqa: PTH113 - pathlib's may raise


@cache
def _of_pipe(source: str) -> tuple[str, str]:
    from brakecli.case.read import read_text

    return read_text(source, pipes=True)


def result_path(
    output: str | PathLike[str] | None, source: object, kind: str = "case", ending: str = ".h5"
) -> Path:
    """Where a result goes: to `output`, or into the current directory under the name of its source.

    Raises UsageError if that is the source itself; a result file may be replaced by the same run again.
    """
    name = str(source)
    target = Path(output or (kind if name == "-" else Path(name).stem) + ending)
    if name != "-" and not is_result(name):
        refuse_source(target, name, kind)
    suffix = follow_link(target).suffix
    if suffix.lower() in (".txt", ".csv", ".json", ".png", ".pdf", ".svg", ".toml") and ending == ".h5":
        raise UsageError(
            f"{target}: a result is HDF5, not {suffix}; name a file that ends in .h5 with {argument('output')}"
        )
    return target


def is_result(source: str) -> bool:
    """Whether this is a result file, or was one: by its name, or by its content."""
    if source == "-" or Path(source).suffix == ".toml":
        return False
    named = Path(source).suffix == ".h5" and os.path.isfile(source)  # noqa: PTH113 - pathlib's may raise
    return named or is_hdf5(Path(source))
