"""`import brakecli`: cases in, xarray objects out, as on the command line. Large imports wait for a call."""

import json
import multiprocessing
import os
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace
from datetime import date, time
from functools import partial
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from brakecli.errors import BrakecliError, UnreadableResultError, UsageError
from brakecli.faces import in_python
from brakecli.files.trust import readings
from brakecli.stop import signals_shown

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from brakecli.accessor import Advice, Differences
    from brakecli.case.read import LoadedCase
    from brakecli.front.measured import Measured
    from brakecli.scattering.study import LoadedStudy
    from brakecli.solver.motion import Counted
    from brakecli.sweeps.listed import Listed
    from brakecli.sweeps.plan import LoadedSweep
    from brakecli.sweeps.tables import Axis

    Source: TypeAlias = str | PathLike[str] | LoadedCase
    Settings = Mapping[str, Any]
    Result = str | PathLike[str] | xr.Dataset | xr.DataTree
    Progress = bool | Callable[[str, int, int], None]


def load(source: "str | PathLike[str]", settings: "Settings | None" = None, *, force_read: bool = False) -> Any:
    """What a file holds: a case, a sweep or a study, for the other functions, or a result as an `xarray.DataTree`.

    Args:
        source: path of a case file, a sweep file, a study, or a result file of any kind.
        settings: keys of the case to change, as `{"friction.coefficient": 0.4}`; of a result none.
        force_read: look at a result whose digest does not fit; its attribute `digest` and a warning say so.

    Raises:
        CaseError: the case or a setting is wrong; holds every problem.
        UnreadableResultError: the result is damaged or of another program.
    """
    from brakecli.front.inputs import is_result, kind_of_file, load_case, load_study, load_sweep

    name = str(source)
    with in_python(), _readings(force_read=force_read):
        if is_result(name):
            if settings:
                raise UsageError(f"{name}: holds a result, which has no settings; give them to brakecli.run")
            from brakecli.files.as_xarray import opened

            return opened(Path(name))
        kinds: dict[str, Callable[[str, list[str]], Any]] = {"sweep": load_sweep, "study": load_study}
        return kinds.get(kind_of_file(name), load_case)(name, _overrides(settings))


def run(
    case: "Source",
    settings: "Settings | None" = None,
    *,
    output: "str | PathLike[str] | None" = None,
    progress: "Progress" = False,
    force: bool = False,
) -> "xr.DataTree":
    """Simulate one case: the result as a tree of datasets.

    Groups `history` (over `time`, s) and `spectrum` (over `frequency`, Hz) hold the motion; attributes of the root
    are regime, frequency (Hz), amplitude (m) and all else that `docs/result-format.md` names.

    Args:
        case: path of a case file or of a result, or what `load` gave.
        settings: keys of the case to change, as `{"friction.coefficient": 0.4}`; a table as
            `{"solver": {"tolerance": 1e-4}}` replaces the one that the case has. A measured profile may be an
            array of places and heights (m): `{"roughness.wheel.profile": np.column_stack([places, heights])}`.
        output: a result file to keep; none if left out.
        progress: True shows how far it is, as the command does; or a function that is called with what is counted,
            how many are done, and how many there are (0 if unknown).
        force: replace that file if it exists.

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError: as `brakecli run`; nothing is left behind.
        BrakecliError: the run has failed; `output` is written up to there.

    A run that is not sure to keep its tolerance warns, as all that `brakecli run` warns of is a `UserWarning`.
    """
    with _interruptible(), _readings(), _target(output) as path, _telling(progress) as tell:
        loaded = _case(case, settings)
        from brakecli.files.as_xarray import opened
        from brakecli.runs.run import run

        report = run(loaded, path, force=force, progress=tell)
        _warn(report.warnings)
        if report.motion.work.failed:
            raise BrakecliError(str(report.motion.work.failure_sentence))
        return opened(path, own=True)


