"""`brakecli run`."""

from functools import partial

from brakecli.api.inputs import result_path
from brakecli.api.progress import say, telling
from brakecli.api.records import Run
from brakecli.api.values import case_of
from brakecli.cli.options import AsJson, Details, Quiet, with_options
from brakecli.cli.output import show_result, warn
from brakecli.errors import BrakecliError


@with_options
def command(options: Run, details: Details = False, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Simulate one case; write motion and regime to HDF5."""
    loaded = case_of(options.case, options.settings)
    target = result_path(options.output, options.case)
    from brakecli.studies.runs.run import load_kernels, origin, run
    from brakecli.views.motion import of_run

    load_kernels(loaded)
    with telling(quiet) as tell:
        report = run(loaded, target, force=options.force, progress=tell)
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
