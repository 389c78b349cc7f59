"""Two results of one kind beside each other: what was changed, what became of it, and both in one picture."""

from collections.abc import Sequence
from functools import partial
from typing import Any

from brakecli.errors import UsageError
from brakecli.files.contents import changed, keys
from brakecli.files.read import StoredResult
from brakecli.plots import two
from brakecli.reports.blocks import Pair, Part, Table, key_unit, picture, rounded, shown

PICTURE = "Both results in one picture, the first one wide, the second one dashed"
DIGITS, MOST_PART = 4, 10.0  # to which numbers are compared; increase above which there is no per cent
_SAME = "same"


def pair_of(results: tuple[StoredResult, StoredResult], parts: Sequence[Part]) -> Pair | None:
    """What a page says of both together, if they are of one kind. Raises UnreadableResultError."""
    kinds = {str(result.attributes.get("kind")) for result in results}
    if len(kinds) != 1:
        return None
    a, b = parts
    case = [
        (each["name"], each["a"], each["b"], key_unit(each["name"]))
        for each in changed(*map(keys, results))
        if each["name"] != "title" and {} not in each.values()  # which stands for a table without keys
    ]
    names = {**a.numbers, **b.numbers}
    columns = [[rounded(part.numbers.get(name, (None,))[0], DIGITS) for name in names] for part in parts]
    both = zip(names, *columns, (units for _, units in names.values()), strict=True)
    numbers = [row for row in both if {*map(str, row[1:3])} - {"None", ""}]
    try:
        pictures = [picture(PICTURE, partial(two.draw, results, ""))]
    except UsageError:  # no curves that could be drawn over each other
        pictures = [each.picture for each in parts if each.picture]
    title = a.title if a.title == b.title else f"{a.title} – {b.title}"
    files = tuple(f"{letter}: {part.name}" for letter, part in zip("AB", parts, strict=True))
    head = ("", *files, "B against A")
    return Pair(title, _table(case, head), _table(numbers, head), pictures)


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
            return f"{100.0 * part:+.3g}\u00a0%".replace("-", "−")
    return "differs"
