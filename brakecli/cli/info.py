"""`brakecli info`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from brakecli.api.options import Description
from brakecli.cli.check import command as check
from brakecli.cli.options import AsJson, with_options
from brakecli.cli.output import show_result


@dataclass(frozen=True)
class Info:
    """Options of `info`."""

    file: Annotated[
        str, Description("Result of any kind; of a case or a sweep what `check` says.", "FILE", by_place=True)
    ]


@with_options
def command(options: Info, as_json: AsJson = False) -> None:
    """What a result holds, whether it is whole, what made it."""
    file = options.file
    if file == "-" or Path(file).suffix == ".toml":
        check(file=file, settings=None, as_json=as_json, quiet=False)
        return
    from brakecli.results.contents import INFO, contents
    from brakecli.results.field import values_of
    from brakecli.results.read import open_result
    from brakecli.views.file import of_info

    with open_result(Path(file)) as stored:
        numbers = values_of(INFO, contents(stored))
    show_result("info", numbers, lambda show: of_info(numbers), as_json=as_json, quiet=False)
