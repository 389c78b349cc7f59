"""`run`, `stability`, `branch` and `advise` of `import brakecli`: one case."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from brakecli.api import commands
from brakecli.api.calls import as_files, called, target, telling_to, warn
from brakecli.api.commands import slips_in
from brakecli.api.options import takes
from brakecli.api.records import Advise, Branch, Run, Stability
from brakecli.api.values import case_of, ends_of
from brakecli.errors import BrakecliError, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable

    import xarray as xr

    from brakecli.views.accessor import Advice


@takes(Run)
def run(options: Run) -> "xr.DataTree":
    """Simulate one case: the result as a tree of datasets.

    Groups `history` (over `time`, s) and `spectrum` (over `frequency`, Hz) hold the motion; attributes of the root
    are regime, frequency (Hz), amplitude (m) and all else that `docs/result-format.md` names.

    Args:
        {options}

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError: as `brakecli run`; nothing is left behind.
        BrakecliError: the run has failed; `output` is written up to there.

    A run that is not sure to keep its tolerance warns, as all that `brakecli run` warns of is a `UserWarning`.
    """
    with called(), target(options.output) as path, telling_to(options.progress) as tell:
        loaded = case_of(options.case, options.settings)
        from brakecli.results.as_xarray import read_tree
        from brakecli.studies.runs.run import run

        report = run(loaded, path, force=options.force, progress=tell)
        warn(report.warnings)
        if report.motion.work.failed:
            raise BrakecliError(str(report.motion.work.failure_sentence))
        return read_tree(path)


@takes(Stability)
def stability(options: Stability) -> "xr.Dataset":
    """Critical friction, modes and growth of steady sliding, and from which friction on a vibration can exist.

    Args:
        {options}

    Returns:
        A variable for each number that `brakecli stability --json` prints, NaN or an empty text if there is none;
        lists as attributes, and objects, as JSON. `modes`, `crossings`, `equilibrium` and `discrete` of
        `result.brakecli` are records. With `vary` the lock-in diagram, and no limit cycles.

    Raises:
        CaseError, UsageError, RefusedError: as `brakecli stability`; CannotWriteError with `output`.
    """
    with called(), telling_to(options.progress) as tell:
        loaded = case_of(options.case, options.settings)
        from brakecli.results.as_xarray import dataset, read_tree
        from brakecli.results.stability_fields import STABILITY, THRESHOLDS

        warn(slips_in(loaded))
        if options.vary is None:
            if options.output is not None:
                raise UsageError("output: holds what vary finds; give vary, or leave output out")
            return dataset((*STABILITY, *THRESHOLDS), commands.stability_of(loaded, tell, options.pushes))
        from brakecli.studies.sweeps.lock_in import write

        diagram = commands.modes_along(loaded, options.vary, tell)
        if options.output is not None:
            write(Path(options.output), loaded, diagram, force=options.force)
        with target(None) as path:
            write(path, loaded, diagram, force=False)
            return read_tree(path).to_dataset()


@takes(Branch)
def branch(options: Branch) -> "xr.DataTree":
    """Every motion along a key, stable or not: a tree with a group `branch_0`, `branch_1`, … for each branch.

    The first one is steady sliding. A group holds its motions over `point`: value, amplitudes of x, y (m) and vx
    (m/s), means of x and y (m), frequency (Hz), whether it is stable, Floquet multipliers. Its group `special`
    holds folds, flips and all that is special.
    Attributes of the root are critical, coexists_from, barrier (m), sentence and all else that
    `docs/result-format.md` names.

    Args:
        {options}

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError, UnreadableResultError: as `brakecli branch`.
    """
    with called(), target(options.output) as path, telling_to(options.progress) as tell:
        loaded = case_of(options.case, options.settings)
        from brakecli.results.as_xarray import read_tree
        from brakecli.studies.runs.branch import write
        from brakecli.studies.sweeps.result import unit

        keys, _, _ = ends_of(options.parameter)
        start: Any = options.start
        starts: Iterable[Any] = start if isinstance(start, list | tuple) else [start] if start is not None else []
        with as_files(starts, "start") as files:
            _, follow = commands.explorer_of(loaded, options, files, tell)
        warn(slips_in(loaded))
        write(path, loaded, follow(), unit(keys[0]), force=options.force)
        return read_tree(path)


@takes(Advise)
def advise(options: Advise) -> "Advice":
    """What moves the critical friction of a case, and what to change so that it does not squeal.

    `brakecli.advise("squeal.toml").advice[0].to` is the new value of the key that helps best.

    Args:
        {options}

    Returns:
        A record: `critical_friction`, `margin`, `stable`; `sensitivities` and `advice`, lists of records, of which
        the first move most and help best; `check`, a run with the first advice followed; `conclusion` and
        `notes()` in words; `numbers()` is what `brakecli advise --json` prints. Values have their keys' units.

    Raises:
        CaseError, UsageError, RefusedError: as `brakecli advise`.
    """
    with called(), telling_to(options.progress) as tell:
        loaded = case_of(options.case, options.settings)
        from brakecli.views.accessor import Advice

        report, warnings = commands.advise(loaded, options, tell, in_caller=True)
        warn(warnings)
        return Advice(**vars(report))
