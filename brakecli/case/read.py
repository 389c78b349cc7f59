"""TOML file → `Case`, or every problem of the file at once, each with its line and a remedy."""

import json
import re
import shlex
import sys
from collections.abc import Container, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from operator import itemgetter
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from brakecli.case.case import Case, resolved_toml
from brakecli.case.tables import Table
from brakecli.case.toml_lines import (
    LARGEST_TEXT,
    WRITING,
    Finding,
    KeyPath,
    Located,
    UnfitTextError,
    key_text,
    parse,
    printable,
    split,
    too_large,
)
from brakecli.case.wording import MISSING, sentences, tables
from brakecli.errors import CaseError, Problem

_Table = TypeVar("_Table", bound=Table)


@dataclass(frozen=True)
class LoadedCase:
    """A case with the text it was read from, and the same case as TOML with overrides and defaults filled in."""

    case: Case
    text: str
    resolved: str


def starter_text() -> str:
    """A commented case to start from, valid as it is."""
    return resources.files("brakecli.case").joinpath("starter.toml").read_text(encoding="utf-8")


def read_case(source: str, overrides: Sequence[str] = ()) -> LoadedCase:
    """Read the case from a path, or from standard input where the path is "-". Raises `CaseError`.

    Overrides are those of `parse_case`.
    """
    label = "standard input" if source == "-" else source
    return parse_case(read_text(source, label), label, overrides)


def read_text(source: str, label: str) -> str:
    """The text of a file, or of standard input where the path is "-"; line ends stay as they are."""
    try:
        if source == "-":
            data = sys.stdin.buffer.read(LARGEST_TEXT + 1)
        else:
            with Path(source).open("rb") as file:
                data = file.read(LARGEST_TEXT + 1)
    except (OSError, ValueError, AttributeError) as error:
        # ValueError: a NUL in the path, or standard input is closed; AttributeError: there is no standard input.
        closed = isinstance(error, AttributeError)
        reason = "it is closed" if closed else getattr(error, "strerror", None) or str(error)
        what = f"cannot be read: {reason[0].lower()}{reason[1:]}"
        raise CaseError([Problem(label, "", what, 'name a TOML file, or "-" for standard input')]) from error
    if len(data) > LARGEST_TEXT:
        raise CaseError([_problem(too_large(), label)])
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        utf_16 = data.startswith((b"\xff\xfe", b"\xfe\xff"))
        line = data.count(b"\n", 0, error.start) + 1
        what = "is UTF-16, not UTF-8" if utf_16 else f"is not UTF-8 (found byte 0x{data[error.start]:02x})"
        raise CaseError([Problem(f"{label}:{line}", "", what, "save the file as UTF-8")]) from error


def parse_case(text: str, label: str, overrides: Sequence[str] = ()) -> LoadedCase:
    """Make a case of a TOML text; messages call it `label`. Raises `CaseError`, which holds every problem.

    An override reads `key.path=VALUE`, the value in TOML. It replaces what the text says, creates the tables
    that it needs, and takes effect before anything is checked. Of two keys that exclude each other (a constant
    load or a schedule, wavelengths or wavenumbers), an override of one removes the other from the text.
    """
    case = parse_table(Case, text, label, overrides)
    return LoadedCase(case, text, resolved_toml(case))


def parse_table(kind: type[_Table], text: str, label: str, overrides: Sequence[str] = ()) -> _Table:
    """Make a table of some kind, such as a case, of a whole TOML text; see `parse_case`."""
    try:
        statements = split(text)
    except UnfitTextError as error:
        raise CaseError([_problem(error.finding, label)]) from error
    data = parse(text)
    located = None
    findings = []
    if isinstance(data, Finding):
        located = Located(statements)
        findings = located.findings or [data]
        data = located.data
    is_readable = not any(finding.key == () for finding in findings)
    problems = [(finding.line, _problem(finding, label)) for finding in findings]
    set_by, refused = _override(data, overrides, kind)
    problems += refused
    try:
        table = kind.model_validate(data)
    except ValidationError as error:
        located = located or Located(statements)
        for key, what, remedy in sentences(error, kind):
            if is_readable or what != MISSING:  # what seems to be missing may be in the part that cannot be read
                order, where = _place(key, located, label, set_by, overrides)
                problems.append((order, Problem(where, key_text(key), what, remedy)))
    if problems:
        raise CaseError([problem for _, problem in sorted(problems, key=itemgetter(0))])
    return table


