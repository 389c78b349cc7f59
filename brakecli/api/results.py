"""`load`, `classify`, `plot`, `report` and `diff` of `import brakecli`: what files and results hold."""

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brakecli.api.calls import as_files, called, target, telling_to, warn
from brakecli.api.given import chosen_of, measured_of, overrides, path_of, text_of
from brakecli.errors import UsageError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from brakecli.accessor import Differences
    from brakecli.api.calls import Progress, Result
    from brakecli.api.given import Settings


def load(source: "str | PathLike[str]", settings: "Settings | None" = None) -> Any:
    """What a file holds: a case, a sweep or a study, for the other functions, or a result as an `xarray.DataTree`.

    Args:
        source: path of a case file, a sweep file, a study, or a result file of any kind.
        settings: keys of the case to change, as `{"friction.coefficient": 0.4}`; of a result none.

    Raises:
        CaseError: the case or a setting is wrong; holds every problem.
        UnreadableResultError: the result is damaged or of another program.
    """
    from brakecli.front.inputs import is_result, kind_of_file, load_case, load_study, load_sweep

    name = path_of(source)
    with called():
        if is_result(name):
            if settings:
                raise UsageError(f"{name}: holds a result, which has no settings; give them to brakecli.run")
            from brakecli.files.as_xarray import opened

            return opened(Path(name))
        kinds: dict[str, Callable[[str, list[str]], Any]] = {"sweep": load_sweep, "study": load_study}
        return kinds.get(kind_of_file(name), load_case)(name, overrides(settings))


def classify(
    source: "Result",
    quantity: str | None = None,
    *,
    belt_speed: float | None = None,
    stiffness: float | None = None,
    thresholds: "Mapping[str, float] | None" = None,
    **reading: Any,
) -> "xr.Dataset":
    """Regime of a stored run, or of a measured signal, with evidence.

    Args:
        source: what `run` gave, or the path of a result, or of a measured signal.
        quantity: what was measured, as `brakecli classify --quantity` has it; None for a result.
        belt_speed: speed of the wheel's surface (m/s), if known.
        stiffness: stiffness behind a measured force (N/m), if known.
        thresholds: those to change, by name.
        reading: how a file is read: `column`, `time_column`, `sample_rate` (Hz), `unit`, `time_unit`.

    Returns:
        A variable for each number that `brakecli classify --json` prints; lists and objects (JSON) as attributes.
        `reasons` of `result.brakecli` are texts, `bursts` and `vibrations` are records.

    Raises:
        UsageError, UnreadableResultError: as `brakecli classify`.
    """
    from brakecli.files.as_xarray import dataset
    from brakecli.files.fields import EXPONENT, UNIT, VERDICT
    from brakecli.front.verdict import verdict_on

    if "second_run" in reading:
        raise UsageError("classify: second_run: there is none any more; every verdict asks what it asked")
    changes = chosen_of(thresholds, "thresholds")
    measured = measured_of("classify", quantity, belt_speed, stiffness, reading)
    with called(), as_files([source], "result") as (file,):
        numbers = verdict_on(str(file), measured, changes)
    warn(numbers.get("warnings", ()))
    return dataset((*VERDICT, *EXPONENT, UNIT), numbers)


