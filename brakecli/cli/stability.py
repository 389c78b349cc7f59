"""`brakecli stability`."""

from contextlib import nullcontext
from typing import TYPE_CHECKING

from brakecli.api.commands import modes_along, slips_in, stability_of
from brakecli.api.inputs import result_path
from brakecli.api.progress import telling
from brakecli.api.records import Stability
from brakecli.api.values import axis_of, case_of
from brakecli.cli.options import AsJson, Details, Quiet, with_options
from brakecli.cli.output import show_result, warn
from brakecli.errors import UsageError
from brakecli.results.atomic import check_target, new_output

if TYPE_CHECKING:
    from brakecli.views.render import Renderer
    from brakecli.views.view import View


@with_options
def command(options: Stability, details: Details = False, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Critical friction, modes, least friction that vibrates."""
    axis = axis_of(options.vary) if options.vary is not None else None
    if options.output is not None and axis is None:
        what = "holds what --vary finds; give --vary, and a name that ends in .h5 or .csv"
        raise UsageError(f"{options.output}: {what}")
    loaded = case_of(options.case, options.settings)
    target = result_path(options.output, options.case, ending=".csv") if options.output is not None else None
    if target is not None:
        check_target(target, "what --vary finds", (".h5", ".csv"))
    from brakecli.studies.sweeps.result import unit
    from brakecli.views.stability import of_stability

    with telling(quiet) as tell:
        numbers = stability_of(loaded, tell, None if axis else options.pushes)
        if axis:
            from brakecli.results.field import values_of
            from brakecli.results.stability_fields import LOCK_IN
            from brakecli.studies.sweeps.lock_in import write

            with new_output(target, force=options.force) if target else nullcontext():  # whether it can be written
                pass
            diagram = modes_along(loaded, options.vary, tell)
            if target:
                write(target, loaded, diagram, force=options.force)
            numbers |= {"vary": diagram.entries, **values_of(LOCK_IN, diagram), "output": target and str(target)}
    warn(*slips_in(loaded))
    units = unit(axis.parameter[0]) if axis else ""

    def view(show: "Renderer") -> "View":
        return of_stability(numbers, loaded.case.title, show, units)

    show_result("stability", numbers, view, as_json=as_json, quiet=quiet, details=details)
