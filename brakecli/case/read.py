"""TOML file → `Case`, or every problem of the file at once, each with its line and a remedy."""

import json
import re
import shlex
import sys
from collections.abc import Container, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib import resources
from io import BufferedReader
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from brakecli.case import wording
from brakecli.case.case import Case, changed, resolved_toml
from brakecli.case.records import Record, arrays
from brakecli.case.roughness import Records, reading
from brakecli.case.tables import MISSING, OverCase, Table, tables_within
from brakecli.errors import CaseError, KeyPath, Problem, key_text, printable
from brakecli.faces import argument
from brakecli.results import toml_lines
from brakecli.results.opening import SIGNATURE, open_regular
from brakecli.results.toml_lines import WRITING, Located, check_size, innermost, parse, split, unfit

_Table = TypeVar("_Table", bound=Table)
_OverCase = TypeVar("_OverCase", bound=OverCase)


@dataclass(frozen=True)
class LoadedCase:
    """A case with the text it was read from, and the same case as TOML with overrides and defaults filled in.

    `records` are the measured profiles of its surfaces, as they were when it was read.
    """

    case: Case
    text: str
    resolved: str
    records: Mapping[str, Record] = field(default_factory=dict)


def with_duration(loaded: LoadedCase, seconds: float) -> LoadedCase:
    """The same, whose case is run for so many seconds."""
    case = changed(loaded.case, solver={"duration": seconds, "budget": None})
    return replace(loaded, case=case, resolved=resolved_toml(case))


def starters() -> dict[str, str]:
    """Commented files to start from, valid as they are, by their names; the first line of each is its question."""
    files = resources.files("brakecli.case").joinpath("starters").iterdir()
    return {file.name.removesuffix(".toml"): file.read_text(encoding="utf-8") for file in sorted(files, key=str)}


def read_text(source: str, *, pipes: bool = False) -> tuple[str, str]:
    """The text of a file, or of standard input where the path is "-", and its name; line ends stay as they are.

    A byte order mark, with which some editors begin a file, is no part of it. With `pipes`, also of a pipe that
    the shell has opened.
    """
    name = "standard input" if source == "-" else source
    try:
        stream = (
            nullcontext(sys.stdin.buffer) if source == "-" else BufferedReader(open_regular(source, pipes=pipes))
        )
        with stream as file:
            data = file.read(toml_lines.LARGEST_TEXT + 1)
    except (OSError, ValueError, AttributeError) as error:
        # ValueError: a NUL in the path, or standard input is closed; AttributeError: there is no standard input.
        closed = isinstance(error, AttributeError)
        reason = "it is closed" if closed else getattr(error, "strerror", None) or str(error)
        what = f"cannot be read: {reason[0].lower()}{reason[1:]}"
        raise unfit(what, "name a TOML file", name) from error
    if data.startswith(SIGNATURE):
        raise unfit("is a result, not TOML", "name the TOML file that it was computed from", name)
    check_size(data, name, toml_lines.LARGEST_TEXT)
    try:
        return data.decode("utf-8-sig"), name
    except UnicodeDecodeError as error:
        utf_16 = data.startswith((b"\xff\xfe", b"\xfe\xff"))
        what = "is UTF-16, not UTF-8" if utf_16 else f"is not UTF-8 (found byte 0x{data[error.start]:02x})"
        line = data.count(b"\n", 0, error.start) + 1
        raise unfit(what, "save the file as UTF-8", name, line) from error


def parse_case(
    text: str, label: str, overrides: Sequence[str] = (), profiles: Mapping[str, Record] | None = None
) -> LoadedCase:
    """Make a case of a TOML text, which messages call `label`. Raises `CaseError`, which holds every problem.

    An override reads `key.path=VALUE`, the value in TOML. It replaces what the text says, creates the tables that
    it needs, and takes effect before anything is checked. Of two keys that exclude each other, such as a constant
    load and a schedule, an override of one removes the other from the text. Measured profiles are read unless they
    are among the `profiles` or the `arrays`.
    """
    records = Records({**arrays.get({}), **(profiles or {})})
    with reading(records):
        case = parse_table(Case, text, label, overrides)
    resolved = resolved_toml(case)
    split(resolved, f"{label}, with every default filled in")  # whoever reads the result must be able to read it
    return LoadedCase(case, text, resolved, records)


def parse_resolved(text: str, label: str, overrides: Sequence[str] = ()) -> LoadedCase:
    """Make a case of the resolved one in a result; see `parse_case`.

    What its surfaces were made of is not there, and cannot be changed alone.
    """
    remedy = "a result holds the sines of a surface alone; run the case file anew, or set the whole surface, too"

    def explained(problem: Problem) -> Problem:
        made_of = problem.path[:1] == ("roughness",) and {*problem.path} & {"profile_error", "spectrum"}
        return replace(problem, remedy=remedy) if made_of else problem

    stored = parse_case(text, label)
    try:
        loaded = parse_case(text, label, overrides)
    except CaseError as error:
        raise CaseError([*map(explained, error.problems)]) from None
    before = stored.case.wheel.radius
    wheel = stored.case.roughness.wheel
    if wheel and wheel.note and loaded.case.wheel.radius != before and loaded.case.roughness.wheel == wheel:
        raise CaseError(
            [
                Problem(
                    ("wheel", "radius"),
                    f"cannot change the sines of a measured profile, made for {before!r} m",
                    remedy,
                    source=label,
                )
            ]
        )
    return loaded


