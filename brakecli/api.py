"""`import brakecli`: cases in, xarray objects out, as on the command line. Large imports wait for a call."""

import multiprocessing
import os
import signal
import tempfile
import threading
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from datetime import date, time
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from brakecli.errors import BrakecliError, UsageError, in_python
from brakecli.files.os_signals import Interrupted, unwinding
from brakecli.files.trust import readings
from brakecli.stop import signals_shown

if TYPE_CHECKING:
    import xarray as xr

    from brakecli.case.read import LoadedCase
    from brakecli.sweeps.listed import Listed
    from brakecli.sweeps.plan import LoadedSweep
    from brakecli.sweeps.tables import Axis

    Source: TypeAlias = str | PathLike[str] | LoadedCase
    Settings = Mapping[str, Any]


def load(source: "str | PathLike[str]", settings: "Settings | None" = None, *, force_read: bool = False) -> Any:
    """What a file holds: a case or a sweep, for the other functions, or a result as an `xarray.DataTree`.

    Args:
        source: path of a case file, a sweep file, or a result file.
        settings: keys of the case to change, as `{"friction.coefficient": 0.4}`; of a result none.
        force_read: look at a result whose digest does not fit; its attribute `digest` and a warning say so.

    Raises:
        CaseError: the case or a setting is wrong; holds every problem.
        UnreadableResultError: the result is damaged or of another program.
    """
    from brakecli.cli.inputs import is_result, is_sweep, load_case, load_sweep

    name = str(source)
    with in_python(), _readings(force_read=force_read):
        if is_result(name):
            if settings:
                raise UsageError(f"{name}: holds a result, which has no settings; give them to brakecli.run")
            from brakecli.files.as_xarray import opened

            return opened(Path(name))
        return (load_sweep if is_sweep(name) else load_case)(name, _overrides(settings))


def run(
    case: "Source",
    settings: "Settings | None" = None,
    *,
    output: "str | PathLike[str] | None" = None,
    force: bool = False,
) -> "xr.DataTree":
    """Simulate one case: the result as a tree of datasets.

    Groups `history` (over `time`, s) and `spectrum` (over `frequency`, Hz) hold the motion; attributes of the root
    are regime, frequency (Hz), amplitude (m) and all else that `docs/result-format.md` names.

    Args:
        case: path of a case file or of a result, or what `load` gave.
        settings: keys of the case to change, as `{"friction.coefficient": 0.4}`; a table as
            `{"solver": {"tolerance": 1e-4}}` replaces the one that the case has.
        output: a result file to keep; none if left out.
        force: replace that file if it exists.

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError: as `brakecli run`; nothing is left behind.
        BrakecliError: the run has failed; `output` is written up to there.

    A run that is not sure to keep its tolerance warns, as all that `brakecli run` warns of is a `UserWarning`.
    """
    with _interruptible(), _readings(), _target(output) as path:
        loaded = _case(case, settings)
        from brakecli.files.as_xarray import opened
        from brakecli.runs.run import run

        report = run(loaded, path, force=force)
        _warn(report.warnings)
        if report.motion.work.failed:
            raise BrakecliError(str(report.motion.work.failure_sentence))
        return opened(path, own=True)


def stability(
    case: "Source",
    settings: "Settings | None" = None,
    *,
    vary: "Mapping[str | tuple[str, ...], Iterable[float]] | None" = None,
) -> "xr.Dataset":
    """Critical friction, modes and growth of steady sliding, and from which friction on a vibration can exist.

    Args:
        case: path of a case file or of a result, or what `load` gave.
        settings: keys of the case to change.
        vary: one key, or several that take the same value, with values that rise or fall, as
            `{"friction.coefficient": np.linspace(0, 1, 101)}`: follows both modes along them.

    Returns:
        A variable for each number that `brakecli stability --json` prints, NaN or an empty text if there is none;
        lists as attributes, and objects, as JSON. With `vary` the lock-in diagram, and no limit cycles.

    Raises:
        CaseError, UsageError, RefusedError: as `brakecli stability`.
    """
    with _interruptible(), _readings():
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
                both = thresholds(loaded.case, system, report)
            numbers = values_of(STABILITY, report) | values_of(THRESHOLDS, both)
            return dataset((*STABILITY, *THRESHOLDS), numbers)
        from brakecli.sweeps.lock_in import lock_in, write

        with _target(None) as path:
            found = lock_in(loaded, _axis(vary), "vary", lambda what, done, total: None)
            write(path, loaded, found, force=False)
            return opened(path, own=True).to_dataset()