def stability(
    case: "Source",
    settings: "Settings | None" = None,
    *,
    vary: "Mapping[str | tuple[str, ...], Iterable[float] | Settings] | None" = None,
    progress: "Progress" = False,
) -> "xr.Dataset":
    """Critical friction, modes and growth of steady sliding, and from which friction on a vibration can exist.

    Args:
        case: path of a case file or of a result, or what `load` gave.
        settings: keys of the case to change.
        vary: one key, or several that take the same value, with values that rise or fall, as
            `{"friction.coefficient": np.linspace(0, 1, 101)}`: follows both modes along them. A range is written
            as in a sweep: `{"friction.coefficient": {"start": 0, "stop": 1, "num": 101}}`.
        progress: as for `run`.

    Returns:
        A variable for each number that `brakecli stability --json` prints, NaN or an empty text if there is none;
        lists as attributes, and objects, as JSON. `modes`, `crossings`, `equilibrium` and `discrete` of
        `result.brakecli` are records. With `vary` the lock-in diagram, and no limit cycles.

    Raises:
        CaseError, UsageError, RefusedError: as `brakecli stability`.
    """
    with _interruptible(), _readings(), _telling(progress) as tell:
        loaded = _case(case, settings)
        from brakecli.files.as_xarray import dataset, opened
        from brakecli.files.field import values_of
        from brakecli.files.fields import STABILITY, THRESHOLDS

        if vary is None:
            from brakecli.analysis.stability.report import stability
            from brakecli.branches.thresholds import thresholds
            from brakecli.case.system import system_of
            from brakecli.runs.limits import within_range

            with within_range():
                system = system_of(loaded.case)
                report = stability(system)
                both = thresholds(loaded.case, system, report, tell)
            numbers = values_of(STABILITY, report) | values_of(THRESHOLDS, both)
            return dataset((*STABILITY, *THRESHOLDS), numbers)
        from brakecli.sweeps.lock_in import lock_in, write

        with _target(None) as path:
            found = lock_in(loaded, _axis(vary), "vary", tell)
            write(path, loaded, found, force=False)
            return opened(path, own=True).to_dataset()


def branch(
    case: "Source",
    settings: "Settings | None" = None,
    *,
    parameter: "Mapping[str | tuple[str, ...], tuple[float, float]]",
    start: "Result | Sequence[Result] | None" = None,
    switch: bool = False,
    output: "str | PathLike[str] | None" = None,
    progress: "Progress" = False,
    force: bool = False,
) -> "xr.DataTree":
    """Every motion along a key, stable or not: a tree with a group `branch_0`, `branch_1`, … for each branch.

    The first one is steady sliding. A group holds its motions over `point`: value, amplitude (m), frequency (Hz),
    whether it is stable, Floquet multipliers; its group `special` holds folds, flips and all that is special.
    Attributes of the root are critical, coexists_from, barrier (m), sentence and all else that
    `docs/result-format.md` names.

    Args:
        case: path of a case file or of a result, or what `load` gave.
        settings: keys of the case to change.
        parameter: one key with both ends of its range, as `{"friction.coefficient": (0.0, 1.0)}`; a tuple of keys
            takes the same value.
        start: what `run` gave, or the path of a result, whose end comes to a motion that is followed, too; or a
            list of them.
        switch: also follow the motions of twice the period from each flip.
        output: a result file to keep; none if left out.
        progress: as for `run`.
        force: replace that file if it exists.

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError, UnreadableResultError: as `brakecli branch`.
    """
    with _interruptible(), _readings(), _target(output) as path, _telling(progress) as tell:
        loaded = _case(case, settings)
        from brakecli.files.as_xarray import opened
        from brakecli.runs.branch import branch, line_of, parsed, start_of, write
        from brakecli.runs.limits import within_range
        from brakecli.sweeps.result import unit

        if len(_mapping(parameter, "parameter")) != 1:
            raise UsageError("parameter: takes one key with both ends of its range, or one tuple of keys")
        [(names, ends)] = parameter.items()
        low, high = _ends(ends)
        text = f"{names if isinstance(names, str) else ','.join(names)}={low!r}:{high!r}"
        keys, low, high = parsed(text)
        with within_range():
            line = line_of(loaded, keys, low, high, "parameter")
        given: Iterable[Any] = start if isinstance(start, list | tuple) else [start] if start is not None else []
        with _files(given, "start") as files:
            starts = [start_of(file, keys) for file in files]
        found = branch(line, tell, lambda: False, starts, switch)
        write(path, loaded, found, unit(keys[0]), force=force)
        return opened(path, own=True)


