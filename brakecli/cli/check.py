"""`brakecli check`."""

import math
from functools import partial
from pathlib import Path
from typing import Annotated

from brakecli.cli.options import AsJson, Overrides, Quiet, source_argument
from brakecli.cli.output import show_result, warn
from brakecli.front.inputs import kind_of_file, load_case, load_sweep

OF_SYSTEM = ("belt_speed", "contact_stiffness", "natural_frequencies", "passing_frequency", "evaluator", "nodes")


def command(
    file: Annotated[str, source_argument("FILE.toml", 'Case or sweep file, or "-" for standard input.')],
    overrides: Overrides = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Validate a case or a sweep; what it takes, its limits."""
    if kind_of_file(file) == "sweep":
        sweep = load_sweep(file, overrides)
        from brakecli.runs.limits import free_bytes
        from brakecli.sweeps.driver import crew
        from brakecli.sweeps.size import refuse_sweep, size_of
        from brakecli.views.file import of_size

        size = size_of(sweep.plan, crew(sweep.plan), spare=True)
        numbers = {"valid": True, **vars(size)}
        view = partial(of_size, size, sweep.title)
        show_result("check", numbers, lambda show: view(), as_json=as_json, quiet=quiet)
        warn(*size.refused, *size.implausible)
        refuse_sweep(size, free_bytes(Path()))
        return
    loaded = load_case(file, overrides)
    from brakecli.case.system import system_of
    from brakecli.runs.limits import check, free_bytes, refuse, within_range
    from brakecli.views.file import of_check

    with within_range():
        found = check(system_of(loaded.case))
    numbers = {"valid": True, "coefficients": found.system.coefficients._asdict()}
    numbers |= {name: getattr(found.system, name) for name in OF_SYSTEM} | vars(found) | vars(found.limits)
    infinite = [name for name, value in numbers.items() if value in (math.inf, -math.inf)]
    for name in ("system", "limits", *infinite):
        del numbers[name]
    show_result("check", numbers, partial(of_check, found, loaded.case.title), as_json=as_json, quiet=quiet)
    warn(*found.warnings)
    refuse(found, free_bytes(Path()))
