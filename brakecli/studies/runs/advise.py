"""What to change so that a shoe does not squeal: sensitivities, advised values, and a run that checks the best."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from brakecli.analysis.branches.thresholds import Thresholds, thresholds
from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.stability import advice as of_case
from brakecli.analysis.stability.advice import Change, Left, Sensitivity, percent
from brakecli.analysis.stability.modes import is_undamped
from brakecli.analysis.stability.report import LARGEST_FRICTION, StabilityReport, stability
from brakecli.case.case import Case
from brakecli.case.read import LoadedCase, key_path
from brakecli.case.system import system_of
from brakecli.results import stability_fields as fields
from brakecli.results.field import values_of
from brakecli.solver.integrate import Counted, Motion
from brakecli.solver.system import System
from brakecli.studies.runs.judge import judged_in_memory, to_judge
from brakecli.studies.runs.settled import Judged, settle
from brakecli.studies.runs.work import stability_work, table_work, work_of

SMALLEST = "smallest ratio (or rad)"
"""In which order changes stand."""


@dataclass(frozen=True)
class CheckRun:
    """A run of the case with the best advice followed, from the case's own start."""

    parameter: str
    value: float
    verdict: Verdict
    duration: float  # s of motion
    seconds: float  # s of computing


@dataclass(frozen=True)
class AdviceReport:
    """Everything that is known of a case and its changes; `fields.ADVICE` says where each number is."""

    title: str
    system: System
    stability: StabilityReport
    critical_friction: float | None
    wanted_margin: float
    sensitivities: list[Sensitivity]
    advice: list[Change]
    checks: Mapping[str, CheckRun]  # by the changed key
    thresholds: Thresholds
    left_out: str = ""  # what was not asked, as it takes too long
    squeal: Left | None = None  # of the case itself, under scatter
    scatter: str = ""  # which one, in words
    ranking: str = f"Confirmed by a run, {SMALLEST} first"
    band: tuple[float, ...] | None = None  # Hz, between which squeal counts under scatter; any where None
    elsewhere: str = ""  # what is said of brakes that are unstable, but do not squeal there
    helpful: Sequence[str] = ()  # keys whose change surely lowers what is unstable under scatter
    mildest: str | None = None  # of these the one that leaves least of it
    in_vain: str = ""  # what no change does to how many are unstable under scatter; empty where one does

    @property
    def margin(self) -> float | None:
        """The critical friction over the case's own, less 1; None without one of the two."""
        critical = self.critical_friction
        own = self.stability.friction
        return critical / own - 1.0 if critical is not None and own > 0.0 else None

    @property
    def stable(self) -> bool | None:
        """Whether sliding is stable; None where the wheel stands, or nothing presses the shoe."""
        return self.stability.stable if self.stability.belt_speed else None

    @property
    def check(self) -> CheckRun | None:
        """The run with the first advice followed; None without one."""
        return self.checks.get(self.advice[0].parameter) if self.advice else None

    def numbers(self) -> dict[str, Any]:
        """Names and values as `--json` gives them."""
        return values_of(fields.ADVICE, self)

    @property
    def conclusion(self) -> "Words":
        """The answer in a sentence; `conclusion()` gives it, too."""
        return Words("; ".join((*self._state(), *self._remedy())))

    def notes(self) -> list[str]:
        """What the answer rests on."""
        equilibrium = self.stability.equilibrium
        load = abs(self.system.load_at_start)
        sentences = []
        if equilibrium is not None and equilibrium.normal_force < 0.5 * load:  # links carry more than the pad
            pressed = f"{float(f'{equilibrium.normal_force:.3g}'):g} N press the shoe on"
            sentences.append(f"of the load of {load:g} N, {pressed}; the links carry the rest")
        if equilibrium is not None and 0.0 < equilibrium.contact_fraction < 1.0:
            instead = 'a sweep with method = "simulation" follows the motion itself'
            sentences.append(f"the pad opens in part: this rests on the mean stiffness of the contact; {instead}")
        if is_undamped(self.system.coefficients):
            sentences.append("no dashpot acts: where sliding is stable, vibration does not die away either")
        if not self.system.steady:
            sentences.append("speed and load are those of t = 0")
        if self.left_out:
            sentences.append(self.left_out)
        return sentences

    def _state(self) -> Iterator[str]:
        report = self.stability
        critical = self.critical_friction
        own = self.stability.friction
        if report.belt_speed == 0.0:
            yield "the wheel stands, so that nothing slides: give wheel.angular_speed"
            return
        if report.equilibrium is None:
            yield f"at {own:g} {report.no_equilibrium}"
        elif own == 0.0:
            yield "without friction nothing squeals"
        elif not report.stable:
            first = report.modes[0]
            yield f"squeals at {first.frequency:.4g} Hz" if first.frequency else "locks, without vibration"
        elif critical:
            yield "as drawn it does not squeal by itself"
        if critical == 0.0:
            yield "unstable at any friction, however small"
        elif critical is not None and report.critical is not None:
            tone = report.critical.frequency
            at = f" at {tone:.4g} Hz" if tone and report.stable else ""
            lost = f"sliding loses its stability{at} from a friction coefficient of {critical:.3g} on"
            yield f"{lost}{_far(self.margin, own)}"
            if report.stable and critical < own:
                changes = (("lost" if zero.lost else "regained", zero.friction) for zero in report.crossings)
                turns = ", ".join(f"{change} at {friction:.3g}" for change, friction in changes)
                yield f"the case lies above a range of instability, as stability is {turns}"
            if self.thresholds.beside:
                yield self.thresholds.beside
            if self.squeal:
                yield self._scattered(self.squeal)
        elif report.equilibrium is not None and report.contact_stiffness > 0.0:
            searched = "" if self.system.smooth else f", up to {LARGEST_FRICTION:g}"
            yield f"stable: no friction makes it unstable{searched}"

    def _scattered(self, squeal: Left) -> str:
        """How many brakes squeal that are built to the drawing."""
        but = "but " if self.stability.stable and squeal.squeal_lower > 0.0 else ""
        those = "brakes built to this drawing" if self.stability.stable else "such brakes"
        return f"{but}under a scatter {self.scatter} {self._share(squeal, f' of {those}')}"

    def _share(self, squeal: Left, those: str = "") -> str:
        """Which part squeals, in the band if there is one, and what is unstable beside it."""
        there = f"between {self.band[0]:g} and {self.band[1]:g} Hz" if self.band and those else "in that band"
        said = f"{part_of(squeal)}{those} squeal" + f" {there}" * (self.band is not None)
        beside = squeal.unstable_elsewhere or 0.0
        return f"{said}, and {percent(beside)} {self.elsewhere}" if self.elsewhere and beside > 0.0 else said

    def _remedy(self) -> Iterator[str]:
        if not self.advice:
            return
        best = self.advice[0]
        if best.to is None:
            yield f"no key alone gives a margin of {100.0 * self.wanted_margin:.3g} %"
            return
        critical = best.critical_friction
        effect = "takes the instability away"
        if critical is not None:
            effect = f"moves the loss of stability to {critical:.3g}"
        squealing = "" if best.squeal is None else f", and {self._share(best.squeal)}"
        yield f"{best.parameter} {best.start:.4g} → {best.rounded} {effect}{squealing}"
        mildest = next((change for change in self.advice if change.parameter == self.mildest), best)
        if mildest.parameter != best.parameter and mildest.squeal:
            yield f"{mildest.parameter} → {mildest.rounded} leaves least: {self._share(mildest.squeal)}"
        if self.in_vain:
            yield f"no change listed {self.in_vain} how many are unstable: try a larger --margin, or damping"
        if best.check is None:
            yield "no run has checked that"
        elif best.check == Regime.UNDECIDED:
            yield "but a run from the case's own start is undecided"
        elif best.check != Regime.DAMPED:
            yield f"but from the case's own start it still vibrates: {best.check}"


