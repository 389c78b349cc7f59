"""The verdict on a motion, with what is asked of its case."""

import numpy as np

from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.context import context
from brakecli.analysis.regime.measure import Continued
from brakecli.analysis.regime.table import Thresholds
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.stability.linear import Theory
from brakecli.solver.history import History
from brakecli.solver.system import System
from brakecli.solver.tangent import Exponent
from brakecli.solver.track import UNTRACKED, Track

DEFAULT = Thresholds()


def verdict_on(
    history: History,
    system: System,
    failure: str | None,
    exponent: Exponent | None = None,
    track: Track | None = None,
    thresholds: Thresholds = DEFAULT,
    *,
    theory: Theory | None = None,
    in_full: bool = True,
) -> Verdict:
    """The verdict on a motion; where a row may need it, it is continued on the smooth wheel.

    `theory` is given where it is known already.
    """

    def continued() -> Continued:
        from brakecli.runs.without_waves import without_waves  # kernels that a linear motion does not need

        last = history.samples - 1
        state = [float(history.read(name, last, last + 1)[0]) for name in ("x", "y", "vx", "vy")]
        return without_waves(system, np.array(state))

    return classify(
        history,
        context(system, theory),
        thresholds,
        exponent=exponent,
        track=track or UNTRACKED,
        continued=continued,
        failure=failure,
        in_full=in_full,
    )
