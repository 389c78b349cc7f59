"""The command line: parse, call one function, print, exit. Heavy imports stay inside the commands."""

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from brakecli import __version__
from brakecli.errors import BrakecliError, CaseError, UsageError
from brakecli.files.os_signals import Interrupted, unwinding

if TYPE_CHECKING:
    from brakecli.case.read import LoadedCase
    from brakecli.runs.limits import Check
    from brakecli.solver.system import System

app = typer.Typer(
    name="brakecli",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Vibration of a brake shoe on a rough wheel: will it vibrate, how, from which friction coefficient on.",
)

CaseArgument = Annotated[
    str, typer.Argument(metavar="CASE.toml", help='Case file, or "-" for standard input.', show_default=False)
]
Override = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY.PATH=VALUE", help="Set a key of the case, the value in TOML; repeatable."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output, nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but warnings and errors.")]
Force = Annotated[bool, typer.Option("--force", help="Replace an existing output.")]


def main() -> None:
    """Run the command line; every failure ends in a sentence on standard error and its exit code."""
    try:
        app()
    except BrakecliError as error:
        _end(str(error), error.exit_code)
    except Interrupted as error:
        _end(f"{error}; {error.left}", error.exit_code)
    except MemoryError:
        _end("out of memory; reduce contact.nodes, or sample less often", 3)
    except OSError as error:  # of a file that is none of ours, such as the cache of compiled code
        _end(f"{error.filename or 'a file'}: cannot be read or written: {error.strerror or error}", 74)


def _end(message: str, code: int) -> None:
    for line in message.splitlines():
        _tell(f"brakecli: {line}" if not line.startswith("brakecli") else line)
    sys.exit(code)


def _tell(message: str) -> None:
    """One line on standard error."""
    print(message, file=sys.stderr, flush=True)  # noqa: T201


def _print(text: str) -> None:
    """Print results on standard output."""
    print(text, flush=True)  # noqa: T201


def _print_json(value: dict[str, Any], indent: int | None = None) -> None:
    """Print as JSON, in ASCII where standard output is not UTF-8."""
    ascii_only = (sys.stdout.encoding or "").lower().replace("-", "") != "utf8"
    _print(json.dumps(value, allow_nan=False, ensure_ascii=ascii_only, indent=indent))


