"""`brakecli stability`."""

from contextlib import nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from brakecli.branches.pushes import PUSHES
from brakecli.cli.options import (
    AsJson,
    CaseArgument,
    Details,
    Force,
    Overrides,
    Pushes,
    Quiet,
    option,
    output_option,
)
from brakecli.cli.output import show_result, warn
from brakecli.errors import UsageError, printable
from brakecli.files.atomic import check_target
from brakecli.front.asked import slips_in, stability_of
from brakecli.front.inputs import load_case, result_path
from brakecli.front.progress import telling

if TYPE_CHECKING:
    from brakecli.sweeps.tables import Axis
    from brakecli.views.render import Renderer
    from brakecli.views.view import View

VARY = "Follow both modes along a key, or along several alike."
MOST_VALUES = 10_000


def command(
    case: CaseArgument,
    output: Annotated[Path | None, output_option("File of --vary: .h5 or .csv", "none")] = None,
    overrides: Overrides = None,
    vary: Annotated[str | None, option(VARY, "KEY[,KEY]=START:STOP:NUM")] = None,
    pushes: Pushes = PUSHES,
    force: Force = False,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Critical friction, modes, least friction that vibrates."""
    axis = _parse_axis(vary) if vary is not None else None
    if output is not None and axis is None:
        raise UsageError(f"{output}: holds what --vary finds; give --vary, and a name that ends in .h5 or .csv")
    loaded = load_case(case, overrides)
    target = result_path(output, case, ending=".csv") if output is not None else None
    if target is not None:
        check_target(target, "what --vary finds", (".h5", ".csv"))
    from brakecli.sweeps.result import unit
    from brakecli.views.stability import of_stability

    with telling(quiet) as show_progress:
        numbers = stability_of(loaded, show_progress, None if axis else pushes)
        if axis:
            from brakecli.files.atomic import new_output
            from brakecli.files.field import values_of
            from brakecli.files.stability_fields import LOCK_IN
            from brakecli.runs.limits import within_range
            from brakecli.sweeps.lock_in import lock_in, write

            with new_output(target, force=force) if target else nullcontext():  # whether it can be written
                pass
            with within_range():
                found = lock_in(loaded, axis, f"--vary {printable(str(vary))}", show_progress)
            if target:
                write(target, loaded, found, force=force)
            numbers |= {"vary": found.entries, **values_of(LOCK_IN, found), "output": target and str(target)}
    warn(*slips_in(loaded))
    units = unit(axis.parameter[0]) if axis else ""

    def view(show: "Renderer") -> "View":
        return of_stability(numbers, loaded.case.title, show, units)

    show_result("stability", numbers, view, as_json=as_json, quiet=quiet, details=details)


def _parse_axis(text: str) -> "Axis":
    """The axis of KEY,KEY=START:STOP:NUM, both ends included; raises UsageError."""
    from brakecli.case.read import key_path
    from brakecli.sweeps.tables import Axis

    keys, _, numbers = text.partition("=")
    with suppress(ValueError):  # pydantic's own is one, too
        start, stop, count = numbers.split(":")
        axis = Axis(parameter=tuple(keys.split(",")), start=float(start), stop=float(stop), num=int(count))
        different = len({*map(key_path, axis.parameter)}) == len(axis.parameter)
        if different and axis.size <= MOST_VALUES and (axis.size == 1 or axis.start != axis.stop):
            return axis
    what = f"is not KEY=START:STOP:NUM with two ends, NUM from 1 to {MOST_VALUES}, and no key twice"
    raise UsageError(f"--vary {printable(text)}: {what}; write, for instance, --vary link2.angle_deg=1:10:10")
