"""Two modes followed along a parameter, against closed forms and single oscillators."""

import math

import numpy as np
import pytest

from brakecli.analysis.stability.follow import Pair, followed
from brakecli.analysis.stability.modes import modes
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.links import coefficients
from tests.analysis.test_stability import full_matrix, random_shoe
from tests.campaign import counts


def values_of(pair: Pair | None) -> list[complex]:
    assert pair is not None
    return [complex(mode.growth, 2.0 * math.pi * mode.frequency) for mode in pair]


def oscillators(b_1: float, b_2: float, c_1: float, mass: float = 2.0) -> Coefficients:
    """Link 1 across the wheel and link 2 along it, without coupling."""
    return coefficients(mass=mass, c_1=c_1, b_1=b_1, beta_deg=0, c_2=50.0, b_2=b_2, alpha_deg=0, phi=0)


def test_modes_of_the_minimal_model_meet_as_its_closed_form_says() -> None:
    c = Coefficients(1.0, 0.0, 0.0, 0.0, 2.0, -1.0, 2.0 - 4.0 / 3.0, 0.0, 1.0, 0.0)
    frictions = np.linspace(0.0, 1.5, 76)
    found = list(followed(tuple(modes(c, 4.0 / 3.0, phi)) for phi in frictions))
    for phi, pair in zip(frictions, found, strict=True):
        root = np.emath.sqrt(1.0 - 4.0 * phi / 3.0)  # of ω² = 2 ± root: real below 0.75
        low = 1j * np.sqrt(2.0 - root + 0j)
        high = 1j * np.sqrt(2.0 + root + 0j)
        expected = [low, high] if phi < 0.75 else sorted([low, high], key=lambda value: -value.real)
        # where modes meet, rounding of 1e-16 in the squares is one of 1e-8 in their roots
        assert values_of(pair) == pytest.approx(expected, abs=1e-7 if abs(phi - 0.75) < 0.01 else 1e-12)


def test_modes_that_cross_without_coupling_stay_what_they_are() -> None:
    stiffness = np.linspace(20.0, 90.0, 8)
    found = list(followed(tuple(modes(oscillators(0.1, 0.2, c_1), 0.0, 0.0)) for c_1 in stiffness))
    across, along = zip(*map(values_of, found), strict=True)
    assert along == pytest.approx([-0.05 + 1j * math.sqrt(50.0 / 2.0 - 0.05**2)] * 8, rel=1e-12)
    assert across == pytest.approx([-0.025 + 1j * math.sqrt(c_1 / 2.0 - 0.025**2) for c_1 in stiffness], rel=1e-12)


@pytest.mark.parametrize(("b_1", "b_2"), [(50.0, 0.1), (50.0, 22.0), (21.0, 100.0), (200.0, 0.0)])
def test_a_pair_of_real_eigenvalues_is_one_mode_of_no_frequency_and_the_larger_growth(
    b_1: float, b_2: float
) -> None:
    (pair,) = followed([tuple(modes(oscillators(b_1, b_2, 50.0), 0.0, 0.0))])
    expected = [max(np.roots([2.0, b, 50.0]), key=lambda s: (s.imag, s.real)) for b in (b_1, b_2)]
    assert sorted(values_of(pair), key=abs) == pytest.approx(sorted(expected, key=abs), rel=1e-9)
    assert all(mode.frequency == 0.0 or mode.damping_ratio < 1.0 for mode in pair or ())


def test_a_gap_leaves_the_modes_in_their_order() -> None:
    first, *_, last = (tuple(modes(oscillators(0.1, 0.2, c_1), 0.0, 0.0)) for c_1 in (20.0, 30.0, 90.0))
    found = list(followed([(), first, (), last]))
    assert found[0] is found[2] is None
    assert values_of(found[1])[0].imag < values_of(found[1])[1].imag
    assert values_of(found[3])[0].imag > values_of(found[3])[1].imag


@pytest.mark.parametrize("shoes", counts(10, 100))
def test_neighbours_are_nearest_wherever_two_eigenvalues_are_far_apart(shoes: int) -> None:
    """The eigenvalues are computed here, from the whole matrix; modes apart by ten steps cannot be confused."""
    rng = np.random.default_rng(8)
    compared = 0
    for _ in range(shoes):
        c, k = random_shoe(rng, 10.0 ** rng.uniform(1.0, 4.0))
        frictions = np.linspace(0.0, 2.0, 201)
        found = [values_of(pair) for pair in followed(tuple(modes(c, k, phi)) for phi in frictions)]
        for phi, before, now in zip(frictions[1:], found, found[1:], strict=False):
            exact = np.linalg.eigvals(full_matrix(c, k, phi))
            size = np.abs(exact).max()
            for value in now:
                assert np.abs(exact - value).min() < 1e-7 * size
            moved, swapped = (
                max(abs(a - b) for a, b in zip(before, each, strict=True)) for each in (now, now[::-1])
            )
            if abs(now[0] - now[1]) > 10.0 * min(moved, swapped):
                assert moved < swapped
                compared += 1
    assert compared > 100 * shoes
