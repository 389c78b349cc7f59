"""`brakecli plot`."""

from pathlib import Path
from typing import Annotated

from brakecli.cli.measured import (
    BeltSpeed,
    Column,
    Quantity,
    SampleRate,
    Stiffness,
    TimeColumn,
    TimeUnit,
    Unit,
    check,
    look_at,
    quantity_of,
)
from brakecli.cli.options import Force, Quiet, option, output_option, source_argument
from brakecli.cli.output import show, warn
from brakecli.errors import UsageError
from brakecli.files.os_signals import unwinding

SOURCE = "Result of a run, a sweep, a comparison or stability; with --quantity a measured signal, as for classify."
VARIABLE = (
    "Draw this number of a sweep; of a run x, y, vx, vy, friction_force, normal_force, torque or contact_fraction."
)


def command(
    result: Annotated[str, source_argument("FILE", SOURCE)],
    output: Annotated[Path | None, output_option("Picture", "FILE.png, here")] = None,
    select: Annotated[
        list[str] | None, option("Draw the nearest value of a sweep's axis; repeatable.", "KEY=VALUE")
    ] = None,
    variable: Annotated[str | None, option(VARIABLE, "NAME")] = None,
    quantity: Quantity = None,
    column: Column = None,
    time_column: TimeColumn = None,
    sample_rate: SampleRate = None,
    unit: Unit = None,
    time_unit: TimeUnit = None,
    belt_speed: BeltSpeed = None,
    stiffness: Stiffness = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Draw a result, or a measured signal (needs matplotlib)."""
    reading = {"column": column, "time_column": time_column, "sample_rate": sample_rate}
    reading |= {"unit": unit, "time_unit": time_unit}
    machine = {"belt_speed": belt_speed, "stiffness": stiffness}
    quantity = quantity_of(result, quantity)
    check(quantity, {**reading, **machine})
    target = output or Path(f"{Path(result).stem}.png")
    if quantity is not None:
        if select or variable:
            raise UsageError("--select and --variable: are for results; leave them out for a measured signal")
        from brakecli.plots.result import plot_signal

        look = look_at(result, quantity, reading, machine)
        warn(*look.verdict.warnings)
        with unwinding():
            plot_signal(look, result, target, force=force)
    else:
        from brakecli.plots.result import plot_result

        with unwinding():
            plot_result(Path(result), target, force=force, select=select or (), variable=variable or "")
    if not quiet:
        show(f"{target}: written")
