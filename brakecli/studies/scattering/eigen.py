"""Samples by eigenvalues: growth of steady sliding, its frequency, and the critical friction coefficient."""

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.modes import Mode, modes
from brakecli.analysis.stability.report import critical_friction
from brakecli.case.system import system_of
from brakecli.errors import BrakecliError, CaseError, Problem
from brakecli.solver.integrate import Counted
from brakecli.solver.steady_sliding import UNPRESSED, sliding
from brakecli.solver.system import System
from brakecli.studies.runs.limits import within_range
from brakecli.studies.sweeps.driver import TaskQueue
from brakecli.studies.sweeps.plan import Plan
from brakecli.studies.sweeps.workers.task import Compute, Engine

ASKED = np.dtype([("growth_rate", "f8"), ("frequency", "f8"), ("critical_friction", "f8"), ("reason", "S160")])
"""Answers of a sample: growth (1/s) and frequency (Hz) of the mode that counts, and φ; NaN where it failed."""


def asking(plan: Plan, band: tuple[float, ...] | None) -> Compute:
    """What workers compute."""
    return partial(_compute, plan, band)


def ask(engine: Engine, count: int, progress: Counted) -> NDArray[np.void]:
    """The answers of all samples, in their order."""
    answers = np.zeros(count, ASKED)
    finished = np.zeros(count, np.bool_)
    queue = TaskQueue(finished, None, workers=engine.workers)
    for task, records, seconds, failure in engine.run(queue.next_task):
        if task is None:
            continue
        if records is None:
            if not queue.retry(task):
                rows = slice(task.first, task.first + task.size)
                answers[rows] = _failed(failure)
                finished[rows] = True
            continue
        queue.note_time(task, seconds)
        rows = slice(task.first, task.first + task.size)
        answers[rows] = np.frombuffer(records, ASKED)
        finished[rows] = True
        progress("shoes", int(finished.sum()), count)
    if not finished.all():
        raise BrakecliError("samples are missing; run the same command again")
    return answers


def _compute(plan: Plan, band: tuple[float, ...] | None, first: int, count: int) -> bytes:
    answers = np.zeros(count, ASKED)
    for index in range(count):
        try:
            with within_range():
                answers[index] = (*answer_of(system_of(plan.case(plan.settings(first + index))), band), b"")
        except BrakecliError as error:
            answers[index] = _failed(str(error))
    return answers.tobytes()


def _failed(reason: str) -> tuple[float, float, float, bytes]:
    return math.nan, math.nan, math.nan, reason.encode()[:160].decode(errors="ignore").encode()


def answer_of(system: System, band: tuple[float, ...] | None) -> tuple[float, float, float]:
    """Growth, frequency and critical friction; raises CaseError where nothing slides.

    A shoe that locks itself does not slide steadily: it is unstable, by what full contact makes of it.
    """
    c = system.coefficients
    belt = system.belt_speed
    if belt == 0.0:
        raise CaseError([Problem(("wheel",), "the wheel stands, so that nothing slides", "give it a speed")])
    equilibrium = sliding(system)
    k = equilibrium.stiffness if equilibrium else system.contact_stiffness
    mode = _counting(modes(c, k, c.grip(belt)), band)
    locks = system.load_at_start > 0.0 and mode.growth > 0.0
    if not (equilibrium.is_pressed(system.load_at_start) if equilibrium else locks):
        raise CaseError([Problem(("load",), UNPRESSED, "press the shoe onto the wheel")])
    critical = critical_friction(system, k)
    return mode.growth, mode.frequency, math.nan if critical is None else critical


def _counting(candidates: list[Mode], band: tuple[float, ...] | None) -> Mode:
    """The mode that grows fastest; of those in the band where one of them grows."""
    low, high = band or (0.0, math.inf)
    squeals = [
        mode for mode in candidates if mode.growth > 0.0 and mode.frequency > 0.0 and low <= mode.frequency <= high
    ]
    return squeals[0] if squeals else candidates[0]