def _ends(given: Any) -> tuple[float, float]:
    try:
        low, high = map(float, given)
    except (TypeError, ValueError):
        raise UsageError(f"parameter: {given!r} is not both ends of a range; give two numbers") from None
    return low, high


def sweep(
    source: "Source | LoadedSweep",
    settings: "Settings | None" = None,
    *,
    axes: "Mapping[str | tuple[str, ...], Iterable[Any]] | None" = None,
    points: "Mapping[str, Iterable[Any]] | None" = None,
    critical: "Settings | None" = None,
    direction: "str | Mapping[str | tuple[str, ...], str] | None" = None,
    output: "str | PathLike[str] | None" = None,
    jobs: int | None = None,
    scheduler: Any = None,
    progress: "Progress" = False,
    force: bool = False,
) -> "xr.Dataset":
    """Simulate a grid or a list of cases, or search for critical values: a dataset with a dimension for each axis.

    A script that calls this needs `if __name__ == "__main__":` around its work, as workers are new processes that
    run it anew; not with `jobs=1`, which computes in this process.

    Args:
        source: path of a sweep file, or what `load` gave; with `axes`, `points` or `critical` a case.
        settings: keys of the base case to change.
        axes: values of each key, as `{"friction.coefficient": [0.3, 0.5]}`; a tuple of keys takes the same values.
            A range is written as in a file: `{"friction.coefficient": {"start": 0.1, "stop": 0.5, "num": 5}}`.
        points: points in place of a grid: the values of each key at all of them, as `{"shoe.mass": [10.0, 12.0],
            "friction.coefficient": [0.3, 0.5]}` or as a data frame; the dataset has the dimension `point`.
        critical: the keys of `[critical]`, as `{"parameter": "friction.coefficient", "lower": 0, "upper": 2}`.
        direction: "up", "down" or "both" follows the motion along the only axis, each point from the end of the
            one before; of several axes name one, as `{"friction.coefficient": "both"}`. With "both" the dataset
            has the dimension `direction` as well.
        output: a result file to keep; with it, an interrupted sweep goes on where it was.
        jobs: worker processes; one for each core if left out.
        scheduler: compute on a dask cluster: its client, the cluster, or the address of its scheduler. If left out
            it is the address in the environment's `DASK_SCHEDULER_ADDRESS`, if there is one.
        progress: as for `run`.
        force: replace that file if it exists.

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError: as `brakecli sweep`.
    """
    _refuse_jobs(jobs)
    with _interruptible(), _readings(), _target(output) as path, _telling(progress) as tell:
        from brakecli.files import fields
        from brakecli.files.as_xarray import opened
        from brakecli.files.field import values_of
        from brakecli.front.inputs import load_sweep
        from brakecli.runs.run import load_kernels
        from brakecli.sweeps.driver import choose_engine, counting, sweep
        from brakecli.sweeps.listed import GIVEN
        from brakecli.sweeps.plan import LoadedSweep, sweep_of

        if axes is not None or points is not None or critical is not None:
            listed = _listed(points)
            tables = {"case": "-", "axis": _axes(axes, direction), "critical": critical or {}}
            given = _plain(tables, "sweep")
            given |= {"points": GIVEN} if listed else {}
            loaded = sweep_of(
                {name: each for name, each in given.items() if each}, _case(source, settings), listed
            )
        elif direction is not None:
            raise UsageError("direction: is for axes; a sweep file states it in an axis of its own")
        elif not isinstance(source, LoadedSweep):
            loaded = load_sweep(str(source), _overrides(settings))
        elif settings:
            raise UsageError("settings: come too late for a sweep that was loaded; give them to brakecli.load")
        else:
            loaded = source
        load_kernels(loaded.base)
        with choose_engine(loaded.plan, jobs, _scheduler(scheduler), in_caller=True) as engine:
            report = sweep(loaded, path, engine, force=force, progress=counting(loaded.plan, tell))
        _warn(report.notes)
        if found := report.findings.failures:
            failed = f"{report.findings.failed} of {report.findings.points} points failed"
            _warn([f"{failed}, the first: {found[0]['reason']}"])
        result = opened(path, own=True).to_dataset()  # without groups
        if report.findings.attractors is not None:
            known = [values_of(fields.ATTRACTOR, each) for each in report.findings.attractors]
            result.attrs["attractors"] = json.dumps(known)
        return result