def _problem(finding: Finding, label: str) -> Problem:
    where = f"{label}:{finding.line}" if finding.line else label
    return Problem(where, key_text(finding.key), finding.what, finding.remedy)


def _place(
    key: KeyPath, located: Located, label: str, set_by: dict[KeyPath, int], overrides: Sequence[str]
) -> tuple[int, str]:
    """Where a key is, or else the table that it belongs to, and the order of such places."""
    prefixes = [key[:end] for end in range(len(key), 0, -1)]
    for prefix in prefixes:
        if prefix in set_by:
            return _order(set_by[prefix]), _option(overrides[set_by[prefix]])
    for prefix in prefixes:
        if prefix in located.lines:
            return located.lines[prefix], f"{label}:{located.lines[prefix]}"
    return 0, label


def _order(index: int) -> int:
    return LARGEST_TEXT + 1 + index  # after every line


def _option(override: str) -> str:
    return f"--set {printable(override)}"


def _override(
    data: dict[str, Any], overrides: Sequence[str], kind: type[Table]
) -> tuple[dict[KeyPath, int], list[tuple[int, Problem]]]:
    """Apply overrides to the data; tell which key was set by which of them, and what is wrong with the rest."""
    set_by: dict[KeyPath, int] = {}
    problems = []
    for index, override in enumerate(overrides):
        parsed = parse_override(override)
        if isinstance(parsed, Finding):
            problem = Problem(_option(override), "", parsed.what, parsed.remedy)
            problems.append((_order(index), problem))
            continue
        path, value = parsed
        try:
            created = put(data, path, value, kind, kept=set_by)
        except TypeError:
            what = f"{key_text(path[:-1])} is not a table"
            problem = Problem(_option(override), key_text(path), what, "set a key of a table")
            problems.append((_order(index), problem))
            continue
        set_by |= dict.fromkeys((*created, path), index)
    return set_by, problems


def put(
    data: dict[str, Any], path: tuple[str, ...], value: object, kind: type[Table], kept: Container[KeyPath] = ()
) -> list[tuple[str, ...]]:
    """Set a key in the data of a table of some kind; the paths of the tables that it took to create.

    Of keys that exclude each other the ones given before are removed, unless they are to be kept. Raises TypeError
    where something on the path is no table.
    """
    *parents, key = path
    table: Any = data
    created = []
    for end, parent in enumerate(parents, start=1):
        if isinstance(table, dict):
            if parent not in table:
                table[parent] = {}
                created.append(path[:end])
            table = table[parent]
    if not isinstance(table, dict):
        raise TypeError(path)
    table[key] = value
    groups = _alternatives(kind).get(tuple(parents), ())
    if any(key in group for group in groups):
        for other in (other for group in groups if key not in group for other in group):
            if (*parents, other) not in kept:
                table.pop(other, None)
    return created


@cache
def _alternatives(kind: type[Table]) -> dict[KeyPath, tuple[tuple[str, ...], ...]]:
    return {path: table.alternatives for path, table in tables(kind)}


def parse_override(override: str) -> tuple[tuple[str, ...], object] | Finding:
    """The key path and the value of an override, or what is wrong with it."""
    try:
        override.encode()
        split(override)
    except UnicodeEncodeError:
        return Finding(0, (), "is not UTF-8", "write it in UTF-8")
    except UnfitTextError as error:
        return error.finding
    key, _, value = override.partition("=")
    path = key_path(key)
    if "=" not in override or not path:
        return Finding(0, (), f"does not begin with a key (found {printable(key)})", "write --set key.path=VALUE")
    parsed = parse(f"value={value}")
    if isinstance(parsed, dict) and parsed.keys() == {"value"}:
        return path, parsed["value"]
    remedy = WRITING
    if re.fullmatch(r"[^\W\d][\w .-]*", value):
        remedy = f"texts need quotes: --set {key}={shlex.quote(json.dumps(value, ensure_ascii=False))}"
    return Finding(0, (), f"the value is not valid TOML (found {printable(value)})", remedy)


def key_path(text: str) -> tuple[str, ...]:
    """The parts of a key path as TOML writes it; none if it is not one."""
    rest: Any = parse(f"{text}=0") if "\n" not in text else None
    path: tuple[str, ...] = ()
    while isinstance(rest, dict) and len(rest) == 1:
        ((part, rest),) = rest.items()
        path = (*path, part)
    return path if rest == 0 else ()
