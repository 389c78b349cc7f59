"""`brakecli plot`."""

from pathlib import Path
from typing import Annotated

from brakecli.cli.measured import UNMEASURED, with_measured
from brakecli.cli.options import Force, Quiet, option, output_option, source_argument
from brakecli.cli.output import show, warn
from brakecli.errors import UsageError
from brakecli.faces import as_argument
from brakecli.front.inputs import COMMANDS, kind_of_file
from brakecli.front.measured import Measured

SOURCE = "Result of any kind; with --quantity a measured signal, as for classify."
SELECT = "Draw the nearest value of a sweep's axis; repeatable."
VARIABLE = (
    "Draw this number of a sweep; of branches the amplitude of x, y or vx, the mean, or another number; "
    "of a run x, y, vx, vy, friction_force, normal_force, torque or contact_fraction."
)
SECTION = (
    'Draw the Poincaré section of a run: its states once in each period of a passing "wave", '
    "or at its events stick, slip, turn, lift-off or touch."
)


@with_measured
def command(
    result: Annotated[str, source_argument("FILE", SOURCE)],
    output: Annotated[Path | None, output_option("Picture", "FILE.png, here")] = None,
    select: Annotated[list[str] | None, option(SELECT, "KEY=VALUE")] = None,
    variable: Annotated[str | None, option(VARIABLE, "NAME")] = None,
    section: Annotated[str | None, option(SECTION, "NAME")] = None,
    measured: Measured = UNMEASURED,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Draw a result, or a measured signal (needs matplotlib)."""
    target = output or Path(f"{Path(result).stem}.png")
    if Path(result).suffix == ".toml":
        computes = COMMANDS.get(kind_of_file(result), "run")
        remedy = f"run it first, with: brakecli {computes} {as_argument(result)}"
        raise UsageError(f"{result}: is no result yet; {remedy}")
    if measured.quantity_of(result) is not None:
        if select or variable or section:
            what = "--select, --variable and --section: are for results"
            raise UsageError(f"{what}; leave them out for a measured signal")
        from brakecli.plots.result import plot_signal

        look = measured.look_at(result)
        warn(*look.verdict.warnings)
        plot_signal(look, result, target, force=force)
    else:
        from brakecli.plots.result import plot_result

        plot_result(Path(result), target, select or (), variable or "", section or "", force=force)
    if not quiet:
        show(f"{target}: written")
