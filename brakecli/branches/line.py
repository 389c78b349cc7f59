"""A case along a line: keys that take the same value, from one end of a range to the other."""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache

from pydantic import ValidationError

from brakecli.case import wording
from brakecli.case.case import Case
from brakecli.case.read import key_path, put
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.system import System

MOST_KEPT = 64
"""Systems that are kept: those of one step of a branch, and of the differences around it."""


class Line:
    """The systems of a case whose keys go from `low` (p = 0) to `high` (p = 1)."""

    def __init__(self, case: Case, keys: Sequence[str], low: float, high: float, label: str = "it") -> None:
        """`label` is what messages of problems call the line."""
        self.case, self.keys, self.low, self.high, self.label = case, tuple(keys), low, high, label
        self._paths = [key_path(key) for key in keys]
        self._given = case.model_dump(exclude_unset=True)
        self.system = lru_cache(maxsize=MOST_KEPT)(self._system)

    def value(self, p: float) -> float:
        """The value of the keys at p; both ends are met exactly."""
        return self.low + p * (self.high - self.low) if p != 1.0 else self.high

    def place(self, value: float) -> float:
        """The p of a value."""
        return (value - self.low) / (self.high - self.low)

    def case_at(self, p: float) -> Case:
        """The case at p; raises CaseError where it is not valid."""
        data = deepcopy(self._given)
        for path in self._paths:
            put(data, path, self.value(p), Case, kept=self._paths)
        try:
            return Case.model_validate(data)
        except ValidationError as error:
            problems = [replace(each, source=self.label) for each in wording.problems(error, Case)]
            raise CaseError(problems) from None

    def _system(self, p: float) -> System:
        """The system at p; raises CaseError where the case is not valid."""
        return system_of(self.case_at(p))
