"""The normal contact force, (2): one file per way of computing it, loaded by the name that the case gives.

Contract of an evaluator module: `evaluate(x, y, layer)`, a kernel of the signature `records.EVALUATE`, fills
`layer.contact`, a record of `records.CONTACT`, for the shoe at (x, y) and the phases `layer.angles` of the wheel's
harmonics (`roughness.wheel_angles`). It takes constants and tables from `layer.pad` and `layer.tables`, changes
nothing but the contact and `layer.scratch`, and names itself by its index into `KINDS`.
"""

from importlib import import_module
from typing import Any

KINDS = ("closed-form", "midpoint", "exact")
CLOSED_FORM, MIDPOINT, EXACT = range(3)


def load(name: str) -> Any:
    """The kernel `evaluate` of the evaluator of this name; it is compiled on the first call of a new version."""
    return import_module(f"brakecli.solver.contact.{name.replace('-', '_')}").evaluate
