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

# s, measured with `make cases` on one core, as all numbers of this file that give no other reason
_STEP_WORK = 1.5e-7
_OWN_STEP_WORK = 4e-6  # of a scheme that finds its steps itself
FINEST = 1e-13
"""Least tolerance of the steps of such a scheme."""


class Work(NamedTuple):
    """The steps of a run, and the work of all runs that a case needs."""

    steps: int
    amount: float


def work_of(system: System) -> Work:
    """A rough count of the work of a case, without its file and its verdict."""
    method = system.method
    pairs = 0.0 if system.window_rows else float(len(system.wheel.g) ** 2)
    if not method.own_steps:
        per_step = _STEP_WORK * (1.0 + pairs / 20.0)  # in full contact, where so many take as long as the rest
        if system.finds_patches or system.nodes:
            per_step = _STEP_WORK + 1.5 * evaluation_work(system)
        window = _window_work(system, system.sampled_duration * system.fastest_belt)
        return Work(system.steps, system.steps * per_step + window)
    c = system.coefficients
    alone = method.step is not None
    if method.row.exact:
        return Work(system.steps, system.steps * 1e-7)  # with events
    # That of steps is far below that of histories.
    tolerance = method.tolerance if alone else max(min(1e-5 * method.tolerance, 1e-8), FINEST)
    fastest = system.natural_frequencies[1]
    start = system.initial
    bound = c.c_xx + c.c_yy + 2.0 * abs(c.c_xy) + (1.0 + c.phi) * system.contact_stiffness  # as a step is limited
    # 25 steps of order 8 to a period at 1e-10, and eight to a passing wave; dashpots shorten them to 4 decay times
    rate = max(fastest * 25.0 * (1e-10 / tolerance) ** (1.0 / 8.0), 0.5 * math.sqrt(bound / c.m))
    swing = 2.0 * math.pi * fastest * (abs(start.x) + abs(start.y)) + abs(start.vx) + abs(start.vy)
    turns = float(max(system.wheel.turns, default=0.0))
    rate += 8.0 * turns * (system.fastest_belt + swing) + (c.b_xx + c.b_yy) / 4.0 / c.m
    steps = 1 + int(min(system.sampled_duration * rate, 1e300))
    per_step = _OWN_STEP_WORK * (1.0 + pairs / 80.0)
    if system.finds_patches:
        # Rough surfaces that the load presses together are seldom open in part; a step takes 27 evaluations there.
        heights = float(np.abs(system.shoe.g).sum() + np.abs(system.wheel.g).sum())
        least_load = float(np.abs(values(system.load)).min())
        open_part = 0.01 if heights * (c.c_yy + system.contact_stiffness) < least_load else 0.12
        per_step += 27.0 * open_part * evaluation_work(system)
    return Work(steps, (1.0 if alone else 1.6) * steps * per_step)  # more runs, where histories keep a tolerance


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
    histories = 2.0 if system.method.row.exact else 4.0  # one while it is joined; two with what compares them
    return histories * 8.0 * len(HISTORY) * system.samples


def stability_work(system: System) -> float:
    """The work of finding steady sliding at every friction coefficient of `stability`."""
    tried = np.linspace(0.0, LARGEST_FRICTION, FRICTIONS).tolist()
    if system.belt_speed == 0.0 or not any(_opens(system, phi) for phi in tried):
        return 0.0
    return (TABLE + 6.0) * _average_work(system)  # some at each place of the wheel, to find steady sliding


def table_work(system: System) -> float:
    """The work of filling the tables of the contact, which very many waves make long."""
    return 4e-9 * system.table_bytes


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
        return waves * terms * (2.5e-8 + 5e-10 * terms)  # per harmonic, and per pair of them
    waves = 3 if system.window_rows and not summed else len(system.wheel.g)  # a window takes as long as three
    return system.nodes * (1.2e-9 + 1e-10 * waves)


def _window_work(system: System, travel: float) -> float:
    """The work of filling the window while the wheel travels so far (m)."""
    points = system.nodes * system.window_rows * (1.0 + travel / (2.0 * system.half_length))
    return points * len(system.wheel.g) * 1.5e-10