class Words(str):
    """A sentence that may be called as well: it gives itself."""

    def __call__(self) -> str:
        """The sentence."""
        return str(self)


def part_of(squeal: Left) -> str:
    """The share that squeals, with its 95 % interval where that leaves no second digit sure."""
    upper = percent(squeal.squeal_upper)
    if not squeal.is_vague:
        return percent(squeal.squeal_probability)
    if squeal.squeal_probability == 0.0:
        return f"at most {upper}"
    return f"{percent(squeal.squeal_probability)} (95 %: {percent(squeal.squeal_lower)[:-2]} to {upper})"


def _far(margin: float | None, own: float) -> str:
    """How far the critical friction lies from a case's own."""
    if not margin:
        return ""
    if margin > 10.0:  # per cent would be hard to read
        return f", {margin + 1.0:.3g} times the case's {own:g}"
    percent = 100.0 * abs(margin)
    where = "above" if margin > 0.0 else "below"
    return f", {percent:{'.0f' if percent > 99.0 else '.2g'}} % {where} the case's {own:g}"


def _work(loaded: LoadedCase) -> float:
    """The work of all advice: each number of a case is changed to find critical friction anew."""
    system = system_of(loaded.case)
    return len(of_case.numbers(loaded.case)) * (stability_work(system) + table_work(system))


