"""A second run of a case, which decides whether friction or the roughness keeps its vibration up."""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from brakecli.analysis.regime.evidence import Part, follows
from brakecli.analysis.regime.forced import GROWN
from brakecli.analysis.regime.of_run import context, numbers_of, stored_run, verdict_on
from brakecli.analysis.regime.verdict import Excitation, Feeds, Regime, Thresholds
from brakecli.analysis.stability.modes import crossings, growth
from brakecli.errors import CaseError
from brakecli.runs.cost import duration_text
from brakecli.runs.limits import check, refuse
from brakecli.runs.run import motion_of
from brakecli.solver.history import History, array_history
from brakecli.solver.motion import Counted, Progress
from brakecli.solver.roughness import surface
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.solver.system import Initial, System

_REDUCED = 1.0 / 3.0  # of the critical friction: far below it also where surfaces that open move it
_LOST = 4.0  # powers of e by which what is not forced has decayed
_LONGER = 4.0  # times as long, so that it loses its start, and a vibration that dies becomes linear
_REMAINS, _VANISHES = 0.7, 0.2  # part of the level of the first run
_HARDLY = 0.8  # part of it beyond which a second run hardly decays, as the first may
_HALVED = math.log(2.0) / 3.5  # decay rate times duration of the first, where the second ends at half its level


@dataclass(frozen=True)
class Second:
    """What is run a second time, and which question it answers."""

    system: System
    change: str
    smooth: bool  # the same without the wheel's roughness, from where the first has ended
    friction: float = 1.0  # part of that of the first run
    growth: float = 0.0  # 1/s, of a small disturbance where the pad touches as it does in the first run


def classify_twice(
    path: Path, thresholds: Thresholds, say: Callable[[str], None], progress: Counted
) -> dict[str, Any]:
    """The verdict on a stored run as `classify_result` gives it, by a second run where one is asked for."""
    with stored_run(path) as (system, history, attributes):
        failure = attributes.get("failure")
        verdict = verdict_on(history, system, failure, thresholds)
        if not verdict.decision.second_run:
            say("--second-run: this verdict asks for none; nothing was run")
            return numbers_of(verdict, failure)
        second = second_system(system, history)
        found = check(second.system)
        refuse(found)
        say(f"second run, {second.change}, four times as long: about {duration_text(found.seconds)}")
        feeds, sticks, shown = compared(second, history, lambda done: progress("steps", done, second.system.steps))
        verdict = verdict_on(history, system, failure, thresholds, feeds, sticks)
        decision, notes = verdict.decision._replace(second_run=False), {**verdict.notes, "second_run": shown}
        return numbers_of(replace(verdict, decision=decision, notes=notes), failure)


