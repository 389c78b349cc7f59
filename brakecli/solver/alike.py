"""Many things at once, as far as they are alike."""

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any

from numpy.typing import NDArray


def at_once(keys: Sequence[Hashable], compute: Callable[[list[int]], Iterable[Any]]) -> list[Any]:
    """What is computed of each, by its place: of all with the same key at once, and nothing where the key is None.

    `compute` gets the places of those that are alike, and gives what it finds of each in this order.
    """
    found = list[Any]([None] * len(keys))
    alike = defaultdict[Hashable, list[int]](list)
    for place, key in enumerate(keys):
        if key is not None:
            alike[key].append(place)
    for places in alike.values():
        for place, each in zip(places, compute(places), strict=True):
            found[place] = each
    return found


def by_rows(columns: dict[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """The rows of columns, numbers of Python by the names of the columns."""
    rows = zip(*(each.tolist() for each in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]
