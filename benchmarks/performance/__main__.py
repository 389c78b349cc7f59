"""Speed beside general solvers at matched errors, and what is to be reached: writes docs/performance.md.

    python -m benchmarks.performance [--keep] [PART ...]

Needs the extra `bench`. Programs that are not installed are named on the page. Parts, by words in their names, are
printed and leave the page alone. It fails where a ratio fell far below what has been reached, see `reached`; where
none did, `--keep` takes over those that are higher.
"""

import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")

from benchmarks.performance import ensembles, in_c, page, peers, reached, rows, taylor
from benchmarks.performance.matching import (
    TARGETS,
    US,
    Entry,
    Floats,
    Ladder,
    cheapest,
    deviation,
    loop,
    measure,
    our_ladders,
    ratio,
    warm,
)
from benchmarks.performance.page import Goal, number
from benchmarks.performance.problem import Problem
from brakecli.solver.method import Method
from brakecli.solver.system import System
from brakecli.studies.runs.tolerance import certify

CASES = {"S": "smooth surfaces", "B": "rough surfaces, pad partly open", "C": "stick-slip"}
DURATIONS = (0.02, 0.5)
# tolerances, of 20 ms and of longer motions
REFERENCE = 1e-12
LONG_REFERENCE = 1e-10
TURN_SECONDS = 3.0
AGAINST_LSODA = {("S", 0.02): 5, ("B", 0.02): 3, ("C", 0.02): 5, ("S", 0.5): 12, ("B", 0.5): 3, ("C", 0.5): 10}
AGAINST_SCIPY = {"S": 500, "B": 70, "C": 100}
GUARD = (
    "How many times longer others take, larger is better. `make bench` fails where a ratio is more than"
    f" {100 * reached.LOSS:.0f} % below what was reached; `make bench BENCH_ARGS=--keep` raises that, and no"
    " command lowers it. Times by themselves are not guarded."
)


@dataclass
class Report:
    """What has been measured so far."""

    begin: float  # s
    load: float  # of the machine at the start
    before: reached.Ratios = field(default_factory=reached.read)
    goals: list[Goal] = field(default_factory=list)
    ratios: dict[str, float] = field(default_factory=dict)  # those that are guarded
    motions: dict[tuple[str, float], list[Entry]] = field(default_factory=dict)
    ensemble: list[Entry] = field(default_factory=list)  # case B for the duration of the ensembles
    rates: list[ensembles.Rate] = field(default_factory=list)
    single: list[in_c.Beside] = field(default_factory=list)
    grown: list[rows.Table] = field(default_factory=list)
    missing: str = ""
    left: list[str] = field(default_factory=list)  # what is still to be measured

    def lines(self) -> list[str]:
        lines = page.head(self.load, (time.perf_counter() - self.begin) / 60.0)
        if self.left:
            lines += [f"The run was interrupted: not measured are {', '.join(self.left)}.", ""]
        lines += ["## Goals", "", *page.goals(self.goals)]
        lines += ["## Motions side by side", "", *page.absent(self.motions)] if self.motions else []
        for (name, duration), entries in self.motions.items():
            lines += page.side_by_side(f"{name}: {CASES[name]}", duration, entries)
        if self.rates:
            lines += ["## Many cases", "", *page.rates(self.rates)]
        if self.single or self.missing:
            lines += ["## Beside C", "", *(page.in_c_rows(self.single) or [f"Not measured: {self.missing}.", ""])]
        if self.grown:
            lines += ["## How cost grows", "", *page.growth(self.grown)]
        return lines


def say(what: str) -> None:
    print(f"# {time.strftime('%H:%M:%S')} {what}", file=sys.stderr, flush=True)


def everyone(problem: Problem, name: str, reference: Floats) -> Iterator[Ladder]:
    yield from our_ladders(problem.system)
    if name == "S" and peers.found("heyoka"):
        yield from taylor.heyoka(problem, taylor.bouncing)
    for package, ladders in peers.PEERS.items():
        if peers.found(package):
            yield from ladders(problem, name == "C", reference)


def exact(system: System, tolerance: float) -> Floats:
    """The motion that others are compared with."""
    scheme = "piecewise-exact" if system.smooth else "event-driven"
    return loop(replace(system, method=Method(scheme, tolerance=tolerance)))[1]