def second_system(system: System, history: History) -> Second:
    """What has to be run again.

    Where sliding is stable, also in full contact, friction alone can keep only a large vibration up: the second
    run goes on from the end of the first, without the roughness of the wheel. Otherwise it has less friction than
    makes sliding unstable.
    """
    longer = replace(system, duration=_LONGER * system.duration)
    belt, c, theory = system.belt_speed, system.coefficients, (known := context(system)).linear()
    if known.growth() < 0.0 and (theory is None or theory.direction < 0):
        last = history.samples - 1
        x, y, vx, vy = (float(history.read(name, last, last + 1)[0]) for name in ("x", "y", "vx", "vy"))
        start = Initial(x, y, vx, vy)
        smooth = replace(longer, wheel=surface(), initial=start)
        return Second(smooth, "without the roughness of the wheel, from the end of this one", smooth=True)
    stiffnesses = [system.contact_stiffness]
    with suppress(CaseError):
        stiffnesses.append(steady_sliding(system, belt=belt).stiffness)
    lost = [crossing.friction for stiffness in stiffnesses for crossing in crossings(c, stiffness, belt)]
    phi = min([c.phi, *lost])
    less = replace(longer, coefficients=c._replace(phi=_REDUCED * phi))
    change = f"with a friction coefficient of {_REDUCED * phi:.3g}, at which sliding is stable"
    touching = Part(history, history.samples // 2, history.samples).mean("contact_fraction")
    rate = growth(c, touching * system.contact_stiffness, math.copysign(c.phi, belt))
    return Second(less, change, smooth=False, friction=_REDUCED * phi / c.phi, growth=rate)


def compared(
    second: Second, history: History, progress: Progress = lambda steps: None
) -> tuple[Feeds, float, str]:
    """Run it in memory; who keeps the vibration up, in which part of the cycles it sticks, and what shows that."""
    motion, _ = motion_of(second.system, progress)
    if motion.work.failed:
        return Feeds.UNKNOWN, 0.0, f"the second run failed: {motion.work.failure_sentence}"
    again = array_history(second.system.interval, motion.rows)
    part, duration = level(again) / level(history), history.samples * history.interval
    text = f"in the second run, {second.change}, vx has {part:.2g} times the level"
    verdict, needed = verdict_on(again, second.system, None), _LONGER * duration
    if not second.smooth:
        lost = -context(second.system).growth() * second.system.duration > _LOST  # what is left of the start
        lost &= verdict.excitation is not Excitation.SELF_EXCITED
        remains = part >= _REMAINS and (lost or verdict.excitation is Excitation.FORCED)
        if remains and 0.0 < second.growth * duration < GROWN:  # what it has not shown yet, less friction cannot
            own = f"the shoe's own vibration grows at {second.growth:.3g} 1/s"
            text = f"{text}, but in the first sliding is unstable: {own}"
            return _told(Feeds.UNKNOWN, 0.0, text, 1.01 * GROWN / second.growth)
        waves, end = context(second.system).waves, Part(history, history.samples // 2, history.samples)
        least = _VANISHES  # what moves as the waves do may be forced along x, and falls as friction does
        vanishes = part <= (min(least, 0.5 * second.friction) if follows(end, waves) else least)
        feeds = Feeds.ROUGHNESS if remains else Feeds.FRICTION if vanishes else Feeds.UNKNOWN
        return _told(feeds, 0.0, text, needed, ", or sweep friction.coefficient to see where the level sets in")
    text, decays = f"{text}: {verdict.decision.reason}", verdict.regime is Regime.DAMPED
    if decays and part >= _HARDLY:
        text += ", too slowly to show whether the first does"
        needed = max(needed, _HALVED / abs(verdict.growth_rate or math.inf))
    elif decays and _friction_feeds(history):
        both = "but in the first friction gives energy and the roughness takes it: neither keeps it up alone"
        return Feeds.UNKNOWN, 0.0, f"{text}, {both}"
    lasts = verdict.settled and verdict.excitation is Excitation.SELF_EXCITED and part >= _REMAINS
    feeds = Feeds.ROUGHNESS if decays and part < _HARDLY else Feeds.FRICTION if lasts else Feeds.UNKNOWN
    return _told(feeds, verdict.evidence.get("stick_cycles", 0.0), text, needed)


def _told(feeds: Feeds, sticks: float, text: str, needed: float, other: str = "") -> tuple[Feeds, float, str]:
    """What a second run has shown; where that decides nothing, with the duration (s) that the first needs."""
    undecided = feeds is Feeds.UNKNOWN
    return feeds, sticks, f"{text}; run at least {needed:.3g} s and decide again{other}" if undecided else text


def _friction_feeds(history: History) -> bool:
    """Whether friction surely gives energy to the vibration, and the roughness takes it."""
    half = Part(history, history.samples // 2, history.samples)
    (gives, off), (takes, off_too) = half.power("friction_force", "vx"), half.power("normal_force", "vy")
    return gives > 2.0 * off and takes < -2.0 * off_too


def level(history: History) -> float:
    """Standard deviation of vx in the last quarter, m/s."""
    return float(np.std(history.read("vx", 3 * history.samples // 4, history.samples)))
