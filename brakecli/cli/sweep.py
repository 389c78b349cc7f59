"""`brakecli sweep`."""

from functools import partial
from pathlib import Path
from typing import Annotated

from brakecli.cli.options import SET, AsJson, Details, Quiet, option, output_option, source_argument
from brakecli.cli.output import show_result, warn
from brakecli.errors import BrakecliError
from brakecli.front.inputs import load_sweep, result_path
from brakecli.front.progress import say, telling

JOBS = "Worker processes  [default: one for each core; none for a second of work]"
SCHEDULER = "Compute on a dask cluster: the scheduler's address, as tcp://host:8786."
SCHEDULER_FILE = "The same cluster, given by the scheduler's file."
TASK_SIZE = "Points in each task  [default: as many as take 0.2 s]"
SETTING = "Set a key of the base case or of [critical]; repeatable."
REPLACE = "Replace an existing output, and drop finished points of another sweep."


def command(
    file: Annotated[str, source_argument("SWEEP.toml", 'Sweep file, or "-" for standard input.')],
    output: Annotated[Path | None, output_option("Result file", "the sweep's name with .h5, here")] = None,
    overrides: Annotated[list[str] | None, option(SETTING, *SET)] = None,
    jobs: Annotated[int | None, option(JOBS, None, "--jobs", "-j", min=1, max=4096)] = None,
    scheduler: Annotated[str | None, option(SCHEDULER, "ADDRESS", envvar="DASK_SCHEDULER_ADDRESS")] = None,
    scheduler_file: Annotated[str | None, option(SCHEDULER_FILE, "FILE")] = None,
    task_size: Annotated[int | None, option(TASK_SIZE, min=1)] = None,
    force: Annotated[bool, option(REPLACE, None, "--force")] = False,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate a grid of cases, or search for critical values.

    The same command continues an interrupted sweep.
    """
    loaded = load_sweep(file, overrides)
    target = result_path(output, file, kind="sweep")
    from brakecli.runs.run import load_kernels
    from brakecli.sweeps.driver import choose_engine, counting, keeping_points, sweep
    from brakecli.sweeps.size import Size
    from brakecli.views.points import of_sweep

    load_kernels(loaded.base)
    with telling(quiet) as show_progress:

        def begin(found: Size, resumed: int) -> None:
            if not quiet:
                say(found.sentence() + (f"; {resumed} of them are there already" if resumed else ""))

        advance = counting(loaded.plan, show_progress)
        with keeping_points(target), choose_engine(loaded.plan, jobs, scheduler, scheduler_file) as engine:
            report = sweep(loaded, target, engine, force=force, task_size=task_size, begin=begin, progress=advance)
    found = report.findings
    warn(*report.notes)
    warn(*found.warnings)
    numbers = {"output": str(report.output), **report.numbers()}
    show_result("sweep", numbers, partial(of_sweep, report), as_json=as_json, quiet=quiet, details=details)
    for failure in found.failures:
        where = ", ".join(f"{key} = {value}" for key, value in failure["parameters"].items())
        say(f"point {failure['point']}{f' ({where})' if where else ''}: {failure['reason']}")
    if found.failed:
        failed = f"{found.failed} of {found.points} points failed; all others were written"
        if found.failed == found.points:
            which = "its only point" if found.points == 1 else f"all {found.points} points"
            failed = f"{which} failed; correct the case, the sweep or the machine, as the reasons above say"
        raise BrakecliError(f"{report.output}: {failed}")
