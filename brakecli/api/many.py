"""`sweep` and `scatter` of `import brakecli`: many cases."""

import json
from collections.abc import Iterable, Mapping
from functools import partial
from os import PathLike
from typing import TYPE_CHECKING, Any

from brakecli.api.calls import called, target, telling_to, warn
from brakecli.api.given import (
    axes_of,
    case_of,
    mapping,
    overrides,
    path_of,
    plain,
    points_of,
    refuse_jobs,
    scheduler_of,
    study_of,
)
from brakecli.errors import UsageError

if TYPE_CHECKING:
    import xarray as xr

    from brakecli.api.calls import Progress
    from brakecli.api.given import Settings, Source
    from brakecli.scattering.study import LoadedStudy
    from brakecli.sweeps.plan import LoadedSweep


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
    refuse_jobs(jobs)
    with called(), target(output) as path, telling_to(progress) as tell:
        from brakecli.files import fields
        from brakecli.files.as_xarray import opened
        from brakecli.files.field import values_of
        from brakecli.front.inputs import load_sweep
        from brakecli.runs.run import load_kernels
        from brakecli.sweeps.driver import choose_engine, counting, sweep
        from brakecli.sweeps.listed import GIVEN
        from brakecli.sweeps.plan import LoadedSweep, sweep_of

        if axes is not None or points is not None or critical is not None:
            listed = points_of(points)
            tables = {"case": "-", "axis": axes_of(axes, direction), "critical": mapping(critical, "critical")}
            given = plain(tables, "sweep")
            given |= {"points": GIVEN} if listed else {}
            loaded = sweep_of(
                {name: each for name, each in given.items() if each}, case_of(source, settings), listed
            )
        elif direction is not None:
            raise UsageError("direction: is for axes; a sweep file states it in an axis of its own")
        elif not isinstance(source, LoadedSweep):
            loaded = load_sweep(path_of(source), overrides(settings))
        elif settings:
            raise UsageError("settings: come too late for a sweep that was loaded; give them to brakecli.load")
        else:
            loaded = source
        load_kernels(loaded.base)
        with choose_engine(loaded.plan, jobs, scheduler_of(scheduler), in_caller=True) as engine:
            report = sweep(loaded, path, engine, force=force, progress=counting(loaded.plan, tell))
        warn(report.notes)
        warn(report.findings.warnings)
        if found := report.findings.failures:
            failed = f"{report.findings.failed} of {report.findings.points} points failed"
            warn([f"{failed}, the first: {found[0]['reason']}"])
        result = opened(path).to_dataset()  # without groups
        if report.findings.attractors is not None:
            known = [values_of(fields.ATTRACTOR, each) for each in report.findings.attractors]
            result.attrs["attractors"] = json.dumps(known)
        return result


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
    refuse_jobs(jobs)
    with called(), target(output) as path, telling_to(progress) as tell:
        from brakecli.files.as_xarray import opened
        from brakecli.scattering.scatter import engine_for, scatter

        loaded = study_of(source, settings)
        engine_of = partial(engine_for, jobs=jobs, scheduler=scheduler_of(scheduler), in_caller=True)
        report = scatter(loaded, path, engine_of, force=force, tell=tell)
        if report.failed:
            warn(
                [f"{report.failed} of {report.samples} samples have no answer, the first: {report.first_failure}"]
            )
        return opened(path).to_dataset()
