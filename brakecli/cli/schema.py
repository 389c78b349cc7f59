"""`brakecli schema`."""

from dataclasses import dataclass
from typing import Annotated

from brakecli.api.options import Description
from brakecli.cli.options import with_options
from brakecli.cli.output import show_json
from brakecli.errors import UsageError


@dataclass(frozen=True)
class Schema:
    """Options of `schema`."""

    kind: Annotated[str, Description("Which kind of file.", "[case|sweep|scatter]", by_place=True)] = "case"


@with_options
def command(options: Schema) -> None:
    """Print the JSON Schema of cases, sweeps or studies."""
    from brakecli.case.case import Case
    from brakecli.case.tables import Table, json_schema
    from brakecli.studies.scattering.study import Study
    from brakecli.studies.sweeps.tables import Sweep

    kind = options.kind
    tables: dict[str, type[Table]] = {"case": Case, "sweep": Sweep, "scatter": Study}
    if kind not in tables:
        raise UsageError(f"schema {kind}: there is none; give {', '.join(tables)}")
    show_json(json_schema(tables[kind]), indent=2)