def branch(
    case: "Source",
    settings: "Settings | None" = None,
    *,
    parameter: "Mapping[str | tuple[str, ...], tuple[float, float]]",
    start: "str | PathLike[str] | None" = None,
    switch: bool = False,
    output: "str | PathLike[str] | None" = None,
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
        start: result of a run, whose end comes to a motion that is followed, too.
        switch: also follow the motions of twice the period from each flip.
        output: a result file to keep; none if left out.
        force: replace that file if it exists.

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError, UnreadableResultError: as `brakecli branch`.
    """
    with _interruptible(), _readings(), _target(output) as path:
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
        keys, low, high = parsed(text, "parameter")
        with within_range():
            line = line_of(loaded, keys, low, high, "parameter")
        starts = [start_of(Path(start), keys)] if start is not None else []
        found = branch(line, lambda what, done, total: None, lambda: False, starts, switch)
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
    output: "str | PathLike[str] | None" = None,
    jobs: int | None = None,
    force: bool = False,
) -> "xr.Dataset":
    """Simulate a grid or a list of cases, or search for critical values: a dataset with a dimension for each axis.

    A script that calls this needs `if __name__ == "__main__":` around its work, as workers are new processes that
    run it anew; not with `jobs=1`, which computes in this process.

    Args:
        source: path of a sweep file, or what `load` gave; with `axes`, `points` or `critical` a case.
        settings: keys of the base case to change.
        axes: values of each key, as `{"friction.coefficient": [0.3, 0.5]}`; a tuple of keys takes the same values.
        points: points in place of a grid: the values of each key at all of them, as `{"shoe.mass": [10.0, 12.0],
            "friction.coefficient": [0.3, 0.5]}` or as a data frame; the dataset has the dimension `point`.
        critical: the keys of `[critical]`, as `{"parameter": "friction.coefficient", "lower": 0, "upper": 2}`.
        output: a result file to keep; with it, an interrupted sweep goes on where it was.
        jobs: worker processes; one for each core if left out. Where the environment names a dask cluster in
            `DASK_SCHEDULER_ADDRESS`, its workers compute.
        force: replace that file if it exists.

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError: as `brakecli sweep`.
    """
    _refuse_jobs(jobs)
    with _interruptible(), _readings(), _target(output) as path:
        from brakecli.cli.inputs import load_sweep
        from brakecli.files.as_xarray import opened
        from brakecli.runs.run import load_kernels
        from brakecli.sweeps.driver import choose_engine, sweep
        from brakecli.sweeps.listed import GIVEN
        from brakecli.sweeps.plan import LoadedSweep, sweep_of

        if axes is not None or points is not None or critical is not None:
            tables = [{"parameter": keys, "values": values} for keys, values in _mapping(axes, "axes").items()]
            listed = _listed(points)
            given = _plain({"case": "-", "axis": tables, "critical": critical or {}}, "sweep")
            given |= {"points": GIVEN} if listed else {}
            loaded = sweep_of(
                {name: each for name, each in given.items() if each}, _case(source, settings), listed
            )
        elif isinstance(source, LoadedSweep):
            loaded = source
        else:
            loaded = load_sweep(str(source), _overrides(settings))
        load_kernels(loaded.base)
        scheduler = os.environ.get("DASK_SCHEDULER_ADDRESS") or None
        with choose_engine(loaded.plan, jobs, scheduler, in_caller=True) as engine:
            report = sweep(loaded, path, engine, force=force)
        _warn(report.notes)
        if found := report.findings.failures:
            failed = f"{report.findings.failed} of {report.findings.points} points failed"
            _warn([f"{failed}, the first: {found[0]['reason']}"])
        return opened(path, own=True).to_dataset()


def scatter(
    source: "str | PathLike[str]",
    settings: "Settings | None" = None,
    *,
    output: "str | PathLike[str] | None" = None,
    jobs: int | None = None,
    force: bool = False,
) -> "xr.Dataset":
    """How likely brakes squeal that are not built to their drawing: samples of a study, and what they say.

    The dataset has the dimensions `sample` (values of the keys, growth rate, frequency, critical friction or
    regime), `outcome` (`probability` with its 95 % interval) and `parameter` (Sobol indices); attributes are those
    that `brakecli scatter --json` prints. Runs need a guard in a script, as `sweep` does.

    Args:
        source: path of a study file.
        settings: keys of the study to change, as `{"samples": 4096}`, or of its case.
        output: a result file to keep; with it, an interrupted study of runs goes on where it was.
        jobs: worker processes; one for each core if left out.
        force: replace that file if it exists.

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError: as `brakecli scatter`.
    """
    _refuse_jobs(jobs)
    with _interruptible(), _readings(), _target(output) as path:
        from functools import partial

        from brakecli.cli.inputs import load_study
        from brakecli.files.as_xarray import opened
        from brakecli.scattering.scatter import engine_for, scatter

        loaded = load_study(str(source), _overrides(settings))
        engine_of = partial(engine_for, jobs=jobs, scheduler=os.environ.get("DASK_SCHEDULER_ADDRESS") or None)
        report = scatter(loaded, path, partial(engine_of, in_caller=True), force=force)
        if report.failed:
            _warn(
                [f"{report.failed} of {report.samples} samples have no answer, the first: {report.first_failure}"]
            )
        return opened(path, own=True).to_dataset()


def _refuse_jobs(jobs: int | None) -> None:
    """Raise UsageError for a wrong number of workers, and end a worker that is being started by a script."""
    if jobs is not None and not (isinstance(jobs, int) and 1 <= jobs <= 4096):
        raise UsageError(f"jobs {jobs}: is no number of workers from 1 to 4096")
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        os._exit(os.EX_USAGE)  # which tells the caller that there is no guard


def classify(
    source: "str | PathLike[str]",
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
        source: path of a result, or of a measured signal.
        quantity: what was measured, as `brakecli classify --quantity` has it; None for a result.
        belt_speed: speed of the wheel's surface (m/s), if known.
        stiffness: stiffness behind a measured force (N/m), if known.
        thresholds: those to change, by name.
        force_read: look at a result whose digest does not fit; a warning says so.
        reading: how a file is read: `column`, `time_column`, `sample_rate` (Hz), `unit`, `time_unit`.

    Returns:
        A variable for each number that `brakecli classify --json` prints; lists and objects (JSON) as attributes.

    Raises:
        UsageError, UnreadableResultError: as `brakecli classify`.
    """
    from brakecli.cli.classify import Options
    from brakecli.cli.measured import NUMBERS, Measured
    from brakecli.files.as_xarray import dataset
    from brakecli.files.fields import VERDICT

    how = ("column", "time_column", "sample_rate", "unit", "time_unit")
    if "second_run" in reading:
        raise UsageError("classify: second_run: there is none any more; every verdict asks what it asked")
    if unknown := sorted(reading.keys() - {*how}):
        raise UsageError(f"classify: there is no argument {unknown[0]}; give one of {', '.join(how)}")
    changes = [f"{name}={value}" for name, value in _mapping(thresholds, "thresholds").items()]
    given = {"quantity": quantity, "belt_speed": belt_speed, "stiffness": stiffness, **reading}
    texts = {name: str(each) for name, each in given.items() if each is not None and name not in NUMBERS}
    measured = Measured(**given | texts)
    with _interruptible(), _readings(force_read=force_read):
        numbers = Options(measured, changes).verdict(str(source))
    _warn(numbers.get("warnings", ()))
    return dataset(VERDICT, numbers)


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
    said = list[str]()
    readings.begin(said.append, forced=force_read)
    try:
        yield
    finally:
        readings.begin()
    _warn(said, 5)  # the caller of who uses this block


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C end compiled code, too, and remove unfinished files; other threads hear no signals."""
    if threading.current_thread() is not threading.main_thread():
        with in_python():
            yield
        return
    try:
        with signals_shown(), unwinding(), in_python():
            yield
    except Interrupted as error:
        asked = error.exit_code == 128 + signal.SIGINT
        raise (KeyboardInterrupt() if asked else SystemExit(error.exit_code)) from None


@contextmanager
def _target(output: "str | PathLike[str] | None") -> Iterator[Path]:
    """Where a result goes: to a file that stays, or to one that does not."""
    if output is not None:
        if not isinstance(output, str | PathLike):
            raise UsageError(f"output {output!r}: is no path; give one, or leave it out")
        yield Path(output)
        return
    with tempfile.TemporaryDirectory(prefix="brakecli-") as folder:
        yield Path(folder) / "result.h5"


def _case(source: "Source | LoadedSweep", settings: "Settings | None") -> "LoadedCase":
    from brakecli.case.case import given_toml
    from brakecli.case.read import LoadedCase, parse_case, parse_resolved
    from brakecli.cli.inputs import load_case

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


def _axis(vary: "Mapping[str | tuple[str, ...], Iterable[float]]") -> "Axis":
    import tomli_w

    from brakecli.case.read import parse_table
    from brakecli.sweeps.tables import Axis

    if len(_mapping(vary, "vary")) != 1:
        raise UsageError("vary: takes one key with its values, or one tuple of keys; give the others as settings")
    [(keys, values)] = vary.items()
    axis = parse_table(Axis, tomli_w.dumps(_plain({"parameter": keys, "values": values}, "vary")), "vary")
    steps = [after - before for before, after in pairwise(axis.values or ()) if axis.numeric]
    if not axis.numeric or min(steps, default=1) * max(steps, default=1) <= 0:
        raise UsageError("vary: modes are followed along numbers that rise or fall; sort them, each once")
    return axis


def _plain(value: Any, key: str) -> Any:
    """The value of a key without NumPy or xarray, as TOML holds it, or UsageError."""
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