def motions(report: Report, name: str) -> None:
    """A case by all programs; and case B for the time that ensembles compute."""
    system = replace(rows.load(f"accuracy/{name}.toml"), interval=ensembles.INTERVAL, duration=max(DURATIONS))
    reference = exact(system, LONG_REFERENCE)
    for duration in sorted({*DURATIONS, ensembles.DURATION if name == "B" else DURATIONS[0]}):
        say(f"{name}, {duration:g} s")
        part = replace(system, duration=duration)
        begin = reference[: part.samples + 1] if duration > min(DURATIONS) else exact(part, REFERENCE)
        entries = measure(everyone(Problem(part), name, begin), begin, TURN_SECONDS)
        if duration in DURATIONS:
            report.motions[name, duration] = entries
            report.ratios |= reached.side_by_side(f"{name}, {duration:g} s", entries)
        else:
            report.ensemble = entries
    report.goals += motion_goals(report.motions, name)


def motion_goals(found: dict[tuple[str, float], list[Entry]], name: str) -> list[Goal]:
    goals: list[Goal] = []
    for who in ("numbalsoda LSODA", "numbalsoda DOP853"):
        for duration in DURATIONS if peers.found("numbalsoda") else ():
            ratios = {target: ratio(found[name, duration], who, target) for target in TARGETS}
            reached = {target: each for target, each in ratios.items() if each is not None}
            if reached:
                told = ", ".join(f"{number(each)} at {target:.0e}" for target, each in reached.items())
                goal = AGAINST_LSODA[name, duration] if "LSODA" in who else 1
                kept = min(reached.values()) >= goal
                goals.append((f"{who}: {name}, {duration:g} s", f"≥ {goal}", told, kept))
    for duration in DURATIONS if name == "S" and peers.found("heyoka") else ():
        both = [ratio(found["S", duration], "heyoka.py", target) or 0.0 for target in (1e-6, 1e-7)]
        what = f"heyoka.py: S at 1e-6 and 1e-7, {duration:g} s"
        goals.append((what, "≥ 2", ", ".join(map(number, both)), min(both) >= 2))
    each = ratio(found[name, DURATIONS[0]], "SciPy", 1e-3) or 0.0
    goal = AGAINST_SCIPY[name]
    what = f"SciPy: {name} at 1e-3, {DURATIONS[0]:g} s"
    goals.append((what, f"≥ {goal}", number(each), each >= goal))
    return goals


def relaxation(report: Report) -> None:
    """Two seconds of stick-slip, certified to 1e-8, beside heyoka.py at an error up to ten times that."""
    system = rows.load("relaxation.toml", "solver={tolerance=1e-8, duration=2.0}", "output.sample_interval=1e-2")
    reference = loop(replace(system, method=Method("piecewise-exact", share=0.3)))[1]
    settings = {"us": Entry(US, "certified to 1e-8", lambda: certified(system), seconds=[0.0])}
    for tolerance in (1e-8, 1e-10, 1e-12):
        label = f"tolerance {tolerance:.0e}"
        solve = taylor.stick_slip(Problem(system), tolerance)
        settings[label] = Entry("heyoka.py", label, peers.timed(solve, lambda each: each), seconds=[0.0])
    for entry in settings.values():
        entry.error = deviation(entry.compute()[1], reference)
    for _ in range(9):
        for entry in settings.values():
            entry.seconds.append(warm(entry))
    entries = list(settings.values())
    theirs = [entry for entry in entries if entry.who == "heyoka.py"]
    best = min((each for each in theirs if each.error <= 1e-7), key=lambda each: each.time, default=theirs[-1])
    times = (
        f"{number(1e3 * entries[0].time)} ms against {number(1e3 * best.time)} ms at an error of {best.error:.0e}"
    )
    value = best.time / entries[0].time
    report.ratios["heyoka.py: relaxation.toml, 2 s at 1e-08"] = value
    what = "heyoka.py: relaxation.toml, 2 s at 1e-8, 200 samples"
    report.goals.append((what, "≥ 3", f"{number(value)}: {times}", value >= 3))


def certified(system: System) -> tuple[float, Floats]:
    begin = time.process_time()
    motion = certify(system).motion
    return time.process_time() - begin, motion.rows[:, :4]


