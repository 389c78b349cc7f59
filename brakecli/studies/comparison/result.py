"""The result of a comparison: its file, and names and values for programs."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from brakecli.case.case import Case
from brakecli.case.read import LoadedCase
from brakecli.results import fields
from brakecli.results.field import values_of
from brakecli.results.write import new_result
from brakecli.studies.comparison.compare import Comparison, Entry
from brakecli.studies.comparison.methods import in_a_case
from brakecli.studies.runs.run import origin


@dataclass(frozen=True)
class ComparisonReport:
    """A comparison with the error that is aimed at."""

    output: Path
    case: Case
    comparison: Comparison
    target: float

    @property
    def title(self) -> str:
        """Title of the case."""
        return self.case.title

    @property
    def recommended(self) -> Entry | None:
        """The entry that takes the least time of those that meet the target, the reference's error added."""
        timed = [entry for entry in self.comparison.entries if entry.seconds]
        added = self.comparison.reference_error
        able = [entry for entry in timed if entry.error + added <= self.target]
        return min(able, key=lambda entry: entry.wall_seconds or math.inf, default=None)

    @property
    def margin(self) -> float | None:
        """The target over the error of the recommended entry."""
        best = self.recommended
        return None if best is None else self.target / best.error

    @property
    def in_a_case(self) -> dict[str, object]:
        """Keys of a case, and their values, that ask for the recommended method."""
        if (best := self.recommended) is None:
            return {}
        return in_a_case(best.method, self.target, self.case.output.sample_interval)

    def numbers(self) -> dict[str, Any]:
        """Names and values as `--json` gives them."""
        return values_of(fields.COMPARISON, self)


def write(path: Path, loaded: LoadedCase, report: ComparisonReport, *, force: bool) -> None:
    """Write the result file; raises UsageError or CannotWriteError."""
    entries = report.comparison.entries
    index = next((index for index, entry in enumerate(entries) if entry is report.recommended), None)
    with new_result(path, force=force) as result:
        result.set_attributes(origin("comparison", report.title, loaded))
        result.set_fields(fields.COMPARISON, {**report.numbers(), "recommended": index})
        result.axis("/", fields.ENTRY_PLACE, np.arange(len(entries)))
        for field in fields.ENTRY:
            values = [field.read(entry) for entry in entries]
            if field.name == "theta":
                values = [", ".join(f"{weight:.6g}" for weight in theta) for theta in values]
            result.column(field, ("entry",), values)
        result.commit()
