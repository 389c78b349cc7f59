"""`brakecli branch`."""

from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import cast

from brakecli.api.commands import explorer_of, slips_in
from brakecli.api.inputs import result_path
from brakecli.api.progress import telling
from brakecli.api.records import Branch
from brakecli.api.values import case_of, ends_of
from brakecli.cli.options import AsJson, Details, Quiet, with_options
from brakecli.cli.output import show_result, warn
from brakecli.results.os_signals import lastly, signals_deferred
from brakecli.stop import hide_signals


@with_options
def command(options: Branch, details: Details = False, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Follow every motion along a key, stable or not."""
    keys, _, _ = ends_of(options.parameter)
    loaded = case_of(options.case, options.settings)
    target = result_path(options.output, options.case) if options.output is not None else None
    from brakecli.results.field import values_of
    from brakecli.results.stability_fields import BRANCH
    from brakecli.results.write import new_result
    from brakecli.studies.runs.branch import write
    from brakecli.studies.sweeps.result import unit
    from brakecli.views.stability import of_branch

    with telling(quiet) as tell:
        starts = [Path(start) for start in cast(list[str], options.start or ())]
        explorer, follow = explorer_of(loaded, options, starts, tell)
        units = unit(keys[0])
        with new_result(target, force=options.force) if target else nullcontext():  # whether it can be written
            pass
        message = f"what was followed up to here is in {target}" if target else ""
        with lastly(lambda: message), signals_deferred() as waiting:  # until here a signal ends it at once
            explorer.stop = lambda: bool(waiting)
            answers = follow()
            hide_signals()  # from what writes the file
            if target:
                write(target, loaded, answers, units, force=options.force)
    warn(*slips_in(loaded))
    numbers = {**values_of(BRANCH, answers), "output": target and str(target)}
    view = partial(of_branch, numbers, loaded.case.title, units)
    show_result("branch", numbers, view, as_json=as_json, quiet=quiet, details=details)
