"""Two or three results of one kind beside each other: what was changed, and what became of it."""

import textwrap
from collections.abc import Sequence
from functools import partial
from typing import Any

from brakecli.errors import UsageError
from brakecli.files.contents import keys
from brakecli.files.read import StoredResult
from brakecli.plots import over_each_other
from brakecli.reports.blocks import Beside, Part, Table, Texts, key_unit, percent, picture, rounded, shown

PICTURE = "All results in one picture: the first one wide, the second one dashed"
THIRD = ", the third one dotted"
# to which numbers are compared; increase above which there is no per cent
DIGITS = 4
MOST_PART = 10.0
# rows of both tables on a single page, and letters of the keys that are left out
_MOST_KEYS = 5
_MOST_NUMBERS = 9
_MOST_LETTERS = 180
_NARROW = 2  # results whose picture stands beside their numbers, and not below them
_NAMED = 2  # changed keys by which the results are named
_CHOSEN = "solver.duration", "output.sample_interval"  # by the program, where a file gives no numbers
_SAME = "same"


def beside(results: Sequence[StoredResult], parts: Sequence[Part], full: bool) -> Beside | None:
    """What a page says of all of them together, if they are of one kind; rows that are many only if it is `full`.

    Raises UnreadableResultError.
    """
    if len({str(result.attributes.get("kind")) for result in results}) != 1:
        return None
    given = [keys(result, ("case_toml",)) for result in results]
    fixed = [name for name in _CHOSEN if any(isinstance(each.get(name), int | float) for each in given)]
    case = list[tuple[Any, ...]]()
    chosen = list[str]()
    every = [keys(result) for result in results]
    for name in dict.fromkeys(name for each in every for name in each):
        values = [each.get(name) for each in every]
        if all(value == values[0] for value in values):
            continue
        texts = [shown(value, key_unit(name)) for value in values]
        if name in _CHOSEN and name not in fixed:
            chosen += [f"{name} ({', '.join(texts)})"] * (len({*texts}) > 1)
        elif name != "title" and {} not in values:  # which stands for a table without keys
            case.append((name, *values, key_unit(name)))
    known = {name: units for part in parts for name, (_, units) in part.numbers.items()}
    numbers = []
    for name, units in known.items():
        values = [rounded(part.numbers.get(name, (None,))[0], DIGITS) for part in parts]
        if {*map(str, values)} - {"None", ""}:
            numbers.append((name, *values, units))
    single = [row for row in case if all(isinstance(each, str | int | float) for each in row[1:-1])][:_NAMED]
    apart = [
        ", ".join(f"{row[0]} = {shown(row[side], row[-1])}" for row in single) for side in range(1, len(parts) + 1)
    ]
    names = [", ".join(filter(None, pair)) for pair in zip((part.name for part in parts), apart, strict=True)]
    letters = "ABC"[: len(parts)]
    files = [f"{letter}: {part.name}" for letter, part in zip(letters, parts, strict=True)]
    try:
        draw = partial(over_each_other.draw, results, "", files, in_a_row=len(parts) > _NARROW)
        pictures = [picture(PICTURE + THIRD * (len(parts) > _NARROW), draw)]
    except UsageError:  # no curves that could be drawn over each other
        pictures = [each.picture for each in parts if each.picture]
    titles = [part.title for part in parts]
    title = " – ".join(titles)
    if len({*titles}) == 1:
        steps = [f"{name} {' → '.join(shown(each, units) for each in values)}" for name, *values, units in single]
        title = f"{titles[0]}: {', '.join(steps) or ' – '.join(names)}"
        titles = [": ".join(filter(None, pair)) for pair in zip(titles, apart, strict=True)]
    head = ("", *letters, *(f"{letter} against A" for letter in letters[1:]))
    most = len(case) if full else _MOST_KEYS
    blocks: list[Any] = [_table(case[:most], head) if case else Texts(["The cases are the same."])]
    if more := ", ".join(name for name, *_ in case[most:]):
        blocks.append(Texts([f"Different, too: {textwrap.shorten(more, _MOST_LETTERS, placeholder=' …')}."]))
    if not full:  # what is the same is no news
        numbers = [row for row in numbers if len({*map(str, row[1:-1])}) > 1][:_MOST_NUMBERS]
    if chosen:
        blocks.append(Texts([f"Not given as numbers in the files, and different, too: {', '.join(chosen)}."]))
    return Beside(title, names, titles, blocks, _table(numbers, head), pictures)


def _table(rows: Sequence[tuple[Any, ...]], head: Sequence[str]) -> Table:
    """Name, all values, and by how much they differ from the first, of rows that end with the unit."""
    found = list[tuple[str, ...]]()
    marked = list[int]()
    for name, first, *others, units in rows:
        changes = [_change(first, other) for other in others]
        if {*changes} != {_SAME}:
            marked.append(len(found))
        found.append((name, *(shown(each, units) for each in (first, *others)), *changes))
    return Table(found, head, marked=marked)


def _change(a: Any, b: Any) -> str:
    if a == b:
        return _SAME
    if a and all(isinstance(each, int | float) and not isinstance(each, bool) for each in (a, b)):
        part = b / a - 1.0
        if -1.0 <= part < MOST_PART:
            return percent(part)
    return "differs"
