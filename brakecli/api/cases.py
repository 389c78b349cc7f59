"""`run`, `stability`, `branch` and `advise` of `import brakecli`: one case."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from os import PathLike
from typing import TYPE_CHECKING, Any

from brakecli.api.calls import as_files, called, target, telling_to, warn
from brakecli.api.given import axis_of, case_of, ends_of, mapping, margin_of, patterns_of, pushes_of, study_of
from brakecli.branches.pushes import PUSHES
from brakecli.errors import BrakecliError, UsageError
from brakecli.front.asked import advice_on, slips_in, stability_of

if TYPE_CHECKING:
    import xarray as xr

    from brakecli.accessor import Advice
    from brakecli.api.calls import Progress, Result
    from brakecli.api.given import Settings, Source
    from brakecli.scattering.study import LoadedStudy


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
    with called(), target(output) as path, telling_to(progress) as tell:
        loaded = case_of(case, settings)
        from brakecli.files.as_xarray import opened
        from brakecli.runs.run import run

        report = run(loaded, path, force=force, progress=tell)
        warn(report.warnings)
        if report.motion.work.failed:
            raise BrakecliError(str(report.motion.work.failure_sentence))
        return opened(path)


def stability(
    case: "Source",
    settings: "Settings | None" = None,
    *,
    vary: "Mapping[str | tuple[str, ...], Iterable[float] | Settings] | None" = None,
    pushes: int = PUSHES,
    progress: "Progress" = False,
) -> "xr.Dataset":
    """Critical friction, modes and growth of steady sliding, and from which friction on a vibration can exist.

    Args:
        case: path of a case file or of a result, or what `load` gave.
        settings: keys of the case to change.
        vary: one key, or several that take the same value, with values that rise or fall, as
            `{"friction.coefficient": np.linspace(0, 1, 101)}`: follows both modes along them. A range is written
            as in a sweep: `{"friction.coefficient": {"start": 0, "stop": 1, "num": 101}}`.
        pushes: five times as many seek vibrations that no branch from flutter reaches; 0 for none.
        progress: as for `run`.

    Returns:
        A variable for each number that `brakecli stability --json` prints, NaN or an empty text if there is none;
        lists as attributes, and objects, as JSON. `modes`, `crossings`, `equilibrium` and `discrete` of
        `result.brakecli` are records. With `vary` the lock-in diagram, and no limit cycles.

    Raises:
        CaseError, UsageError, RefusedError: as `brakecli stability`.
    """
    with called(), telling_to(progress) as tell:
        loaded = case_of(case, settings)
        from brakecli.files.as_xarray import dataset, opened
        from brakecli.files.stability_fields import STABILITY, THRESHOLDS

        warn(slips_in(loaded))
        if vary is None:
            return dataset((*STABILITY, *THRESHOLDS), stability_of(loaded, tell, pushes_of(pushes)))
        from brakecli.sweeps.lock_in import lock_in, write

        with target(None) as path:
            found = lock_in(loaded, axis_of(vary), "vary", tell)
            write(path, loaded, found, force=False)
            return opened(path).to_dataset()


def branch(
    case: "Source",
    settings: "Settings | None" = None,
    *,
    parameter: "Mapping[str | tuple[str, ...], tuple[float, float]]",
    start: "Result | Sequence[Result] | None" = None,
    switch: bool = False,
    pushes: int = PUSHES,
    output: "str | PathLike[str] | None" = None,
    progress: "Progress" = False,
    force: bool = False,
) -> "xr.DataTree":
    """Every motion along a key, stable or not: a tree with a group `branch_0`, `branch_1`, … for each branch.

    The first one is steady sliding. A group holds its motions over `point`: value, amplitudes of x, y (m) and vx
    (m/s), means of x and y (m), frequency (Hz), whether it is stable, Floquet multipliers. Its group `special`
    holds folds, flips and all that is special.
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
        pushes: five times as many seek vibrations that none of these branches reaches; 0 for none.
        output: a result file to keep; none if left out.
        progress: as for `run`.
        force: replace that file if it exists.

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError, UnreadableResultError: as `brakecli branch`.
    """
    with called(), target(output) as path, telling_to(progress) as tell:
        loaded = case_of(case, settings)
        from brakecli.branches.explore import Explorer
        from brakecli.files.as_xarray import opened
        from brakecli.runs.branch import branch, line_of, parsed, start_of, states_of, write
        from brakecli.runs.limits import within_range
        from brakecli.sweeps.result import unit

        if len(mapping(parameter, "parameter", several=True)) != 1:
            raise UsageError("parameter: takes one key with both ends of its range, or one tuple of keys")
        [(names, ends)] = parameter.items()
        low, high = ends_of(ends)
        text = f"{names if isinstance(names, str) else ','.join(names)}={low!r}:{high!r}"
        keys, low, high = parsed(text)
        with within_range():
            line = line_of(loaded, keys, low, high, "parameter")
        given: Iterable[Any] = start if isinstance(start, list | tuple) else [start] if start is not None else []
        with as_files(given, "start") as files:
            states = states_of(line, [start_of(file, keys) for file in files])
        warn(slips_in(loaded))
        found = branch(Explorer(line, tell), states, switch, pushes_of(pushes))
        write(path, loaded, found, unit(keys[0]), force=force)
        return opened(path)


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
            left. If left out, stiffnesses and friction scatter by 10 %, and the smallest change comes first.
        progress: as for `run`.

    Returns:
        A record: `critical_friction`, `margin`, `stable`; `sensitivities` and `advice`, lists of records, of which
        the first move most and help best; `check`, a run with the first advice followed; `conclusion()` and
        `notes()` in words; `numbers()` is what `brakecli advise --json` prints. Values have their keys' units.

    Raises:
        CaseError, UsageError, RefusedError: as `brakecli advise`.
    """
    with called(), telling_to(progress) as tell:
        loaded = case_of(case, settings)
        from brakecli.accessor import Advice
        from brakecli.scattering.scatter import engine_for

        patterns = None if keys is None else patterns_of(keys)
        margin = margin_of(margin)
        study = replace(study_of(scatter), base=loaded) if scatter is not None else None
        report = advice_on(loaded, patterns, margin, study, partial(engine_for, in_caller=True), tell)
        warn([*slips_in(loaded), *(study.beside(loaded.case) if study else ())])
        return Advice(**vars(report))
