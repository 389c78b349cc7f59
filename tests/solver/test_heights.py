"""Many waves on the wheel: heights interpolated from a window are those of their sums, to rounding."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator

from brakecli.case.system import system_of
from brakecli.solver.contact import pad as pads
from brakecli.solver.contact.force import fill
from brakecli.solver.contact.pad import ContactLayer, Pad, build_layer, build_pad, interpolation_error, window_rows
from brakecli.solver.integrate import solve
from brakecli.solver.method import Method
from brakecli.solver.roughness import Surface, surface, turn
from brakecli.solver.schemes import QUARTERS
from brakecli.studies.runs.work import work_of
from tests.examples import ROUGH, make
from tests.solver.rough_gap import EPS, outputs

A = 0.05
K = 5e7
SHOE = surface([30e-6, 9e-6], wavelengths=[0.02, 0.005], phases_deg=[10.0, 200.0])


def wheel_of(waves: int, seed: int = 0, shortest: float = 0.004) -> Surface:
    rng = np.random.default_rng(seed)
    lengths = np.geomspace(0.03, shortest, waves)
    return surface(
        (rng.uniform(0.1, 1.0, waves) * 1e-4 / waves).tolist(),
        wavelengths=lengths.tolist(),
        phases_deg=rng.uniform(0.0, 360.0, waves).tolist(),
    )


def found(layer: ContactLayer, x: float, y: float, travel: float = 0.0, travel_low: float = 0.0) -> Any:
    """Normal force, stiffness, tangential stiffness, fraction, store and its slope."""
    turn(travel, travel_low, *layer)
    fill(x, y, *layer)
    return outputs(layer.contact)


def both(pad: Pad) -> tuple[ContactLayer, ContactLayer]:
    return build_layer("midpoint", pad, moving=True), build_layer("midpoint", pad)


def walk(rng: np.random.Generator, places: int) -> Iterator[tuple[float, float, float]]:
    """Positions and travels (m): forth and back by less than a node to more than a pad, and jumps up to 10^6 m."""
    travel = 0.0
    for n in range(places):
        travel += rng.normal() * 10.0 ** rng.uniform(-6, -0.5)
        if n % 20 == 19:
            travel = rng.uniform(-1.0, 1.0) * 10.0 ** rng.uniform(-2, 6)
        yield rng.uniform(-2e-3, 2e-3), travel, rng.uniform(-1.0, 1.0) * EPS / 4 * abs(travel)


@pytest.mark.parametrize(
    ("waves", "nodes", "rows"),
    [(11, 70, 16), (50, 130, 8), (500, 256, 4), (23, 512, 2), (37, 2000, 1)],
)
def test_a_window_gives_the_heights_of_the_sums(waves: int, nodes: int, rows: int) -> None:
    wheel = wheel_of(waves, seed=waves)
    assert window_rows(wheel, 2 * A / nodes) == rows
    window, sums = both(build_pad(K, A, SHOE, wheel, nodes))
    assert (window.layer.window.rows, sums.layer.window.rows) == (rows, 0)
    high = float(np.abs(wheel.g).sum() + np.abs(SHOE.g).sum())
    low = wheel.omega.max()
    # Rounding: a few units in the last place of heights and of places on the pad, x and the wave, over its length.
    rounding = 8 * EPS * (1.0 + low * (A + 2e-3))
    full = 2 * A * K * np.array([3 * high, 1e-9, low * high, 1e-9, 9 * high**2, 3 * high**2 * low])
    for x, *travel in walk(np.random.default_rng(waves), 120):
        one, other = (found(layer, x, -2.0 * high, *travel) for layer in (window, sums))
        assert np.all(np.abs(one - other) <= rounding * full)  # wholly in contact: nothing else differs
        one, other = (found(layer, x, -0.1 * high, *travel) for layer in (window, sums))
        assert np.all(np.abs(one - other)[[0, 4]] <= rounding * full[[0, 4]])


def test_the_error_of_interpolation_is_bounded_and_the_bound_is_sharp() -> None:
    """By scipy's interpolation of one sine, and by a window whose grid is so wide that it shows."""
    at = np.linspace(0.0, 1.0, 201)
    for turned in (0.2, 0.4):  # rad, from one point to the next
        points = np.arange(-5, 7)
        errors = []
        for phase in np.linspace(0.0, np.pi, 20):
            polynomial = BarycentricInterpolator(points, np.sin(turned * points + phase))
            errors.append(np.abs(polynomial(at) - np.sin(turned * at + phase)))
        one = Surface(np.ones(1), np.full(1, turned), *np.zeros((3, 1)))
        assert 0.8 < np.max(errors) / interpolation_error(one, 1.0) <= 1.0 + 1e-15 / np.max(errors)
    wheel = wheel_of(40, seed=2)
    nodes = 192
    pad = build_pad(K, A, surface(), wheel, nodes)
    pad.constants.rows = 1
    wide = interpolation_error(wheel, 2 * A / nodes)
    assert 1e-14 < wide / np.abs(wheel.g).sum() < 1e-6
    window, sums = both(pad)
    worst = max(
        abs(found(window, x, -1e-3, travel)[0] - found(sums, x, -1e-3, travel)[0]) / (2 * A * K)
        for x, travel, _ in walk(np.random.default_rng(3), 300)
        if abs(travel) < 10.0
    )
    assert 1e-3 * wide < worst <= wide  # of the mean over all nodes, whose errors cancel in part


