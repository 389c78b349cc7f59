"""The cheapest evaluator that is good enough, chosen anew at each evaluation."""

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.compile import EVALUATE, kernel
from brakecli.solver.contact.closed_form import CLEAR, FULL, clear, coverage, full_contact
from brakecli.solver.contact.midpoint import evaluate as midpoint


@kernel(EVALUATE)
def evaluate(
    x: float, y: float, angles: NDArray[np.float64], pad: NDArray[np.float64], contact: NDArray[np.float64]
) -> None:
    """Closed form where a bound proves the pad to touch everywhere or nowhere, else the midpoint rule."""
    covered = coverage(y, pad)
    if covered == FULL:
        full_contact(x, y, angles, pad, contact)
    elif covered == CLEAR:
        clear(x, y, angles, pad, contact)
    else:
        midpoint(x, y, angles, pad, contact)
