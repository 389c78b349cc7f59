"""A torus is told from chaos, from noise, and from what repeats, by maps whose motion is known."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from brakecli.analysis.regime.torus import turns_per_cycle
from tests.campaign import campaign, counts

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Turns in a cycle, of which 1 - GOLDEN are left."""
WITHIN = 0.05
N = np.arange(1000)


def values(step: Callable[[float], float], start: float = 0.3, count: int = 1000) -> NDArray[np.float64]:
    """Values of a map, without the first ones."""
    found = [start]
    for _ in range(count + 500):
        found.append(step(found[-1]))
    return np.array(found[-count:])


def logistic(growth: float) -> NDArray[np.float64]:
    return values(lambda x: growth * x * (1.0 - x))


def on_circle(number: int, count: int = 1000) -> Any:
    """cos 2πθ of a circle map of a free rotation, and that: by the distance covered in a long time."""
    rng = np.random.default_rng(number)
    turn = rng.uniform(0.05, 0.45)
    force = rng.uniform(0.0, 0.7)
    phase = values(lambda at: at + turn + force / (2.0 * math.pi) * math.sin(2.0 * math.pi * at), count=100_000)
    return np.cos(2.0 * math.pi * phase[:count]), (phase[-1] - phase[0]) / (len(phase) - 1)


TURNS = {
    "one line": 0.01 * np.cos(2.0 * math.pi * GOLDEN * N),
    "its second harmonic is stronger": np.cos(4.0 * math.pi * GOLDEN * N)
    + 0.4 * np.cos(2.0 * math.pi * GOLDEN * N),
    "its third harmonic is": np.cos(6.0 * math.pi * GOLDEN * N) + 0.4 * np.cos(2.0 * math.pi * GOLDEN * N),
    "with corners": np.maximum(np.abs((GOLDEN * N) % 1.0 - 0.3), 0.1),
    "with a little noise": np.cos(2.0 * math.pi * GOLDEN * N) + np.random.default_rng(1).normal(0.0, 0.02, 1000),
}
DO_NOT = {
    "all alike": np.zeros(1000),
    "rounding": 1e-16 * np.random.default_rng(2).integers(-2, 3, 1000),
    "noise": np.random.default_rng(3).normal(size=1000),
    "a line in noise": np.cos(2.0 * math.pi * GOLDEN * N) + np.random.default_rng(4).normal(0.0, 0.2, 1000),
    "fades": np.exp(-N / 300.0) * np.cos(2.0 * math.pi * GOLDEN * N),
    "drifts": 1e-3 * N,
    "chaos": logistic(4.0),
    "chaos in two bands": logistic(3.6),
    "chaos in four bands": logistic(3.58),
    "two in turns": logistic(3.2),
    "seven in turns": np.cos(2.0 * math.pi * 2.0 / 7.0 * N),
    "nineteen in turns": np.cos(2.0 * math.pi * 7.0 / 19.0 * N),
    "too slow to be seen": np.cos(2.0 * math.pi * N / 400.0),
    "few cycles": np.cos(2.0 * math.pi * GOLDEN * N[:30]),
}


@pytest.mark.parametrize("name", TURNS)
def test_sizes_on_a_closed_curve_turn(name: str) -> None:
    assert turns_per_cycle(1.0 + TURNS[name], WITHIN) == pytest.approx(1.0 - GOLDEN, abs=1e-5)


@pytest.mark.parametrize("name", DO_NOT)
def test_sizes_on_no_closed_curve_do_not_turn(name: str) -> None:
    assert math.isnan(turns_per_cycle(1.0 + DO_NOT[name], WITHIN))


@pytest.mark.parametrize("maps", counts(10, 200))
def test_turns_are_the_rotation_number_of_a_circle_map(maps: int) -> None:
    said = 0
    for number in range(maps):
        sizes, rotation = on_circle(number)
        turns = turns_per_cycle(sizes, WITHIN)
        if math.isfinite(turns):
            assert turns == pytest.approx(rotation, abs=2e-5), number
            said += 1
    assert said > 0.7 * maps  # the others are locked, or nearly


@campaign
def test_no_chaos_of_the_logistic_map_turns() -> None:
    for growth in np.linspace(3.57, 4.0, 400):
        assert math.isnan(turns_per_cycle(logistic(growth), WITHIN)), growth
