"""`brakecli scatter`."""

from functools import partial
from pathlib import Path
from typing import Annotated

from brakecli.cli.options import SET, AsJson, Details, Force, Quiet, option, output_option, source_argument
from brakecli.cli.output import show_result, warn
from brakecli.cli.sweep import JOBS, SCHEDULER, SCHEDULER_FILE
from brakecli.front.inputs import load_study, result_path
from brakecli.front.progress import telling

SETTING = "Set a key of the study, as samples, or of its case; repeatable."


def command(
    file: Annotated[str, source_argument("STUDY.toml", 'Study, or "-" for standard input.')],
    output: Annotated[Path | None, output_option("Result file", "the study's name with .h5, here")] = None,
    overrides: Annotated[list[str] | None, option(SETTING, *SET)] = None,
    jobs: Annotated[int | None, option(JOBS, None, "--jobs", "-j", min=1, max=4096)] = None,
    scheduler: Annotated[str | None, option(SCHEDULER, "ADDRESS", envvar="DASK_SCHEDULER_ADDRESS")] = None,
    scheduler_file: Annotated[str | None, option(SCHEDULER_FILE, "FILE")] = None,
    force: Force = False,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """How likely brakes squeal whose numbers scatter."""
    loaded = load_study(file, overrides)
    target = result_path(output, file, kind="study")
    from brakecli.scattering.scatter import engine_for, scatter
    from brakecli.sweeps.driver import keeping_points
    from brakecli.views.stability import of_scatter

    engine_of = partial(engine_for, jobs=jobs, scheduler=scheduler, scheduler_file=scheduler_file)
    with telling(quiet) as tell, keeping_points(target):
        report = scatter(loaded, target, engine_of, force=force, tell=tell)
    if report.failed:
        warn(f"{report.failed} of {report.samples} samples have no answer, the first: {report.first_failure}")
    numbers = {**report.numbers(), "output": str(report.output)}
    title = report.loaded.title
    show_result(
        "scatter", numbers, lambda show: of_scatter(numbers, title), as_json=as_json, quiet=quiet, details=details
    )
