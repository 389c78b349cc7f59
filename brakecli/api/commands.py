"""What commands compute, by their options: the same functions for the shell and for Python."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.api.measured import look_at, perhaps_a_signal, quantity_of
from brakecli.api.values import (
    axis_of,
    chosen_of,
    ends_of,
    margin_of,
    patterns_of,
    pushes_of,
    scheduler_of,
    study_of,
    sweep_of_options,
    text_of,
)
from brakecli.errors import UsageError, printable
from brakecli.faces import argument

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.figure import Figure

    from brakecli.analysis.branches.answers import Answers
    from brakecli.analysis.branches.explore import Explorer
    from brakecli.api.records import Advise, Branch, Diff, Plot, Scatter, Sweep
    from brakecli.case.read import LoadedCase
    from brakecli.results.contents import Difference
    from brakecli.solver.integrate import Counted
    from brakecli.studies.runs.advise import AdviceReport
    from brakecli.studies.scattering.scatter import ScatterReport
    from brakecli.studies.sweeps.lock_in import LockIn
    from brakecli.studies.sweeps.result import SweepReport
    from brakecli.studies.sweeps.size import Size


def slips_in(loaded: LoadedCase) -> list[str]:
    """Warnings of numbers that no brake has, such as masses in grams."""
    from brakecli.case.system import system_of
    from brakecli.studies.runs.plausible import implausible

    return [*implausible(system_of(loaded.case))]


def stability_of(loaded: LoadedCase, tell: Counted, pushes: int | None) -> dict[str, object]:
    """Critical friction, modes and growth of steady sliding, by the names of `--json`.

    Also from which friction on a vibration can exist, which so many `pushes` seek; not if None.
    """
    from brakecli.analysis.branches.thresholds import thresholds
    from brakecli.analysis.stability.report import stability
    from brakecli.case.system import system_of
    from brakecli.results.field import values_of
    from brakecli.results.stability_fields import STABILITY, THRESHOLDS
    from brakecli.studies.runs.limits import within_range

    with within_range():
        system = system_of(loaded.case)
        report = stability(system)
        numbers = values_of(STABILITY, report)
        if pushes is not None:
            limits = thresholds(loaded.case, system, report, tell, pushes_of(pushes))
            numbers |= values_of(THRESHOLDS, limits)
    return numbers


def modes_along(loaded: LoadedCase, vary: object, tell: Counted) -> LockIn:
    """Both modes of steady sliding along keys of `stability --vary`."""
    from brakecli.studies.runs.limits import within_range
    from brakecli.studies.sweeps.lock_in import lock_in

    named = f"{argument('vary')} {printable(vary)}" if isinstance(vary, str) else argument("vary")
    with within_range():
        return lock_in(loaded, axis_of(vary), named, tell)


def explorer_of(
    loaded: LoadedCase, options: Branch, starts: Sequence[Path], tell: Counted
) -> tuple[Explorer, Callable[[], Answers]]:
    """What follows the branches of a case, and the call that does so, also from the ends of the runs `starts`."""
    from brakecli.analysis.branches.explore import Explorer
    from brakecli.studies.runs.branch import branch, foreign, line_of, start_of, states_of
    from brakecli.studies.runs.limits import within_range

    keys, low, high = ends_of(options.parameter)
    pushes = pushes_of(options.pushes)
    parameter = options.parameter
    named = f"{argument('parameter')} {parameter}" if isinstance(parameter, str) else argument("parameter")
    with within_range():
        line = line_of(loaded, keys, low, high, named)
    ends = [start_of(path, keys) for path in starts]
    states = states_of(line, ends)
    explorer = Explorer(line, tell)
    explorer.notes += foreign(line, ends)
    return explorer, partial(branch, explorer, states, options.switch, pushes)


def advise(
    loaded: LoadedCase, options: Advise, tell: Counted, *, in_caller: bool = False
) -> tuple[AdviceReport, list[str]]:
    """What moves the critical friction, and what to change, under the scatter of a study or under a usual one.

    With warnings. `in_caller`: a study that is asked of one worker is computed in this process.
    """
    from brakecli.analysis.stability.advice import KEYS
    from brakecli.studies.runs.advise import advise
    from brakecli.studies.runs.limits import within_range
    from brakecli.studies.runs.run import load_kernels
    from brakecli.studies.scattering.advised import under_scatter, under_tolerance
    from brakecli.studies.scattering.scatter import engine_for

    keys = KEYS if options.keys is None else patterns_of(options.keys)
    margin = margin_of(options.margin)
    study = None if options.scatter is None else replace(study_of(options.scatter), base=loaded)
    load_kernels(loaded)
    warnings = slips_in(loaded)
    with within_range():
        report = advise(loaded, keys, margin, tell)
        if study is None:
            return under_tolerance(report, loaded.case), warnings
        warnings += study.beside(loaded.case)
        engine_of = partial(engine_for, in_caller=in_caller)
        return under_scatter(report, loaded, study, engine_of, tell), warnings


def sweep(
    options: Sweep,
    output: Path,
    tell: Counted,
    *,
    in_caller: bool = False,
    begin: Callable[[Size, int], None] = lambda size, resumed: None,
) -> SweepReport:
    """Simulate a grid of cases, or search for critical values; `begin` is told of its size and what is there."""
    from brakecli.studies.runs.run import load_kernels
    from brakecli.studies.sweeps.driver import choose_engine, counting, sweep

    loaded = sweep_of_options(options)
    load_kernels(loaded.base)
    scheduler = scheduler_of(options.scheduler)
    with choose_engine(
        loaded.plan, options.jobs, scheduler, options.scheduler_file, in_caller=in_caller
    ) as engine:
        return sweep(
            loaded,
            output,
            engine,
            force=options.force,
            task_size=options.task_size,
            begin=begin,
            progress=counting(loaded.plan, tell),
        )


def scatter(
    options: Scatter, output: Path, tell: Counted, *, in_caller: bool = False
) -> tuple[ScatterReport, list[str]]:
    """How likely brakes squeal whose numbers scatter, with warnings."""
    from brakecli.studies.scattering.scatter import engine_for, scatter

    loaded = study_of(options.source, options.settings)
    engine_of = partial(
        engine_for,
        jobs=options.jobs,
        scheduler=scheduler_of(options.scheduler),
        scheduler_file=options.scheduler_file,
        in_caller=in_caller,
    )
    report = scatter(loaded, output, engine_of, force=options.force, tell=tell)
    if not report.failed:
        return report, []
    without = f"{report.failed} of {report.samples} samples have no answer"
    return report, [f"{without}, the first: {report.first_failure}"]


def plot(options: Plot, source: str, target: Path) -> tuple[Figure, Sequence[str]]:
    """Draw the result or the measured signal of a file, with warnings."""
    from brakecli.views.plots.result import plot_result, plot_signal

    variable = text_of(options.variable, "variable")
    section = text_of(options.section, "section")
    if quantity_of(options, source) is None:
        select = chosen_of(options.select, "select")
        with perhaps_a_signal(source):
            return plot_result(Path(source), target, select, variable, section, force=options.force), []
    if options.select or variable or section:
        names = f"{argument('select')}, {argument('variable')} and {argument('section')}"
        raise UsageError(f"{names}: are for results; leave them out for a measured signal")
    look = look_at(options, source)
    return plot_signal(look, source, target, force=options.force), look.verdict.warnings


def diff(options: Diff, first: Path, second: Path, target: Path | None) -> Difference:
    """How a second result differs from a first one; a picture of both if there is a target."""
    from brakecli.results.contents import difference
    from brakecli.results.read import open_result

    variable = text_of(options.variable, "variable")
    with open_result(first) as a, open_result(second) as b:
        differences = difference(a, b)
    if target is not None:
        from brakecli.views.plots.result import plot_two

        plot_two(first, second, target, force=options.force, variable=variable)
    return differences
