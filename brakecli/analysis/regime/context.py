"""What the verdict has to know of the case behind a history."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from brakecli.analysis.regime.evidence import Stretch
from brakecli.analysis.regime.ripple import Ripple, detuned, ripple
from brakecli.analysis.regime.spectra import forced_lines
from brakecli.analysis.stability.discrete import spectral_radius, without_damping
from brakecli.analysis.stability.linear import Theory, theory_of
from brakecli.analysis.stability.modes import growth, is_undamped, locks_from, slowest_of_cycles
from brakecli.errors import CaseError
from brakecli.solver.schedules import value_at, values
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.solver.system import System


class Context(NamedTuple):
    """What is known of the case behind a history."""

    belt_speed: float  # U, m/s
    steady: bool = True  # whether U and Q are constant
    forced: tuple[float, ...] = ()  # Hz, lines of the roughness
    waves: tuple[tuple[float, float], ...] = ()  # Hz and m: passing frequency, and the swing of x that it forces
    quiet: float = 0.0  # m/s, size of vx that may come from rounding
    frictionless: bool = False
    undamped: bool = False
    held_by_link: bool = True  # whether a link holds the shoe along the wheel
    locks: float | None = None  # friction coefficient from which the shoe locks itself, where its own is larger
    touches: Callable[[], bool] = lambda: True  # whether the shoe touches the wheel where it slides steadily
    settles: float = math.inf  # 1/s: the slowest disturbance of a limit cycle without stick decays no faster
    growth: Callable[[], float] = lambda: 0.0  # 1/s, of a small disturbance of steady sliding; below 0 it decays
    linear: Theory = lambda: None  # the theory of full contact
    steadier: Callable[[], str] = str  # what to do where the steps damp what grows in theory; empty if they do not
    ripple: Callable[[Stretch, Sequence[float]], Ripple | None] = lambda stretch, lines: None  # of the nodes
    detuned: Callable[[Stretch, Sequence[float]], float] = lambda stretch, lines: 0.0  # part of a forced amplitude
    radius: float = 1.0  # R, m
    step: float = 0.0  # s; 0 where steps are chosen to keep an error

    @property
    def pattern(self) -> float:
        """Time (s) until the strong waves repeat: a turn or a part of it if they are orders, or the longest."""
        strong = 0.01 * max((swing for _, swing in self.waves), default=0.0)
        passing = [frequency for frequency, swing in self.waves if swing > strong]
        turns = abs(self.belt_speed) / (2.0 * math.pi * self.radius)
        orders = [round(f / turns) for f in passing]
        whole = all(math.isclose(f, order * turns) for f, order in zip(passing, orders, strict=True))
        slowest = turns * math.gcd(*orders) if whole else min(passing)
        return 1.0 / slowest if passing else 0.0


def context(system: System, theory: Theory | None = None) -> Context:
    """What a verdict has to know of a system, the theory of which may be known already."""
    belt = float(value_at(system.belt, system.sampled_duration))
    c = system.coefficients
    compression = float(np.abs(values(system.load)).max()) / (c.c_yy + system.contact_stiffness)

    @cache
    def stiffness() -> float:  # in the mean, for which nodes are good enough, and thirty times cheaper
        by_nodes = system.method.own_steps and system.finds_patches
        on_nodes = replace(system, method=replace(system.method, evaluator="cells")) if by_nodes else system
        try:
            return steady_sliding(on_nodes, belt=belt).stiffness
        except CaseError:  # none: a shoe that locks itself drifts away, by what full contact makes of it
            return system.contact_stiffness

    theory = theory or theory_of(system)
    turns = tuple(system.wheel.turns.tolist())
    highest = 0.5 / system.interval
    swings = np.abs(linear.waves[:, 0]) if turns and (linear := theory()) else np.ones(len(turns))
    waves = tuple((abs(belt) * turn, float(swing)) for turn, swing in zip(turns, swings, strict=True))
    fastest = compression * system.natural_frequencies[1]  # at which the compressed pad can swing
    return Context(
        belt,
        radius=system.radius,
        step=0.0 if system.method.own_steps or system.method.step is None else system.step,
        steady=system.steady,
        forced=forced_lines(belt, turns, highest),
        waves=waves if belt else (),
        quiet=1e-9 * fastest,
        frictionless=c.phi == 0.0,
        undamped=is_undamped(c),
        held_by_link=c.c_xx > 0.0,
        locks=limit if c.phi > (limit := locks_from(c, system.contact_stiffness, belt)) else None,
        touches=lambda: stiffness() > 0.0,
        settles=slowest_of_cycles(c),
        growth=lambda: growth(c, stiffness(), c.grip(belt)),
        linear=theory,
        steadier=lambda: _steadier(system),
        ripple=lambda stretch, lines: ripple(system, belt, stiffness, stretch, lines),
        detuned=lambda stretch, lines: detuned(system, belt, stiffness, stretch, lines),
    )


def _steadier(system: System) -> str:
    """What to do where no disturbance grows by the scheme at its step; empty where one does."""
    k = system.contact_stiffness
    phi = system.coefficients.phi
    grows = system.method.own_steps or spectral_radius(system, k, phi) > 1.0
    return "" if grows else without_damping(system.method)
