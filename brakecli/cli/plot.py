"""`brakecli plot`."""

from pathlib import Path

from brakecli.api.commands import plot
from brakecli.api.inputs import COMMANDS, kind_of_file
from brakecli.api.records import Plot
from brakecli.cli.options import Quiet, with_options
from brakecli.cli.output import show, warn
from brakecli.errors import UsageError
from brakecli.faces import as_argument


@with_options
def command(options: Plot, quiet: Quiet = False) -> None:
    """Draw a result, or a measured signal (needs matplotlib)."""
    source = str(options.result)
    target = Path(options.output or f"{Path(source).stem}.png")
    if Path(source).suffix == ".toml":
        computes = COMMANDS.get(kind_of_file(source), "run")
        remedy = f"run it first, with: brakecli {computes} {as_argument(source)}"
        raise UsageError(f"{source}: is no result yet; {remedy}")
    _, warnings = plot(options, source, target)
    warn(*warnings)
    if not quiet:
        show(f"{target}: written")
