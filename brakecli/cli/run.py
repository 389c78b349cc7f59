"""`brakecli run`."""

from functools import partial
from pathlib import Path
from typing import Annotated

from brakecli.cli.options import (
    AsJson,
    Details,
    Force,
    Overrides,
    Quiet,
    output_option,
    source_argument,
)
from brakecli.cli.output import show_result, warn
from brakecli.errors import BrakecliError
from brakecli.front.inputs import load_case, result_path
from brakecli.front.progress import say, telling

SOURCE = 'Case file, "-" for standard input, or a result file, whose case is run again.'


def command(
    case: Annotated[str, source_argument("CASE.toml", SOURCE)],
    output: Annotated[Path | None, output_option("Result file", "the case's name with .h5, here")] = None,
    overrides: Overrides = None,
    force: Force = False,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate one case; write motion and regime to HDF5."""
    loaded = load_case(case, overrides)
    target = result_path(output, case)
    from brakecli.runs.run import load_kernels, origin, run
    from brakecli.views.motion import of_run

    load_kernels(loaded)
    with telling(quiet) as show_progress:
        report = run(loaded, target, force=force, progress=show_progress)
    if not quiet:
        say(*report.check.adjustments)
    warn(*report.warnings)
    numbers = {"output": str(report.output), **origin("run", report.title, report.loaded), **report.numbers()}
    del numbers["case_toml"]  # which `resolved_toml` says in full
    view = partial(of_run, numbers, report.title, str(report.output))
    show_result("run", numbers, view, as_json=as_json, quiet=quiet, details=details)
    if report.motion.work.failed:
        say(f"{report.output}: the history up to the failure was written")
        raise BrakecliError(str(report.motion.work.failure_sentence))
    certificate = report.certificate
    if certificate is not None and not certificate.certified and loaded.case.solver.tolerance is not None:
        raise BrakecliError(f"{report.output}: was written, but solver.tolerance is not sure to be kept")
