"""One run, from a case to a finished result file: what `brakecli run` does."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import h5py
import numba
import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from brakecli import __version__
from brakecli.analysis.regime.of_run import RunVerdict, context, failed
from brakecli.analysis.regime.rules import classify
from brakecli.analysis.regime.spectra import peak, spectrum
from brakecli.case.read import LoadedCase
from brakecli.case.system import Setup, set_up
from brakecli.files import fields
from brakecli.files.write import ResultFile, new_result
from brakecli.runs.limits import Check, check, free_bytes, refuse, within_range
from brakecli.runs.modelled import scene
from brakecli.runs.tolerance import Certificate, certify
from brakecli.solver.energy import EnergyAccount
from brakecli.solver.motion import Motion, Work
from brakecli.solver.quantities import HISTORY, ContactState, Failure
from brakecli.solver.schemes import has_own_steps


@dataclass(frozen=True)
class RunReport(RunVerdict):
    """Everything that a run has found out; numbers in SI units."""

    output: Path
    check: Check
    work: Work
    energy: EnergyAccount
    certificate: Certificate | None  # where the case gives no step
    spectrum_peak: float | None  # Hz, of vx
    warnings: tuple[str, ...]

    @property
    def failed(self) -> bool:
        """Whether the run ended before its time."""
        return self.work.failure is not Failure.NONE

    @property
    def status(self) -> str:
        """How the run has ended, in a word."""
        return "failed" if self.failed else "done"

    @property
    def failure_sentence(self) -> str | None:
        """What ended the run before its time, or made it worthless."""
        return failure_sentence(self.work) if self.failed else None

    @property
    def title(self) -> str:
        """The title of the case."""
        return self.setup.case.title

    @property
    def iteration(self) -> str | None:
        """How the equations of a step are solved; None where the scheme finds its steps itself."""
        return None if has_own_steps(self.setup.scheme) else self.setup.case.solver.iteration

    @property
    def step(self) -> float | None:
        """The time step, s; None where the scheme finds its steps itself."""
        return None if has_own_steps(self.setup.scheme) else self.setup.timing.step

    @property
    def modelled(self) -> list[str]:
        """What of the model the run has used."""
        return scene(self.setup, self.work)[0]

    @property
    def left_out(self) -> list[str]:
        """What of the model the run has left out, and why that was safe."""
        return scene(self.setup, self.work)[1]

    def numbers(self) -> dict[str, Any]:
        """Names and values as `--json` gives them."""
        numbers = fields.values(fields.RUN, self)
        if self.certificate is None:
            del numbers["certified_by"]
        return numbers


def failure_sentence(work: Work) -> str:
    """The sentence of a failure with its time, where it has one."""
    when = f"t = {work.failure_time:.6g} s: " if work.failure_time is not None else ""
    return when + work.failure.sentence


def load_kernels(loaded: LoadedCase) -> None:
    """Compile what a run of a case needs, or load it: this takes seconds only once."""
    with within_range():
        setup = set_up(loaded.case)
    _ = setup.scheme, setup.evaluate


def run(
    loaded: LoadedCase,
    output: Path,
    *,
    force: bool,
    begin: Callable[[Setup, Check], None] = lambda setup, found: None,
    progress: Callable[[int], None] = lambda steps: None,
) -> RunReport:
    """Simulate a case and write its result file.

    `begin` is told of the run before it starts, `progress` the steps done. Raises RefusedError,
    CannotWriteError or UsageError before anything is computed, CannotWriteError also later; a run that fails
    numerically is written up to there and reported.
    """
    with within_range():
        setup = set_up(loaded.case)
        found = check(setup)
        with new_result(output, force=force) as result:
            refuse(setup, found, free_bytes(output.resolve().parent))
            begin(setup, found)
            _declare_history(result)
            interval = setup.timing.interval

            def sink(rows: NDArray[np.float64]) -> None:
                _require_finite("a force", rows)
                first = result.rows("history")
                columns = dict(zip(HISTORY, rows.T, strict=True))
                result.append("history", {"time": interval * np.arange(first, first + len(rows)), **columns})

            certificate = None
            if setup.case.solver.promise is None:
                work, energy = Motion(setup).run(sink, progress)
            else:
                motion = certify(setup.case, progress)
                setup, work, energy, certificate = motion.setup, motion.work, motion.energy, motion.certificate
                sink(motion.rows)
            _require_finite("an energy", list(asdict(energy).values()))
            report = _analyse(setup, found, work, energy, certificate, result, output)
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
    setup: Setup,
    found: Check,
    work: Work,
    energy: EnergyAccount,
    certificate: Certificate | None,
    result: ResultFile,
    output: Path,
) -> RunReport:
    """Regime, spectra and warnings of the finished history; the spectra go into the file at once."""
    history = _Written(result, setup.timing.interval)
    verdict = classify(history, context(setup))
    if work.failure is not Failure.NONE:
        verdict = failed(verdict, failure_sentence(work))
    lines = spectrum(history, verdict.settled_from)
    result.axis("spectrum", fields.FREQUENCY, lines.frequency)
    for name, density in lines.density.items():
        result.variable("spectrum", fields.SPECTRUM[name], ("frequency",), density)
    result.set_attributes({"first_sample": lines.start, "segments": lines.segments, "window": "hann"}, "spectrum")
    warnings = list(found.warnings)
    if work.unconverged_steps and setup.case.solver.allow_unconverged:
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
    return RunReport(setup, verdict, output, found, work, energy, certificate, top, tuple(warnings))


def _declare_history(result: ResultFile) -> None:
    flags = {
        "flag_values": np.array([int(state) for state in ContactState], dtype=np.int8),
        "flag_meanings": " ".join(state.name.lower() for state in ContactState),
    }
    for field in fields.HISTORY:
        result.variable("history", field, ("time",), attributes=flags if field.name == "state" else None)


def _write(result: ResultFile, loaded: LoadedCase, report: RunReport) -> None:
    """Everything but the arrays: the case, the versions, the numbers."""
    result.set_attributes(origin("run", report.title, loaded))
    result.set_fields(fields.RUN, report.numbers())
    if len(events := report.work.unconverged):
        event, *columns = fields.UNCONVERGED
        result.axis("unconverged", event, np.arange(len(events)))
        for field, values in zip(columns, events.T, strict=True):
            finite = np.nan_to_num(values, nan=np.finfo(float).max)
            result.variable("unconverged", field, ("event",), finite)


def origin(kind: str, title: str, loaded: LoadedCase) -> dict[str, Any]:
    """The attributes that say where a result comes from: the case and the versions."""
    case = {"case_toml": loaded.text, "resolved_toml": loaded.resolved}
    return {"kind": kind, "title": title, **case, "brakecli_version": __version__, **versions()}


def versions() -> dict[str, str]:
    """The versions of the numerical libraries."""
    return {
        "numpy_version": np.__version__,
        "scipy_version": scipy.__version__,
        "numba_version": numba.__version__,
        "h5py_version": h5py.__version__,
        "hdf5_version": h5py.version.hdf5_version,
    }
