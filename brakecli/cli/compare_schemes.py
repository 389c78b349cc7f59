"""`brakecli compare-schemes`."""

from pathlib import Path
from typing import Annotated

from brakecli.cli.options import (
    AsJson,
    CaseArgument,
    Details,
    Force,
    Overrides,
    Quiet,
    option,
    output_option,
)
from brakecli.cli.output import show_result
from brakecli.front.inputs import load_case, result_path
from brakecli.front.progress import telling
from brakecli.solver.schemes import SCHEMES

STEPS = "Time steps in s; the largest is a whole multiple of each."
TARGET = "Recommend the cheapest method with this error."


def command(
    case: CaseArgument,
    output: Annotated[Path | None, output_option("Result file", "the case's name with -schemes.h5, here")] = None,
    overrides: Overrides = None,
    schemes: Annotated[str | None, option(f"Compare only these: {', '.join(SCHEMES)}.", "NAME,…")] = None,
    steps: Annotated[str | None, option(STEPS, "H,…")] = None,
    budget: Annotated[float, option("Approximate time to spend.", "SECONDS", min=1.0, max=86400.0)] = 60.0,
    target_error: Annotated[float, option(TARGET, "E", min=1e-12, max=1.0)] = 1e-3,
    force: Force = False,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compare all schemes by error and cost; recommend one."""
    loaded = load_case(case, overrides)
    target = result_path(output, case, ending="-schemes.h5")
    from brakecli.comparison.compare import compare
    from brakecli.comparison.methods import parse_schemes, parse_steps
    from brakecli.comparison.result import ComparisonReport, write
    from brakecli.files.write import new_result
    from brakecli.runs.run import load_kernels
    from brakecli.views.points import of_comparison

    chosen = parse_schemes(schemes)
    ladder = parse_steps(steps)
    system = load_kernels(loaded)
    with telling(quiet) as show_progress:
        with new_result(target, force=force):  # whether it can be written is known before anything is computed
            pass
        found = compare(system, schemes=chosen, steps=ladder, budget=budget, progress=show_progress)
        report = ComparisonReport(target, loaded.case, found, target_error)
        write(target, loaded, report, force=force)
    numbers = {"output": str(target), **report.numbers()}
    show_result(
        "compare-schemes",
        numbers,
        lambda show: of_comparison(numbers, report.in_a_case, report.title),
        as_json=as_json,
        quiet=quiet,
        details=details,
    )
