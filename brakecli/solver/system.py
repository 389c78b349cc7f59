"""A system: the numbers of a case that the solver works on, and the method that the case asks for."""

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from brakecli.errors import RefusedError
from brakecli.solver import contact, schemes
from brakecli.solver.arrays import Floats
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.contact.pad import Pad, build_pad, default_nodes, fewest_nodes, window_rows, window_width
from brakecli.solver.links import natural_frequencies
from brakecli.solver.method import MOST_EVALUATIONS, Method
from brakecli.solver.records import Grid, Weights, new
from brakecli.solver.roughness import Surface
from brakecli.solver.schedules import Schedule, knots, value_at, values

MOST_STEPS = 1e11
MOST_TABLE_BYTES = 4e9
WHOLE = 1e-9
"""A ratio this close to a whole number is whole."""
_build_small = lru_cache(maxsize=8)(build_pad)
"""Pads that points of a sweep have in common; nobody changes them."""


@dataclass(frozen=True)
class Initial:
    """The state at t = 0 (SI units), added to steady sliding where `from_equilibrium`."""

    x: float = 0.0
    y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    from_equilibrium: bool = False

    def beside(self, equilibrium: tuple[float, float] | Floats) -> Floats:
        """x, y, v_x and v_y, where steady sliding is at `equilibrium` (x, y)."""
        x, y = equilibrium if self.from_equilibrium else (0.0, 0.0)
        return np.array([self.x + x, self.y + y, self.vx, self.vy])


def longest_step(c: Coefficients, stiffness: float) -> float:
    """The longest exact step, s, by bounds of the fastest motion and of the fastest decay; stiffness in N/m.

    The motion turns by 0.8 rad in it: so little that a margin is lowest in it once at most, and that the series of
    the step need few terms.
    """
    bound = c.c_xx + c.c_yy + 2.0 * abs(c.c_xy) + (1.0 + c.phi) * stiffness
    return 0.8 / (math.sqrt(bound / c.m) + (c.b_xx + c.b_yy) / c.m)


