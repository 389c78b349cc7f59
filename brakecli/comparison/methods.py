"""The ways to compute a case that are compared, and the ladder of steps for each."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from brakecli.analysis.stability.discrete import natural_frequencies
from brakecli.case.case import Case, Evaluator, Iteration, Scheme, Start, changed
from brakecli.case.system import Setup
from brakecli.errors import UsageError

HALF, QUARTERS, NUMEROV = (0.5, 0.5), (0.25, 0.5, 0.25), (1 / 12, 10 / 12, 1 / 12)
COARSEST = 16
"""Steps per period of the fastest motion that a ladder begins with."""
RUNGS = 7
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
NODE_FACTORS = (0.25, 0.5, 2.0, 4.0)


class Method(NamedTuple):
    """A scheme with everything that is chosen beside its step. `nodes`: 0 where no quadrature is needed."""

    scheme: Scheme
    theta: tuple[float, ...]
    start: Start
    iteration: Iteration
    evaluator: Evaluator
    nodes: int

    def label(self) -> str:
        """The method in a few words."""
        weights = f" ({', '.join(_fraction(weight) for weight in self.theta)})" if self.theta else ""
        start = ", paper's start" if self.start is Start.PAPER else ""
        iteration = ", fixed point" if self.iteration is Iteration.FIXED_POINT else ""
        nodes = f", {self.nodes} nodes" if self.evaluator is Evaluator.MIDPOINT else ""
        exact = ", exact contact" if self.evaluator is Evaluator.EXACT else ""
        return f"{self.scheme}{weights}{start}{iteration}{nodes}{exact}"


class Rung(NamedTuple):
    """A method at one step (s), or at one tolerance."""

    method: Method
    step: float | None
    tolerance: float | None


def methods(setup: Setup, wanted: Sequence[str] = ()) -> list[Method]:
    """The methods that are compared on a case, the cheapest kinds of a scheme first; `wanted` names schemes."""
    found = [method for method in _all(setup) if not wanted or method.scheme in wanted]
    moving = setup.case.initial.vx != 0.0 or setup.case.initial.vy != 0.0
    return [method for method in found if not (moving and method.start is Start.PAPER)]


def _all(setup: Setup) -> Iterator[Method]:
    newton, fixed = Iteration.NEWTON, Iteration.FIXED_POINT
    consistent, paper = Start.CONSISTENT, Start.PAPER
    evaluator, nodes = (Evaluator.CLOSED_FORM, 0) if setup.smooth else (Evaluator.AUTO, setup.nodes)
    two, three = Scheme.TWO_LAYER, Scheme.THREE_LAYER
    for theta in (HALF, (1.0, 0.5), (0.5, 1.0), (1.0, 1.0)):
        yield Method(two, theta, consistent, newton, evaluator, nodes)
    yield Method(two, HALF, consistent, fixed, evaluator, nodes)
    for start in (consistent, paper):
        for weights in (QUARTERS, NUMEROV):
            yield Method(three, weights, start, newton, evaluator, nodes)
    yield Method(three, QUARTERS, paper, fixed, evaluator, nodes)
    if not setup.smooth:
        for factor in NODE_FACTORS:
            count = max(2, round(nodes * factor))
            yield Method(two, HALF, consistent, newton, Evaluator.MIDPOINT, count)
        yield Method(two, HALF, consistent, newton, Evaluator.EXACT, 0)
    yield Method(Scheme.EVENT_DRIVEN, (), consistent, newton, Evaluator.AUTO, 0)


def ladder(setup: Setup, steps: Sequence[float] = ()) -> list[float]:
    """Steps (s) from the coarsest down, each a whole part of the coarsest: by halves, unless they are given."""
    if steps:
        return sorted(steps, reverse=True)
    fast = natural_frequencies(setup.coefficients, setup.contact_stiffness)[1]
    speed = max(abs(float(value)) for value in setup.belt["value"])
    passing = speed * float(max(setup.wheel.turns, default=0.0))
    coarsest = 1.0 / (COARSEST * max(fast, passing))
    return [coarsest / 2**rung for rung in range(RUNGS)]


def rungs(method: Method, steps: Sequence[float]) -> list[Rung]:
    """A method over the ladder: over steps, or over tolerances if its steps are its own."""
    if method.scheme is Scheme.EVENT_DRIVEN:
        return [Rung(method, None, tolerance) for tolerance in TOLERANCES]
    return [Rung(method, step, None) for step in steps]


def case_of(case: Case, rung: Rung, interval: float, duration: float) -> Case:
    """The case as a rung computes it, sampled on a grid that all rungs share."""
    method = rung.method
    return changed(
        case,
        solver={
            "scheme": method.scheme,
            "theta": method.theta,
            "start": method.start,
            "iteration": method.iteration,
            "step": rung.step,
            "tolerance": rung.tolerance,
            "duration": duration,
            "allow_unconverged": False,
        },
        contact={"evaluator": method.evaluator, "nodes": method.nodes or None},
        output={"sample_interval": interval},
    )


def parse_schemes(text: str | None) -> list[str]:
    """Names of schemes, separated by commas; raises UsageError."""
    names = [name.strip() for name in (text or "").split(",") if name.strip()]
    for name in names:
        if name not in set(Scheme):
            raise UsageError(f"--schemes {text}: there is no scheme {name}; give some of {', '.join(Scheme)}")
    return names


def parse_steps(text: str | None) -> list[float]:
    """Steps (s), separated by commas; raises UsageError."""
    if text is None:
        return []
    try:
        steps = [float(part) for part in text.split(",")]
    except ValueError:
        steps = []
    if not steps or not all(1e-100 < step < 1e100 for step in steps):
        raise UsageError(f"--steps {text}: is no list of steps; write, for instance, --steps 1e-5,5e-6")
    largest = max(steps)
    if any(abs(largest / step - round(largest / step)) > 1e-9 * largest / step for step in steps):
        raise UsageError(f"--steps {text}: all must be whole parts of the largest; halve it, for instance")
    if len({round(largest / step) for step in steps}) < len(steps):
        raise UsageError(f"--steps {text}: names a step twice; give each once")
    return steps


def _fraction(weight: float) -> str:
    for denominator in (1, 2, 3, 4, 12):
        if math.isclose(weight * denominator, round(weight * denominator), abs_tol=1e-12):
            numerator = round(weight * denominator)
            return str(numerator) if denominator == 1 else f"{numerator}/{denominator}"
    return f"{weight:.4g}"
