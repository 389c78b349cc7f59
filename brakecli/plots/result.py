"""Draw any result: read its file, choose the picture of its kind, write the file of the picture."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.errors import UsageError
from brakecli.files.atomic import new_output
from brakecli.files.read import StoredResult, open_result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from brakecli.analysis.regime.of_signal import SignalLook


def plot_result(result: Path, target: Path, *, force: bool, select: Sequence[str] = ()) -> None:
    """Draw a result of any kind into a PNG, PDF or SVG file; the suffix of `target` says which.

    `select` holds `KEY=VALUE` for axes of a sweep of which one value is to be drawn. Raises UsageError for another
    suffix, for an existing target without `force`, for what cannot be drawn or selected, and where matplotlib is
    missing; UnreadableResultError; CannotWriteError.
    """
    suffix = _suffix(target, result)
    from brakecli.plots import style

    with open_result(result) as stored, new_output(target, force=force) as file, style.applied():
        file.write(style.rendered(draw(stored, select), suffix))
        file.publish()


def plot_signal(look: "SignalLook", source: str, target: Path, *, force: bool) -> None:
    """Draw a measured signal as `plot_result` draws a result."""
    suffix = _suffix(target, Path(source))
    from brakecli.plots import signal, style

    with new_output(target, force=force) as file, style.applied():
        file.write(style.rendered(signal.draw(look, source), suffix))
        file.publish()


def _suffix(target: Path, source: Path) -> str:
    """The kind of picture; raises UsageError for another, where it is the source, and without matplotlib."""
    suffix = target.suffix.lower()
    if suffix not in (".pdf", ".png", ".svg"):
        problem = f"its suffix does not name a kind of picture (found {target.suffix!r})"
        raise UsageError(f"{target}: {problem}; name a file that ends in .pdf, .png or .svg with -o")
    with suppress(OSError, ValueError):  # one of them does not exist, or cannot
        if target.samefile(source):
            raise UsageError(f"{target}: this is the result itself; choose another output with -o")
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError as error:
        problem = f"matplotlib cannot be imported ({error})"
        raise UsageError(f"{problem}; install it with: python -m pip install matplotlib") from error
    return suffix


def draw(result: StoredResult, select: Sequence[str] = ()) -> "Figure":
    """The picture of an open result, drawn with the style that is set."""
    from brakecli.plots import comparison, curves, lock_in, maps, run, sweep

    kind = result.attributes.get("kind")
    if kind == "sweep":
        picture = sweep.gather(result, select)
        return curves.draw(picture) if len(picture.axes) == 1 else maps.draw(picture)
    if kind not in ("run", "comparison", "stability"):
        known = "a run, of a sweep, of a comparison or of stability"
        raise UsageError(f"{result.path}: holds a result of kind {kind!r}; name the result of {known}")
    if select:
        raise UsageError(f"{result.path}: --select is for sweeps (found {select[0]!r}); leave it out for a {kind}")
    if kind == "run":
        return run.draw(run.RunPicture(result))
    return comparison.draw(result) if kind == "comparison" else lock_in.draw(result)
