"""What a command prints: results on standard output; warnings, progress and failures on standard error."""

import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from brakecli.api.progress import say, telling
from brakecli.results.os_signals import Styled

if TYPE_CHECKING:
    from brakecli.views.render import Renderer
    from brakecli.views.view import View


def show(text: str) -> None:
    """Print a result on standard output."""
    print(text, flush=True)  # noqa: T201


def show_json(value: Mapping[str, object], indent: int | None = None) -> None:
    """Print a result as JSON, in ASCII if standard output is not UTF-8."""
    utf8 = (sys.stdout.encoding or "").lower() in ("utf-8", "utf8")
    show(json.dumps(value, allow_nan=False, ensure_ascii=not utf8, indent=indent))


def show_result(
    command: str,
    numbers: Mapping[str, object],
    view: "Callable[[Renderer], View]",
    *,
    as_json: bool,
    quiet: bool,
    details: bool = False,
) -> None:
    """Print what a command has found: its numbers as JSON, or its view, with all `details`; or nothing."""
    if as_json:
        show_json({"command": command, **numbers})
    elif not quiet:
        from brakecli.views.render import EXACT, TERMINAL
        from brakecli.views.terminal import terminal_text

        text = terminal_text(view(EXACT if details else TERMINAL), details=details)
        print(text, file=Styled(sys.stdout), flush=True)  # it escapes what is in its cells


def warn(*warnings: str) -> None:
    """Print warnings on standard error."""
    say(*(f"warning: {warning}" for warning in warnings))


@contextmanager
def showing_compilation(seconds: float) -> Iterator[Callable[[int, int], None]]:
    """Show how far all kernels are, which are compiled once and take about so long."""
    takes = f"this takes about {seconds:.0f} s, and longer beside other work"
    say(f"compiling all numerical kernels, once for this version; {takes}")
    with telling(quiet=False) as tell:
        yield lambda done, total: tell("kernels", done, total)


def announce_compilation(trouble: str) -> None:
    """Say that kernels are being compiled, and what keeps the cache from being used."""
    say("compiling numerical kernels for this kind of work, once for this version; this may take a minute or two")
    warn(*filter(None, [trouble]))
