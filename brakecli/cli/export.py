"""`brakecli export`."""

import math
from pathlib import Path
from typing import Annotated

from brakecli.cli.options import Force, Quiet, option, output_option, source_argument
from brakecli.cli.output import show, warn
from brakecli.front.inputs import result_path
from brakecli.front.progress import telling

GROUP = "Of a run: history (default), spectrum, over_time, spectrogram, vibrations."
VARIABLE = "Variable to export, of a table repeatable; all of them, or vx for sound, if left out."


def command(
    result: Annotated[Path, source_argument("FILE.h5", "Result of a run, a sweep, a comparison or stability.")],
    output: Annotated[Path | None, output_option("File, .csv or .wav", "FILE.csv, here")] = None,
    variables: Annotated[list[str] | None, option(VARIABLE, "NAME", "--variable")] = None,
    group: Annotated[str | None, option(GROUP, "GROUP")] = None,
    start: Annotated[float | None, option("First time in s, of what has a time.", "S", "--from")] = None,
    end: Annotated[float | None, option("Last time in s.", "S", "--to")] = None,
    every: Annotated[int, option("Keep one of so many samples, the first one among them.", "N", min=1)] = 1,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Write numbers as CSV, or a motion as sound."""
    from brakecli.files.export import Part, export
    from brakecli.files.read import open_result

    target = result_path(output, str(result), ending=".csv")
    with telling(quiet) as tell, open_result(result) as stored:
        part = Part(-math.inf if start is None else start, math.inf if end is None else end, every)
        notes = export(stored, target, group, variables or (), part, force=force, tell=tell)
    warn(*notes)
    if not quiet:
        show(f"{target}: written")