def _axes(axes: Any, direction: Any) -> list[dict[str, Any]]:
    """The tables `[[axis]]` of a sweep."""
    given = _mapping(axes, "axes")
    ways = dict.fromkeys(given, direction) if isinstance(direction, str) and len(given) == 1 else direction
    ways = _mapping(ways, "direction")
    if unknown := [key for key in ways if key not in given]:
        raise UsageError(f"direction: {unknown[0]!r} is not among the axes; name an axis as axes does")
    return [
        {"parameter": key}
        | dict(each if isinstance(each, Mapping) else {"values": each})
        | ({"direction": ways[key]} if key in ways else {})
        for key, each in given.items()
    ]


def _scheduler(given: Any) -> Any:
    return given if given is not None else os.environ.get("DASK_SCHEDULER_ADDRESS") or None


def scatter(
    source: "str | PathLike[str] | LoadedStudy",
    settings: "Settings | None" = None,
    *,
    output: "str | PathLike[str] | None" = None,
    jobs: int | None = None,
    scheduler: Any = None,
    progress: "Progress" = False,
    force: bool = False,
) -> "xr.Dataset":
    """How likely brakes squeal that are not built to their drawing: samples of a study, and what they say.

    The dataset has the dimensions `sample` (values of the keys, growth rate, frequency, critical friction or
    regime), `outcome` (`probability` with its 95 % interval) and `parameter` (Sobol indices); attributes are those
    that `brakecli scatter --json` prints. Runs need a guard in a script, as `sweep` does.

    Args:
        source: path of a study file, or what `load` gave.
        settings: keys of the study to change, as `{"samples": 4096}`, or of its case.
        output: a result file to keep; with it, an interrupted study of runs goes on where it was.
        jobs: worker processes; one for each core if left out.
        scheduler: as for `sweep`.
        progress: as for `run`.
        force: replace that file if it exists.

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError: as `brakecli scatter`.
    """
    _refuse_jobs(jobs)
    with _interruptible(), _readings(), _target(output) as path, _telling(progress) as tell:
        from brakecli.files.as_xarray import opened
        from brakecli.scattering.scatter import engine_for, scatter

        loaded = _study(source, settings)
        engine_of = partial(engine_for, jobs=jobs, scheduler=_scheduler(scheduler), in_caller=True)
        report = scatter(loaded, path, engine_of, force=force, tell=tell)
        if report.failed:
            _warn(
                [f"{report.failed} of {report.samples} samples have no answer, the first: {report.first_failure}"]
            )
        return opened(path, own=True).to_dataset()


def _study(source: Any, settings: "Settings | None" = None) -> "LoadedStudy":
    from brakecli.front.inputs import load_study
    from brakecli.scattering.study import LoadedStudy

    if not isinstance(source, LoadedStudy):
        return load_study(str(source), _overrides(settings))
    if settings:
        raise UsageError("settings: come too late for a study that was loaded; give them to brakecli.load")
    return source


