"""What a page is made of: sections with tables, pictures and texts, which the template `report.html` writes."""

import base64
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from itertools import groupby
from typing import SupportsFloat

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from brakecli.results.field import Field
from brakecli.studies.runs.advise import AdviceReport
from brakecli.studies.sweeps.result import unit
from brakecli.views.plots import style
from brakecli.views.render import Renderer
from brakecli.views.view import Row, View, sentences
from brakecli.views.view import Table as Columns

Numbers = Mapping[str, tuple[object, str]]
"""What results are compared by: values with their units, by their names."""

Shares = tuple[float, float, float]
"""Part of the brakes that squeal, and both ends of its 95 % interval."""

PER_CENT = "%"
_PARTS = ("margin", "squeal_probability")  # besides parts of the time


@dataclass(frozen=True)
class Table:
    """Rows of texts, with a header or without; one that is `folded` under its title opens on demand.

    Numbers of rows that are `marked` are those that a reader is to see first.
    """

    rows: Sequence[Sequence[str]]
    head: Sequence[str] = ()
    folded: str = ""
    marked: Collection[int] = ()
    kind = "table"


@dataclass(frozen=True)
class Texts:
    """Sentences."""

    lines: Sequence[str]
    kind = "texts"


@dataclass(frozen=True)
class Code:
    """A text to be copied, folded under a title if there is one."""

    text: str
    folded: str = ""
    kind = "code"


@dataclass(frozen=True)
class Picture:
    """A picture for wide and for narrow screens, with the words for those who do not see it."""

    words: str
    wide: str
    narrow: str
    kind = "picture"


@dataclass(frozen=True)
class Side:
    """An axis of a map: the edges of its cells and the names of their values, in short for ticks."""

    label: str
    edges: list[float]
    values: list[str]
    short: list[str]

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Places of ticks, seven at most, and what stands there."""
        step = -(-len(self.values) // 7)
        middles = [0.5 * (low + high) for low, high in zip(self.edges, self.edges[1:], strict=False)]
        return list(zip(middles, self.short, strict=True))[::step]


@dataclass(frozen=True)
class Map:
    """Cells in rows and columns; `data` is what the page's script reads."""

    title: str
    x: Side
    y: Side
    cells: list[tuple[str, str]]  # colour and path of all cells that have it
    letters: list[tuple[float, float, str]]
    legend: list[tuple[str, str]]
    data: Mapping[str, object]
    kind = "map"


Block = Table | Texts | Code | Picture | Map


@dataclass(frozen=True)
class Section:
    """A headline with what stands below it."""

    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Part:
    """What the page says of one result: its first page, then the `sections` of the appendix."""

    name: str
    title: str
    question: str
    answer: Sequence[str]
    picture: Picture | None
    change: Sequence[Block]  # what to change
    sections: Callable[[], Sequence[Section]]
    numbers: Numbers
    versions: Mapping[str, str] = field(default_factory=dict)
    advice: AdviceReport | None = None  # of a run
    squeal: Shares | None = None  # of a study


@dataclass(frozen=True)
class Beside:
    """Results beside each other, named by what differs: a picture of all together, or one of each."""

    title: str
    best: str  # a sentence; empty where nothing tells one from the other
    names: Sequence[str]
    titles: Sequence[str]  # of their own pages
    changed: Sequence[Block]
    numbers: Table
    pictures: Sequence[Picture]


def picture(words: str, draw: Callable[[], Figure]) -> Picture:
    """The picture that a function draws, for both widths."""
    images = []
    for narrow in (False, True):
        with style.applied(narrow, titled=False):
            png = Image.open(BytesIO(style.rendered(draw(), ".png", dpi=120))).convert("RGB")
        stream = BytesIO()
        # a third of the bytes, and no difference that could be seen; rare colours are among them
        few = png.quantize(255, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        few.save(stream, "png", optimize=True)
        images.append("data:image/png;base64," + base64.b64encode(stream.getvalue()).decode())
    return Picture(words, images[0], images[1])


def _prefixed(value: SupportsFloat, unit: str) -> str:
    if isinstance(value, int | np.integer) and not unit:
        return f"{int(value):,}".replace(",", "\u202f").replace("-", "−")
    factor, unit = style.prefixed(abs(float(value)), unit)
    return f"{style.readable(factor * float(value))} {unit}".rstrip().replace(" ", "\u00a0")


PAGE = Renderer(_prefixed, "–", most=8, units_each=True)
"""A page writes a prefix where a number needs one."""
shown = PAGE.text


def blocks_of(view: View) -> list[Block]:
    """The numbers and tables of a view, as a page writes them."""
    pieces = list[Block]()
    for kind, blocks in groupby(view.blocks, type):
        if kind is Row:
            pieces.append(Table([(row.label, row.text) for row in blocks if isinstance(row, Row)]))
            continue
        for table in blocks:
            if isinstance(table, Columns):
                pieces.append(Texts(sentences([table.title])))
                pieces.append(Table([*zip(*table.columns.values(), strict=True)], [*table.columns]))
    return pieces


def percent(fraction: float) -> str:
    """A change, as a part of what was there before, in per cent."""
    return f"{100.0 * fraction:+.3g}\u00a0%".replace("-", "−")


def rounded(value: object, digits: int) -> object:
    """A number to so many digits; anything else as it is."""
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


def key_unit(key: str) -> str:
    """The unit of a key of the case; empty where it has none, or where a case has no such key."""
    with suppress(KeyError):
        return unit(key)
    return ""


def numbers_of(fields: Iterable[Field], values: Mapping[str, object]) -> Numbers:
    """The values of some fields, None where there is none; parts are in per cent, as in sentences."""
    return {item.title: _number(item, values.get(item.name)) for item in fields}


def share(fraction: float | None) -> tuple[float | None, str]:
    """A part of a whole in per cent, with that as its unit."""
    return None if fraction is None else 100.0 * fraction, PER_CENT


def _number(item: Field, value: object) -> tuple[object, str]:
    if item.is_part_of_time or item.name in _PARTS:
        return share(float(value) if isinstance(value, SupportsFloat) else None)
    return value, item.units
