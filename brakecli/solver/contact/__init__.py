"""The normal contact force, (2): one file and one row of `EVALUATORS` for each way of computing it.

The rows are plain data; a file is imported when it is used.

A module keeps the contract `EvaluatorModule`.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from brakecli.solver.arrays import Floats
    from brakecli.solver.records import Layer


@runtime_checkable
class EvaluatorModule(Protocol):
    """What every evaluator has.

    It may also have a kernel `press` of the same signature, which finds normal force, stiffness, fraction, kind
    and validity alone, for event-driven runs, with a branch in `motion.forces`.
    """

    def evaluate(self, x: float, y: float, layer: "Layer", tables: "Floats", scratch: "Floats", /) -> None:
        """Fill `layer.contact` for the shoe at (x, y): a kernel, with a branch of its own in `contact.force`.

        The phases of the wheel's harmonics lie in the scratch from `layer.angles_at` on (`roughness.turn`); on
        nodes heights come from `heights.profiles`, and with a window there are no phases. Constants are in
        `layer.pad`, which says where in the tables each of them begins. It changes nothing but the contact and the
        scratch up to the phases, and notes its place in `kinds()`. `near` and `blur` say how far F_y can be from
        linear nearby, which may save an evaluation; both may be left. What it keeps in the scratch may save work,
        and change results by rounding alone.
        """


@dataclass(frozen=True)
class Evaluator:
    """What a way of computing the contact states of itself.

    `needs_nodes`: it takes quadrature nodes. `finds_patches`: it seeks the edges of every patch that touches.
    """

    module: str
    needs_nodes: bool = False
    finds_patches: bool = False


EVALUATORS: dict[str, Evaluator] = {
    "auto": Evaluator("brakecli.solver.contact.auto", needs_nodes=True),
    "closed-form": Evaluator("brakecli.solver.contact.closed_form"),
    "midpoint": Evaluator("brakecli.solver.contact.midpoint", needs_nodes=True),
    "exact": Evaluator("brakecli.solver.contact.exact", finds_patches=True),
}
"""`auto` hands over to the others."""
MOST_KINDS = 8
"""How many of `kinds()` a run has counters for."""


def kinds() -> tuple[str, ...]:
    """The evaluators that do the work, in the order of the kinds that they note."""
    return tuple(name for name in EVALUATORS if name != "auto")


CLOSED_FORM, MIDPOINT, EXACT = (kinds().index(name) for name in ("closed-form", "midpoint", "exact"))


def place_of(name: str) -> int:
    """The place of an evaluator in `EVALUATORS`, by which a layer names it.

    Raises ValueError where there are more kinds than a run can count.
    """
    if len(kinds()) > MOST_KINDS:
        raise ValueError(f"EVALUATORS has {len(kinds())} kinds, a run can count {MOST_KINDS}; increase MOST_KINDS")
    return list(EVALUATORS).index(name)
