"""The normal contact force, (2): one file per way of computing it, loaded by the name that the case gives.

Contract of an evaluator module: `evaluate(x, y, angles, pad, contact)`, a kernel of the signature `EVALUATE`,
fills `contact` for the shoe at (x, y), with `angles` the phases of the wheel's harmonics
(`roughness.wheel_angles`) and `pad` the constants and tables of `brakecli.solver.contact.pad`:

- NORMAL_FORCE, N: F_y = k ∫ max(gap, 0) dξ over the pad, gap = f2(ξ + x - travel) - f1(ξ) - y;
- STIFFNESS, N/m: -∂F_y/∂y = k (length that touches) >= 0;
- TANGENTIAL, N/m: ∂F_y/∂x = k Σ [f2] over the touching intervals;
- FRACTION: the part of the pad that touches, 0 to 1;
- STORE, J: V = k/2 ∫ max(gap, 0)² dξ, and STORE_X, N: ∂V/∂x;
- KIND: the evaluator that did the work (index into `KINDS`), VALID: 0 where its assumptions do not hold.
"""

from importlib import import_module
from typing import Any

KINDS = ("closed-form", "midpoint", "exact")


def load(name: str) -> Any:
    """The kernel `evaluate` of the evaluator of this name; it is compiled on the first call of a new version."""
    return import_module(f"brakecli.solver.contact.{name.replace('-', '_')}").evaluate
