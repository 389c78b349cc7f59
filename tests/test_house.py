"""What linters cannot see: arrows through the package itself, and numbers that share a name."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from benchmarks.size import is_packed, is_starred
from tests.commands import ROOT

PACKAGE = ROOT / "brakecli"
parsed = cache(ast.parse)


def arrows(text: str) -> Iterator[str]:
    """What a file imports of the package itself, at its top and inside functions."""
    for node in ast.walk(parsed(text)):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names if each.name == "brakecli")
        elif isinstance(node, ast.ImportFrom) and (node.module == "brakecli" or node.level):
            yield from (f"brakecli.{each.name}" for each in node.names)


def is_room(name: str) -> bool:
    """Whether a name stands for a module, which import-linter follows."""
    path = PACKAGE.joinpath(*name.split(".")[1:])
    return path != PACKAGE and (path.with_suffix(".py").exists() or path.is_dir())


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("import brakecli", ["brakecli"]),
        ("from brakecli import __version__", ["brakecli.__version__"]),
        ("def f():\n    from brakecli import run", ["brakecli.run"]),
        ("from . import sweep", ["brakecli.sweep"]),
        ("from brakecli import stop, about", []),
        ("from brakecli.about import __version__", []),
    ],
)
def test_an_arrow_to_the_face_is_seen(text: str, wrong: list[str]) -> None:
    assert [name for name in arrows(text) if not is_room(name)] == wrong


def test_no_room_imports_the_face() -> None:
    found = {
        str(path.relative_to(PACKAGE)): wrong
        for path in PACKAGE.rglob("*.py")
        if (wrong := [name for name in arrows(path.read_text()) if not is_room(name)])
    }
    assert not found


def test_the_face_imports_nothing_but_the_version_until_it_is_used() -> None:
    tree = parsed(Path(PACKAGE, "__init__.py").read_text())
    at_once = [node.module for node in tree.body if isinstance(node, ast.ImportFrom)]
    assert at_once == ["typing", "brakecli.about"]


def is_number(node: ast.expr) -> bool:
    """Whether an expression is made of numbers alone."""
    parts = [part for part in ast.walk(node) if not isinstance(part, ast.operator | ast.unaryop)]
    arithmetic = all(isinstance(part, ast.Constant | ast.BinOp | ast.UnaryOp) for part in parts)
    return arithmetic and all(type(part.value) in (int, float) for part in parts if isinstance(part, ast.Constant))


def holds_numbers(node: ast.expr | None) -> bool:
    """Whether a literal holds several numbers side by side. The text keys of a dictionary are their names."""
    match node:
        case ast.Tuple(entries) | ast.List(entries) | ast.Set(entries):
            return sum(map(is_number, entries)) > 1 or any(map(holds_numbers, entries))
        case ast.Dict(keys, values):
            named = all(isinstance(key, ast.Constant) and isinstance(key.value, str) for key in keys)
            return (sum(map(is_number, values)) > 1 and not named) or any(map(holds_numbers, values))
    return False


def shared_names(text: str) -> Iterator[str]:
    """Names at the top of a file that hold several numbers, without a type that says that all are of one kind."""
    for node in parsed(text).body:
        pairs: list[tuple[ast.expr, ast.expr | None]] = []
        if isinstance(node, ast.AnnAssign) and "..." not in ast.unparse(node.annotation):
            pairs = [(node.target, node.value)]
        elif isinstance(node, ast.Assign):
            names = node.targets[0]
            values = node.value
            apart = isinstance(names, ast.Tuple) and isinstance(values, ast.Tuple)
            pairs = [*zip(names.elts, values.elts, strict=True)] if apart else [(names, values)]  # type: ignore[attr-defined]
        yield from (name.id for name, value in pairs if isinstance(name, ast.Name) and holds_numbers(value))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("KICKED = 0.5, 0.1", ["KICKED"]),
        ("KICKED = [1 / 2, -0.1]", ["KICKED"]),
        ("KICKED: tuple[float, float] = 0.5, 0.1", ["KICKED"]),
        ("KICKED, LATE = (0.5, 0.1), 3.0", ["KICKED"]),
        ("KICKED = {1: 0.5, 2: 0.1}", ["KICKED"]),
        ("KICKED = (('sizes', 0.5, 0.1),)", ["KICKED"]),
        ("SIZE_OFF, FREQUENCY_OFF = 0.5, 0.1", []),
        ("MOST = {'newton': 100, 'fixed-point': 500}", []),
        ("LADDER: tuple[float, ...] = 0.5, 0.1", []),
        ("LADDER = Ladder(0.5, 0.1)", []),
        ("NAMES = 'one', 'two'", []),
    ],
)
def test_numbers_under_one_name_are_seen(text: str, found: list[str]) -> None:
    assert [*shared_names(text)] == found


def test_every_number_has_a_name_of_its_own() -> None:
    found = {
        str(path.relative_to(PACKAGE)): names
        for path in PACKAGE.rglob("*.py")
        if (names := [*shared_names(path.read_text())])
    }
    assert not found


def packed(text: str) -> list[str]:
    """Assignments that pack several things into one line, though none of them needs the others."""
    return [ast.unparse(node) for node in ast.walk(parsed(text)) if is_packed(node)]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a, b = f(x), 0.0", ["a, b = (f(x), 0.0)"]),
        ("def f():\n    one.x, two.y = 1, 2", ["one.x, two.y = (1, 2)"]),
        ("a, b = b, a", []),
        ("a, b = b, a + b", []),
        ("a, b = f(x)", []),
        ("a = f(x)\nb = 0.0", []),
    ],
)
def test_a_packed_assignment_is_seen(text: str, found: list[str]) -> None:
    assert packed(text) == found


def test_every_assignment_has_a_line_of_its_own() -> None:
    paths = [
        path
        for folder in ("brakecli", "tests", "benchmarks", "docs")
        for path in ROOT.joinpath(folder).rglob("*.py")
    ]
    found = {str(path.relative_to(ROOT)): wrong for path in paths if (wrong := packed(path.read_text()))}
    assert len(paths) > 400
    assert not found


def is_large_record(node: ast.ClassDef) -> bool:
    """Whether a class is a NamedTuple or a dataclass of more than three fields."""
    made_by = " ".join(map(ast.unparse, [*node.bases, *node.decorator_list]))
    fields = [part for part in node.body if isinstance(part, ast.AnnAssign)]
    return len(fields) > 3 and ("NamedTuple" in made_by or "dataclass" in made_by)


def large_records(text: str) -> list[str]:
    """The names of such records that a file defines."""
    nodes = ast.walk(parsed(text))
    return [node.name for node in nodes if isinstance(node, ast.ClassDef) and is_large_record(node)]


def filled_by_place(text: str, records: set[str]) -> list[int]:
    """The lines in which these records, or `cls` of one of them, are filled by starred tuples, or by `_make`."""
    tree = parsed(text)
    places = [(node, records) for node in ast.walk(tree)]
    for owner in ast.walk(tree):
        if isinstance(owner, ast.ClassDef) and owner.name in records:
            places += [(node, {"cls"}) for node in ast.walk(owner)]
    found = set[int]()
    for node, names in places:
        if isinstance(node, ast.Call):
            *_, before, last = ["", *ast.unparse(node.func).split(".")]
            if (last in names and is_starred(node)) or (last == "_make" and before in names):
                found.add(node.lineno)
    return sorted(found)


RECORDS = """
class Seen(NamedTuple):
    a: float
    b: float
    c: float
    d: float = 0.0
    @classmethod
    def of(cls, row): return cls(*row)

