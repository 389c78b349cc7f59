"""A case in memory: its motion, what is to be judged of it, and its verdict."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.fate import Fate
from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.context import context
from brakecli.analysis.regime.decision import Thresholds
from brakecli.analysis.regime.measure import Given
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.stability.linear import Theory
from brakecli.results.field import LARGEST
from brakecli.solver.history import History, array_history
from brakecli.solver.integrate import Motion, Progress, Sink, solve
from brakecli.solver.system import System
from brakecli.solver.tangent import Exponent
from brakecli.solver.track import UNTRACKED, Track
from brakecli.studies.runs.against import exponent_of
from brakecli.studies.runs.certificate import Certificate
from brakecli.studies.runs.settled import Judged
from brakecli.studies.runs.tolerance import certify
from brakecli.studies.runs.without_waves import without_waves

_DEFAULT = Thresholds()


def inputs_of(
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

    def continued() -> Fate:
        last = history.samples - 1
        state = [float(history.read(name, last, last + 1)[0]) for name in ("x", "y", "vx", "vy")]
        return without_waves(system, np.array(state))

    return Given(history, context(system, theory), exponent, track or UNTRACKED, continued, failure or "")


def to_judge(system: System) -> System:
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
        motion = solve(system, sink=sink, progress=progress)
        if system.tangents and motion.track and not system.method.own_steps and not motion.work.failed:
            motion = replace(motion, exponent=exponent_of(system, motion.track))
        return motion, None
    certified = certify(system, progress)
    if sink is not None:
        sink(certified.motion.rows)
    return certified


def verdict_in_memory(motion: Motion, system: System, thresholds: Thresholds = _DEFAULT) -> Verdict:
    """The verdict on a motion whose samples are in memory."""
    return classify([in_memory(motion, system)], thresholds)[0]


def in_memory(motion: Motion, system: System, theory: Theory | None = None) -> Given:
    """A motion to be judged whose samples are in memory; raises FloatingPointError where one overflows."""
    refuse_overflow(motion.rows)
    history = array_history(system.interval, motion.rows)
    return inputs_of(history, system, motion.work.failure_sentence, motion.exponent, motion.track, theory)


def judged_in_memory(system: System, progress: Progress) -> Judged[Motion]:
    """The motion of a system, in memory, with its verdict and its certificate."""
    motion, certificate = motion_of(system, progress)
    return Judged(verdict_in_memory(motion, system), motion, certificate)


def refuse_overflow(rows: NDArray[np.float64]) -> None:
    """Raise FloatingPointError where a sample is not finite, or so large that no result holds it."""
    if not (np.abs(rows) <= LARGEST).all():  # the loop bounds only the motion itself
        raise FloatingPointError("a force overflows")
