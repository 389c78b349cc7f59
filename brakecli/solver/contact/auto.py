"""The cheapest evaluator that is good enough, chosen anew at each evaluation."""

from brakecli.solver.arrays import Floats
from brakecli.solver.contact import CLOSED_FORM, EVALUATORS
from brakecli.solver.contact.cells import evaluate as cells
from brakecli.solver.contact.closed_form import CLEAR, FULL, PARTLY, clear, coverage, full_contact
from brakecli.solver.kernels import kernel
from brakecli.solver.records import Layer

_AUTO = list(EVALUATORS).index("auto")


@kernel
def evaluate(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """Closed form where a bound proves the pad to touch everywhere or nowhere, otherwise cells.

    On a pad that touches everywhere it has the same force, and with a window it takes less time. A layer that
    names cells takes these in any case.
    """
    covered = coverage(y, layer.pad) if layer.evaluator == _AUTO else PARTLY
    if covered == FULL and layer.window.rows == 0:
        full_contact(x, y, layer, tables, scratch)
    elif covered == CLEAR:
        clear(layer.contact)
    else:
        cells(x, y, layer, tables, scratch)
        if covered == FULL:  # their sum is the closed form
            layer.contact.kind = CLOSED_FORM
