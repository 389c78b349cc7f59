"""Work that is counted before anything runs: steps, evaluations of the contact, bytes.

It decides which evaluator is cheaper, how long a run that checks advice may be, and whether workers are worth
their start. Its unit is what a core of a usual machine does in a second; no clock is asked, and nobody is told.
"""

import math
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from brakecli.analysis.stability.report import FRICTIONS, LARGEST_FRICTION
from brakecli.errors import CaseError
from brakecli.solver import integrate
from brakecli.solver.quantities import HISTORY
from brakecli.solver.schedules import values
from brakecli.solver.steady_sliding import PLACES, TABLE, averaged_length, fills_window, steady_sliding
from brakecli.solver.system import System

# Measured with `make cases` on one core, in seconds.
_STEP_WORK = 1.5e-7
_NODE_WORK = 1.2e-9  # per node, and again per node and wave of the wheel:
_NODE_WAVE_WORK = 1e-10
# with a window: as many waves; to fill it, per point and wave
_WINDOW_WAVES = 3
_POINT_WAVE_WORK = 1.5e-10
# exact, for each wave on the pad: per harmonic, and per pair of them
_TERM_WORK = 2.5e-8
_PAIR_WORK = 5e-10
# of waves in full contact, which take as long as the rest of a step
_PAIRS = 20.0
_OWN_PAIRS = 80.0
_EVALUATIONS = 1.5  # of the contact in a step
# in a period, of a scheme that finds them itself, at this tolerance
_OWN_STEPS = 25.0
_AT = 1e-10
_ORDER = 8  # of these steps
# such steps for a passing wave, and decay rate times such a step
_STEPS_PER_WAVE = 8.0
_DECAY = 4.0
# tolerance of steps over that of histories, and its bounds
_FINER = 1e-5
FINEST = 1e-13
_COARSEST = 1e-8
_RUNS = 1.6  # where histories keep a tolerance
# part of the time in which a pad is open in part: under load, and elsewhere
_PRESSED = 0.01
_PLAYS = 0.12
_OWN_STEP_WORK = 4e-6
_OWN_EVALUATIONS = 27.0
_EXACT_STEP_WORK = 1e-7  # events included
_START_EVALUATIONS = 6.0  # at each place of the wheel, to find steady sliding
_TABLE_WORK = 4e-9  # to fill a byte of the tables of the contact
# histories: two with what compares them, or one while it is joined
_HELD = 4.0
_HELD_EXACT = 2.0


class Work(NamedTuple):
    """The steps of a run, and the work of all runs that a case needs."""

    steps: int
    amount: float


def work_of(system: System) -> Work:
    """A rough count of the work of a case, without its file and its verdict."""
    method = system.method
    pairs = 0.0 if system.window_rows else float(len(system.wheel.g) ** 2)
    if not method.own_steps:
        per_step = _STEP_WORK * (1.0 + pairs / _PAIRS)
        if system.finds_patches or system.nodes:
            per_step = _STEP_WORK + _EVALUATIONS * evaluation_work(system)
        window = _window_work(system, system.sampled_duration * system.fastest_belt)
        return Work(system.steps, system.steps * per_step + window)
    c = system.coefficients
    alone = method.step is not None
    if method.row.exact:
        return Work(system.steps, system.steps * _EXACT_STEP_WORK)
    tolerance = method.tolerance if alone else max(min(_FINER * method.tolerance, _COARSEST), FINEST)
    fastest = system.natural_frequencies[1]
    start = system.initial
    bound = c.c_xx + c.c_yy + 2.0 * abs(c.c_xy) + (1.0 + c.phi) * system.contact_stiffness  # as a step is limited
    rate = max(fastest * _OWN_STEPS * (_AT / tolerance) ** (1.0 / _ORDER), 0.5 * math.sqrt(bound / c.m))
    swing = 2.0 * math.pi * fastest * (abs(start.x) + abs(start.y)) + abs(start.vx) + abs(start.vy)
    turns = float(max(system.wheel.turns, default=0.0))
    rate += _STEPS_PER_WAVE * turns * (system.fastest_belt + swing) + (c.b_xx + c.b_yy) / _DECAY / c.m
    steps = 1 + int(min(system.sampled_duration * rate, 1e300))
    per_step = _OWN_STEP_WORK * (1.0 + pairs / _OWN_PAIRS)
    if system.finds_patches:
        # Rough surfaces that the load presses together are seldom open in part.
        heights = float(np.abs(system.shoe.g).sum() + np.abs(system.wheel.g).sum())
        least_load = float(np.abs(values(system.load)).min())
        open_part = _PRESSED if heights * (c.c_yy + system.contact_stiffness) < least_load else _PLAYS
        per_step += _OWN_EVALUATIONS * open_part * evaluation_work(system)
    return Work(steps, (1.0 if alone else _RUNS) * steps * per_step)


