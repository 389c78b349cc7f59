"""One run, from a case to a finished result file: what `brakecli run` does."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import h5py
import numba
import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from brakecli import __version__
from brakecli.analysis.regime.of_run import context, failed, verdict_numbers
from brakecli.analysis.regime.rules import Verdict, classify
from brakecli.analysis.regime.spectra import SPECTRAL, Spectrum, peak, spectrum
from brakecli.case.read import LoadedCase
from brakecli.case.system import system_of
from brakecli.files.write import ResultFile, new_result
from brakecli.runs.limits import Check, check, free_bytes, refuse, within_range
from brakecli.runs.modelled import modelled
from brakecli.runs.tolerance import Certificate, certify
from brakecli.solver.motion import Motion, solve
from brakecli.solver.quantities import HISTORY, TIME, ContactState
from brakecli.solver.system import System


@dataclass(frozen=True)
class RunReport:
    """Everything that a run has found out; numbers in SI units."""

    output: Path
    title: str
    motion: Motion
    check: Check
    certificate: Certificate | None  # where the case gives no step
    verdict: Verdict
    spectrum_peak: float | None  # Hz, of vx
    warnings: tuple[str, ...]

    @property
    def failed(self) -> bool:
        """Whether the run ended before its time."""
        return self.motion.work.failed

    def numbers(self) -> dict[str, Any]:
        """Names and values as `--json` gives them and the file's attributes hold them."""
        system, work, energy = self.motion.system, self.motion.work, self.motion.energy
        method, (used, left) = system.method, modelled(self.motion)
        return {
            "status": "failed" if self.failed else "done",
            "failure": work.failure_sentence,
            **verdict_numbers(self.verdict, system),
            "spectrum_peak": self.spectrum_peak,
            "scheme": method.scheme,
            "theta": list(method.theta),
            "iteration": None if method.own_steps else method.iteration,
            "step": None if method.own_steps else system.step,
            **certificate_numbers(self.certificate),
            "evaluators": work.evaluators,
            "nodes": system.nodes,
            "steps": work.steps,
            "contact_evaluations": work.contact_evaluations,
            "most_evaluations_in_a_step": work.most_evaluations,
            "unconverged_steps": work.unconverged_steps,
            "non_unique_steps": work.non_unique_steps,
            "energy": {
                **asdict(energy),
                "closing_error": energy.closing_error,
                "relative_closing_error": energy.relative_closing_error,
            },
            "modelled": used,
            "left_out": left,
            "adjustments": list(self.check.adjustments),
            "warnings": list(self.warnings),
        }


def certificate_numbers(certificate: Certificate | None) -> dict[str, Any]:
    """Names and values of what a tolerance has come to; null where the case gives a step."""
    if certificate is None:
        return {"tolerance": None, "certified": None, "estimated_error": None, "certified_until": None}
    return {
        "tolerance": certificate.tolerance,
        "certified": int(certificate.certified),
        "estimated_error": certificate.estimated_error,
        "certified_until": certificate.certified_until,
        "certified_by": certificate.method,
    }


def load_kernels(loaded: LoadedCase) -> None:
    """Compile what a run of a case needs, or load it: this takes seconds only once."""
    with within_range():
        system = system_of(loaded.case)
    _ = system.scheme, system.evaluate


def run(
    loaded: LoadedCase,
    output: Path,
    *,
    force: bool,
    begin: Callable[[System, Check], None] = lambda system, found: None,
    progress: Callable[[int], None] = lambda steps: None,
) -> RunReport:
    """Simulate a case and write its result file.

    `begin` is told of the run before it starts, `progress` the steps done. Raises RefusedError,
    CannotWriteError or UsageError before anything is computed, CannotWriteError also later; a run that fails
    numerically is written up to there and reported.
    """
    with within_range():
        system = system_of(loaded.case)
        found = check(system)
        with new_result(output, force=force) as result:
            refuse(system, found, free_bytes(output.resolve().parent))
            begin(system, found)
            _declare_history(result)
            interval = system.interval

            def sink(rows: NDArray[np.float64]) -> None:
                _require_finite("a force", rows)
                first = result.rows("history")
                columns = dict(zip(HISTORY, rows.T, strict=True))
                result.append("history", {"time": interval * np.arange(first, first + len(rows)), **columns})

            certificate = None
            if system.method.step is not None:
                motion = solve(system, sink=sink, progress=progress)
            else:
                certified = certify(system, progress)
                motion, certificate = certified.motion, certified.certificate
                sink(motion.rows)
            _require_finite("an energy", list(asdict(motion.energy).values()))
            report = _analyse(loaded.case.title, motion, found, certificate, result, output)
            _write(result, loaded, report)
            result.commit()
    return report


