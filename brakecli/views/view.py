"""A view: a title, the answer in sentences, then numbers and tables; what is a detail is shown on demand."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from brakecli.faces import argument

SHORT_POINTS = 6
"""Points, or values along a key, that are listed unless all are asked for: a short answer has twelve lines."""


@dataclass(frozen=True)
class Row:
    """A number or a text under its label."""

    label: str
    text: str
    detail: bool = False


@dataclass(frozen=True)
class Table:
    """Columns under their headers; the first `keys` of them name a row.

    A short answer has the rows before `first`, all of them if None, and no table of which none is left.
    """

    columns: Mapping[str, Sequence[str]]
    title: str = ""
    keys: int = 1
    first: int | None = None


@dataclass(frozen=True)
class View:
    """What a person sees of a result, its answer first."""

    title: str
    answer: Sequence[str] = ()
    blocks: Sequence[Row | Table] = field(default_factory=list)

    def short(self) -> "View":
        """The view without its details."""
        return View(self.title, self.answer, [piece for block in self.blocks for piece in _short(block)])


def _short(block: Row | Table) -> list[Row | Table]:
    if isinstance(block, Row):
        return [] if block.detail else [block]
    rows = max(map(len, block.columns.values()), default=0)
    if block.first is None or rows <= block.first:
        return [block]
    columns = {header: cells[: block.first] for header, cells in block.columns.items()}
    title = f"{block.title} ({block.first} of {rows}; all: {argument('details')})" if block.title else ""
    return [replace(block, columns=columns, title=title)] if block.first else []


def details(*rows: Row) -> list[Row]:
    """Rows that are shown on demand."""
    return [Row(row.label, row.text, detail=True) for row in rows]


def sentence(text: str) -> str:
    """A text as a sentence; a key, a number or a command at its head stays as it is."""
    head = text.partition(" ")[0]
    named = any(sign in head for sign in ".:_`=")
    return f"{text if named else text[:1].upper() + text[1:]}{'' if text.endswith('.') else '.'}"


def sentences(texts: Iterable[str]) -> list[str]:
    """Texts as sentences; an empty one is none."""
    return [sentence(text) for text in texts if text]
