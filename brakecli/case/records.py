"""Measured profiles as they travel with a case."""

from contextvars import ContextVar
from typing import NamedTuple

MOST_MEASURED = 2.5e8  # bytes of all measured profiles of a case or sweep, which travel to every worker


class Record(NamedTuple):
    """A measured profile: rising places (m, or rad if `is_angle`) and heights (m), each as bytes of float64."""

    place: bytes
    height: bytes
    is_angle: bool


arrays = ContextVar[dict[str, Record]]("measured profiles that come from no file, by their names")
