"""Sweeps over initial states whose points have made-up numbers: those of motions that are one or another."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from brakecli.studies.sweeps.plan import Plan
from brakecli.studies.sweeps.record import Status, blank, record_type
from brakecli.studies.sweeps.result import SweepReport
from tests.studies.sweeps.helpers import axis, inline, write_sweep

DAMPED: dict[str, Any] = {"regime": "damped", "excitation": "none", "amplitude": 1e-9}
FORCED: dict[str, Any] = {"regime": "damped", "excitation": "forced", "settled": 1, "amplitude": 2e-6}
CYCLE: dict[str, Any] = {
    "regime": "relaxation",
    "excitation": "self-excited",
    "settled": 1,
    "amplitude": 1e-5,
    "frequency": 100.0,
    "stick_fraction": 0.3,
    "contact_loss_fraction": 0.0,
}
SPEEDS = axis("initial.vx", "start = 0.0", "stop = 1.0", "num = {}")

Made = list[dict[str, Any]]


def made_of(points: Made) -> Callable[[Plan, int, int], bytes]:
    """What makes up these numbers in place of runs."""

    def compute(plan: Plan, begin: int, count: int) -> bytes:
        records = np.repeat(blank(record_type(plan), Status.DONE, "made up"), count)
        for record, point in zip(records, points[begin : begin + count], strict=True):
            for name, value in point.items():
                record[name] = value.encode() if isinstance(value, str) else value
        return records.tobytes()

    return compute


def swept(folder: Path, points: Made, *tables: str, **options: Any) -> SweepReport:
    """A sweep over initial speeds whose points have these numbers."""
    loaded = write_sweep(folder, *(tables or [SPEEDS.format(len(points))]))
    return inline(loaded, folder / "s.h5", made_of(points), force=True, **options)
