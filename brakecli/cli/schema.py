"""`brakecli schema`."""

from typing import Annotated

import typer

from brakecli.cli.output import show_json
from brakecli.errors import UsageError


def command(
    kind: Annotated[str, typer.Argument(metavar="[case|sweep|scatter]", help="Which kind of file.")] = "case",
) -> None:
    """Print the JSON Schema of cases, sweeps or studies."""
    from brakecli.case.case import Case
    from brakecli.case.tables import Table, json_schema
    from brakecli.scattering.study import Study
    from brakecli.sweeps.tables import Sweep

    tables: dict[str, type[Table]] = {"case": Case, "sweep": Sweep, "scatter": Study}
    if kind not in tables:
        raise UsageError(f"schema {kind}: there is none; give {', '.join(tables)}")
    show_json(json_schema(tables[kind]), indent=2)
