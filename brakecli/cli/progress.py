"""What a command shows while it works: that kernels are compiled, and how far it has come."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from brakecli.cli.output import say
from brakecli.files.os_signals import unwinding


def announce_compilation(quiet: bool) -> None:
    """Report that kernels will be compiled, which takes seconds once for each version.

    They are compiled as they are imported: a command calls this before it imports them.
    """
    if quiet:
        return
    from brakecli.solver.compile import cache_is_cold

    if cache_is_cold():
        say("compiling kernels, once for this version …")


@contextmanager
def progress(quiet: bool) -> Iterator[Callable[[str, int, int], None]]:
    """Yield a function that shows on a terminal what is counted, how many are done, and how many there are.

    Within, a signal raises `Interrupted`: at once, or when that function is called next.
    """
    with unwinding() as recall:
        if quiet or sys.stderr is None or not sys.stderr.isatty():
            yield lambda what, done, total: recall()
            return
        from rich import progress as rich_progress
        from rich.console import Console

        columns = (*rich_progress.Progress.get_default_columns(), rich_progress.MofNCompleteColumn())
        with rich_progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("", visible=False)

            def show(what: str, done: int, total: int) -> None:
                recall()
                bar.update(task, description=what, completed=done, total=total, visible=True)

            yield show