def work_done(system: System, done: integrate.Work) -> float:
    """The work of a run that was made: of its steps, and of the contact in those that no closed form took."""
    per_step = _OWN_STEP_WORK if system.method.own_steps else _STEP_WORK
    taken = sum(done.evaluators.values())
    open_part = 1.0 - done.evaluators.get("closed-form", 0) / max(taken, 1)
    return per_step * done.steps + open_part * done.contact_evaluations * evaluation_work(system)


def held_bytes(system: System) -> float:
    """Memory for the histories that are held to keep a tolerance; 0 with a step, whose samples go to the file."""
    if system.method.step is not None:
        return 0.0
    return (_HELD_EXACT if system.method.row.exact else _HELD) * 8.0 * len(HISTORY) * system.samples


def stability_work(system: System) -> float:
    """The work of finding steady sliding at every friction coefficient of `stability`."""
    tried = np.linspace(0.0, LARGEST_FRICTION, FRICTIONS).tolist()
    if system.belt_speed == 0.0 or not any(_opens(system, phi) for phi in tried):
        return 0.0
    return (TABLE + _START_EVALUATIONS) * _average_work(system)


def table_work(system: System) -> float:
    """The work of filling the tables of the contact, which very many waves make long."""
    return _TABLE_WORK * system.table_bytes


def _average_work(system: System) -> float:
    """The work of the mean contact at one height."""
    if not fills_window(system):
        return (PLACES if len(system.wheel.g) else 1) * evaluation_work(system, summed=True)
    return PLACES * evaluation_work(system) + _window_work(system, averaged_length(system))


def _opens(system: System, phi: float) -> bool:
    """Whether the pad may touch in part in steady sliding."""
    if system.smooth:
        return False
    pad = system.pad.constants
    opens = False

    def mean(y: float) -> tuple[float, float, float]:
        nonlocal opens
        opens = opens or y > pad.full_up_to
        return max(-system.contact_stiffness * (y + pad.shoe_mean), 0.0), 0.0, 0.0

    with suppress(CaseError):
        steady_sliding(system, phi=phi, mean=mean)
    return opens


def evaluation_work(system: System, *, summed: bool = False) -> float:
    """The work of one evaluation of a contact that is open in part.

    `summed`: without a window.
    """
    if system.finds_patches:
        terms = len(system.shoe.g) + len(system.wheel.g)
        waves = 1.0 + 2.0 * system.half_length * system.most_turns
        return waves * terms * (_TERM_WORK + _PAIR_WORK * terms)
    waves = _WINDOW_WAVES if system.window_rows and not summed else len(system.wheel.g)
    return system.nodes * (_NODE_WORK + _NODE_WAVE_WORK * waves)


def _window_work(system: System, travel: float) -> float:
    """The work of filling the window while the wheel travels so far (m)."""
    points = system.nodes * system.window_rows * (1.0 + travel / (2.0 * system.half_length))
    return points * len(system.wheel.g) * _POINT_WAVE_WORK