def _require_finite(what: str, values: ArrayLike) -> None:
    """Compiled code overflows without a word; the motion itself is bounded by the loop."""
    if not np.isfinite(values).all():
        raise FloatingPointError(f"{what} overflows")


@dataclass(frozen=True)
class _Written:
    """The history of a file that is being written, as the analysis reads it."""

    result: ResultFile
    interval: float

    @property
    def samples(self) -> int:
        return self.result.rows("history")

    def read(self, name: str, start: int, stop: int) -> NDArray[np.float64]:
        return self.result.read("history", name, start, stop)


def _analyse(
    title: str, motion: Motion, found: Check, certificate: Certificate | None, result: ResultFile, output: Path
) -> RunReport:
    """Regime, spectra and warnings of the finished history; the spectra go into the file at once."""
    system, work = motion.system, motion.work
    history = _Written(result, system.interval)
    verdict = classify(history, context(system))
    if work.failure_sentence is not None:
        verdict = failed(verdict, work.failure_sentence)
    lines = spectrum(history, verdict.settled_from)
    _write_spectrum(result, lines)
    warnings = list(found.warnings)
    if work.unconverged_steps and system.method.allow_unconverged:
        warnings.append(
            f"{work.unconverged_steps} of {work.steps} steps did not converge, as the case allows; their times "
            "and residuals are in the file, the history is not to be trusted there"
        )
    if work.non_unique_steps:
        warnings.append(
            f"{work.non_unique_steps} steps met a point where their solution need not be unique (the contact "
            "force rises with itself); reduce solver.step or friction.coefficient"
        )
    if certificate is not None and not certificate.certified:
        warnings.append(f"solver.tolerance: {certificate.sentence()}")
    top = peak(lines.frequency, lines.density["vx"])
    told = tuple(warnings)
    return RunReport(output, title, motion, found, certificate, verdict, top, told)


def _declare_history(result: ResultFile) -> None:
    result.axis("history", "time", TIME.units, TIME.long_name)
    for name, quantity in HISTORY.items():
        if name == "state":
            flags = {
                "flag_values": np.array([int(state) for state in ContactState], dtype=np.int8),
                "flag_meanings": " ".join(state.name.lower() for state in ContactState),
            }
            result.variable(
                "history", name, ("time",), quantity.units, quantity.long_name, dtype=np.int8, attributes=flags
            )
        else:
            result.variable("history", name, ("time",), quantity.units, quantity.long_name)


def _write_spectrum(result: ResultFile, lines: Spectrum) -> None:
    result.axis("spectrum", "frequency", "Hz", "frequency", lines.frequency)
    for name in SPECTRAL:
        quantity = HISTORY[name]
        result.variable(
            "spectrum",
            name,
            ("frequency",),
            f"({quantity.units})2 Hz-1",
            f"power spectral density of: {quantity.long_name}",
            lines.density[name],
        )
    result.set_attributes({"first_sample": lines.start, "segments": lines.segments, "window": "hann"}, "spectrum")


def _write(result: ResultFile, loaded: LoadedCase, report: RunReport) -> None:
    """Everything but the arrays: the case, the versions, the numbers."""
    numbers = report.numbers()
    groups = {
        "regime/evidence": "evidence",
        "regime/thresholds": "thresholds",
        "energy": "energy",
        "evaluators": "evaluators",
    }
    result.set_attributes(
        {
            "kind": "run",
            "title": report.title,
            "case_toml": loaded.text,
            "resolved_toml": loaded.resolved,
            "brakecli_version": __version__,
            **versions(),
            **_present({name: value for name, value in numbers.items() if name not in groups.values()}),
        }
    )
    for group, name in groups.items():
        result.set_attributes(_present(numbers[name]), group)
    unconverged = report.motion.work.unconverged
    if len(unconverged):
        result.axis("unconverged", "event", "1", "steps that did not converge", np.arange(len(unconverged)))
        for column, (name, units) in enumerate({"time": "s", "residual": "N"}.items()):
            values = np.nan_to_num(unconverged[:, column], nan=np.finfo(float).max)
            result.variable("unconverged", name, ("event",), units, f"{name} of an unconverged step", values)


def versions() -> dict[str, str]:
    """The versions of the numerical libraries."""
    return {
        "numpy_version": np.__version__,
        "scipy_version": scipy.__version__,
        "numba_version": numba.__version__,
        "h5py_version": h5py.__version__,
        "hdf5_version": h5py.version.hdf5_version,
    }


def _present(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values that are there: an attribute cannot be nothing, nor an empty list."""
    return {name: value for name, value in values.items() if value is not None and value != []}
