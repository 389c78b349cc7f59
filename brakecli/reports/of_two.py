"""Two results of one kind beside each other: what was changed, what became of it, and both in one picture."""

from collections.abc import Sequence
from functools import partial
from typing import Any

from brakecli.errors import UsageError
from brakecli.files.contents import changed, keys
from brakecli.files.read import StoredResult
from brakecli.plots import two
from brakecli.reports.blocks import Pair, Part, Table, Texts, key_unit, percent, picture, rounded, shown

PICTURE = "Both results in one picture, the first one wide, the second one dashed"
# to which numbers are compared; increase above which there is no per cent
DIGITS = 4
MOST_PART = 10.0
_NAMED = 2  # changed keys by which the results are named
_CHOSEN = "solver.duration", "output.sample_interval"  # by the program, where a file gives no numbers
_SAME = "same"


def pair_of(results: tuple[StoredResult, StoredResult], parts: Sequence[Part]) -> Pair | None:
    """What a page says of both together, if they are of one kind. Raises UnreadableResultError."""
    kinds = {str(result.attributes.get("kind")) for result in results}
    if len(kinds) != 1:
        return None
    a, b = parts
    given = [keys(result, ("case_toml",)) for result in results]
    fixed = [name for name in _CHOSEN if any(isinstance(each.get(name), int | float) for each in given)]
    case = list[tuple[Any, ...]]()
    chosen = list[str]()
    for name, *values in (each.values() for each in changed(*map(keys, results))):
        texts = [shown(value, key_unit(name)) for value in values]
        if name in _CHOSEN and name not in fixed:
            chosen += [f"{name} ({', '.join(texts)})"] * (texts[0] != texts[1])
        elif name != "title" and {} not in values:  # which stands for a table without keys
            case.append((name, *values, key_unit(name)))
    known = {**a.numbers, **b.numbers}
    columns = [[rounded(part.numbers.get(name, (None,))[0], DIGITS) for name in known] for part in parts]
    both = zip(known, *columns, (units for _, units in known.values()), strict=True)
    numbers = [row for row in both if {*map(str, row[1:3])} - {"None", ""}]
    single = [row for row in case if all(isinstance(each, str | int | float) for each in row[1:3])][:_NAMED]
    apart = [", ".join(f"{row[0]} = {shown(row[side], row[3])}" for row in single) for side in (1, 2)]
    names = [", ".join(filter(None, pair)) for pair in zip((a.name, b.name), apart, strict=True)]
    try:
        pictures = [picture(PICTURE, partial(two.draw, results, "", names))]
    except UsageError:  # no curves that could be drawn over each other
        pictures = [each.picture for each in parts if each.picture]
    title = f"{a.title} – {b.title}"
    titles = [a.title, b.title]
    if a.title == b.title:
        steps = [f"{name} {shown(one, units)} → {shown(other, units)}" for name, one, other, units in single]
        title = f"{a.title}: {', '.join(steps) or ' – '.join(names)}"
        titles = [": ".join(filter(None, pair)) for pair in zip(titles, apart, strict=True)]
    files = tuple(f"{letter}: {part.name}" for letter, part in zip("AB", parts, strict=True))
    head = ("", *files, "B against A")
    blocks: list[Any] = [_table(case, head) if case else Texts(["The cases are the same."])]
    if chosen:
        blocks.append(Texts([f"Not given as numbers in the files, and different, too: {', '.join(chosen)}."]))
    return Pair(title, names, titles, blocks, _table(numbers, head), pictures)


def _table(rows: Sequence[tuple[Any, ...]], head: Sequence[str]) -> Table:
    """Name, both values, and by how much they differ, of rows that end with the unit."""
    found = [(name, shown(a, units), shown(b, units), _change(a, b)) for name, a, b, units in rows]
    return Table(found, head, marked=[place for place, row in enumerate(found) if row[-1] != _SAME])


def _change(a: Any, b: Any) -> str:
    if a == b:
        return _SAME
    if a and all(isinstance(each, int | float) and not isinstance(each, bool) for each in (a, b)):
        part = b / a - 1.0
        if -1.0 <= part < MOST_PART:
            return percent(part)
    return "differs"
