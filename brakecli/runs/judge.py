"""A case in memory: its motion, and the verdict on a motion, with what is asked of its case."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.context import context
from brakecli.analysis.regime.measure import Continued
from brakecli.analysis.regime.table import Thresholds
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.stability.linear import Theory
from brakecli.runs.certificate import Certificate
from brakecli.runs.settled import Judged
from brakecli.runs.tolerance import certify
from brakecli.solver.history import History, array_history
from brakecli.solver.motion import Motion, Progress, Sink, solve
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


def asked(system: System) -> System:
    """The same, whose motion carries along what verdicts ask for: events; a disturbance where waves shake it."""
    shaken = system.steady and system.belt_speed != 0.0 and system.wheel.g.size > 0
    return replace(system, tracked=True, tangents=shaken)


def motion_of(
    system: System, progress: Progress = lambda steps: None, sink: Sink | None = None
) -> tuple[Motion, Certificate | None]:
    """The motion of a system: at the step of its method, or to its tolerance, with a certificate.

    Samples go to `sink` where there is one.
    """
    if system.method.step is not None:
        return solve(system, sink=sink, progress=progress), None
    certified = certify(system, progress)
    if sink is not None:
        sink(certified.motion.rows)
    return certified


def verdict_in_memory(
    motion: Motion,
    system: System,
    thresholds: Thresholds = DEFAULT,
    *,
    theory: Theory | None = None,
    in_full: bool = True,
) -> Verdict:
    """The verdict on a motion whose samples are in memory."""
    refuse_overflow(motion.rows)
    history = array_history(system.interval, motion.rows)
    failure, known = motion.work.failure_sentence, (motion.exponent, motion.track)
    return verdict_on(history, system, failure, *known, thresholds, theory=theory, in_full=in_full)


def judged_in_memory(system: System, progress: Progress) -> Judged[Motion]:
    """The motion of a system, in memory, with its verdict and its certificate."""
    motion, certificate = motion_of(system, progress)
    return Judged(verdict_in_memory(motion, system), motion, certificate)


def refuse_overflow(rows: NDArray[np.float64]) -> None:
    """Raise FloatingPointError where a sample is not finite."""
    if not np.isfinite(rows).all():  # the loop bounds only the motion itself
        raise FloatingPointError("a force overflows")