def parse_table(kind: type[_Table], text: str, label: str, overrides: Sequence[str] = ()) -> _Table:
    """Make a table of some kind, such as a case, of a whole TOML text; see `parse_case`."""
    located = Located(text, label)
    problems = list[Problem]()
    try:
        data = parse(text, label)
    except CaseError as error:
        data = located.data
        problems = located.problems or [*error.problems]
    all_is_readable = all(problem.path for problem in problems)
    twice = {problem.path for problem in problems}
    sources = [label]
    set_by = dict[KeyPath, str]()
    roughness = data.get("roughness")
    for surface in roughness.values() if isinstance(roughness, dict) else ():
        if isinstance(surface, dict) and isinstance(profile := surface.get("profile"), str) and profile:
            surface["profile"] = str(Path(label).parent / profile)  # those of overrides are seen from here
    initial = data.get("initial")
    if isinstance(initial, dict) and isinstance(result := initial.get("from"), str) and result:
        initial["from"] = str(Path(label).parent / result)
    for override in overrides:
        sources.append(by := f"{argument('set')} {printable(override)}")
        try:
            path, value = parse_override(override)
            set_by |= dict.fromkeys((*put(data, path, value, kind, kept=set_by), path), by)
        except CaseError as error:
            problems += [replace(problem, source=by, line=0) for problem in error.problems]
    try:
        table = kind.model_validate(data)
    except ValidationError as error:
        for problem in wording.problems(error, kind):
            by = innermost(set_by, problem.path, "")
            line = 0 if by else innermost(located.lines, problem.path, 0)
            # what is missing may stand where nothing can be read, and of what is given twice one is kept
            if (problem.what != MISSING or all_is_readable) and problem.path not in twice:
                problems.append(replace(problem, source=by or label, line=line))
    if problems:
        raise CaseError(sorted(problems, key=lambda problem: (sources.index(problem.source), problem.line)))
    return table


def parse_over_case(
    kind: type[_OverCase], text: str, name: str, folder: Path, overrides: Sequence[str], own: Container[str]
) -> tuple[_OverCase, LoadedCase, dict[KeyPath, int]]:
    """Make a table of a file that names its case, seen from `folder`; the case; the line of each key.

    Overrides of its `own` keys belong to the file, all others to its case. Raises `CaseError`.
    """
    for_file = [override for override in overrides if (*key_path(override.partition("=")[0]), "")[0] in own]
    table = parse_table(kind, text, name, for_file)
    lines = Located(text, name).lines
    try:
        case_text, source = read_text(str(folder / table.case))
    except CaseError as error:
        at = Problem(("case",), "", "", name, lines.get(("case",), 0))
        raise CaseError(
            [
                replace(at, what=f"{problem.where} {problem.what}", remedy=problem.remedy)
                for problem in error.problems
            ]
        ) from error
    for_case = [override for override in overrides if override not in for_file]
    return table, parse_case(case_text, source, for_case), lines


def put(
    data: dict[str, object], path: tuple[str, ...], value: object, kind: type[Table], kept: Container[KeyPath]
) -> list[tuple[str, ...]]:
    """Set a key in the data of a table of some kind; the paths of the tables that were created for it.

    Of keys that exclude each other the ones given before are removed, unless they are to be kept, and so are those
    that the new one makes needless. Raises `CaseError` where something on the path is not a table.
    """
    *parents, key = path
    table: object = data
    created = []
    for end, parent in enumerate(parents, start=1):
        if isinstance(table, dict):
            if parent not in table:
                created.append(path[:end])
            table = table.setdefault(parent, {})
    if not isinstance(table, dict):
        raise CaseError([Problem(path, f"{key_text(path[:-1])} is not a table", "set a key of a table")])
    table[key] = value
    groups = tables_within(kind).get(tuple(parents), Table).alternatives
    beside = {other for group in groups if key in group for other in group}
    excluded = [(*parents, other) for group in groups for other in group if beside and other not in beside]
    for other in (*excluded, *kind.needless.get(path, ())):
        parent_table = table if other[:-1] == path[:-1] else data.get(str(other[0]))
        if other not in kept and isinstance(parent_table, dict):
            parent_table.pop(other[-1], None)
    return created


def parse_override(override: str) -> tuple[tuple[str, ...], object]:
    """The key path and the value of an override; raises `CaseError`."""
    try:
        override.encode()
    except UnicodeEncodeError:
        raise unfit("is not UTF-8", "write it in UTF-8") from None
    split(override)  # refuses what would take long
    key, _, value = override.partition("=")
    path = key_path(key)
    if "=" not in override or not path:
        raise unfit(
            f"does not begin with a key (found {printable(key)})", f"write {argument('set')} key.path=VALUE"
        )
    with suppress(CaseError):
        parsed = parse(f"value={value}")
        if parsed.keys() == {"value"}:
            return path, parsed["value"]
    remedy = WRITING
    if re.fullmatch(r"[^\W\d][\w .-]*", value):
        remedy = f"texts need quotes: {argument('set')} {key}={shlex.quote(json.dumps(value, ensure_ascii=False))}"
    raise unfit(f"the value is not valid TOML (found {printable(value)})", remedy)


@lru_cache(maxsize=256)
def key_path(text: str) -> tuple[str, ...]:
    """The parts of a key path as TOML writes it; none if it is not one."""
    if "\n" in text or text.count(".") >= toml_lines.MOST_PARTS:
        return ()
    with suppress(CaseError):
        path, value = toml_lines.only_path(parse(f"{text}=0"))
        return path if value == 0 else ()
    return ()
