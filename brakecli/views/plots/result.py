"""Draw any result: read its file, choose the picture of its kind, write the file of the picture."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.errors import UsageError, installed, printable
from brakecli.faces import argument
from brakecli.results.atomic import check_target, new_output
from brakecli.results.read import StoredResult, open_result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from brakecli.analysis.signals.look import SignalLook


def plot_result(
    result: Path, target: Path, select: Sequence[str] = (), variable: str = "", section: str = "", *, force: bool
) -> "Figure":
    """Draw a result of any kind into a PNG, PDF or SVG file; the suffix of `target` says which.

    `select` holds `KEY=VALUE` for axes of a sweep of which one value is to be drawn; `variable` names a number of
    a sweep or a quantity of a run, `section` a Poincaré section of a run. Raises UsageError for another suffix,
    for an existing target without `force`, for what cannot be drawn or selected, and where matplotlib is missing;
    UnreadableResultError; CannotWriteError.
    """
    with _opened(target, result, force=force) as (write, stored):
        return write(draw(stored[0], select, variable, section))


def plot_two(first: Path, second: Path, target: Path, *, force: bool, variable: str = "") -> None:
    """Draw the curves of two results of one kind over each other; raises what `plot_result` raises."""
    with _opened(target, first, second, force=force) as (write, stored):
        from brakecli.views.plots import over_each_other

        write(over_each_other.draw((stored[0], stored[1]), variable))


def plot_signal(look: "SignalLook", source: str, target: Path, *, force: bool) -> "Figure":
    """Draw a measured signal as `plot_result` draws a result."""
    with _opened(target, force=force) as (write, _):
        from brakecli.views.plots import signal

        return write(signal.draw(look, source))


@contextmanager
def _opened(
    target: Path, *results: Path, force: bool
) -> Iterator[tuple[Callable[["Figure"], "Figure"], list[StoredResult]]]:
    """Results for a picture, and what writes it."""
    suffix = target.suffix.lower()
    check_target(target, "a kind of picture", (".pdf", ".png", ".svg"), results)
    with installed("matplotlib"):
        import matplotlib.figure  # noqa: F401
    from brakecli.views.plots import style

    with ExitStack() as stack:
        stored = [stack.enter_context(open_result(result)) for result in results]
        stack.enter_context(style.applied())

        def write(figure: "Figure") -> "Figure":
            with new_output(
                target, force=force
            ) as file:  # what cannot be drawn has more to say than an old picture
                file.write(style.rendered(figure, suffix))
                file.publish()
            vars(figure)["_repr_png_"] = partial(style.rendered, figure, ".png")  # by which notebooks show it
            return figure

        yield write, stored


def draw(result: StoredResult, select: Sequence[str] = (), variable: str = "", section: str = "") -> "Figure":
    """The picture of an open result, drawn with the style that is set; only what its kind needs is imported."""
    kind = str(result.attributes.get("kind"))
    _refuse_section(result, kind, variable, section)
    if kind == "sweep":
        from brakecli.views.plots import curves, gather, maps

        picture = gather.gather(result, select, variable)
        is_curve = len(picture.axes) == 1 and not picture.listed
        return curves.draw(picture) if is_curve else maps.draw(picture)
    if kind not in _KINDS:
        choices = "a run, of a sweep, of a comparison, of stability, of branches or of scatter"
        raise UsageError(f"{result.path}: holds a result of kind {printable(kind)}; name the result of {choices}")
    if select:
        raise UsageError(
            f"{result.path}: {argument('select')} is for sweeps (found {select[0]!r}); leave it out for a {kind}"
        )
    if section:
        from brakecli.views.plots import section as sections  # waits for SciPy's splines

        return sections.draw(result, section)
    if kind == "run":
        from brakecli.views.plots import run

        return run.draw(run.RunPicture(result, variable or "vx"))
    if kind == "branch":
        from brakecli.views.plots import branch

        return branch.draw(result, variable)
    if variable:
        what = f"{argument('variable')} is for runs, sweeps and branches (found {variable!r})"
        raise UsageError(f"{result.path}: {what}; leave it out")
    if kind == "comparison":
        from brakecli.views.plots import comparison

        return comparison.draw(result)
    if kind == "stability":
        from brakecli.views.plots import lock_in

        return lock_in.draw(result)
    from brakecli.views.plots import scatter

    return scatter.draw(result)


_KINDS = ("run", "branch", "comparison", "stability", "scatter")
"""Kinds of results that have a picture, beside sweeps."""


def _refuse_section(result: StoredResult, kind: str, variable: str, section: str) -> None:
    """Raise UsageError where a section is asked of what is no run, or beside a variable."""
    if section and kind != "run":
        what = f"is for runs, and {result.path} is a {printable(kind)}; leave it out"
        raise UsageError(f"{argument('section')} {section}: {what}")
    if section and variable:
        what = f"is a picture of its own; leave {argument('variable')} out"
        raise UsageError(f"{argument('section')} {section}: {what}")