@dataclass(frozen=True, eq=False)
class System:
    """What moves, for how long, and how that is solved; tables and kernels follow when they are first asked for.

    `half_length` a (m) and `layer_stiffness` k (N/m²) are the pad's. Samples are taken every `interval` (s) up to
    the first one that is not before `duration` (s).
    """

    coefficients: Coefficients
    belt: Schedule
    load: Schedule
    shoe: Surface
    wheel: Surface
    radius: float
    half_length: float
    layer_stiffness: float
    initial: Initial
    interval: float
    duration: float
    method: Method
    budget: int = 0  # steps until its verdict is decided, where `duration` is only the first that is tried
    notes: tuple[str, ...] = ()  # where surfaces come from, and how long a run has become
    tangents: bool = False  # whether a small disturbance is carried along, by schemes with steps of their own
    tracked: bool = False  # whether the loop notes works of parts, and events
    start_error: tuple[float, float] | None = None  # of x and y, m; where given, the error is carried along
    most_error: float = math.inf  # relative to the motion so far, beyond which such a run ends

    @property
    def settles(self) -> bool:
        """Whether it is to run until its verdict is decided."""
        return self.budget > 0

    def by(self, **changes: Any) -> "System":
        """The same, with these changes of its method."""
        return replace(self, method=replace(self.method, **changes))

    @cached_property
    def pad(self) -> Pad:
        """Constants and tables of the contact."""
        self.refuse_tables()
        build = _build_small if self.table_bytes < 1e6 else build_pad
        return build(self.layer_stiffness, self.half_length, self.shoe, self.wheel, self.nodes)

    @cached_property
    def table_bytes(self) -> float:
        """Memory of the contact: values at nodes, a window, two numbers for each pair of waves."""
        terms = len(self.shoe.g) + len(self.wheel.g)
        nodes = self.nodes
        at_nodes = nodes * (len(self.wheel.g) + 3.0) + self.window_rows * window_width(nodes)
        return 8.0 * (at_nodes + 2.0 * terms**2)

    @property
    def window_rows(self) -> int:
        """Points of the grid of a window to a node, see `solver.contact.heights`; 0 without one."""
        return window_rows(self.wheel, 2.0 * self.half_length / self.nodes) if self.nodes else 0

    def refuse_tables(self) -> None:
        """Raise RefusedError where the tables of the contact would be too large."""
        if self.table_bytes > MOST_TABLE_BYTES:
            waves = len(self.shoe.g) + len(self.wheel.g)
            what = f"the contact's tables for {waves} waves and {self.nodes} nodes would take"
            remedy = "reduce contact.nodes, or the number of waves in roughness"
            raise RefusedError(f"{what} {self.table_bytes / 1e9:.3g} GB of memory; {remedy}")

    @cached_property
    def evaluator(self) -> str:
        """The contact evaluator that runs: "auto" is "closed-form" on smooth surfaces."""
        if self.method.evaluator != "auto":
            return self.method.evaluator
        return "closed-form" if self.smooth else "exact" if self.method.own_steps else "auto"

    @property
    def finds_patches(self) -> bool:
        """Whether the contact evaluator seeks the edges of every patch that touches."""
        return contact.EVALUATORS[self.evaluator].finds_patches

    @cached_property
    def nodes(self) -> int:
        """Quadrature nodes, an even number that tells the shortest wave; 0 where no quadrature can be needed."""
        if not contact.EVALUATORS[self.evaluator].needs_nodes:
            return 0
        pad = self.half_length, self.shoe, self.wheel
        nodes = self.method.nodes or default_nodes(self.evaluator, *pad)
        return max(nodes + nodes % 2, fewest_nodes(*pad))

    @property
    def scheme(self) -> schemes.SchemeModule:
        """The scheme's module, for which no kernel is loaded."""
        return schemes.module_of(self.method.scheme)

    @property
    def smooth(self) -> bool:
        """Whether neither surface has any roughness."""
        return self.shoe.g.size == 0 and self.wheel.g.size == 0

    @property
    def steady(self) -> bool:
        """Whether speed and load are constant."""
        return knots(self.belt) == knots(self.load) == 1

    @property
    def contact_stiffness(self) -> float:
        """2ak, N/m: the contact that touches everywhere."""
        return 2.0 * self.half_length * self.layer_stiffness

    @property
    def belt_speed(self) -> float:
        """U at the start, m/s."""
        return float(value_at(self.belt, 0.0))

    @property
    def fastest_belt(self) -> float:
        """The largest |U|, m/s."""
        return float(np.abs(values(self.belt)).max())

    @property
    def load_at_start(self) -> float:
        """Q at the start, N."""
        return float(value_at(self.load, 0.0))

    @property
    def passing_frequency(self) -> float:
        """Passing frequency of the shortest wave of the wheel at its largest speed, Hz."""
        return self.fastest_belt * max(self.wheel.turns.tolist(), default=0.0)

    @property
    def most_turns(self) -> float:
        """Waves per metre of the shortest wave of both surfaces, 1/m; 0 where they are smooth."""
        return max([*self.shoe.turns.tolist(), *self.wheel.turns.tolist()], default=0.0)

    def refuse_steps(self, size: float) -> None:
        """Raise RefusedError where a run would not end, or hold samples of too many bytes in memory."""
        if self.steps > MOST_STEPS:
            remedy = "reduce solver.duration and output.sample_interval, or increase solver.step"
            raise RefusedError(f"the run is too long: {self.steps:.3g} steps; {remedy}")
        if size > MOST_TABLE_BYTES:
            what = f"histories of {self.samples:.3g} samples are held in memory, which takes {size / 1e9:.3g} GB"
            remedy = "reduce solver.duration, or increase output.sample_interval"
            raise RefusedError(f"{what}; {remedy}")

    @cached_property
    def natural_frequencies(self) -> tuple[float, float]:
        """Natural frequencies without friction, in a contact that touches everywhere, Hz, rising."""
        return natural_frequencies(self.coefficients, self.contact_stiffness)

    @cached_property
    def per_sample(self) -> int:
        """Steps of a sample interval."""
        method = self.method
        step = method.share * self.longest_step if method.row.exact else None if method.own_steps else method.step
        return _at_least(self.interval / (step or self.interval))

    @property
    def longest_step(self) -> float:
        """The longest exact step, s."""
        return longest_step(self.coefficients, self.contact_stiffness)

    @property
    def step(self) -> float:
        """h, s; the sample interval where the scheme finds its steps itself, unless they are exact."""
        return self.interval / self.per_sample

    @cached_property
    def samples(self) -> int:
        """Samples after the one at t = 0."""
        return _at_least(self.duration / self.interval)

    @property
    def steps(self) -> int:
        """Steps from the first sample to the last."""
        return self.samples * self.per_sample

    @property
    def sampled_duration(self) -> float:
        """Time of the last sample, s."""
        return self.samples * self.interval

    @cached_property
    def weights(self) -> Weights:
        """Step and weights of the scheme."""
        theta_1, theta_2, theta_3 = (*self.method.theta, 0.0, 0.0, 0.0)[:3]
        return Weights(self.step, theta_1, theta_2, theta_3)

    @property
    def grid(self) -> Grid:
        """The grid of time as the loop sees it."""
        method = self.method
        grid = new(Grid)
        grid.interval = self.interval
        grid.weighted = self.scheme.weighted_time(self.weights)
        grid.tolerance = method.tolerance
        grid.per_sample = self.per_sample
        grid.lag = self.scheme.LAG
        grid.most = MOST_EVALUATIONS[method.iteration]
        grid.go_on = int(method.allow_unconverged)
        grid.samples = self.samples
        grid.scheme = list(schemes.SCHEMES).index(method.scheme)
        grid.iteration = list(MOST_EVALUATIONS).index(method.iteration)
        return grid


def _at_least(ratio: float) -> int:
    """The whole number that is not below a ratio, but for rounding."""
    nearest = max(1, round(ratio))
    return nearest if abs(ratio - nearest) <= WHOLE * nearest else max(1, math.ceil(ratio))
