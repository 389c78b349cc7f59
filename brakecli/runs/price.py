"""What a case costs: its beginning is run, each time longer, until that takes its time; the last part is judged.

Formulas cannot know how often friction and patches cut the steps, how many runs keep a tolerance, nor what a
verdict takes.
"""

from contextlib import suppress
from dataclasses import replace
from time import process_time
from typing import NamedTuple

from brakecli.analysis.over_time import over_time
from brakecli.runs.cost import Price, evaluation_seconds, guessed, start_seconds
from brakecli.runs.judge import asked, motion_of, verdict_in_memory
from brakecli.solver.history import array_history
from brakecli.solver.integrate import Motion
from brakecli.solver.system import MOST_STEPS, System

SECONDS = 0.15
"""Processor time (s) after which a part is given up. Other programs do not change it."""
ENOUGH = 0.05
"""Time (s) of a part from which on no longer one is run: a third of what is allowed, as it may be run twice."""
AIM = 2.0 * ENOUGH
"""Time (s) that the next part is to take, so that it is at least twice as long."""
FIRST = 5e-4
"""Guessed time (s) of the first part: a guess may be a hundred times too small."""
SHORTER = 16.0
"""By what the first part becomes shorter where it is given up; a choice."""
LONGER = 32.0
"""By what a part is longer than the one before, at most; a choice: a short one may only have started."""
MOST_EXACT = 0.02
MOST_AT_NODES = 2e-3
"""Guessed time (s) of an evaluation of the contact, exact and by nodes, beyond which no step is tried. Choices:
a part takes many."""
FINER = 1.5
"""Time of the rest over that by a straight line, where a tolerance is kept: long runs may take finer steps."""
SLOWER = 2.0
"""Seconds for a second of motion at the end of the longest part, over those before it, from which on the rest may
take more yet."""


class _Part(NamedTuple):
    """The beginning of a run: its length and its processor time (s), without its verdict, and its motion.

    There is no motion where it was given up.
    """

    length: float
    seconds: float
    motion: Motion | None = None


def measured(system: System) -> Price | None:
    """The cost of a case by runs of its beginning, or None where a single step may take too long."""
    if evaluation_seconds(system) > (MOST_EXACT if system.finds_patches else MOST_AT_NODES):
        return None
    if (start := start_seconds(system)) <= SECONDS:
        return _begun(system)
    elsewhere = replace(system, initial=replace(system.initial, from_equilibrium=False))
    begun = _begun(elsewhere)  # it moves as fast
    return begun._replace(seconds=start + begun.seconds)


def _begun(system: System) -> Price:
    """The cost of a case that starts soon."""
    method = system.method
    duration = system.sampled_duration
    guess = guessed(system)
    length = duration * min(1.0, FIRST / max(guess.seconds, FIRST))
    before = _Part(0.0, 0.0)
    _ran(system, length)  # kernels are loaded first
    while True:
        part = _ran(system, length)
        if part.seconds > ENOUGH:  # kernels may have been loaded
            part = min(part, _ran(system, length), key=lambda each: each.seconds / max(each.length, 1e-300))
        if part.motion and (length >= duration or part.motion.work.failed):
            return Price(part.motion.work.steps, part.seconds + _judging(part.motion))
        unknown = part.motion is None and part.length <= before.length
        if unknown and before.motion is None and length > duration / MOST_STEPS:
            length /= SHORTER
            continue
        if part.motion is None or part.seconds >= ENOUGH:
            break
        before = part
        length = min(length * min(AIM / max(part.seconds, 1e-9), LONGER), duration)
    reached = length if unknown else part.length
    rate = max(part.seconds - before.seconds, 0.0) / (reached - before.length)
    rate *= FINER if method.step is None and not method.row.exact else 1.0
    slower = rate * before.length > SLOWER * before.seconds
    price = Price(guess.steps, part.seconds + rate * (duration - reached), unknown or slower)
    if not (motion := part.motion or before.motion):
        return price
    steps = guess.steps
    if not method.row.exact and (method.own_steps or method.step is None):
        steps = int(float(f"{motion.work.steps * duration / motion.system.sampled_duration:.2g}"))
    closed = method.own_steps and not system.smooth and set(motion.work.evaluators) == {"closed-form"}
    return Price(steps, price.seconds + _judging(motion), price.at_least or closed)


def _ran(system: System, length: float) -> _Part:
    """A part so long (s); of one that is given up, as far as its only run has come."""
    part = asked(replace(system, duration=length, interval=min(length, system.interval)))
    begin = process_time()
    reached = 0.0
    motion = None

    def tell(done: int) -> None:
        nonlocal reached
        reached = 0.0 if part.method.step is None else done * part.step
        if process_time() - begin > SECONDS:
            raise TimeoutError

    with suppress(TimeoutError):
        motion, _ = motion_of(part, tell)
    return _Part(length if motion else reached, process_time() - begin, motion)


def _judging(motion: Motion) -> float:
    """Processor time (s) of the verdict, and of what changes with speed and load; kernels are loaded before."""
    for _ in range(2):
        begin = process_time()
        verdict_in_memory(motion, motion.system)
        over_time(array_history(motion.system.interval, motion.rows), motion.system)
    return process_time() - begin