def _version(wanted: bool) -> None:
    if wanted:
        _print(f"brakecli {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


@app.command("run")
def run_command(
    case: Annotated[
        str,
        typer.Argument(
            metavar="CASE.toml",
            help='Case file, "-" for standard input, or a result file, whose case is run again.',
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="PATH", help="Result file  [default: the case's name with .h5, here]"
        ),
    ] = None,
    overrides: Override = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate one case; write time histories, spectra, regime and energy account to an HDF5 file."""
    loaded = _load(case, overrides)
    target = output or Path("case.h5" if case == "-" else Path(case).with_suffix(".h5").name)
    if case != "-" and not _is_result(case) and _is_same_file(target, case):
        raise UsageError(f"{target}: this is the case itself; choose another output with -o")
    _announce_compilation(quiet)
    from brakecli.cli.tables import run_table
    from brakecli.runs.run import load_kernels, run

    load_kernels(loaded)
    with unwinding() as recall, _progress(quiet) as bar:

        def progress(steps: int) -> None:
            recall()
            bar.advance(steps)

        def begin(system: "System", found: "Check") -> None:
            bar.begin("steps" if found.step is not None else "samples", system.steps)

        report = run(loaded, target, force=force, begin=begin, progress=progress)
    for line in (*report.check.adjustments, *(f"warning: {warning}" for warning in report.warnings)):
        if not quiet or line.startswith("warning"):
            _tell(f"brakecli: {line}")
    if as_json:
        _print_json({"command": "run", "output": str(report.output), **report.numbers()})
    elif not quiet:
        _print(run_table(report))
    if report.failed:
        _tell(f"brakecli: {report.output}: the history up to the failure was written")
        raise BrakecliError(str(report.motion.work.failure_sentence))
    certificate = report.certificate
    if certificate is not None and not certificate.certified and loaded.case.solver.tolerance is not None:
        raise BrakecliError(f"{report.output}: was written, but solver.tolerance is not sure to be kept")


@app.command("sweep")
def sweep_command(
    file: Annotated[
        str,
        typer.Argument(metavar="SWEEP.toml", help='Sweep file, or "-" for standard input.', show_default=False),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="PATH", help="Result file  [default: the sweep's name with .h5, here]"
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY.PATH=VALUE", help="Set a key of the base case or of [critical]; repeatable."
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", "-j", min=1, max=4096, help="Worker processes  [default: one for each core]"),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS",
            envvar="DASK_SCHEDULER_ADDRESS",
            help="Compute on a dask cluster: the scheduler's address, as tcp://host:8786.",
        ),
    ] = None,
    scheduler_file: Annotated[
        str | None,
        typer.Option("--scheduler-file", metavar="FILE", help="The same, by the scheduler's file."),
    ] = None,
    task_size: Annotated[
        int | None,
        typer.Option("--task-size", min=1, help="Points of a task  [default: as many as take 0.2 s]"),
    ] = None,
    force: Annotated[
        bool,
        typer.Option("--force", help="Replace an existing output, and drop finished points of another sweep."),
    ] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate a grid of cases, or search for a critical parameter at each.

    The same command goes on where an interrupted one has ended.
    """
    from brakecli.sweeps.file import is_case, read_sweep

    try:
        loaded = read_sweep(file, overrides or ())
    except CaseError as error:
        if file != "-" and is_case(file):
            raise UsageError(f"{file}: this is a case; simulate it with: brakecli run {file}") from error
        raise
    target = output or Path("sweep.h5" if file == "-" else Path(file).with_suffix(".h5").name)
    if file != "-" and _is_same_file(target, file):
        raise UsageError(f"{target}: this is the sweep itself; choose another output with -o")
    _announce_compilation(quiet)
    from brakecli.cli.tables import sweep_table
    from brakecli.runs.run import load_kernels
    from brakecli.sweeps.cost import Estimate
    from brakecli.sweeps.driver import Progress as Points
    from brakecli.sweeps.driver import choose_engine, sweep

    load_kernels(loaded.base)
    with _kept(target), unwinding() as recall, _progress(quiet) as bar:

        def begin(found: Estimate, resumed: int) -> None:
            if not quiet:
                before = f"; {resumed} of them are there already" if resumed else ""
                _tell(f"brakecli: {found.sentence()}{before}")
            bar.begin("points", found.points)

        def progress(points: Points) -> None:
            recall()
            bar.advance(points.done, f"points, {points.failed} failed" if points.failed else None)

        with choose_engine(loaded.plan, jobs, scheduler, scheduler_file) as engine:
            report = sweep(
                loaded, target, engine, force=force, task_size=task_size, begin=begin, progress=progress
            )
    found = report.findings
    for note in report.notes:
        _tell(f"brakecli: warning: {note}")
    if found.warned:
        _tell(f"brakecli: warning: {found.warned} points ran with warnings, the first: {found.first_warning}")
    if as_json:
        _print_json({"command": "sweep", "output": str(report.output), **report.numbers()})
    elif not quiet:
        _print(sweep_table(report))
    if found.failed:
        for failure in found.failures:
            where = ", ".join(f"{key} = {value}" for key, value in failure["parameters"].items())
            _tell(f"brakecli: point {failure['point']}{f' ({where})' if where else ''}: {failure['reason']}")
        raise BrakecliError(
            f"{report.output}: {found.failed} of {found.points} points failed; all others were written"
        )


@app.command("compare-schemes")
def compare_command(
    case: CaseArgument,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="PATH", help="Result file  [default: the case's name with -schemes.h5, here]"
        ),
    ] = None,
    overrides: Override = None,
    schemes: Annotated[
        str | None,
        typer.Option("--schemes", metavar="NAME,…", help="Only these: two-layer, three-layer, event-driven."),
    ] = None,
    steps: Annotated[
        str | None, typer.Option("--steps", metavar="H,…", help="Time steps in s, whole parts of the largest.")
    ] = None,
    budget: Annotated[
        float, typer.Option("--budget", metavar="SECONDS", min=1.0, max=86400.0, help="Time to spend, about.")
    ] = 60.0,
    target_error: Annotated[
        float,
        typer.Option("--target-error", metavar="E", min=1e-12, max=1.0, help="Name the cheapest that meets it."),
    ] = 1e-3,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compare every scheme, its weights, starts and iterations by error and cost; recommend one."""
    loaded = _load(case, overrides)
    target = output or Path(("case" if case == "-" else Path(case).stem) + "-schemes.h5")
    _announce_compilation(quiet)
    from brakecli.case.system import system_of
    from brakecli.cli.tables import comparison_table
    from brakecli.comparison.compare import compare
    from brakecli.comparison.methods import parse_schemes, parse_steps
    from brakecli.comparison.result import ComparisonReport, write
    from brakecli.files.atomic import new_output
    from brakecli.runs.run import load_kernels

    chosen, ladder = parse_schemes(schemes), parse_steps(steps)
    load_kernels(loaded)
    with unwinding() as recall, _progress(quiet) as bar:
        with new_output(target, force=force):  # whether it can be written is known before anything is computed
            pass

        def progress(what: str, done: int, total: int) -> None:
            recall()
            bar.begin(what, total)
            bar.advance(done)

        found = compare(system_of(loaded.case), schemes=chosen, steps=ladder, budget=budget, progress=progress)
        report = ComparisonReport(target, loaded.case.title, found, target_error)
        write(target, loaded, report, force=force)
    if as_json:
        _print_json({"command": "compare-schemes", "output": str(target), **report.numbers()})
    elif not quiet:
        _print(comparison_table(report))


@app.command("check")
def check_command(
    case: Annotated[
        str,
        typer.Argument(
            metavar="FILE.toml", help='Case or sweep file, or "-" for standard input.', show_default=False
        ),
    ],
    overrides: Override = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Validate a case or a sweep and tell what it would cost and which limits it meets, without stepping it."""
    if _is_sweep(case):
        _check_sweep(case, overrides, as_json, quiet)
        return
    loaded = _load(case, overrides)
    _announce_compilation(quiet)
    from brakecli.case.system import system_of
    from brakecli.cli.tables import check_numbers, check_table
    from brakecli.runs.limits import check, free_bytes, refuse, within_range

    with within_range():
        system = system_of(loaded.case)
        found = check(system)
    if as_json:
        _print_json({"command": "check", "valid": True, **check_numbers(found)})
    elif not quiet:
        _print(check_table(loaded.case.title, found))
    for warning in found.warnings:
        _tell(f"brakecli: warning: {warning}")
    refuse(system, found, free_bytes(Path()))


@app.command("new")
def new_command(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the file, with or without .toml.")] = "case",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PATH", help="File to write  [default: NAME.toml]")
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Write a commented starter case that runs."""
    import shlex

    from brakecli.case.read import starter_text
    from brakecli.files.atomic import new_output

    if not name:
        raise UsageError("the name is empty; give one, or leave it out for case.toml")
    path = output or Path(name if name.endswith(".toml") else f"{name}.toml")
    with unwinding(), new_output(path, force=force) as file:
        file.write(starter_text().encode())
        file.publish()
    if not quiet:
        _print(f"{path}: written; run it with: brakecli run {shlex.quote(str(path))}")


@app.command("schema")
def schema_command(
    kind: Annotated[str, typer.Argument(metavar="[case|sweep]", help="Which kind of file.")] = "case",
) -> None:
    """Print the JSON Schema of case files, or of sweep files, for editors that know TOML."""
    from brakecli.case.case import Case
    from brakecli.case.tables import Table, json_schema
    from brakecli.sweeps.tables import Sweep

    tables: dict[str, type[Table]] = {"case": Case, "sweep": Sweep}
    if kind not in tables:
        raise UsageError(f"schema {kind}: there is none; give {' or '.join(tables)}")
    _print_json(json_schema(tables[kind]), indent=2)


@app.command("plot")
def plot_command(
    result: Annotated[
        Path,
        typer.Argument(metavar="FILE.h5", help="Result of a run, a sweep or a comparison.", show_default=False),
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PATH", help="Picture  [default: FILE.png, here]")
    ] = None,
    select: Annotated[
        list[str] | None,
        typer.Option("--select", metavar="KEY=VALUE", help="Draw one value of a sweep's axis; repeatable."),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Draw the motion of a run, values of a sweep, or errors of a comparison (needs matplotlib)."""
    from brakecli.plots.result import plot_result

    target = output or Path(result.with_suffix(".png").name)
    with unwinding():
        plot_result(result, target, force=force, select=select or ())
    if not quiet:
        _print(f"{target}: written")


@app.command("classify")
def classify_command(
    source: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="Result of a run; with --quantity a measured signal: CSV, or FILE.h5:/path in any HDF5 file.",
            show_default=False,
        ),
    ],
    quantity: Annotated[
        str | None, typer.Option("--quantity", help="What was measured: displacement, velocity or force.")
    ] = None,
    column: Annotated[
        str | None, typer.Option("--column", help="Column of the signal, by name or number.")
    ] = None,
    time_column: Annotated[
        str | None, typer.Option("--time-column", help="Column of the time (s), by name or number.")
    ] = None,
    sample_rate: Annotated[
        float | None, typer.Option("--sample-rate", metavar="HZ", help="Samples per second.")
    ] = None,
    belt_speed: Annotated[
        float | None, typer.Option("--belt-speed", metavar="M/S", help="Speed of the wheel's surface, if known.")
    ] = None,
    stiffness: Annotated[
        float | None,
        typer.Option("--stiffness", metavar="N/M", help="Stiffness behind a measured force, if known."),
    ] = None,
    thresholds: Annotated[
        list[str] | None,
        typer.Option("--threshold", metavar="NAME=VALUE", help="Move a threshold of the rules; repeatable."),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Tell the regime of a stored run or of a measured signal, with the evidence."""
    from brakecli.cli.judging import judge

    options = {"column": column, "time_column": time_column, "sample_rate": sample_rate}
    known = {"belt_speed": belt_speed, "stiffness": stiffness}
    _announce_compilation(quiet or quantity is not None)
    from brakecli.cli.tables import verdict_table

    numbers = judge(source, quantity, options, known, thresholds or ())
    for warning in numbers.get("warnings", ()):
        _tell(f"brakecli: warning: {warning}")
    if as_json:
        _print_json({"command": "classify", "source": source, **numbers})
    elif not quiet:
        _print(verdict_table(source, numbers))


@app.command("stability")
def stability_command(
    case: CaseArgument,
    overrides: Override = None,
    vary: Annotated[
        str | None,
        typer.Option("--vary", metavar="KEY=START:STOP:NUM", help="Tabulate critical friction along a key."),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Critical friction coefficient, eigenvalues and growth of steady sliding, without stepping in time."""
    from brakecli.cli.varying import parse_vary, varied

    chosen = parse_vary(vary) if vary is not None else None
    loaded = _load(case, overrides)
    _announce_compilation(quiet)
    from brakecli.analysis.stability.report import stability
    from brakecli.case.system import system_of
    from brakecli.cli.tables import stability_table, vary_table
    from brakecli.runs.limits import within_range

    with within_range():
        report = stability(system_of(loaded.case))
        entries = varied(loaded, chosen) if chosen else []
    if as_json:
        _print_json({"command": "stability", **report.numbers(), **({"vary": entries} if chosen else {})})
    elif not quiet:
        _print(stability_table(loaded.case.title, report))
        if chosen:
            _print("\n" + vary_table(chosen.key, entries))


def _is_result(source: str) -> bool:
    """Whether this is a result file, or was one: by its name, or by its content."""
    if source == "-":
        return False
    if Path(source).suffix == ".h5" and os.path.isfile(source):  # noqa: PTH113 - pathlib's may raise
        return True
    from brakecli.files.read import is_hdf5

    return is_hdf5(Path(source))


@contextmanager
def _kept(target: Path) -> Iterator[None]:
    """Say that an interrupted sweep can be taken up again."""
    try:
        yield
    except Interrupted as error:
        if Path(f"{os.path.realpath(target)}.partial").exists():
            error.left = "finished points are kept, and the same command goes on with them"
        raise


def _is_sweep(source: str) -> bool:
    """Whether a file is meant to be a sweep; standard input can be read only once, and holds a case."""
    from brakecli.sweeps.file import is_sweep

    return source != "-" and not _is_result(source) and is_sweep(source)


def _check_sweep(source: str, overrides: list[str] | None, as_json: bool, quiet: bool) -> None:
    from brakecli.sweeps.file import read_sweep

    loaded = read_sweep(source, overrides or ())
    _announce_compilation(quiet)
    from dataclasses import asdict

    from brakecli.cli.tables import estimate_table
    from brakecli.runs.limits import free_bytes
    from brakecli.sweeps.cost import estimate, refuse_sweep
    from brakecli.sweeps.driver import cores

    found = estimate(loaded.plan, cores())
    if as_json:
        _print_json({"command": "check", "valid": True, **asdict(found)})
    elif not quiet:
        _print(estimate_table(loaded.title, found))
    refuse_sweep(found, free_bytes(Path()))


def _is_same_file(one: Path, other: str) -> bool:
    try:
        return one.samefile(other)
    except (OSError, ValueError):  # one of them does not exist, or cannot
        return False


def _load(source: str, overrides: list[str] | None) -> "LoadedCase":
    """The case of a case file, or the stored case of a result file."""
    from brakecli.case.read import LoadedCase, parse_case, read_case

    if source == "-" or Path(source).suffix == ".toml" or not _is_result(source):
        try:
            return read_case(source, overrides or ())
        except CaseError as error:
            if _is_sweep(source):
                raise UsageError(f"{source}: this is a sweep; compute it with: brakecli sweep {source}") from error
            raise
    from brakecli.files.read import open_result

    with open_result(Path(source), kind="run") as stored:
        text, resolved = stored.attributes["case_toml"], stored.attributes["resolved_toml"]
    again = parse_case(resolved, f"{source} (its resolved case)", overrides or ())
    return LoadedCase(again.case, text, again.resolved)


def _announce_compilation(quiet: bool) -> None:
    """Kernels are compiled as they are imported, once for each version: say so before it takes seconds."""
    from brakecli.solver.compile import cache_is_cold

    if not quiet and cache_is_cold():
        _tell("brakecli: compiling kernels, once for this version …")


class _Bar:
    """Progress on a terminal: steps or points, rate and time left. Elsewhere nothing."""

    def __init__(self, bar: Any = None) -> None:
        self._bar, self._task = bar, None

    def begin(self, what: str, total: int) -> None:
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=what, total=total)
        elif self._bar is not None:
            self._task = self._bar.add_task(what, total=total)

    def advance(self, done: int, what: str | None = None) -> None:
        if self._bar is not None:
            self._bar.update(self._task, completed=done, **({"description": what} if what else {}))


@contextmanager
def _progress(quiet: bool) -> Iterator[_Bar]:
    if quiet or sys.stderr is None or not sys.stderr.isatty():
        yield _Bar()
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    columns: tuple[Any, ...] = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(show_speed=True))
    with Progress(
        *columns, MofNCompleteColumn(), TimeRemainingColumn(), console=Console(stderr=True), transient=True
    ) as bar:
        yield _Bar(bar)
