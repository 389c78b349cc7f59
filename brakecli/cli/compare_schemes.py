"""`brakecli compare-schemes`."""

from dataclasses import dataclass
from typing import Annotated

from brakecli.api.inputs import result_path
from brakecli.api.options import Description
from brakecli.api.progress import telling
from brakecli.api.records import Case, Force, Settings, target
from brakecli.api.values import case_of
from brakecli.cli.options import AsJson, Details, Quiet, with_options
from brakecli.cli.output import show_result
from brakecli.solver.schemes import SCHEMES


@dataclass(frozen=True)
class CompareSchemes:
    """Options of `compare-schemes`."""

    case: Case
    settings: Settings = None
    output: Annotated[str | None, target("Result file", "the case's name with -schemes.h5, here")] = None
    schemes: Annotated[str | None, Description(f"Compare only these: {', '.join(SCHEMES)}.", "NAME,…")] = None
    steps: Annotated[
        str | None, Description("Time steps in s; the largest is a whole multiple of each.", "H,…")
    ] = None
    budget: Annotated[float, Description("Approximate time to spend.", "SECONDS", least=1.0, most=86400.0)] = 60.0
    target_error: Annotated[
        float,
        Description("Recommend the cheapest method with this error.", "E", least=1e-12, most=1.0),
    ] = 1e-3
    force: Force = False


@with_options
def command(
    options: CompareSchemes, details: Details = False, as_json: AsJson = False, quiet: Quiet = False
) -> None:
    """Compare all schemes by error and cost; recommend one."""
    loaded = case_of(options.case, options.settings)
    target = result_path(options.output, options.case, ending="-schemes.h5")
    from brakecli.results.write import new_result
    from brakecli.studies.comparison.compare import compare
    from brakecli.studies.comparison.methods import parse_schemes, parse_steps
    from brakecli.studies.comparison.result import ComparisonReport, write
    from brakecli.studies.runs.run import load_kernels
    from brakecli.views.points import of_comparison

    schemes = parse_schemes(options.schemes)
    steps = parse_steps(options.steps)
    system = load_kernels(loaded)
    with telling(quiet) as tell:
        with new_result(target, force=options.force):  # whether it can be written is known beforehand
            pass
        comparison = compare(system, schemes=schemes, steps=steps, budget=options.budget, progress=tell)
        report = ComparisonReport(target, loaded.case, comparison, options.target_error)
        write(target, loaded, report, force=options.force)
    numbers = {"output": str(target), **report.numbers()}
    show_result(
        "compare-schemes",
        numbers,
        lambda show: of_comparison(numbers, report.in_a_case, report.title),
        as_json=as_json,
        quiet=quiet,
        details=details,
    )