def advise(
    case: "Source",
    settings: "Settings | None" = None,
    *,
    keys: "str | Iterable[str] | None" = None,
    margin: float = 0.2,
    scatter: "str | PathLike[str] | LoadedStudy | None" = None,
    progress: "Progress" = False,
) -> "Advice":
    """What moves the critical friction of a case, and what to change so that it does not squeal.

    `brakecli.advise("squeal.toml").advice[0].to` is the new value of the key that helps best.

    Args:
        case: path of a case file or of a result, or what `load` gave.
        settings: keys of the case to change.
        keys: those that may be advised, with `*` for any part; masses, stiffnesses, dampings, angles and load if
            left out.
        margin: part of its friction by which the case is to stay stable above it, from 0 to 10.
        scatter: path of a study file, or what `load` gave: advice is ranked by the probability of squeal that is
            left.
        progress: as for `run`.

    Returns:
        A record: `critical_friction`, `margin`, `stable`; `sensitivities` and `advice`, lists of records, of which
        the first move most and help best; `check`, a run with the first advice followed; `conclusion()` and
        `notes()` in words; `numbers()` is what `brakecli advise --json` prints. Values have their keys' units.

    Raises:
        CaseError, UsageError, RefusedError: as `brakecli advise`.
    """
    with _interruptible(), _readings(), _telling(progress) as tell:
        loaded = _case(case, settings)
        from brakecli.accessor import Advice
        from brakecli.analysis.stability.advice import KEYS
        from brakecli.runs.advise import advise
        from brakecli.runs.limits import within_range
        from brakecli.runs.run import load_kernels

        if not (isinstance(margin, int | float) and 0.0 <= margin <= 10.0):
            raise UsageError(f"margin {margin}: is no number from 0 to 10")
        patterns = keys.split(",") if isinstance(keys, str) else KEYS if keys is None else [*map(str, keys)]
        study = replace(_study(scatter), base=loaded) if scatter is not None else None
        load_kernels(loaded)
        with within_range():
            report = advise(loaded, patterns, margin, tell)
            if study is not None:
                from brakecli.scattering.advised import under_scatter
                from brakecli.scattering.scatter import engine_for

                report = under_scatter(report, loaded, study, partial(engine_for, in_caller=True), tell)
                _warn(study.beside(loaded.case))
        return Advice(**vars(report))


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
    force_read: bool = False,
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
        force_read: look at a result whose digest does not fit; the picture says so.
        reading: how a signal is read, as for `classify`.

    Returns:
        The figure of matplotlib, which notebooks show.

    Raises:
        UsageError, UnreadableResultError, CannotWriteError: as `brakecli plot`; also where matplotlib is missing.
    """
    from brakecli.plots.result import plot_result, plot_signal

    measured = _measured("plot", quantity, belt_speed, stiffness, reading)
    with (
        _interruptible(),
        _readings(force_read=force_read),
        _target(output, "picture.png") as path,
        _files([result], "result") as (file,),
    ):
        if measured.quantity_of(str(file)) is None:
            chosen = [f"{key}={value}" for key, value in _mapping(select, "select").items()]
            return plot_result(file, path, chosen, variable or "", section or "", force=force)
        if select or variable or section:
            what = "select, variable and section"
            raise UsageError(f"{what}: are for results; leave them out for a measured signal")
        look = measured.look_at(str(file))
        _warn(look.verdict.warnings)
        return plot_signal(look, str(file), path, force=force)


def report(
    *results: "Result",
    output: "str | PathLike[str] | None" = None,
    progress: "Progress" = False,
    force: bool = False,
    force_read: bool = False,
) -> str:
    """Put results on one page, answer first, as `brakecli.report(result, output="report.html")`.

    Args:
        results: what other functions gave, or paths of results: of runs, sweeps, comparisons, stability with
            `vary`, branches or scatter.
        output: the page to write, .html; none if left out.
        progress: as for `run`.
        force: replace that file if it exists.
        force_read: look at results whose digest does not fit; the page says so.

    Returns:
        The page, HTML that is complete in itself.

    Raises:
        UsageError, UnreadableResultError, CannotWriteError: as `brakecli report`; also where jinja2 is missing.
    """
    if not results:
        raise UsageError("report: there is no result; give one or more")
    with (
        _interruptible(),
        _readings(force_read=force_read),
        _target(output, "report.html") as path,
        _telling(progress) as tell,
        _files(results, "result") as files,
    ):
        from brakecli.reports.page import write_report
        from brakecli.runs.limits import within_range

        with within_range():
            write_report(files, path, force=force, progress=tell)
        return path.read_text(encoding="utf-8")


def diff(
    first: "Result",
    second: "Result",
    *,
    output: "str | PathLike[str] | None" = None,
    variable: str | None = None,
    force: bool = False,
    force_read: bool = False,
) -> "Differences":
    """How a second result differs from a first one: case, numbers, curves, as `brakecli.diff(first, second).same`.

    Args:
        first: what another function gave, or the path of a result of any kind.
        second: a result of the same kind.
        output: a picture of both to write, .png, .pdf or .svg; none if left out.
        variable: what is drawn of two runs, `vx` if left out, or of two other results.
        force: replace that file if it exists.
        force_read: look at results whose digest does not fit.

    Returns:
        A record: `same`; `case`, `numbers`, `variables` and `versions`, lists of what differs, by the names of
        `brakecli diff --json`.

    Raises:
        UsageError, UnreadableResultError, CannotWriteError: as `brakecli diff`.
    """
    with (
        _interruptible(),
        _readings(force_read=force_read),
        _target(output) as path,
        _files([first, second], "a", "b") as files,
    ):
        from brakecli.accessor import Differences
        from brakecli.files.contents import difference
        from brakecli.files.read import open_result

        with open_result(files[0]) as a, open_result(files[1]) as b:
            found = Differences(**vars(difference(a, b)))
        if output is not None:
            from brakecli.plots.result import plot_two

            plot_two(files[0], files[1], path, force=force, variable=variable or "")
        return found


def _refuse_jobs(jobs: int | None) -> None:
    """Raise UsageError for a wrong number of workers, and end a worker that is being started by a script."""
    if jobs is not None and not (isinstance(jobs, int) and 1 <= jobs <= 4096):
        raise UsageError(f"jobs {jobs}: is no number of workers from 1 to 4096")
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        os._exit(os.EX_USAGE)  # which tells the caller that there is no guard


def classify(
    source: "Result",
    quantity: str | None = None,
    *,
    belt_speed: float | None = None,
    stiffness: float | None = None,
    thresholds: "Mapping[str, float] | None" = None,
    force_read: bool = False,
    **reading: Any,
) -> "xr.Dataset":
    """Regime of a stored run, or of a measured signal, with evidence.

    Args:
        source: what `run` gave, or the path of a result, or of a measured signal.
        quantity: what was measured, as `brakecli classify --quantity` has it; None for a result.
        belt_speed: speed of the wheel's surface (m/s), if known.
        stiffness: stiffness behind a measured force (N/m), if known.
        thresholds: those to change, by name.
        force_read: look at a result whose digest does not fit; a warning says so.
        reading: how a file is read: `column`, `time_column`, `sample_rate` (Hz), `unit`, `time_unit`.

    Returns:
        A variable for each number that `brakecli classify --json` prints; lists and objects (JSON) as attributes.
        `reasons` of `result.brakecli` are texts, `bursts` and `vibrations` are records.

    Raises:
        UsageError, UnreadableResultError: as `brakecli classify`.
    """
    from brakecli.files.as_xarray import dataset
    from brakecli.files.fields import EXPONENT, VERDICT
    from brakecli.front.verdict import verdict_on

    if "second_run" in reading:
        raise UsageError("classify: second_run: there is none any more; every verdict asks what it asked")
    changes = [f"{name}={value}" for name, value in _mapping(thresholds, "thresholds").items()]
    measured = _measured("classify", quantity, belt_speed, stiffness, reading)
    with _interruptible(), _readings(force_read=force_read), _files([source], "result") as (file,):
        numbers = verdict_on(str(file), measured, changes)
    _warn(numbers.get("warnings", ()))
    return dataset((*VERDICT, *EXPONENT), numbers)


def _measured(
    function: str, quantity: str | None, belt_speed: Any, stiffness: Any, reading: dict[str, Any]
) -> "Measured":
    """How a signal was measured, from the arguments of a function."""
    from brakecli.front.measured import NUMBERS, Measured

    how = ("column", "time_column", "sample_rate", "unit", "time_unit")
    if unknown := sorted(reading.keys() - {*how}):
        raise UsageError(f"{function}: there is no argument {unknown[0]}; give one of {', '.join(how)}")
    given = {"quantity": quantity, "belt_speed": belt_speed, "stiffness": stiffness, **reading}
    texts = {name: str(each) for name, each in given.items() if each is not None and name not in NUMBERS}
    return Measured(**given | texts)


def _listed(points: "Mapping[str, Iterable[Any]] | None") -> "Listed | None":
    """Points that are given by columns; a data frame has them as well."""
    from brakecli.case.read import key_path
    from brakecli.sweeps.listed import Listed

    if points is None:
        return None
    if not hasattr(points, "keys"):
        raise UsageError("points: are no columns; write them as {'friction.coefficient': [0.3, 0.5]}")
    columns = _plain({key: points[key] for key in points}, "points")
    if wrong := [key for key in columns if not key_path(key)]:
        raise UsageError(f"points: {wrong[0]!r} is no key path; name a key as in 'link2.angle_deg'")
    if len({*map(key_path, columns)}) < len(columns):
        raise UsageError("points: a key has two columns; keep one of them")
    lists = [each for each in columns.values() if isinstance(each, list)]
    if len(lists) < len(columns) or len({*map(len, lists)}) != 1 or not all(lists):
        raise UsageError("points: need a value of each key at each point, and one point at least")
    return Listed.of([*columns], columns.values())


@contextmanager
def _readings(*, force_read: bool = False) -> Iterator[None]:
    """Warn of results that no digest vouches for, and forget them at the end."""
    import brakecli.accessor  # noqa: F401 - which xarray objects have from then on
    from brakecli.case.roughness import arrays

    said, before = list[str](), arrays.set({})
    readings.begin(said.append, forced=force_read)
    try:
        yield
    finally:
        readings.begin()
        arrays.reset(before)
    _warn(said, 5)  # the caller of who uses this block


@contextmanager
def _telling(progress: "Progress") -> Iterator["Counted"]:
    """What tells the progress: a function of the caller, or that of the commands."""
    from brakecli.front.progress import telling

    if callable(progress):
        yield progress
        return
    with telling(not progress, first_line=1.0) as tell:
        yield tell


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C end compiled code, too; other threads hear no signals."""
    hears = threading.current_thread() is threading.main_thread()
    with signals_shown() if hears else nullcontext(), in_python():
        yield


