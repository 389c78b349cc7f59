"""`brakecli plot`."""

from pathlib import Path
from typing import Annotated

from brakecli.cli.options import Force, Quiet, option, output_option, source_argument
from brakecli.cli.output import show
from brakecli.files.os_signals import unwinding

VARIABLE = (
    "Draw this number of a sweep; of a run x, y, vx, vy, friction_force, normal_force, torque or contact_fraction."
)


def command(
    result: Annotated[Path, source_argument("FILE.h5", "Result of a run, a sweep, a comparison or stability.")],
    output: Annotated[Path | None, output_option("Picture", "FILE.png, here")] = None,
    select: Annotated[
        list[str] | None, option("Draw the nearest value of a sweep's axis; repeatable.", "KEY=VALUE")
    ] = None,
    variable: Annotated[str | None, option(VARIABLE, "NAME")] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Draw a result of any kind (needs matplotlib)."""
    from brakecli.plots.result import plot_result

    target = output or Path(f"{result.stem}.png")
    with unwinding():
        plot_result(result, target, force=force, select=select or (), variable=variable or "")
    if not quiet:
        show(f"{target}: written")
