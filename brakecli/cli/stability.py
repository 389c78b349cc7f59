"""`brakecli stability`."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from brakecli.cli.inputs import load_case
from brakecli.cli.options import AsJson, CaseArgument, Overrides, Quiet, option
from brakecli.cli.output import show_result
from brakecli.cli.progress import announce_compilation
from brakecli.errors import UsageError

if TYPE_CHECKING:
    from brakecli.case.read import LoadedCase

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
    from brakecli.case.system import system_of
    from brakecli.cli.tables import stability_table
    from brakecli.files import fields
    from brakecli.files.field import values_of
    from brakecli.runs.limits import within_range

    with within_range():
        report = stability(system_of(loaded.case))
        entries = _critical_friction_along(loaded, key, values)
    numbers, found = values_of(fields.STABILITY, report), (loaded.case.title, report, key, entries)
    if key:
        numbers["vary"] = entries
    show_result("stability", numbers, stability_table, *found, as_json=as_json, quiet=quiet)


def _parse_range(text: str) -> tuple[str, list[float]]:
    """The key and the values of KEY=START:STOP:NUM, both ends included; raises UsageError."""
    import numpy as np

    key, _, numbers = text.partition("=")
    try:
        start, stop, count = (
            read(part) for read, part in zip((float, float, int), numbers.split(":"), strict=True)
        )
        sound = key != "" and 1 <= count <= MOST_VALUES and math.isfinite(start) and math.isfinite(stop)
    except ValueError:
        sound = False
    if not sound:
        raise UsageError(
            f"--vary {text}: is not KEY=START:STOP:NUM with NUM from 1 to {MOST_VALUES}; write, for instance, "
            "--vary link2.angle_deg=1:10:10"
        )
    return key, np.linspace(start, stop, int(count)).tolist()


def _critical_friction_along(loaded: "LoadedCase", key: str, values: Sequence[float]) -> list[dict[str, Any]]:
    """Critical friction, its kind, and the scheme's answer at each value; raises CaseError for a wrong one."""
    from brakecli.analysis.stability.report import stability
    from brakecli.case.read import parse_case
    from brakecli.case.system import system_of
    from brakecli.files import fields
    from brakecli.files.field import values_of

    entries = []
    for value in values:
        case = parse_case(loaded.resolved, "--vary", (f"{key}={value!r}",)).case
        entries.append({"value": value, **values_of(fields.VARIED, stability(system_of(case)))})
    return entries
