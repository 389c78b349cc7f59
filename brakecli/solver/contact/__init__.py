"""The normal contact force, (2): one file and one row of `EVALUATORS` for each way of computing it.

The rows are plain data; a file is imported when it is used. An evaluator keeps the contract `EvaluatorModule`.

1. Its kernel `evaluate` fills `layer.contact` for the shoe at (x, y): F_y, its derivatives, the part of the pad
   that touches, the energy stored and its derivative by x.
2. It changes nothing but the contact and the scratch up to the phases of the wheel's harmonics.
3. These lie in the scratch from `layer.angles_at` on (`roughness.turn`); with a window there are none.
4. On nodes heights are those at the edges of cells, with some beyond each end; they come from `heights.gaps`.
5. Constants are in `layer.pad`, which says where in the tables each of them begins (`contact.pad`).
6. It notes its place in `kinds()` as `contact.kind`, so that a run can say how contact was modelled.
7. `valid` is 0 where its assumptions do not hold.
8. `near` and `blur` say how far F_y can be from linear nearby, which may save an evaluation; both may be left.
9. What it keeps in the scratch may save work, and changes results by rounding alone.
10. It has a branch in `contact.force`, and may have a kernel `press` that finds normal force, stiffness, fraction,
    kind and validity alone, for event-driven runs, with a branch in `motion.forces`.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from brakecli.solver.arrays import Floats
    from brakecli.solver.records import Layer


@runtime_checkable
class EvaluatorModule(Protocol):
    """What every evaluator has."""

    def evaluate(self, x: float, y: float, layer: "Layer", tables: "Floats", scratch: "Floats", /) -> None:
        """Fill `layer.contact` for the shoe at (x, y), in m: a kernel."""


@dataclass(frozen=True)
class Evaluator:
    """What a way of computing the contact states of itself.

    `nodes_per_wave`: quadrature nodes to the shortest wavelength that keep the force to a few parts in 10,000,
    measured in tests/solver/test_contact.py; 0 where it takes none. `finds_patches`: it seeks the edges of every
    patch that touches.
    """

    module: str
    nodes_per_wave: int = 0
    finds_patches: bool = False

    @property
    def needs_nodes(self) -> bool:
        """Whether it takes quadrature nodes."""
        return self.nodes_per_wave > 0


EVALUATORS: dict[str, Evaluator] = {
    "auto": Evaluator("brakecli.solver.contact.auto", nodes_per_wave=8),
    "closed-form": Evaluator("brakecli.solver.contact.closed_form"),
    "midpoint": Evaluator("brakecli.solver.contact.midpoint", nodes_per_wave=16),
    "exact": Evaluator("brakecli.solver.contact.exact", finds_patches=True),
    "cells": Evaluator("brakecli.solver.contact.cells", nodes_per_wave=8),
}
"""`auto` hands over to the others."""


def kinds() -> tuple[str, ...]:
    """The evaluators that do the work, in the order of the kinds that they note."""
    return tuple(name for name in EVALUATORS if name != "auto")


CLOSED_FORM, MIDPOINT, EXACT, CELLS = map(kinds().index, ("closed-form", "midpoint", "exact", "cells"))


def place_of(name: str) -> int:
    """The place of an evaluator in `EVALUATORS`, by which a layer names it.

    Raises ValueError where there are more kinds than a run can count.
    """
    from brakecli.solver.records import MOST_KINDS

    if len(kinds()) > MOST_KINDS:
        raise ValueError(f"EVALUATORS has {len(kinds())} kinds, a run can count {MOST_KINDS}; increase MOST_KINDS")
    return list(EVALUATORS).index(name)
