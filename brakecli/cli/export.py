"""`brakecli export`."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from brakecli.api.inputs import result_path
from brakecli.api.options import Description
from brakecli.api.progress import telling
from brakecli.api.records import Force, target
from brakecli.cli.options import Quiet, with_options
from brakecli.cli.output import show, warn


@dataclass(frozen=True)
class Export:
    """Options of `export`."""

    result: Annotated[
        str, Description("Result of a run, a sweep, a comparison or stability.", "FILE.h5", by_place=True)
    ]
    output: Annotated[str | None, target("File, .csv or .wav", "FILE.csv, here")] = None
    variables: Annotated[
        list[str] | None,
        Description(
            "Variable to export, of a table repeatable; all of them, or vx for sound, if left out.",
            "NAME",
            names=("--variable",),
            shell=list[str],
        ),
    ] = None
    group: Annotated[
        str | None,
        Description("Of a run: history (default), spectrum, over_time, spectrogram, vibrations.", "GROUP"),
    ] = None
    start: Annotated[float | None, Description("First time in s, of what has a time.", "S", names=("--from",))] = (
        None
    )
    end: Annotated[float | None, Description("Last time in s.", "S", names=("--to",))] = None
    every: Annotated[int, Description("Keep one of so many samples, the first one among them.", "N", least=1)] = 1
    force: Force = False


@with_options
def command(options: Export, quiet: Quiet = False) -> None:
    """Write numbers as CSV, or a motion as sound."""
    from brakecli.results.export import Excerpt, export
    from brakecli.results.read import open_result

    target = result_path(options.output, options.result, ending=".csv")
    start = -math.inf if options.start is None else options.start
    end = math.inf if options.end is None else options.end
    excerpt = Excerpt(start, end, options.every)
    with telling(quiet) as tell, open_result(Path(options.result)) as stored:
        notes = export(
            stored, target, options.group, options.variables or (), excerpt, force=options.force, tell=tell
        )
    warn(*notes)
    if not quiet:
        show(f"{target}: written")
