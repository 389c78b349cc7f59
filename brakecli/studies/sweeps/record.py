"""The record of a point of a sweep: its fields, its size, and whether one that arrives is sound."""

import math
from collections.abc import Mapping
from contextlib import suppress
from enum import StrEnum
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.results.field import LARGEST_SQUARE
from brakecli.studies.sweeps.plan import Plan


class Status(StrEnum):
    """How the computation of a point has ended."""

    DONE = "done"
    FAILED = "failed"
    CRASHED = "crashed"


_KNOWN: dict[str, type[StrEnum]] = {"status": Status, "regime": Regime, "excitation": Excitation}


@lru_cache(maxsize=4)
def record_type(plan: Plan) -> np.dtype[np.void]:
    """The record of a point of the sweep."""
    return np.dtype([(field.name, field.kind) for field in plan.fields])


def unsound(plan: Plan, records: bytes, units: int) -> str:
    """Why these are not the records of so many units, wherever they come from; empty where they are."""
    kind = record_type(plan)
    size = len(records)
    if size != units * plan.unit_length * kind.itemsize:
        return f"{size} bytes in place of {units * plan.unit_length} records of {kind.itemsize}"
    rows = np.frombuffer(records, kind)
    return next((f"a {name} that no point has" for name in kind.names or () if not _fits(name, rows[name])), "")


def _fits(name: str, values: NDArray[Any]) -> bool:
    """Whether points may have these values; numbers may be missing, counts not."""
    if values.dtype.kind == "i":
        return bool((values >= 0).all())
    if values.dtype.kind == "f":
        return not (np.abs(values) > LARGEST_SQUARE).any()
    with suppress(UnicodeDecodeError):
        texts = {text.decode() for text in np.unique(values).tolist()}
        return texts <= {*_KNOWN.get(name, texts)}
    return False


def blank(kind: np.dtype[np.void], status: Status, reason: str) -> NDArray[np.void]:
    """The record of a point without a result."""
    return filled(kind, {"status": status, "reason": reason, "regime": "undecided", "excitation": "none"})


def filled(kind: np.dtype[np.void], values: Mapping[str, object]) -> NDArray[np.void]:
    """A record of some values; missing numbers are NaN."""
    return np.array([tuple(_fitted(kind[name], values.get(name)) for name in kind.names or ())], kind)


def _fitted(kind: np.dtype[np.void], value: object) -> object:
    """A value as its place in a record takes it."""
    if isinstance(value, str):  # as many whole characters as fit
        value = value.encode()
        return value if len(value) <= kind.itemsize else value[: kind.itemsize].decode(errors="ignore").encode()
    if isinstance(value, list):  # as many as there are, the rest missing
        return np.resize(value + [math.nan] * kind.shape[0], kind.shape)
    if value is None:
        return b"" if kind.kind == "S" else math.nan if kind.base.kind == "f" else 0
    return value
