"""`load`, `classify`, `plot`, `report` and `diff` of `import brakecli`: what files and results hold."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brakecli.api import commands
from brakecli.api.calls import as_files, called, target, telling_to, warn
from brakecli.api.options import docstring, takes
from brakecli.api.records import Classify, Diff, Plot, Report
from brakecli.api.values import overrides, path_of
from brakecli.errors import UsageError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from brakecli.api.records import Changes, Counter, File, Result
    from brakecli.views.accessor import Differences


def load(source: "File", settings: "Changes | None" = None) -> Any:
    """What a file holds: a case, a sweep or a study, for the other functions, or a result as an `xarray.DataTree`.

    Args:
        source: path of a case file, a sweep file, a study, or a result file of any kind.
        settings: keys of the case to change, as `{"friction.coefficient": 0.4}`; of a result none.

    Raises:
        CaseError: the case or a setting is wrong; holds every problem.
        UnreadableResultError: the result is damaged or of another program.
    """
    from brakecli.api.inputs import is_result, kind_of_file, load_case, load_study, load_sweep

    name = path_of(source)
    with called():
        if is_result(name):
            if settings:
                raise UsageError(f"{name}: holds a result, which has no settings; give them to brakecli.run")
            from brakecli.results.as_xarray import read_tree

            return read_tree(Path(name))
        kinds: dict[str, Callable[[str, list[str]], Any]] = {"sweep": load_sweep, "study": load_study}
        return kinds.get(kind_of_file(name), load_case)(name, overrides(settings))


@takes(Classify)
def classify(options: Classify) -> "xr.Dataset":
    """Regime of a stored run, or of a measured signal, with evidence.

    Args:
        {options}

    Returns:
        A variable for each number that `brakecli classify --json` prints; lists and objects (JSON) as attributes.
        `reasons` of `result.brakecli` are texts, `bursts` and `vibrations` are records.

    Raises:
        UsageError, UnreadableResultError: as `brakecli classify`.
    """
    from brakecli.api.verdict import verdict_on
    from brakecli.results.as_xarray import dataset
    from brakecli.results.fields import DYING, EXPONENT, UNIT, VERDICT

    with called(), as_files([options.source], "result") as (file,):
        numbers = verdict_on(str(file), options)
    warn(numbers.get("warnings", ()))
    return dataset((*VERDICT, *EXPONENT, *DYING, UNIT), numbers)


@takes(Plot)
def plot(options: Plot) -> "Figure":
    """Draw a result of any kind, or a measured signal, as `brakecli.plot(brakecli.run("squeal.toml"))`.

    Args:
        {options}

    Returns:
        The figure of matplotlib, which notebooks show.

    Raises:
        UsageError, UnreadableResultError, CannotWriteError: as `brakecli plot`; also where matplotlib is missing.
    """
    with (
        called(),
        target(options.output, "picture.png") as path,
        as_files([options.result], "result") as (file,),
    ):
        figure, warnings = commands.plot(options, str(file), path)
        warn(warnings)
        return figure


def report(
    *results: "Result",
    output: "File | None" = None,
    full: bool = False,
    progress: "Counter" = False,
    force: bool = False,
) -> str:
    """Put results on one page, answer first, as `brakecli.report(result, output="report.html")`.

    Args:
        {options}

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
        from brakecli.studies.runs.limits import within_range
        from brakecli.views.reports.page import write_report

        with within_range():
            return write_report(files, path, full=full, force=force, progress=tell)


report.__doc__ = docstring(report.__doc__, Report)  # a record has no field that takes any number of arguments


@takes(Diff)
def diff(options: Diff) -> "Differences":
    """How a second result differs from a first one: case, numbers, curves, as `brakecli.diff(first, second).same`.

    Args:
        {options}

    Returns:
        A record: `same`; `case`, `numbers`, `variables` and `versions`, lists of what differs, by the names of
        `brakecli diff --json`.

    Raises:
        UsageError, UnreadableResultError, CannotWriteError: as `brakecli diff`.
    """
    with (
        called(),
        target(options.output) as path,
        as_files([options.first, options.second], "a", "b") as files,
    ):
        from brakecli.views.accessor import Differences

        differences = commands.diff(options, files[0], files[1], None if options.output is None else path)
        return Differences(**vars(differences))