def advise(
    loaded: LoadedCase, patterns: Sequence[str], margin: float, progress: Counted, most: float = math.inf
) -> AdviceReport:
    """Sensitivities of a case, the nearest safe value of each key that fits a pattern, and a run of the best.

    A case that has the margin (a part of its friction) needs no advice; what takes more work than `most` is left
    out. Raises UsageError.
    """
    case = loaded.case
    advice = list[Change]()
    keys = of_case.advised_keys(case, patterns)
    everything = of_case.numbers(case)
    system = system_of(case)
    report = stability(system)
    answer = of_case.answer(case)
    critical = answer.critical if answer else None
    sensitivities = list[Sensitivity]()
    left_out = ""
    if _work(loaded) > most:
        left_out = "what to change is left out, as it takes long here: `brakecli advise` asks it"
    else:
        for done, path in enumerate(everything if answer else ()):
            counted = partial(progress, "derivatives", done, len(everything))
            sensitivities.append(of_case.sensitivity(case, path, critical, counted))
        slides = answer is not None or (system.smooth and system.belt_speed != 0.0)
        if slides and not (answer and answer.safe((1.0 + margin) * report.friction)):
            for done, path in enumerate(keys):
                advice.append(of_case.advised(case, path, margin, partial(progress, "keys", done, len(keys))))
    sensitivities.sort(key=lambda sensitivity: -abs(sensitivity.elasticity or 0.0))
    advice, checks = _ranked(case, advice, progress)
    both = thresholds(case, system, report, progress)
    return AdviceReport(
        case.title, system, report, critical, margin, sensitivities, advice, checks, both, left_out
    )


def _ranked(case: Case, advice: list[Change], progress: Counted) -> tuple[list[Change], dict[str, CheckRun]]:
    """Advice that a run confirms first, what still vibrates last, small changes first; and the runs by key.

    Runs are made for small changes first; none is begun after a work of 10.
    """
    checks = dict[str, CheckRun]()
    spent = 0.0
    for change in sorted(advice, key=lambda change: change.size):
        if change.to is None or spent > 10.0 or (trial := _to_check(case, change)) is None:
            continue
        system, work = trial
        checks[change.parameter] = _checked(system, change, progress)
        spent = spent + work
    regimes = {key: str(check.verdict.regime) for key, check in checks.items()}
    places: dict[str | None, int] = {Regime.DAMPED: 0, Regime.UNDECIDED: 1, None: 1}

    def rank(change: Change) -> tuple[bool, int, float]:
        return change.to is None, places.get(change.check, 2), change.size

    return sorted((replace(change, check=regimes.get(change.parameter)) for change in advice), key=rank), checks


def _to_check(case: Case, change: Change) -> tuple[System, float] | None:
    """The case with an advised value, until disturbances have decayed by 15 powers of e, and the work of its run.

    For that it has 100 000 samples at most. In any case it is cut short beyond a work of 5, or a million samples:
    choices. None where the value, with the digits that are shown, is not valid.
    """
    there = of_case.changed(case, key_path(change.parameter), float(change.rounded))
    if there is None:
        return None
    system = system_of(there)
    answer = of_case.answer(there, 0.0)
    work = work_of(system).amount
    decays = -answer.growth if answer and answer.growth and system.steady else 0.0
    long = min(15.0 / (decays * system.duration), 100_000 / system.samples) if decays > 0.0 else 1.0
    factor = min(max(long, 1.0), 5.0 / max(work, 1e-9), 1_000_000 / system.samples)
    return replace(system, duration=factor * system.duration), factor * work


def _checked(system: System, change: Change, progress: Counted) -> CheckRun:
    """Run a system with an advised value."""
    start = time.perf_counter()

    def run(trial: System) -> Judged[Motion]:
        what, total = ("samples", trial.samples) if trial.method.step is None else ("steps", trial.steps)
        return judged_in_memory(trial, lambda done: progress(f"{what} of the check", done, total))

    ended = settle(to_judge(system), run)
    spent = time.perf_counter() - start
    duration = ended.system.sampled_duration
    return CheckRun(change.parameter, float(change.rounded), ended.judged.verdict, duration, spent)