def plot(
    result: "Result",
    quantity: str | None = None,
    *,
    output: "str | PathLike[str] | None" = None,
    select: "Settings | None" = None,
    variable: str | None = None,
    section: str | None = None,
    belt_speed: float | None = None,
    stiffness: float | None = None,
    force: bool = False,
    **reading: Any,
) -> "Figure":
    """Draw a result of any kind, or a measured signal, as `brakecli.plot(brakecli.run("squeal.toml"))`.

    Args:
        result: what another function gave, or the path of a result; with `quantity` that of a measured signal.
        quantity: what was measured, as `brakecli plot --quantity` has it.
        output: a picture to write, .png, .pdf or .svg; none if left out.
        select: values of a sweep's axes of which the nearest are drawn, as `{"friction.coefficient": 0.4}`.
        variable: a number of a sweep; of a run x, y, vx, vy, friction_force, normal_force, torque or
            contact_fraction.
        section: a Poincaré section of a run in place of its histories, as `brakecli plot --section` has it.
        belt_speed: of a signal: speed of the wheel's surface (m/s), if known.
        stiffness: of a signal: stiffness behind a measured force (N/m), if known.
        force: replace that file if it exists.
        reading: how a signal is read, as for `classify`.

    Returns:
        The figure of matplotlib, which notebooks show.

    Raises:
        UsageError, UnreadableResultError, CannotWriteError: as `brakecli plot`; also where matplotlib is missing.
    """
    from brakecli.plots.result import plot_result, plot_signal

    measured = measured_of("plot", quantity, belt_speed, stiffness, reading)
    shown = text_of(variable, "variable")
    cut = text_of(section, "section")
    with (
        called(),
        target(output, "picture.png") as path,
        as_files([result], "result") as (file,),
    ):
        if measured.quantity_of(str(file)) is None:
            return plot_result(file, path, chosen_of(select, "select"), shown, cut, force=force)
        if select or shown or cut:
            what = "select, variable and section"
            raise UsageError(f"{what}: are for results; leave them out for a measured signal")
        look = measured.look_at(str(file))
        warn(look.verdict.warnings)
        return plot_signal(look, str(file), path, force=force)


def report(
    *results: "Result",
    output: "str | PathLike[str] | None" = None,
    full: bool = False,
    progress: "Progress" = False,
    force: bool = False,
) -> str:
    """Put results on one page, answer first, as `brakecli.report(result, output="report.html")`.

    Args:
        results: what other functions gave, or paths of results: of runs, sweeps, comparisons, stability with
            `vary`, branches or scatter.
        output: the page to write, .html or .pdf; none if left out.
        full: add the case, the evidence, accuracy, warnings, and how to repeat it.
        progress: as for `run`.
        force: replace that file if it exists.

    Returns:
        The page as HTML that is complete in itself, also where a PDF is written.

    Raises:
        UsageError, UnreadableResultError, CannotWriteError: as `brakecli report`; also where jinja2 is missing,
            or weasyprint for a PDF.
    """
    if not results:
        raise UsageError("report: there is no result; give one or more")
    with (
        called(),
        target(output, "report.html") as path,
        telling_to(progress) as tell,
        as_files(results, "result") as files,
    ):
        from brakecli.reports.page import write_report
        from brakecli.runs.limits import within_range

        with within_range():
            return write_report(files, path, full=full, force=force, progress=tell)


def diff(
    first: "Result",
    second: "Result",
    *,
    output: "str | PathLike[str] | None" = None,
    variable: str | None = None,
    force: bool = False,
) -> "Differences":
    """How a second result differs from a first one: case, numbers, curves, as `brakecli.diff(first, second).same`.

    Args:
        first: what another function gave, or the path of a result of any kind.
        second: a result of the same kind.
        output: a picture of both to write, .png, .pdf or .svg; none if left out.
        variable: what is drawn of two runs, `vx` if left out, or of two other results.
        force: replace that file if it exists.

    Returns:
        A record: `same`; `case`, `numbers`, `variables` and `versions`, lists of what differs, by the names of
        `brakecli diff --json`.

    Raises:
        UsageError, UnreadableResultError, CannotWriteError: as `brakecli diff`.
    """
    shown = text_of(variable, "variable")
    with (
        called(),
        target(output) as path,
        as_files([first, second], "a", "b") as files,
    ):
        from brakecli.accessor import Differences
        from brakecli.files.contents import difference
        from brakecli.files.read import open_result

        with open_result(files[0]) as a, open_result(files[1]) as b:
            found = Differences(**vars(difference(a, b)))
        if output is not None:
            from brakecli.plots.result import plot_two

            plot_two(files[0], files[1], path, force=force, variable=shown)
        return found
