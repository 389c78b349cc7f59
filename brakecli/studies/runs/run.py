"""One run, from a case to a finished result file: what `brakecli run` does."""

from collections.abc import Iterator
from dataclasses import astuple, dataclass, replace
from functools import partial
from pathlib import Path

import h5py
import numba
import numpy as np
import scipy
from numpy.typing import NDArray

from brakecli.about import __version__
from brakecli.analysis.over_time import OverTime, over_time
from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.spectrum import peak, spectrum
from brakecli.case.read import LoadedCase, with_duration
from brakecli.case.system import system_of
from brakecli.results import fields
from brakecli.results.field import values_of
from brakecli.results.write import ResultFile, new_result
from brakecli.solver.history import History
from brakecli.solver.integrate import Counted, Motion, Progress, Sink
from brakecli.solver.quantities import HISTORY, ContactState
from brakecli.solver.steps.loop import load
from brakecli.solver.system import System
from brakecli.solver.track import KINDS, MIN, Track
from brakecli.studies.runs.certificate import Certificate
from brakecli.studies.runs.judge import inputs_of, judged_in_memory, motion_of, refuse_overflow, to_judge
from brakecli.studies.runs.limits import Check, check, free_bytes, refuse, within_range
from brakecli.studies.runs.modelled import modelled
from brakecli.studies.runs.settled import settle


@dataclass(frozen=True)
class RunReport:
    """Everything that a run has found out; numbers in SI units. `fields.RUN` says where each of them is."""

    loaded: LoadedCase  # whose resolved case has the duration that the run has come to
    output: Path
    verdict: Verdict
    motion: Motion
    check: Check
    certificate: Certificate | None  # where the case gives no step
    over_time: OverTime | None  # where speed or load change
    spectrum_peak: float | None  # Hz, of vx
    warnings: tuple[str, ...]
    modelled: list[str]
    left_out: list[str]

    @property
    def title(self) -> str:
        """Title of the case."""
        return self.loaded.case.title

    @property
    def status(self) -> str:
        """How the run has ended, in a word."""
        return "failed" if self.motion.work.failed else "done"

    def numbers(self) -> dict[str, object]:
        """Names and values as `--json` gives them."""
        numbers = values_of(fields.RUN, self)
        if self.motion.system.method.own_steps:
            numbers |= {"iteration": None, "step": None}
        if self.certificate is None:
            del numbers["certified_by"]
        return numbers


def load_kernels(loaded: LoadedCase) -> System:
    """The system of a case, whose kernels are compiled or loaded: this takes seconds only once."""
    with within_range():
        system = system_of(loaded.case)
    load(system.method.scheme)
    return system


def run(
    loaded: LoadedCase, output: Path, *, force: bool, progress: Counted = lambda what, done, total: None
) -> RunReport:
    """Simulate a case and write its result file.

    `progress` is called now and then with what is counted, how many are done, and how many there are. Raises
    RefusedError, CannotWriteError or UsageError before anything is computed, CannotWriteError also later. A run
    that fails numerically is written up to the failure and reported.
    """
    with within_range():
        system = to_judge(system_of(loaded.case))
        checked = check(system)
        with new_result(output, force=force) as result:
            refuse(checked, free_bytes(output.resolve().parent))
            counted = "steps" if checked.step else "samples"
            sink = _history_sink(result, system.interval)

            def shown_by(trial: System) -> Progress:
                total = trial.samples if trial.method.step is None else trial.steps
                return lambda done: progress(counted, done, total)

            if system.settles:
                ended = settle(system, lambda trial: judged_in_memory(trial, shown_by(trial)))
                (decided, motion, certificate), system, doubts = ended
                checked = check(system)
                checked = replace(checked, warnings=(*checked.warnings, *doubts))
                loaded = with_duration(loaded, system.duration)
                sink(motion.rows)
            else:
                decided = None
                motion, certificate = motion_of(system, shown_by(system), sink)
            if not np.isfinite(astuple(motion.energy)).all():  # compiled code overflows silently
                raise FloatingPointError("an energy overflows")
            history = History(system.interval, result.rows("history"), partial(result.read, "history"))
            facts = motion.work.failure_sentence, motion.exponent, motion.track
            verdict = decided or classify([inputs_of(history, system, *facts)])[0]
            top = _write_spectrum(result, history, verdict)
            changing = None if motion.work.failed else over_time(history, system)
            if changing:
                _write_over_time(result, changing)
            warnings = (*checked.warnings, *_warnings(motion, certificate), *verdict.notes.values())
            if loaded.case.output.events and motion.track is not None:
                warnings += _write_events(result, motion.track)
            used, left_out = modelled(motion)
            report = RunReport(
                loaded=loaded,
                output=output,
                verdict=verdict,
                motion=motion,
                check=checked,
                certificate=certificate,
                over_time=changing,
                spectrum_peak=top,
                warnings=warnings,
                modelled=used,
                left_out=left_out,
            )
            result.set_attributes(origin("run", report.title, loaded))
            result.set_fields(fields.RUN, report.numbers())
            if len(motion.work.unconverged):
                _write_unconverged(result, motion.work.unconverged)
            result.commit()
    return report


