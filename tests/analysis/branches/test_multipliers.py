"""Multipliers of products of maps, and their tests, against closed forms."""

import math

import numpy as np
import pytest

from brakecli.analysis.branches.multipliers import product, resonant_pair, spectrum


def rotation(angle: float, size: float) -> list[list[float]]:
    c = size * math.cos(angle)
    s = size * math.sin(angle)
    return [[c, -s], [s, c]]


def test_tests_are_the_determinants() -> None:
    rng = np.random.default_rng(1)
    for d in (1, 2, 3, 4):
        m = rng.normal(size=(d, d))
        found = spectrum(m[None])
        bialternate = np.prod(
            [1.0 - a * b for i, a in enumerate(found.multipliers) for b in found.multipliers[i + 1 :]]
        )
        expected = [np.linalg.det(np.eye(d) - m), np.linalg.det(np.eye(d) + m), np.real(bialternate)]
        assert np.sinh(found.tests) == pytest.approx(expected, rel=1e-11, abs=1e-12)
        signs = (-1.0) ** np.arange(1, d + 1)
        assert np.sinh(found.coefficients) == pytest.approx(np.poly(m)[1:] * signs, rel=1e-11, abs=1e-12)


def test_the_first_map_acts_first() -> None:
    a = np.array([[1.0, 2.0], [0.0, 1.0]])
    b = np.array([[0.5, 0.0], [1.0, 3.0]])
    total, log = product(np.array([a, b]))
    assert total * math.exp(log) == pytest.approx(b @ a)


def test_tests_are_smooth_where_multipliers_meet() -> None:
    # λ² - λ + 1/4 - t: the multipliers meet as a root of t, but det(I - M) = 1/4 - t
    for t in (-1e-9, 0.0, 1e-9):
        found = spectrum(np.array([[[0.0, 1.0], [t - 0.25, 1.0]]]))
        assert math.sinh(found.tests[0]) == pytest.approx(0.25 - t, abs=1e-15)


def test_growth_of_hundreds_does_not_overflow() -> None:
    # 50 maps that grow by e^20 in one direction and decay in the others: multipliers e^1000, e^-50, e^-100
    maps = np.repeat(np.diag([math.exp(20.0), math.exp(-1.0), math.exp(-2.0)])[None], 50, axis=0)
    found = spectrum(maps)
    assert np.isfinite(found.multipliers).all()
    assert not found.stable
    # e_1 = e^1000, of which asinh is the logarithm plus ln 2
    assert found.coefficients[0] == pytest.approx(1000.0 + math.log(2.0))
    assert all(math.isnan(test) or math.isfinite(test) for test in found.tests)


def test_rotation_on_the_unit_circle_is_not_stable_and_inside_is() -> None:
    assert not spectrum(np.array([rotation(1.0, 1.0)])).stable
    assert spectrum(np.array([rotation(1.0, 1.0 - 1e-6)])).stable


def test_resonant_pair_is_the_one_with_product_one() -> None:
    assert resonant_pair([3.0, 0.9, 0.34]) == (3.0, 0.34)
    assert resonant_pair([3.0]) is None
