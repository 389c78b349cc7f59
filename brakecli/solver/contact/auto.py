"""The cheapest evaluator that is good enough, chosen anew at each evaluation."""

from brakecli.solver.compile import kernel
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.contact.closed_form import CLEAR, FULL, clear, coverage, full_contact
from brakecli.solver.contact.midpoint import evaluate as midpoint
from brakecli.solver.records import EVALUATE, Layer


@kernel(EVALUATE)
def evaluate(x: float, y: float, layer: Layer) -> None:
    """Closed form where a bound proves the pad to touch everywhere or nowhere, otherwise the midpoint rule.

    On a pad that touches everywhere it has the same force, and with a window it takes less time.
    """
    covered = coverage(y, layer.pad)
    if covered == FULL and layer.window.rows == 0:
        full_contact(x, y, layer)
    elif covered == CLEAR:
        clear(layer.contact)
    else:
        midpoint(x, y, layer)
        if covered == FULL:  # their sum is the closed form
            layer.contact.kind = CLOSED_FORM
