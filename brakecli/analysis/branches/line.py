"""A case along a line: keys that take the same value, from one end of a range to the other."""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np
from pydantic import ValidationError

from brakecli.analysis.shoe import Shoe
from brakecli.case import wording
from brakecli.case.case import Case
from brakecli.case.read import key_path, put
from brakecli.case.system import system_of
from brakecli.errors import CaseError, Problem
from brakecli.solver.arrays import Floats
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.system import System

MOST_KEPT = 64
"""Systems that are kept: those of one step of a branch, and of the differences around it."""
ALONE = {"shoe", "wheel", "link1", "link2", "load", "friction", "contact"}
"""Tables of a case that need not be read again where no key of theirs changes."""

NODES = 33
"""Chebyshev's nodes between which the numbers of shoes are interpolated."""
_PLACES = 0.5 + 0.5 * np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
_NUMBERS = {node: number for number, node in enumerate(_PLACES.tolist())}
_WEIGHTS = np.sin(np.pi * (np.arange(NODES) + 0.5) / NODES) * (-1.0) ** np.arange(NODES)


class Line:
    """The systems of a case whose keys go from `low` (p = 0) to `high` (p = 1)."""

    def __init__(
        self,
        case: Case,
        keys: Sequence[str],
        low: float,
        high: float,
        label: str = "it",
        adapted: Callable[[System], System] = lambda system: system,
    ) -> None:
        """`label` is what messages of problems call the line; `adapted` changes each system of it."""
        self._adapted = adapted
        self.case = case
        self.keys = tuple(keys)
        self.low = low
        self.high = high
        self.label = label
        self._paths = [key_path(key) for key in keys]
        tables = case.model_dump(exclude_unset=True)
        touched = {path[0] for path in self._paths if path}
        self._tables = {
            name: getattr(case, name) if name in ALONE - touched else table for name, table in tables.items()
        }
        self.system = lru_cache(maxsize=MOST_KEPT)(self._system)
        self.shoe = lru_cache(maxsize=MOST_KEPT)(self._shoe)
        self.smooth = case.roughness.shoe is None and case.roughness.wheel is None

    @property
    def case_coefficients(self) -> Coefficients:
        """The coefficients of the case itself."""
        return system_of(self.case).coefficients

    @property
    def own(self) -> float | None:
        """The value that all keys have in the case itself; None where they differ, or lie outside of the range."""
        values = set[object]()
        for path in self._paths:
            table: object = self.case
            for key in path:
                table = getattr(table, key, None)
            values.add(table)
        (value,) = values if len(values) == 1 else (None,)
        inside = isinstance(value, int | float) and min(self.low, self.high) <= value <= max(self.low, self.high)
        return float(value) if inside and isinstance(value, int | float) else None

    def value(self, p: float) -> float:
        """The value of the keys at p; both ends are met exactly."""
        return self.low + p * (self.high - self.low) if p != 1.0 else self.high

    def place(self, value: float) -> float:
        """The p of a value."""
        return (value - self.low) / (self.high - self.low)

    def case_at(self, p: float) -> Case:
        """The case at p; raises CaseError where it is not valid."""
        return self.case_with(self.value(p))

    def case_with(self, value: float) -> Case:
        """The case whose keys have a value; raises CaseError where it is not valid."""
        data = dict(self._tables)
        for path in self._paths:
            data[path[0]] = deepcopy(self._tables.get(path[0], {}))
        for path in self._paths:
            put(data, path, value, Case, kept=self._paths)
        try:
            return Case.model_validate(data)
        except ValidationError as error:
            problems = [replace(problem, source=self.label) for problem in wording.problems(error, Case)]
            raise CaseError(problems) from None

    def systems(self, places: int) -> dict[int, System]:
        """The systems at equally distant places, by their numbers, where the case is valid.

        Raises CaseError where it is nowhere valid, and where speed or load change.
        """
        systems = dict[int, System]()
        failed = None
        for k in range(places):
            try:
                systems[k] = self.system(k / (places - 1))
            except CaseError as error:
                failed = error
        if not systems and failed is not None:
            raise failed
        if not all(system.steady for system in systems.values()):
            what = "the speed of the wheel or the load changes in time"
            raise CaseError([Problem(("wheel",), what, "give constant ones", source=self.label)])
        return systems

    def _system(self, p: float) -> System:
        """The system at p; raises CaseError where the case is not valid."""
        return self._adapted(system_of(self.case_at(p)))

    def _shoe(self, p: float) -> Shoe:
        """The numbers of the shoe at p: interpolated where that is exact to rounding; reading a case takes longer.

        Raises CaseError where the case is not valid.
        """
        if self._table is None:
            return Shoe.of(self.system(p))
        *constants, stiffness, belt, load = _interpolated(self._table, p).tolist()
        coefficients = Coefficients(**dict(zip(Coefficients._fields, constants, strict=True)))
        return Shoe(coefficients=coefficients, stiffness=stiffness, belt=belt, load=load)

    @cached_property
    def _table(self) -> Floats | None:
        """The numbers at Chebyshev's nodes; None where they do not follow a polynomial through them."""
        between = 0.5 * (_PLACES[1:] + _PLACES[:-1])[:: NODES // 6]
        try:
            table, exact = (
                np.array([_row(Shoe.of(self.system(p))) for p in where])
                for where in (_PLACES.tolist(), between.tolist())
            )
        except CaseError:
            return None
        interpolated = np.array([_interpolated(table, p) for p in between.tolist()])
        return table if np.all(np.abs(interpolated - exact) <= 1e-13 * np.abs(table).max(axis=0)) else None


def _row(shoe: Shoe) -> list[float]:
    """A row of the table of numbers."""
    return [*shoe.coefficients, shoe.stiffness, shoe.belt, shoe.load]


def _interpolated(table: Floats, p: float) -> Floats:
    """The polynomial through a table's rows at Chebyshev's nodes, by the barycentric formula."""
    node = _NUMBERS.get(p)
    if node is not None:
        return np.asarray(table[node])
    weights = _WEIGHTS / (p - _PLACES)
    return np.asarray(weights @ table / weights.sum())
