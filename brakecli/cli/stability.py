"""`brakecli stability`."""

import math
from contextlib import suppress
from typing import Annotated

from brakecli.cli.inputs import load_case
from brakecli.cli.options import AsJson, CaseArgument, Overrides, Quiet, option
from brakecli.cli.output import announce_compilation, show_result
from brakecli.errors import UsageError

MOST_VALUES = 10_000


def command(
    case: CaseArgument,
    overrides: Overrides = None,
    vary: Annotated[str | None, option("Tabulate critical friction along a key.", "KEY=START:STOP:NUM")] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Critical friction coefficient, eigenvalues and growth of steady sliding, without stepping in time."""
    key, values = _parse_range(vary) if vary is not None else ("", [])
    loaded = load_case(case, overrides)
    announce_compilation(quiet)
    from brakecli.analysis.stability.report import stability
    from brakecli.case.read import parse_case
    from brakecli.case.system import system_of
    from brakecli.cli.tables import stability_table
    from brakecli.files.field import values_of
    from brakecli.files.fields import STABILITY, VARIED
    from brakecli.runs.limits import within_range

    entries = []
    with within_range():
        report = stability(system_of(loaded.case))
        for value in values:
            varied = parse_case(loaded.resolved, "--vary", (f"{key}={value!r}",), "--vary").case
            entries.append({"value": value, **values_of(VARIED, stability(system_of(varied)))})
    numbers, found = values_of(STABILITY, report), (loaded.case.title, report, key, entries)
    if key:
        numbers["vary"] = entries
    show_result("stability", numbers, stability_table, *found, as_json=as_json, quiet=quiet)


def _parse_range(text: str) -> tuple[str, list[float]]:
    """The key and the values of KEY=START:STOP:NUM, both ends included; raises UsageError."""
    import numpy as np

    from brakecli.case.read import key_path

    key, _, numbers = text.partition("=")
    with suppress(ValueError):
        start, stop, count = numbers.split(":")
        first, last, size = float(start), float(stop), int(count)
        if key_path(key) and 1 <= size <= MOST_VALUES and math.isfinite(last - first):
            return key, np.linspace(first, last, size).tolist()
    what = f"is not KEY=START:STOP:NUM with NUM from 1 to {MOST_VALUES}"
    raise UsageError(f"--vary {text}: {what}; write, for instance, --vary link2.angle_deg=1:10:10")
