"""Around each call from Python: interruptions, warnings, progress, and results as files."""

import tempfile
import threading
import warnings
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.errors import UsageError, found_text
from brakecli.faces import in_python
from brakecli.stop import signals_shown

if TYPE_CHECKING:
    from brakecli.api.records import Counter, Result
    from brakecli.solver.integrate import Counted


@contextmanager
def called() -> Iterator[None]:
    """Around each call: Ctrl-C ends compiled code, too, but in other threads, which hear no signals.

    Objects of xarray have the accessor from then on. Profiles that are arrays are forgotten at the end.
    """
    import brakecli.views.accessor  # noqa: F401
    from brakecli.case.records import arrays

    hears = threading.current_thread() is threading.main_thread()
    before = arrays.set({})
    try:
        with signals_shown() if hears else nullcontext(), in_python():
            yield
    finally:
        arrays.reset(before)


class _OfCaller(BaseException):
    """Carries what a function of the caller has raised past all that handles exceptions on the way."""


@contextmanager
def telling_to(progress: "Counter") -> Iterator["Counted"]:
    """What tells the progress: a function of the caller, or that of the commands.

    What the function of the caller raises comes out of the block as it was raised.
    """
    from brakecli.api.progress import telling

    if not callable(progress):
        with telling(not progress, first_line=1.0) as tell:
            yield tell
        return

    def carried(what: str, done: int, total: int) -> None:
        try:
            progress(what, done, total)
        except BaseException as error:
            raise _OfCaller from error

    try:
        yield carried
    except _OfCaller as end:
        error = end.__cause__
        assert error is not None
        error.__suppress_context__ = True
        raise error  # noqa: B904 - it is its own cause


@contextmanager
def target(output: "str | PathLike[str] | None", name: str = "result.h5") -> Iterator[Path]:
    """Where a result goes: to a file that stays, or to one that does not."""
    if output is not None:
        if not isinstance(output, str | PathLike):
            raise UsageError(f"output: is no path{found_text(output)}; give one, or leave it out")
        yield Path(output)
        return
    with tempfile.TemporaryDirectory(prefix="brakecli-") as folder:
        yield Path(folder) / name


@contextmanager
def as_files(results: "Iterable[Result]", *names: str) -> Iterator[list[Path]]:
    """Results as files: their own, or for those in memory one of these names, which goes with the block."""
    import xarray as xr

    from brakecli.results.as_xarray import stored

    with ExitStack() as stack:
        files = list[Path]()
        for number, result in enumerate(results):
            if isinstance(result, xr.Dataset | xr.DataTree):
                name = names[number] if number < len(names) else f"{names[-1]}-{number + 1}"
                files.append(stack.enter_context(stored(result, f"{name}.h5")))
            elif isinstance(result, str | PathLike):
                files.append(Path(result))
            else:
                raise UsageError(f"{type(result).__name__}: is no result; give a path, or what a function gave")
        yield files


def warn(texts: Iterable[str]) -> None:
    """Warn of each text, at the line of whoever called the function of a record."""
    for text in texts:
        warnings.warn(text, stacklevel=4)
