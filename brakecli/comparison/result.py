"""The result of a comparison: its file, and names and values for programs."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from brakecli import __version__
from brakecli.case.read import LoadedCase
from brakecli.comparison.compare import Comparison, Entry
from brakecli.comparison.deviation import FORCES, MOTION
from brakecli.comparison.methods import method_label
from brakecli.files.write import FILL, ResultFile, new_result
from brakecli.runs.run import versions

DEFAULT_TARGET = 1e-3
_TEXTS = {
    "method": "the method in a few words",
    "scheme": "time-stepping scheme",
    "theta": "weights of the layers",
    "start": "how the second layer is found",
    "iteration": "how the equations of a step are solved",
    "evaluator": "how the contact force is computed",
    "failure": "why there is no result, empty if there is one",
}
_NUMBERS = {
    "step": ("s", "time step; missing where the scheme finds its steps itself"),
    "tolerance": ("1", "tolerance of a scheme that finds its steps itself"),
    "error": ("1", "largest relative error of x, y, vx and vy"),
    **{f"error_{name}": ("1", f"largest relative error of {name}") for name in (*MOTION, *FORCES)},
    **{f"mean_error_{name}": ("1", f"relative error of {name}, mean over time") for name in (*MOTION, *FORCES)},
    "amplitude_error": ("1", "relative error of the amplitude of the settled motion"),
    "phase_error": ("rad", "error of the phase of the settled motion"),
    "critical_bias": ("1", "critical friction of the scheme at its step less the exact one"),
    "observed_order": ("1", "order by which the error falls from the step before"),
    "step_limit": ("s", "largest stable step; missing where any step is stable, or not known"),
    "wall_seconds": ("s", "median time of the loop alone"),
}
_COUNTS = {
    "nodes": "quadrature nodes, 0 where none are needed",
    "steps": "time steps",
    "contact_evaluations": "evaluations of the contact force",
    "iterations": "iterations of all steps together",
    "unconverged_steps": "steps that did not converge",
    "on_front": "whether no other entry is better in both error and time (0, 1)",
}


@dataclass(frozen=True)
class ComparisonReport:
    """A comparison with the error that is aimed at."""

    output: Path
    title: str
    comparison: Comparison
    target: float

    @property
    def recommended(self) -> Entry | None:
        """The cheapest entry that meets the target."""
        return self.comparison.cheapest(self.target)

    def numbers(self) -> dict[str, Any]:
        """Names and values as `--json` gives them."""
        found, best = self.comparison, self.recommended
        return {
            "title": self.title,
            "duration": found.duration,
            "sample_interval": found.interval,
            "reference_error": found.reference_error,
            "reference_seconds": found.reference_seconds,
            "repeats": found.repeats,
            "left_out": found.left_out,
            "target_error": self.target,
            "recommended": entry_numbers(best) if best is not None else None,
            "margin": self.target / best.errors.error if best is not None and best.errors is not None else None,
            "entries": [entry_numbers(entry) for entry in found.entries],
        }


def entry_numbers(entry: Entry) -> dict[str, Any]:
    """Names and values of an entry; null where there is none."""
    method, work, errors = entry.rung.kind, entry.work, entry.errors
    limit = entry.step_limit
    failed = errors is None
    return {
        "method": method_label(method),
        "scheme": method.scheme,
        "theta": list(method.theta),
        "start": method.start,
        "iteration": method.iteration,
        "evaluator": method.evaluator,
        "nodes": method.nodes,
        "step": entry.rung.step,
        "tolerance": entry.rung.tolerance,
        "error": None if errors is None else errors.error,
        **{f"error_{name}": None if errors is None else errors.largest[name] for name in (*MOTION, *FORCES)},
        **{f"mean_error_{name}": None if errors is None else errors.mean[name] for name in (*MOTION, *FORCES)},
        "amplitude_error": None if errors is None else errors.amplitude,
        "phase_error": None if errors is None else errors.phase,
        "critical_bias": entry.critical_bias,
        "observed_order": entry.order,
        "step_limit": None if limit is None or math.isinf(limit) else limit,
        "steps": work.steps if work else 0,
        "contact_evaluations": work.contact_evaluations if work else 0,
        "iterations": entry.iterations,
        "unconverged_steps": work.unconverged_steps if work else 0,
        "wall_seconds": None if failed else entry.wall_seconds,
        "on_front": int(entry.on_front),
        "failure": entry.failure,
    }


def write(path: Path, loaded: LoadedCase, report: ComparisonReport, *, force: bool) -> None:
    """Write the result file; raises UsageError or CannotWriteError."""
    with new_result(path, force=force) as result:
        _write(result, loaded, report)
        result.commit()


def _write(result: ResultFile, loaded: LoadedCase, report: ComparisonReport) -> None:
    numbers = report.numbers()
    entries = numbers.pop("entries")
    best = report.recommended
    place = next((place for place, entry in enumerate(report.comparison.entries) if entry is best), None)
    result.set_attributes(
        {
            "kind": "comparison",
            "case_toml": loaded.text,
            "resolved_toml": loaded.resolved,
            "brakecli_version": __version__,
            **versions(),
            **{key: value for key, value in numbers.items() if key != "recommended" and value is not None},
            **({"recommended": place} if place is not None else {}),
        }
    )
    result.axis("/", "entry", "1", "a method at one step or tolerance", np.arange(len(entries)))
    for name, long_name in _TEXTS.items():
        texts = [_weights(each[name]) if name == "theta" else each[name] for each in entries]
        result.variable("/", name, ("entry",), "", long_name, np.array(texts, dtype=str))
    for name, (units, long_name) in _NUMBERS.items():
        values = np.array([FILL if each[name] is None else each[name] for each in entries], dtype=float)
        fill = {"_FillValue": np.array([FILL])}
        result.variable("/", name, ("entry",), units, long_name, values, attributes=fill)
    for name, long_name in _COUNTS.items():
        counts = np.array([each[name] for each in entries], dtype=np.int64)
        result.variable("/", name, ("entry",), "1", long_name, counts, dtype=np.int64)


def _weights(theta: list[float]) -> str:
    return ", ".join(f"{weight:.6g}" for weight in theta)
