"""What is to be judged of a motion, with what is asked of its case."""

import numpy as np

from brakecli.analysis.regime.context import context
from brakecli.analysis.regime.measure import Continued, Given
from brakecli.analysis.stability.linear import Theory
from brakecli.solver.history import History
from brakecli.solver.system import System
from brakecli.solver.tangent import Exponent
from brakecli.solver.track import UNTRACKED, Track


def given(
    history: History,
    system: System,
    failure: str | None,
    exponent: Exponent | None = None,
    track: Track | None = None,
    theory: Theory | None = None,
) -> Given:
    """What is known of a motion that is to be judged; `theory` is given where it is known already.

    Where a row of the verdict may need it, the motion is continued on the smooth wheel.
    """

    def continued() -> Continued:
        from brakecli.runs.without_waves import without_waves  # kernels that a linear motion does not need

        last = history.samples - 1
        state = [float(history.read(name, last, last + 1)[0]) for name in ("x", "y", "vx", "vy")]
        return without_waves(system, np.array(state))

    return Given(history, context(system, theory), exponent, track or UNTRACKED, continued, failure or "")