def _history_sink(result: ResultFile, interval: float) -> Sink:
    """Declare the history of a file; what is returned writes samples to it."""
    names = " ".join(state.name.lower() for state in ContactState)
    states = {"flag_values": np.array(list(ContactState), dtype=np.int8), "flag_meanings": names}
    for field in fields.HISTORY:
        result.variable("history", field, ("time",), None, **(states if field.name == "state" else {}))

    def append(rows: NDArray[np.float64]) -> None:
        refuse_overflow(rows)
        done = result.rows("history")
        time = interval * np.arange(done, done + len(rows))
        result.append("history", {"time": time, **dict(zip(HISTORY, rows.T, strict=True))})

    return append


def _warnings(motion: Motion, certificate: Certificate | None) -> Iterator[str]:
    """What a careful user should know of a finished motion."""
    work = motion.work
    if work.unconverged_steps and motion.system.method.allow_unconverged:
        what = f"{work.unconverged_steps} of {work.steps} steps did not converge, as the case allows"
        yield f"{what}; their times and residuals are in the file, the history is not reliable there"
    if work.non_unique_steps:
        what = "steps met a point where their solution need not be unique (the contact force rises with itself)"
        yield f"{work.non_unique_steps} {what}; reduce solver.step or friction.coefficient"
    if certificate is not None and not certificate.certified:
        yield f"solver.tolerance: {certificate.sentence()}"


def _write_spectrum(result: ResultFile, history: History, verdict: Verdict) -> float | None:
    """Write the spectra of the samples that a verdict judges; the frequency (Hz) of the highest peak of vx."""
    lines = spectrum(history, verdict.start)
    result.axis("spectrum", fields.FREQUENCY, lines.frequency)
    for name, density in lines.density.items():
        result.variable("spectrum", fields.SPECTRUM[name], ("frequency",), density)
    result.set_attributes(values_of(fields.WELCH, lines), "spectrum")
    strongest = verdict.evidence["line_frequencies"][:1]
    if verdict.evidence.get("ripple_vx", 0.0) > 0.5 or not strongest:
        return None
    duration = (history.samples - verdict.start) * history.interval
    return peak(lines.frequency, lines.density["vx"], duration, *strongest)


def _write_over_time(result: ResultFile, changes: OverTime) -> None:
    """Write the numbers of each window, the short-time spectra, and the intervals of vibration."""
    for group in ("over_time", "spectrogram"):
        result.axis(group, fields.WINDOW_TIME, changes.time)
    for field in fields.OVER_TIME:
        result.column(field, ("time",), field.read(changes), "over_time")
    result.axis("spectrogram", fields.FREQUENCY, changes.lines)
    result.variable("spectrogram", replace(fields.SHORT_TIME, kind="f8"), ("time", "frequency"), changes.density)
    result.axis("vibrations", fields.INTERVAL, np.arange(len(changes.vibrations)))
    for field in fields.VIBRATION:
        column = [field.read(vibration) for vibration in changes.vibrations]
        result.column(field, ("interval",), column, "vibrations")


def _write_unconverged(result: ResultFile, events: NDArray[np.float64]) -> None:
    """Write times and residuals of steps that did not converge."""
    event, *columns = fields.UNCONVERGED
    result.axis("unconverged", event, np.arange(len(events)))
    for field, values in zip(columns, events.T, strict=True):
        result.column(field, ("event",), values, "unconverged")


def _write_events(result: ResultFile, track: Track) -> tuple[str, ...]:
    """Write the events, but turning points of x, as far as they are kept; a warning where some are not."""
    chosen = track.kept.kind > MIN
    time, kind, x, others = (column[chosen] for column in track.kept)
    event, *columns = fields.EVENTS
    result.axis("events", event, np.arange(len(time)))
    for field, values in zip(columns, (time, np.array(KINDS)[kind], x, *others.T), strict=True):
        result.variable("events", field, ("event",), values)
    earlier = int(track.counts[MIN + 1 :].sum()) - len(time)
    result.set_attributes({"earlier": earlier}, "events")
    warning = f"output.events: the last {len(time)} events are in the file, {earlier} earlier ones are not"
    return (warning,) if earlier else ()


def origin(kind: str, title: str, loaded: LoadedCase) -> dict[str, str]:
    """The attributes that say where a result comes from: the case and the versions."""
    case = {"case_toml": loaded.text, "resolved_toml": loaded.resolved}
    return {"kind": kind, "title": title, **case, "brakecli_version": __version__, **versions()}


def versions() -> dict[str, str]:
    """The versions of the numerical libraries."""
    numbers = {f"{library.__name__}_version": str(library.__version__) for library in (np, scipy, numba, h5py)}
    return {**numbers, "hdf5_version": h5py.version.hdf5_version}
