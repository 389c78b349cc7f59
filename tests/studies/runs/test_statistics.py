"""The reference of benchmarks/statistics against closed forms, and random runs with a tolerance against it."""

import math

import numpy as np
import pytest

from benchmarks.statistics.cases import KINDS, draw
from benchmarks.statistics.judging import judge
from benchmarks.statistics.kernels import contact
from benchmarks.statistics.reference import QUICK_SHARE, Tables, shoe_of
from tests.campaign import counts

SMOOTH: Tables = {
    "shoe": {"mass": 10.0},
    "wheel": {"radius": 0.5, "angular_speed": 20.0},
    "link1": {"stiffness": 1e7, "damping": 300.0, "angle_deg": 12.0},
    "link2": {"stiffness": 1.2e7, "damping": 200.0, "angle_deg": 5.0},
    "load": {"force": 5e3},
    "friction": {"coefficient": 0.45},
    "contact": {"half_length": 0.05, "stiffness": 2e7},
    "initial": {"x": 2e-4, "y": -6e-4, "vx": 0.1},
    "solver": {"duration": 0.1},
    "output": {"sample_interval": 1e-4},
}
WAVES = {
    "shoe": {"amplitudes": [1e-5, 4e-6], "wavelengths": [0.017, 0.0043], "phases_deg": [20.0, 250.0]},
    "wheel": {"amplitudes": [2e-5, 3e-6], "wavelengths": [0.023, 0.0061], "phases_deg": [0.0, 100.0]},
}


def test_exact_contact_agrees_with_a_fine_sum_and_its_length_with_the_slope() -> None:
    shoe = shoe_of({**SMOOTH, "roughness": WAVES})
    rng = np.random.default_rng(4)
    seen = 0
    xi = shoe.a * ((2.0 * np.arange(100_000) + 1.0) / 100_000 - 1.0)
    for _ in range(12):
        theta = rng.uniform(0.0, 2.0 * math.pi, 2)
        y = rng.uniform(-1.1, 1.1) * shoe.height
        gap = sum(g * np.sin(q * xi + p) for g, q, p in zip(shoe.g_2, shoe.q_2, theta, strict=True)) - y
        gap -= sum(g * np.sin(q * xi + p) for g, q, p in zip(shoe.g_1, shoe.q_1, shoe.p_1, strict=True))
        force, length = contact(shoe, theta, y)
        cell = xi[1] - xi[0]
        most = shoe.k * np.abs(gap).max() * 2.0 * shoe.a
        assert force == pytest.approx(shoe.k * np.maximum(gap, 0.0).sum() * cell, abs=1e-7 * most)
        assert length == pytest.approx((gap > 0.0).sum() * cell, abs=100.0 * cell)
        seen += 0.0 < length < 2.0 * shoe.a
    assert seen > 5


def test_reference_in_full_contact_does_not_see_roots_that_are_none() -> None:
    """The bound of the heights proves full contact for one position, the cells of the pad for the other."""
    waves = {"wheel": {"amplitudes": [1e-5, 3e-5], "wavelengths": [0.023, 0.0061]}}
    shoe = shoe_of({**SMOOTH, "roughness": waves})
    theta = np.array([1.0, 2.0])
    forces = []
    for y in (-1.0001 * shoe.height, -0.9999 * shoe.height):
        force, length = contact(shoe, theta, y)
        assert length == pytest.approx(2.0 * shoe.a)
        forces.append(force + 2.0 * shoe.a * shoe.k * y)
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)


@pytest.mark.parametrize("many", counts(0, 2))
def test_no_estimate_is_below_the_error_and_no_promise_is_broken(many: int) -> None:
    work = [(kind, 2, number) for kind in KINDS for number in range(1, 1 + many)]
    judged = [judge(draw(*each), QUICK_SHARE) for each in work]
    faults = [str(each) for each in judged if each is None or each.faulty]
    assert faults == []
    assert len(judged) == many * len(KINDS)
