"""The regime of the run in a result file, found from its history: what `brakecli classify RESULT.h5` does."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.evidence import Part
from brakecli.analysis.regime.linear import linear_theory
from brakecli.analysis.regime.over_time import over_time
from brakecli.analysis.regime.ripple import detuned, ripple
from brakecli.analysis.regime.spectra import forced_lines, subharmonics
from brakecli.analysis.regime.verdict import Context, Decision, Feeds, Thresholds, Verdict
from brakecli.analysis.stability.discrete import spectral_radius, without_damping
from brakecli.analysis.stability.modes import growth, is_undamped, locks_from, modes, slowest_of_cycles
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import CaseError, UnreadableResultError
from brakecli.files import fields
from brakecli.files.field import values_of
from brakecli.files.read import open_result
from brakecli.solver.history import History
from brakecli.solver.schedules import value_at
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.solver.system import System


def classify_result(path: Path, thresholds: Thresholds) -> dict[str, Any]:
    """Names and values of the verdict on a stored run; raises UnreadableResultError for anything else."""
    with stored_run(path) as (system, history, attributes):
        failure = attributes.get("failure")
        found = {"over_time": None if failure else over_time(history, system)}
        verdict = verdict_on(history, system, failure, thresholds)
        exponent = {field.name: attributes.get(field.name) for field in fields.EXPONENT}
        return {**numbers_of(verdict, failure), **exponent, "vibrations": fields.VIBRATIONS.read(found)}


@contextmanager
def stored_run(path: Path) -> Iterator[tuple[System, History, Mapping[str, Any]]]:
    """System, history and attributes of a stored run; raises UnreadableResultError for anything else."""
    with open_result(path, kind="run") as result:
        try:
            system = system_of(parse_case(result.text("resolved_toml"), str(path)).case)
        except (CaseError, KeyError) as error:
            raise UnreadableResultError(f"{path}: holds no case of this version; run its case again") from error
        time = result.variables("history").get("time")
        if time is None or time.shape[0] < 1:
            raise UnreadableResultError(f"{path}: has no history; run its case again")
        history = History(system.interval, time.shape[0], partial(result.read, "history"))
        yield system, history, result.attributes


def numbers_of(verdict: Verdict, failure: str | None) -> dict[str, Any]:
    """Names and values of a verdict as `--json` gives them."""
    return {**values_of(fields.VERDICT, {"verdict": verdict}), "failure": failure}


def verdict_on(
    history: History,
    system: System,
    failure: str | None,
    limits: Thresholds | None = None,
    feeds: Feeds = Feeds.UNKNOWN,
    sticks: float = 0.0,
    *,
    in_full: bool = True,
) -> Verdict:
    """The verdict on a motion; a run that has failed has none. `feeds`, `sticks`: what a second run has shown."""
    known = replace(context(system), feeds=feeds, sticks=sticks)
    verdict = classify(history, known, limits or Thresholds(), in_full=in_full)
    if not failure:
        return verdict
    verdict = replace(verdict, growth_rate=None, ringing_frequency=None, frequency=None, settled=False)
    failed = Decision(f"the run failed: {failure}")
    return replace(verdict, regime=failed.regime, excitation=failed.excitation, decision=failed, notes={})


def context(system: System) -> Context:
    """What the rules have to know of a system."""
    belt, c = float(value_at(system.belt, system.sampled_duration)), system.coefficients
    compression = float(np.abs(system.load["value"]).max()) / (c.c_yy + system.contact_stiffness)

    grip = math.copysign(c.phi, belt) if belt else 0.0

    @cache
    def stiffness() -> float:  # in the mean, for which nodes are good enough, and thirty times cheaper
        by_nodes = system.method.own_steps and system.finds_patches
        on_nodes = replace(system, method=replace(system.method, evaluator="midpoint")) if by_nodes else system
        try:
            return steady_sliding(on_nodes, belt=belt).stiffness
        except CaseError:  # none: a shoe that locks itself drifts away, by what full contact makes of it
            return system.contact_stiffness

    theory = cache(partial(linear_theory, system, belt))
    turns, highest = tuple(system.wheel.turns.tolist()), 0.5 / system.interval
    swings = np.abs(known.waves[:, 0]) if turns and (known := theory()) else np.ones(len(turns))
    waves = tuple((abs(belt) * turn, float(swing)) for turn, swing in zip(turns, swings, strict=True))
    fastest = compression * system.natural_frequencies[1]
    return Context(
        belt,
        radius=system.radius,
        step=0.0 if system.method.own_steps or system.method.step is None else system.step,
        steady=system.steady,
        forced=forced_lines(belt, turns, highest),
        subharmonics=partial(subharmonics, belt, turns, highest),
        waves=waves if belt else (),
        quiet=1e-9 * fastest,
        scale=fastest,
        frictionless=c.phi == 0.0,
        undamped=is_undamped(c),
        held=c.c_xx > 0.0,
        locks=limit if c.phi > (limit := locks_from(c, system.contact_stiffness, belt)) else None,
        touches=lambda: stiffness() > 0.0,
        settles=slowest_of_cycles(c),
        growth=lambda: growth(c, stiffness(), grip),
        modes=lambda: [each for k in (stiffness(), system.contact_stiffness) for each in modes(c, k, grip)],
        linear=theory,
        steadier=lambda: _steadier(system),
        ripple=lambda part, lines: ripple(system, belt, stiffness(), part, lines),
        detuned=lambda part, lines: detuned(system, belt, stiffness(), part, lines),
        powers=partial(_powers, system, belt),
    )


def _steadier(system: System) -> str:
    """What to do where no disturbance grows by the scheme at its step; empty where one does."""
    k, phi = system.contact_stiffness, system.coefficients.phi
    grows = system.method.own_steps or spectral_radius(system, k, phi) > 1.0
    return "" if grows else without_damping(system.method)


def _powers(system: System, belt: float, part: Part) -> dict[str, float]:
    """Mean powers (W) at constant U (m/s) and Q (N): the belt's, what becomes of it, and what is left."""
    c, sums = system.coefficients, np.zeros(4)
    for v_x, v_y, friction in zip(*map(part.pieces, ("vx", "vy", "friction_force")), strict=True):
        sums += (
            belt * friction.sum(),
            -float(friction @ (v_x - belt)),
            float(c.b_xx * v_x @ v_x + 2.0 * c.b_xy * v_x @ v_y + c.b_yy * v_y @ v_y),
            system.load_at_start * (c.sin_beta * v_x.sum() + c.cos_beta * v_y.sum()),
        )
    means = sums / (part.stop - part.start)
    names = ("power_belt", "power_friction", "power_dashpots", "power_load", "power_rest")
    return dict(zip(names, [*means.tolist(), float(np.subtract.reduce(means))], strict=True))
