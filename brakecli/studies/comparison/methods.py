"""The ways to compute a case that are compared, and the ladder of steps for each."""

import math
from collections.abc import Sequence
from dataclasses import replace

from brakecli.case.tables import LARGEST, SMALLEST
from brakecli.errors import UsageError
from brakecli.faces import argument
from brakecli.solver.method import Method
from brakecli.solver.schemes import SCHEMES
from brakecli.solver.system import WHOLE, System

# steps per period of the fastest motion that a ladder begins with; steps on it
COARSEST = 16
RUNGS = 7
TOLERANCES: tuple[float, ...] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
NODE_FACTORS: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0)


def method_label(kind: Method) -> str:
    """A method in a few words, without step and tolerance."""
    nodes = f"{kind.nodes} nodes"
    words = [
        kind.scheme + (f" ({', '.join(_fraction(weight) for weight in kind.theta)})" if kind.theta else ""),
        "paper's start" if kind.start == "paper" else "",
        "fixed point" if kind.iteration == "fixed-point" else "",
        {"midpoint": nodes, "cells": nodes, "exact": "exact contact"}.get(kind.evaluator, ""),
    ]
    return ", ".join(filter(None, words))


def in_a_case(method: Method, error: float, interval: float) -> dict[str, object]:
    """Keys of a case, and their values, that ask for a method; keys that a default serves are left out.

    `interval`: between the samples of the case, s, which become fewer where the step is longer.
    Where steps are the method's own, a case states the error, and its run chooses steps and nodes by itself.
    """
    if method.own_steps:
        return {"solver.tolerance": error}
    usual = Method(method.scheme, method.row.theta, evaluator="auto")
    keys: dict[str, object] = {"solver.scheme": method.scheme, "solver.step": method.step}
    if method.step is not None and method.step > interval:
        keys["output.sample_interval"] = method.step
    for key in ("solver.theta", "solver.start", "solver.iteration", "contact.evaluator", "contact.nodes"):
        name = key.split(".")[1]
        if (value := getattr(method, name)) != getattr(usual, name) and value != "closed-form":
            keys[key] = value
    return keys


def kinds(system: System, wanted: Sequence[str] = ()) -> list[Method]:
    """The methods that are compared on a system, the cheapest of a scheme first; `wanted` names schemes."""
    moving = system.initial.vx != 0.0 or system.initial.vy != 0.0
    usual = "closed-form" if system.smooth else "auto"
    plain = system.by(evaluator="midpoint")
    counts = sorted({plain.by(nodes=round(plain.nodes * factor)).nodes for factor in NODE_FACTORS})
    methods = []
    for name, scheme in SCHEMES.items():
        if scheme.exact and not system.smooth:
            continue
        for trial in scheme.trials if not wanted or name in wanted else ():
            if moving and trial.start == "paper":
                continue
            kind = Method(name, trial.theta, trial.start, trial.iteration)
            methods.append(kind if scheme.own_steps else replace(kind, evaluator=usual, nodes=system.nodes))
            if trial.contacts and not system.smooth:
                on_nodes = "cells" if scheme.own_steps else "midpoint"
                methods += [replace(kind, evaluator=on_nodes, nodes=count) for count in counts]
                methods += [] if scheme.own_steps else [replace(kind, evaluator="exact")]
    return sorted(methods, key=lambda kind: (kind.own_steps, kind.evaluator != usual))


def ladder(system: System, steps: Sequence[float] = ()) -> list[float]:
    """Steps (s) from the coarsest down, each a whole part of the coarsest: by halves, unless they are given."""
    if steps:
        return sorted(steps, reverse=True)
    coarsest = 1.0 / (COARSEST * max(system.natural_frequencies[1], system.passing_frequency))
    return [coarsest / 2**rung for rung in range(RUNGS)]


def rungs(kind: Method, steps: Sequence[float]) -> list[Method]:
    """A method over the ladder of steps, or over tolerances if its steps are its own; alone if they are exact."""
    if kind.row.exact:
        return [kind]
    if kind.own_steps:
        on_nodes = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6)  # whose error soon hides that of steps
        return [replace(kind, tolerance=tolerance) for tolerance in (on_nodes if kind.nodes else TOLERANCES)]
    return [replace(kind, step=step) for step in steps]


def parse_schemes(text: str | None) -> list[str]:
    """Names of schemes, separated by commas; raises UsageError."""
    names = [name.strip() for name in (text or "").split(",") if name.strip()]
    for name in names:
        if name not in SCHEMES:
            raise UsageError(
                f"{argument('schemes')} {text}: there is no scheme {name}; give some of {', '.join(SCHEMES)}"
            )
    return names


def parse_steps(text: str | None) -> list[float]:
    """Steps (s), separated by commas; raises UsageError."""
    if text is None:
        return []
    try:
        steps = [float(number) for number in text.split(",")]
    except ValueError:
        steps = []
    if not steps or not all(SMALLEST < step < LARGEST for step in steps):
        raise UsageError(
            f"{argument('steps')} {text}: is not a list of steps; "
            f"write, for instance, {argument('steps')} 1e-5,5e-6"
        )
    largest = max(steps)
    if any(abs(largest / step - round(largest / step)) > WHOLE * largest / step for step in steps):
        raise UsageError(f"{argument('steps')} {text}: each must divide the largest; halve it, for instance")
    if len({round(largest / step) for step in steps}) < len(steps):
        raise UsageError(f"{argument('steps')} {text}: names a step twice; give each once")
    return steps


def _fraction(weight: float) -> str:
    for denominator in (1, 2, 3, 4, 12):
        numerator = round(weight * denominator)
        if math.isclose(weight * denominator, numerator, abs_tol=1e-12):
            return str(numerator) if denominator == 1 else f"{numerator}/{denominator}"
    return f"{weight:.4g}"
