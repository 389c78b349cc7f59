"""`brakecli check`."""

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

from brakecli.api.inputs import kind_of_file, load_sweep
from brakecli.api.options import Description
from brakecli.api.records import Settings
from brakecli.api.values import case_of, overrides, study_of
from brakecli.cli.options import AsJson, Quiet, with_options
from brakecli.cli.output import show_result, warn

OF_SYSTEM = ("belt_speed", "contact_stiffness", "natural_frequencies", "passing_frequency", "evaluator", "nodes")


@dataclass(frozen=True)
class Check:
    """Options of `check`."""

    file: Annotated[
        str, Description('Case, sweep or study, or "-" for standard input.', "FILE.toml", by_place=True)
    ]
    settings: Settings = None


@with_options
def command(options: Check, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Validate a case, sweep or study; what it takes."""
    kind = kind_of_file(options.file)
    if kind == "study":
        _check_study(options, as_json=as_json, quiet=quiet)
        return
    if kind == "sweep":
        sweep = load_sweep(options.file, overrides(options.settings))
        from brakecli.studies.runs.limits import free_bytes
        from brakecli.studies.sweeps.driver import crew
        from brakecli.studies.sweeps.size import refuse_sweep, size_of
        from brakecli.views.file import of_size

        size = size_of(sweep.plan, crew(sweep.plan), spare=True)
        numbers = {"valid": True, **vars(size)}
        view = partial(of_size, size, sweep.title)
        show_result("check", numbers, lambda show: view(), as_json=as_json, quiet=quiet)
        warn(*size.refused, *size.implausible)
        refuse_sweep(size, free_bytes(Path()))
        return
    loaded = case_of(options.file, options.settings)
    from brakecli.case.system import system_of
    from brakecli.studies.runs.limits import check, free_bytes, refuse, within_range
    from brakecli.views.file import of_check

    with within_range():
        report = check(system_of(loaded.case))
    numbers = {"valid": True, "coefficients": report.system.coefficients._asdict()}
    numbers |= {name: getattr(report.system, name) for name in OF_SYSTEM} | vars(report) | vars(report.limits)
    infinite = [name for name, value in numbers.items() if value in (math.inf, -math.inf)]
    for name in ("system", "limits", *infinite):
        del numbers[name]
    show_result("check", numbers, partial(of_check, report, loaded.case.title), as_json=as_json, quiet=quiet)
    warn(*report.warnings)
    refuse(report, free_bytes(Path()))


def _check_study(options: Check, *, as_json: bool, quiet: bool) -> None:
    loaded = study_of(options.file, options.settings)
    from brakecli.studies.runs.limits import free_bytes
    from brakecli.studies.scattering.scatter import draw, size_of_study
    from brakecli.studies.sweeps.size import refuse_sweep
    from brakecli.views.file import of_study_size

    study = loaded.study
    drawing = draw(loaded)
    size = size_of_study(loaded, drawing)
    counts = {"samples": drawing.samples, "index_samples": drawing.index_samples}
    method = {"method": study.method, "indices_of": study.indices_of}
    numbers = {
        "valid": True,
        **counts,
        "keys": [path for axis in study.parameter for path in axis.paths],
        **method,
        **vars(size),
    }
    view = partial(of_study_size, study, counts, size, loaded.title)
    show_result("check", numbers, lambda show: view(), as_json=as_json, quiet=quiet)
    warn(*loaded.beside(loaded.base.case), *size.refused, *size.implausible)
    refuse_sweep(size, free_bytes(Path()))
