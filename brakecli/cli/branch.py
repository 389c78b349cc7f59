"""`brakecli branch`."""

from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Annotated

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
from brakecli.files.os_signals import lastly, signals_deferred
from brakecli.front.asked import slips_in
from brakecli.front.inputs import load_case, result_path
from brakecli.front.progress import telling
from brakecli.stop import hide_signals

PARAMETER = "Follow all motions along a key, or along several that take the same value."
START = "Also follow the motion that the end of this run comes to; repeatable."
SWITCH = "Also follow the motions of twice the period from each flip."


def command(
    case: CaseArgument,
    parameter: Annotated[str, option(PARAMETER, "KEY[,KEY]=LOW:HIGH", "--parameter", show_default=False)],
    output: Annotated[Path | None, output_option("Result file, .h5", "none")] = None,
    overrides: Overrides = None,
    start: Annotated[list[Path] | None, option(START, "FILE.h5")] = None,
    switch: Annotated[bool, option(SWITCH, None, "--switch")] = False,
    pushes: Pushes = PUSHES,
    force: Force = False,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Follow every motion along a key, stable or not."""
    from brakecli.runs.branch import parsed

    keys, low, high = parsed(parameter)
    loaded = load_case(case, overrides)
    target = result_path(output, case) if output is not None else None
    from brakecli.branches.explore import Explorer
    from brakecli.files.field import values_of
    from brakecli.files.stability_fields import BRANCH
    from brakecli.files.write import new_result
    from brakecli.runs.branch import branch, line_of, start_of, states_of, write
    from brakecli.runs.limits import within_range
    from brakecli.sweeps.result import unit
    from brakecli.views.stability import of_branch

    with telling(quiet) as tell:
        with within_range():
            line = line_of(loaded, keys, low, high, f"--parameter {parameter}")
        units = unit(keys[0])
        states = states_of(line, [start_of(path, keys) for path in start or ()])
        with new_result(target, force=force) if target else nullcontext():  # whether it can be written
            pass
        explorer = Explorer(line, tell)  # up to here there is nothing to keep, and a signal ends it at once
        kept = f"what was followed up to here is in {target}" if target else ""
        with lastly(lambda: kept), signals_deferred() as waiting:
            explorer.stop = lambda: bool(waiting)
            found = branch(explorer, states, switch, pushes)
            hide_signals()  # from what writes the file
            if target:
                write(target, loaded, found, units, force=force)
    warn(*slips_in(loaded))
    numbers = {**values_of(BRANCH, found), "output": target and str(target)}
    view = partial(of_branch, numbers, loaded.case.title, units)
    show_result("branch", numbers, view, as_json=as_json, quiet=quiet, details=details)