@contextmanager
def _target(output: "str | PathLike[str] | None", name: str = "result.h5") -> Iterator[Path]:
    """Where a result goes: to a file that stays, or to one that does not."""
    if output is not None:
        if not isinstance(output, str | PathLike):
            raise UsageError(f"output {output!r}: is no path; give one, or leave it out")
        yield Path(output)
        return
    with tempfile.TemporaryDirectory(prefix="brakecli-") as folder:
        yield Path(folder) / name


@contextmanager
def _files(results: "Iterable[Result]", *names: str) -> Iterator[list[Path]]:
    """Results as files: their own, or for those in memory one of these names, which goes with the block."""
    import xarray as xr

    from brakecli.files.as_xarray import stored

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


def _case(source: "Source | LoadedSweep", settings: "Settings | None") -> "LoadedCase":
    from brakecli.case.case import given_toml
    from brakecli.case.read import LoadedCase, parse_case, parse_resolved
    from brakecli.front.inputs import load_case

    if isinstance(source, LoadedCase):
        if settings:
            changed = parse_case(given_toml(source.case), "the case", _overrides(settings), source.records)
            return replace(changed, text=source.text)
        return source
    if resolved := getattr(source, "attrs", {}).get("resolved_toml"):  # a result
        return parse_resolved(str(resolved), "its case", _overrides(settings))
    if not isinstance(source, str | PathLike):
        raise UsageError(f"{type(source).__name__}: is no case; give a path, or a case from brakecli.load")
    return load_case(str(source), _overrides(settings))


