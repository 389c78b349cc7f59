"""The normal contact force, (2): one file and one row of `EVALUATORS` for each way of computing it.

The rows are plain data; a file is imported when it is used.

Contract of an evaluator module: `evaluate(x, y, angles, pad, contact)`, a kernel of the signature `EVALUATE`,
fills `contact` for the shoe at (x, y), with `angles` the phases of the wheel's harmonics
(`roughness.wheel_angles`) and `pad` the constants and tables of `brakecli.solver.contact.pad`:

- NORMAL_FORCE, N: F_y = k ∫ max(gap, 0) dξ over the pad, gap = f2(ξ + x - travel) - f1(ξ) - y;
- STIFFNESS, N/m: -∂F_y/∂y = k (length that touches) >= 0;
- TANGENTIAL, N/m: ∂F_y/∂x = k Σ [f2] over the touching intervals;
- FRACTION: the part of the pad that touches, 0 to 1;
- STORE, J: V = k/2 ∫ max(gap, 0)² dξ, and STORE_X, N: ∂V/∂x;
- KIND: the evaluator that did the work (its place in `kinds()`), VALID: 0 where its assumptions do not hold.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any


@dataclass(frozen=True)
class Evaluator:
    """What a way of computing the contact states of itself; `needs_nodes`: it takes quadrature nodes."""

    module: str
    needs_nodes: bool = False


EVALUATORS: dict[str, Evaluator] = {
    "auto": Evaluator("brakecli.solver.contact.auto", needs_nodes=True),
    "closed-form": Evaluator("brakecli.solver.contact.closed_form"),
    "midpoint": Evaluator("brakecli.solver.contact.midpoint", needs_nodes=True),
    "exact": Evaluator("brakecli.solver.contact.exact"),
}
"""`auto` hands over to the others."""


def kinds() -> tuple[str, ...]:
    """The evaluators that do the work, in the order of the kinds that they note."""
    return tuple(name for name in EVALUATORS if name != "auto")


def load(name: str) -> Any:
    """The kernel `evaluate` of an evaluator; it is compiled on the first call of a new version."""
    return import_module(EVALUATORS[name].module).evaluate
