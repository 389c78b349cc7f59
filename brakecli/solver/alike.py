"""Many things at once, as far as they are alike."""

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any

from numpy.typing import NDArray


def at_once(keys: Sequence[Hashable], compute: Callable[[list[int]], Iterable[Any]]) -> list[Any]:
    """What is computed of each, by its place: of all with the same key at once, and nothing where the key is None.

    `compute` gets the places of those that are alike, and gives what it finds of each in this order.
    """
    results = list[Any]([None] * len(keys))
    alike = defaultdict[Hashable, list[int]](list)
    for index, key in enumerate(keys):
        if key is not None:
            alike[key].append(index)
    for indices in alike.values():
        for index, result in zip(indices, compute(indices), strict=True):
            results[index] = result
    return results


def by_rows(columns: dict[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """The rows of columns, numbers of Python by the names of the columns."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]