def _overrides(settings: "Settings | None") -> list[str]:
    """Settings as `--set` has them; a table replaces the one that the case has."""
    return [f"{key}={_toml(value, key)}" for key, value in _mapping(settings, "settings").items()]


def _mapping(given: Any, name: str) -> Mapping[Any, Any]:
    if not isinstance(given, Mapping | None):
        raise UsageError(f"{name}: is no mapping; write it as {{'friction.coefficient': ...}}")
    return given or {}


def _toml(value: Any, key: str) -> str:
    import tomli_w

    value = _plain(value, key)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name} = {_toml(each, f'{key}.{name}')}" for name, each in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(_toml(each, key) for each in value)}]"
    return tomli_w.dumps({"value": value}).removeprefix("value = ").strip()


def _axis(vary: "Mapping[str | tuple[str, ...], Iterable[float] | Settings]") -> "Axis":
    import tomli_w

    from brakecli.case.read import parse_table
    from brakecli.sweeps.tables import Axis

    if len(_mapping(vary, "vary")) != 1:
        raise UsageError("vary: takes one key with its values, or one tuple of keys; give the others as settings")
    [(keys, values)] = vary.items()
    along = values if isinstance(values, Mapping) else {"values": values}
    axis = parse_table(Axis, tomli_w.dumps(_plain({"parameter": keys, **along}, "vary")), "vary")
    places = axis.values or (axis.start or 0.0, axis.stop or 0.0)
    steps = [after - before for before, after in pairwise(places) if axis.numeric]
    if not axis.numeric or min(steps, default=1) * max(steps, default=1) <= 0:
        raise UsageError("vary: modes are followed along numbers that rise or fall; sort them, each once")
    return axis


def _plain(value: Any, key: str) -> Any:
    """The value of a key without NumPy or xarray, as TOML holds it, or UsageError."""
    if key.rpartition(".")[2] == "profile" and not isinstance(value, str | PathLike):
        from brakecli.case.profile import given

        try:
            return given(value)
        except UnreadableResultError as error:
            raise UsageError(f"{key}: {error}") from error
    if isinstance(value, Mapping) and hasattr(value, "attrs"):  # a dataset, or a tree of them
        what = "is a result in memory; give output to the function that computes it, and name that file"
        raise UsageError(f"{key}: {what}")
    value = value.to_numpy() if hasattr(value, "to_numpy") else value
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, Mapping):
        return {str(name): _plain(each, f"{key}.{name}") for name, each in value.items()}
    if isinstance(value, Iterable) and not isinstance(value, str):
        return [_plain(each, key) for each in value]
    if not isinstance(value, str | int | float | date | time | PathLike):
        raise UsageError(f"{key}: cannot be set to {type(value).__name__}; give a number, text, list or table")
    return str(value) if isinstance(value, PathLike) else value


def _warn(texts: Iterable[str], frames: int = 3) -> None:
    for text in texts:
        warnings.warn(text, stacklevel=frames)
