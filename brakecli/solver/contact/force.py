"""The normal force by the evaluator that a layer names: a branch for each."""

from brakecli.solver.arrays import VECTOR, Floats
from brakecli.solver.contact import EVALUATORS, auto, closed_form, exact, midpoint
from brakecli.solver.kernels import entry, kernel
from brakecli.solver.records import Layer

_CLOSED_FORM, _EXACT, _MIDPOINT = map(list(EVALUATORS).index, ("closed-form", "exact", "midpoint"))


@kernel
def evaluate(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """Fill `layer.contact` for the shoe at (x, y), by the layer's evaluator.

    It is inlined, and each entry has a copy of its own: a process uses the first copy of a function that it loads,
    and that of another entry may add up heights in another order.
    """
    if layer.evaluator == _CLOSED_FORM:
        closed_form.evaluate(x, y, layer, tables, scratch)
    elif layer.evaluator == _EXACT:
        exact.evaluate(x, y, layer, tables, scratch)
    elif layer.evaluator == _MIDPOINT:
        midpoint.evaluate(x, y, layer, tables, scratch)
    else:
        auto.evaluate(x, y, layer, tables, scratch)


@entry(None, float, float, Layer, VECTOR, VECTOR)
def fill(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """`evaluate`, for Python."""
    evaluate(x, y, layer, tables, scratch)
