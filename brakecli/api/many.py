"""`sweep` and `scatter` of `import brakecli`: many cases."""

import json
from typing import TYPE_CHECKING

from brakecli.api import commands
from brakecli.api.calls import called, target, telling_to, warn
from brakecli.api.options import takes
from brakecli.api.records import Scatter, Sweep
from brakecli.api.values import refuse_jobs

if TYPE_CHECKING:
    import xarray as xr


@takes(Sweep)
def sweep(options: Sweep) -> "xr.Dataset":
    """Simulate a grid or a list of cases, or search for critical values: a dataset with a dimension for each axis.

    A script that calls this needs `if __name__ == "__main__":` around its work, as workers are new processes that
    run it anew; not with `jobs=1`, which computes in this process.

    Args:
        {options}

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError: as `brakecli sweep`.
    """
    refuse_jobs(options.jobs)
    with called(), target(options.output) as path, telling_to(options.progress) as tell:
        from brakecli.results import fields
        from brakecli.results.as_xarray import read_tree
        from brakecli.results.field import values_of

        report = commands.sweep(options, path, tell, in_caller=True)
        warn(report.notes)
        warn(report.findings.warnings)
        if failures := report.findings.failures:
            failed = f"{report.findings.failed} of {report.findings.points} points failed"
            warn([f"{failed}, the first: {failures[0]['reason']}"])
        result = read_tree(path).to_dataset()  # without groups
        if report.findings.attractors is not None:
            attractors = [values_of(fields.ATTRACTOR, attractor) for attractor in report.findings.attractors]
            result.attrs["attractors"] = json.dumps(attractors)
        return result


@takes(Scatter)
def scatter(options: Scatter) -> "xr.Dataset":
    """How likely brakes squeal that are not built to their drawing: samples of a study, and what they say.

    The dataset has the dimensions `sample` (values of the keys, growth rate, frequency, critical friction or
    regime), `outcome` (`probability` with its 95 % interval) and `parameter` (Sobol indices); attributes are those
    that `brakecli scatter --json` prints. Runs need a guard in a script, as `sweep` does.

    Args:
        {options}

    Raises:
        CaseError, UsageError, RefusedError, CannotWriteError: as `brakecli scatter`.
    """
    refuse_jobs(options.jobs)
    with called(), target(options.output) as path, telling_to(options.progress) as tell:
        from brakecli.results.as_xarray import read_tree

        _, warnings = commands.scatter(options, path, tell, in_caller=True)
        warn(warnings)
        return read_tree(path).to_dataset()
