"""`brakecli stability`."""

import math
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Annotated

from brakecli.cli.inputs import load_case, result_path
from brakecli.cli.options import AsJson, CaseArgument, Force, Overrides, Quiet, option, output_option
from brakecli.cli.output import announce_compilation, progress, show_result
from brakecli.errors import UsageError

MOST_VALUES = 10_000


def command(
    case: CaseArgument,
    output: Annotated[Path | None, output_option("File of --vary: .h5 or .csv", "none")] = None,
    overrides: Overrides = None,
    vary: Annotated[
        str | None, option("Follow both modes along a key, or along several alike.", "KEY[,KEY]=START:STOP:NUM")
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Critical friction coefficient, eigenvalues and growth of steady sliding, without stepping in time."""
    keys, values = _parse_range(vary) if vary is not None else ([], (0.0, 0.0, 1))
    if output is not None and (not keys or output.suffix.lower() not in (".h5", ".csv")):
        raise UsageError(f"{output}: holds what --vary finds; give --vary, and a name that ends in .h5 or .csv")
    loaded = load_case(case, overrides)
    target = result_path(output, case) if output is not None else None
    announce_compilation(quiet)
    from brakecli.analysis.stability.report import stability
    from brakecli.case.system import system_of
    from brakecli.cli.tables import stability_table
    from brakecli.files.field import values_of
    from brakecli.files.fields import LOCK_IN, STABILITY
    from brakecli.runs.limits import within_range

    with progress(quiet) as show_progress, within_range():
        report, found = stability(system_of(loaded.case)), None
        if keys:
            from brakecli.files.atomic import new_output
            from brakecli.sweeps.lock_in import lock_in, write
            from brakecli.sweeps.tables import Axis

            with new_output(target, force=force) if target else nullcontext():  # whether it can be written
                pass
            axis = Axis(parameter=tuple(keys), start=values[0], stop=values[1], num=values[2])
            found = lock_in(loaded, axis, f"--vary {vary}", show_progress)
            if target:
                write(target, loaded, found, force=force)
    numbers = values_of(STABILITY, report)
    if found:
        numbers |= {"vary": found.entries, **values_of(LOCK_IN, found), "output": target and str(target)}
    show_result(
        "stability", numbers, stability_table, loaded.case.title, report, found, as_json=as_json, quiet=quiet
    )


def _parse_range(text: str) -> tuple[list[str], tuple[float, float, int]]:
    """The keys of KEY,KEY=START:STOP:NUM, both ends, and how many values there are; raises UsageError."""
    from brakecli.case.read import key_path

    keys, _, numbers = text.partition("=")
    with suppress(ValueError):
        start, stop, count = numbers.split(":")
        first, last, size = float(start), float(stop), int(count)
        paths = [key_path(key) for key in keys.split(",")]
        several = 1 <= size <= MOST_VALUES and (size == 1 or first != last) and len({*paths}) == len(paths)
        if all(paths) and several and math.isfinite(first) and math.isfinite(last):
            return keys.split(","), (first, last, size)
    what = f"is not KEY=START:STOP:NUM with NUM from 1 to {MOST_VALUES}"
    raise UsageError(f"--vary {text}: {what}; write, for instance, --vary link2.angle_deg=1:10:10")
