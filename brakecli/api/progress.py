"""Lines on standard error, and how far long work has come."""

import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from textwrap import wrap
from typing import TextIO, cast

from brakecli.results.os_signals import Styled, lastly


def say(*lines: str) -> None:
    """Print lines on standard error; a terminal, which would break them within words, gets shorter ones."""
    for line in lines:
        text = f"brakecli: {line}"
        if sys.stderr is not None and sys.stderr.isatty():
            width = shutil.get_terminal_size().columns
            pieces = wrap(text, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
            text = "\n".join(pieces)
        print(text, file=sys.stderr, flush=True)  # noqa: T201


@contextmanager
def telling(quiet: bool, first_line: float = 20.0) -> Iterator[Callable[[str, int, int], None]]:
    """Yield what tells how many of something are done: a bar, from a second on; lines without a terminal.

    The first line comes after `first_line` seconds, and the time to the next one doubles up to ten minutes. What a
    line has said of is also said when it is complete.
    """
    if quiet or sys.stderr is None or not sys.stderr.isatty():
        start = time.monotonic()
        due = first_line
        open_total = 0

        def tell(what: str, done: int, total: int) -> None:
            nonlocal due, open_total
            ends = 0 < done == total == open_total
            if not quiet and ((passed := time.monotonic() - start) >= due or ends):
                open_total = total if done < total else 0
                due = passed + min(passed, 600.0)
                say(f"{what} {done} of {total}, {passed:.0f} s" if total else f"{what}, {passed:.0f} s")

        yield tell
        return
    from rich import progress as rich_progress
    from rich.console import Console

    console = Console(file=cast(TextIO, Styled(sys.stderr)))
    columns = (*rich_progress.Progress.get_default_columns(), rich_progress.MofNCompleteColumn())
    bar = rich_progress.Progress(*columns, console=console, transient=True)
    with lastly(bar.stop):
        bar.start()
        task = bar.add_task("at work", visible=False, total=None)
        unsaid = threading.Timer(1.0, bar.update, (task,), {"visible": True})
        unsaid.daemon = True
        unsaid.start()

        def show(what: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total or None, visible=True)

        try:
            yield show
        finally:
            unsaid.cancel()