def test_a_height_does_not_depend_on_what_was_evaluated_before() -> None:
    pad = build_pad(K, A, SHOE, wheel_of(30), 100)
    wandering, _ = both(pad)
    for x, *travel in walk(np.random.default_rng(9), 60):
        fresh, _ = both(pad)
        np.testing.assert_array_equal(found(wandering, x, -2e-5, *travel), found(fresh, x, -2e-5, *travel))


@pytest.mark.parametrize("x", [math.nan, math.inf, -1e300, 1e30])
def test_a_motion_that_runs_away_reads_nothing_outside_the_window(x: float) -> None:
    pad = build_pad(K, A, SHOE, wheel_of(30), 100)
    used = both(pad)[0]
    fresh = both(pad)[0]
    found(used, x, -2e-5, 1.0)
    np.testing.assert_array_equal(found(used, 1e-4, -2e-5, 1.0), found(fresh, 1e-4, -2e-5, 1.0))


def test_few_waves_and_waves_that_nodes_do_not_follow_are_summed() -> None:
    assert window_rows(wheel_of(10), 2 * A / 256) == 0
    assert window_rows(wheel_of(11), 2 * A / 256) > 0
    assert window_rows(wheel_of(11, shortest=1e-3), 2 * A / 64) == 0


MANY = {
    "amplitudes": (1e-5 / np.arange(1, 31)).tolist(),
    "wavelengths": (0.06 / np.arange(1, 31)).tolist(),
    "phases_deg": (np.arange(30) ** 2 % 360.0).tolist(),
}
METHODS = (
    Method("three-layer", QUARTERS, nodes=2400, step=2e-5),
    Method("two-layer", (0.5, 0.5), nodes=2400, step=2e-5),
    Method("event-driven", evaluator="cells", nodes=2400, tolerance=1e-4),
)


@pytest.mark.parametrize("method", METHODS)
def test_a_run_is_that_of_sums(method: Method, monkeypatch: pytest.MonkeyPatch) -> None:
    rough = system_of(make(ROUGH, roughness__wheel=MANY, load__force=3000.0))
    rough = replace(rough, method=method, duration=0.005)
    one = solve(rough)
    work = work_of(rough).amount
    assert rough.window_rows > 0
    monkeypatch.setattr(pads, "MOST_SUMMED", 30)
    rough = replace(rough)  # makes its pad anew, as it is too large to be kept
    other = solve(rough)
    assert rough.window_rows == 0
    assert not one.work.failed
    assert one.work.evaluators == other.work.evaluators
    assert set(one.work.evaluators) == {"closed-form", "cells"}
    apart = np.abs(one.rows - other.rows).max(axis=0) / np.abs(other.rows).max(axis=0)
    assert apart.max() < 1e-10
    assert abs(one.energy.relative_closing_error) < 1e-4
    assert one.work.steps == other.work.steps
    if not method.own_steps:  # the guess of `check` knows it
        assert work < 0.5 * work_of(rough).amount
