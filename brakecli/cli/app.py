"""The program: its commands, and the end of every failure in one sentence and an exit code.

A new command is one file and one entry of `GROUPS`. Heavy imports stand inside the functions of the commands, so
that `--help` is quick.
"""

import os
import resource
import sys
from importlib import import_module
from itertools import chain
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from brakecli.about import __released__, __version__
from brakecli.api.progress import say
from brakecli.cli.output import announce_compilation, show, showing_compilation, warn
from brakecli.errors import BrakecliError, RefusedError
from brakecli.faces import as_argument
from brakecli.solver import compiling

GROUPS = {
    "Ask": ("check", "stability", "branch", "advise", "scatter"),
    "Simulate": ("run", "sweep", "compare-schemes"),
    "Show": ("plot", "report", "info", "diff", "export", "classify"),
    "Files": ("new", "schema"),
}
"""Commands by what they are for, in the order in which `--help` lists them."""

CITATION = f"""\
@software{{brakecli,
  author  = {{{{The brakecli authors}}}},
  title   = {{{{brakecli}}: friction-induced vibration of a brake shoe on a rough wheel}},
  version = {{{__version__}}},
  year    = {{{__released__[:4]}}}
}}
@unpublished{{koptovets,
  author = {{Koptovets, A. N.}},
  title  = {{Mathematical modelling of the vibration loading of a shoe-wheel brake}},
  note   = {{The model that brakecli computes. In Russian, UDC 622.625.28-592.112,
            National Mining University, Dnipropetrovsk}}
}}"""
"""How to cite the program and the paper, in BibTeX; CITATION.cff says the same."""

SETTINGS = {"help_option_names": ["-h", "--help"]}
LIBRARIES = 1_075_000_000
"""Bytes of address space for the libraries and compiled kernels; to compile these takes `compiling.KERNELS`."""


class Grouped(TyperGroup):
    """The program, whose help lists commands by their groups; a command is imported when it is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of all commands."""
        return [*chain(*GROUPS.values())]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name; None if there is none, and all are known then, of which one is meant."""
        names = self.list_commands(ctx)
        for name in [cmd_name] if cmd_name in names else names:
            if name not in self.commands:
                alone = typer.Typer(add_completion=False, rich_markup_mode=None, context_settings=SETTINGS)
                alone.command(name)(import_module(f"brakecli.cli.{name.replace('-', '_')}").command)
                self.commands[name] = typer.main.get_command(alone)
        return self.commands.get(cmd_name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section for each group."""
        longest = max(map(len, self.list_commands(ctx)))
        limit = formatter.width - longest - 6  # columns beside names and descriptions
        for title, names in GROUPS.items():
            with formatter.section(title):
                rows = [
                    (name.ljust(longest), self.get_command(ctx, name).get_short_help_str(limit)) for name in names
                ]
                formatter.write_dl(rows)


app = typer.Typer(
    name="brakecli",
    cls=Grouped,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings=SETTINGS,
    help="Vibration of a brake shoe on a rough wheel: will it vibrate, how, from which friction coefficient on.",
)


def main() -> None:
    """Run the command line; every failure ends in a sentence on standard error and its exit code."""
    try:
        app()
    except BrakecliError as error:
        message = str(error)
        code = error.exit_code
    except MemoryError:
        message = "out of memory; reduce contact.nodes, or sample less often"
        code = 3
    except OSError as error:  # not of an input or output, but of a file such as the cache of compiled code
        what = f"{error.filename or 'a file'}: cannot be read or written: {error.strerror or error}"
        message = f"{what}; check its path and permissions"
        code = 74
    except SystemExit as end:
        if end.code == 2:  # bad usage, which is reported already
            files = [word for word in sys.argv[1:] if word[1:] and word[0] == "-" and os.path.isfile(word)]  # noqa: PTH113
            say(*(f"{word}: was read as options; name the file {as_argument(word)}" for word in files))
        raise
    say(*message.split("\n"))
    sys.exit(code)


def _print_version(wanted: bool) -> None:
    if wanted:
        show(f"brakecli {__version__}")
        raise typer.Exit


def _print_citation(wanted: bool) -> None:
    if wanted:
        show(CITATION)
        raise typer.Exit


VERSION = typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True)
CITE = typer.Option(
    "--cite", help="Print how to cite it, in BibTeX, and exit.", callback=_print_citation, is_eager=True
)


@app.callback()
def _common(version: Annotated[bool, VERSION] = False, cite: Annotated[bool, CITE] = False) -> None:
    compiling.set_alone()
    compiling.set_notice(announce_compilation)
    compiling.set_progress(showing_compilation)
    compiling.set_warning(warn)
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return
    if limit < LIBRARIES:
        limited = f"the address space is limited to {limit / 1e6:.0f} MB"
        what = f"{limited}, and the libraries need {LIBRARIES / 1e6:.0f} MB"
        raise RefusedError(f"{what}; raise the limit with: ulimit -v unlimited")
