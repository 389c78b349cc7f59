"""Critical friction along one key of a case: `brakecli stability --vary KEY=START:STOP:NUM`."""

from typing import Any, NamedTuple

import numpy as np

from brakecli.analysis.stability.report import stability
from brakecli.case.read import LoadedCase, parse_case
from brakecli.case.system import system_of
from brakecli.errors import UsageError
from brakecli.files import fields

MOST = 10_000


class Vary(NamedTuple):
    """A key path and its values."""

    key: str
    values: tuple[float, ...]


def parse_vary(text: str) -> Vary:
    """KEY=START:STOP:NUM, both ends included; raises UsageError."""
    key, _, numbers = text.partition("=")
    parts = numbers.split(":")
    try:
        start, stop, count = float(parts[0]), float(parts[1]), int(parts[2])
        sound = len(parts) == 3 and key != "" and 1 <= count <= MOST and np.isfinite([start, stop]).all()
    except (ValueError, IndexError):
        sound = False
    if not sound:
        raise UsageError(
            f"--vary {text}: is not KEY=START:STOP:NUM with NUM from 1 to {MOST}; write, for instance, "
            "--vary link2.angle_deg=1:10:10"
        )
    return Vary(key, tuple(float(value) for value in np.linspace(start, stop, count)))


def varied(loaded: LoadedCase, vary: Vary) -> list[dict[str, Any]]:
    """Critical friction, its kind, and the scheme's answer at each value; raises CaseError for a wrong one."""
    entries = []
    for value in vary.values:
        case = parse_case(loaded.resolved, "--vary", (f"{vary.key}={value!r}",)).case
        entries.append({"value": value, **fields.values(fields.VARIED, stability(system_of(case)))})
    return entries