@dataclass(frozen=True)
class Mode(Generic[A]):
    a: float
    b: float
    c: float
    d: float

@dataclasses.dataclass
class Row(Shown):
    a: float
    b: float
    c: float
    d: float

class Pair(NamedTuple):
    a: float
    b: float

class Plain:
    a: float
    b: float
    c: float
    d: float
"""


def test_records_of_many_fields_are_seen() -> None:
    assert large_records(RECORDS) == ["Seen", "Mode", "Row"]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("Seen(*row)", [1]),
        ("a = 0.0\nb = [seen.Seen(a, *each, d=a) for each in rows]", [2]),
        ("Seen(\n    Mode(*row[:4]), *row[4:]\n)", [1, 2]),
        ("Seen._make(row)\nseen.Seen._make(row)", [1, 2]),
        (RECORDS, [8]),
        ("Seen(a, b, c=c, **rest)\nPair(*row)\nPair._make(row)\nprint(*row)\nf(*row)(1)", []),
    ],
)
def test_a_record_filled_by_place_is_seen(text: str, found: list[int]) -> None:
    assert filled_by_place(text, {"Seen", "Mode"}) == found


def test_records_of_many_fields_are_filled_by_name() -> None:
    texts = {path: path.read_text() for path in PACKAGE.rglob("*.py")}
    records = {name for text in texts.values() for name in large_records(text)}
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path, text in texts.items()
        for line in filled_by_place(text, records)
    ]
    assert len(records) > 100
    assert not found