def many(report: Report) -> None:
    """Case B at many coefficients of friction."""
    entries = report.ensemble
    problem = ensembles.b_problem(ensembles.DURATION)
    found = report.rates
    size = peers.scales(loop(replace(problem.system, method=rows.steps(256)))[1])
    for who, rate in {
        "numbalsoda LSODA": ensembles.numbalsoda,
        "numbalsoda DOP853": ensembles.numbalsoda,
        "diffrax": ensembles.diffrax,
        "SciPy": ensembles.scipy,
    }.items():
        best = cheapest(entries, who, 1e-3)
        if best is not None:
            say(f"ensemble: {who}")
            found.append(rate(problem, best, size))
    interval = f"output.sample_interval={ensembles.INTERVAL}"
    ours = cheapest([entry for entry in entries if entry.who == US and entry.settings["method"].step], US, 1e-3)
    say("ensemble: ours")
    if ours is not None:
        method = ours.settings["method"]
        kind = f'scheme="{method.scheme}", theta={list(method.theta)}'
        solver = f"{{{kind}, step={method.step!r}, duration={ensembles.DURATION}}}"
        what = f"sweep with verdicts, {ours.label}"
        found.insert(0, ensembles.ours(200, what, f"solver={solver}", f"contact.nodes={method.nodes}", interval))
    promised = f"solver={{tolerance=1e-3, duration={ensembles.DURATION}}}"
    found.insert(0, ensembles.ours(10_000, "sweep with verdicts, `tolerance = 1e-3`", promised, interval))
    for each in found[1:]:
        if each.who in reached.GUARDED:
            name = f"{each.who}: map on B, a core"
            report.ratios[name] = found[0].per_cpu_second / each.per_cpu_second
    speed = found[0].per_second
    report.goals.append(("map on B: points/s", "≥ 2,500", number(speed), speed >= 2500))


def maps(report: Report) -> None:
    for points, limit, words in ((100, 6.0, "≤ 6 s"), (1000, 360.0, "≤ 6 minutes")):
        seconds, told = rows.regimes_map(points)
        what = f"map of regimes: {points} × {points}"
        report.goals.append((what, words, f"{number(seconds)} s ({told})", seconds <= limit))


def promises(report: Report) -> None:
    for duration, entries in ((0.02, report.motions["B", 0.02]), (0.2, report.ensemble)):
        seconds, least = rows.promise(duration, entries)
        told = f"{number(seconds / least)} ({number(1e3 * seconds)} ms against {number(1e3 * least)} ms)"
        report.ratios[f"cheapest entry against a promise: B, {duration:g} s at 1e-03"] = least / seconds
        report.goals.append((f"promise: 1e-3 on B, {duration:g} s", "≤ 10", told, seconds <= 10 * least))


def beside_c(report: Report) -> None:
    report.missing = in_c.unavailable()
    if not report.missing:
        report.single = in_c.beside_c(partial(rows.load, "accuracy/B.toml"))
        for each in report.single:
            report.ratios[f"in C: {each.what.partition(',')[0]}"] = each.theirs / each.ours
        value = report.single[0].ours / report.single[0].theirs
        report.goals.append(("one evaluation: 256 nodes, against C", "≤ 1.15", number(value), value <= 1.15))


def critical_smooth(report: Report) -> None:
    rows.critical_seconds("relaxation.toml", 2.0, [rows.REGIMES])  # compiles
    seconds = rows.critical_seconds("relaxation.toml", 2.0, [rows.REGIMES])
    report.goals.append(("critical: a smooth point", "≤ 20 ms", f"{number(1e3 * seconds)} ms", seconds <= 0.02))


def critical_open(report: Report) -> None:
    seconds = rows.critical_seconds("rough-partly-open.toml", 1.0, rows.PERIODIC)
    what = "critical: an open point with a period of 1 s"
    report.goals.append((what, "≤ 60 s", f"{number(seconds)} s", seconds <= 60.0))


def growth(report: Report) -> None:
    for table in (rows.by_duration, rows.by_nodes, rows.by_waves, rows.by_points):
        report.grown.append(table())


def main() -> None:
    report = Report(time.perf_counter(), os.getloadavg()[0])
    stages: dict[str, Callable[[Report], None]] = {f"case {name}": partial(motions, name=name) for name in "SB"}
    if peers.found("heyoka"):
        stages["relaxation"] = relaxation
    stages |= {"promises": promises, "single steps": beside_c, "maps": maps, "case C": partial(motions, name="C")}
    stages |= {"ensembles": many, "growth of cost": growth}
    stages |= {"critical values of a smooth point": critical_smooth, "of an open point": critical_open}
    wanted = [word for word in sys.argv[1:] if word != "--keep"]
    if wanted and "--keep" in sys.argv:
        sys.exit("--keep needs a run of all parts")
    stages = {name: stage for name, stage in stages.items() if not wanted or any(word in name for word in wanted)}
    report.left = list(stages)
    for name, stage in stages.items():
        say(name)
        stage(report)
        report.left.remove(name)
        if not wanted:
            page.write(report.lines())  # an interrupted run leaves what it has found
    print("\n".join([*report.lines(), GUARD, "", *reached.lines(report.before, report.ratios)]))
    if fell := reached.fallen(report.before, report.ratios, whole=not wanted):
        sys.exit("\n".join(["less than what has been reached:", *fell]))
    if "--keep" in sys.argv:
        reached.FILE.write_text(reached.written(reached.raised(report.before, report.ratios)), encoding="utf-8")


if __name__ == "__main__":
    main()
