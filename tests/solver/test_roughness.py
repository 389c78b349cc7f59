"""Profiles as sums of sines, and the phases of a wheel that has travelled far."""

import math
from fractions import Fraction
from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brakecli.solver.roughness import PI, height, surface, wheel_angles
from tests.solver.rough_gap import EPS

mpmath: Any = import_module("mpmath")  # imported so because it has no type hints
mpmath.mp.dps = 50

amplitudes = st.floats(-1e-3, 1e-3).filter(lambda g: abs(g) > 1e-9)
lengths = st.floats(1e-4, 10.0)
phases = st.floats(-720, 720)
waves = st.lists(st.tuples(amplitudes, lengths, phases), min_size=1, max_size=8)


def mpf(value: Fraction | float) -> Any:
    exact = Fraction(value)
    return mpmath.mpf(exact.numerator) / exact.denominator


def test_pi_has_fifty_digits() -> None:
    assert abs(mpf(PI) - mpmath.pi) < mpmath.mpf(10) ** -48


@given(waves, st.floats(-0.1, 0.1), st.booleans())
def test_a_profile_is_the_sum_of_its_sines(
    terms: list[tuple[float, float, float]], xi: float, by_number: bool
) -> None:
    g, length, phase = (list(column) for column in zip(*terms, strict=True))
    numbers = [2 * math.pi / each for each in length]
    waves: dict[str, Any] = {"wavenumbers": numbers} if by_number else {"wavelengths": length}
    f = surface(g, phases_deg=phase, **waves)
    expected = sum(
        mpf(a)
        * mpmath.sin(
            (mpf(number) if by_number else 2 * mpmath.pi / mpf(each)) * mpf(xi) + mpf(p) * mpmath.pi / 180
        )
        for a, each, number, p in zip(g, length, numbers, phase, strict=True)
    )
    # Phases of up to 2 pi 0.1/1e-4 + 4 pi rad round to a few units in their last place.
    tolerance = sum(
        abs(a) * 4 * EPS * (abs(n * xi) + abs(math.radians(p)) + 2)
        for a, n, p in zip(g, numbers, phase, strict=True)
    )
    assert height(f, np.array([xi]))[0] == pytest.approx(float(expected), rel=0, abs=tolerance)


@given(st.lists(lengths, min_size=1, max_size=5))
def test_waves_per_metre_are_known_to_32_digits(each: list[float]) -> None:
    by_length = surface([1e-6] * len(each), wavelengths=each)
    by_number = surface([1e-6] * len(each), wavenumbers=each)
    for i, value in enumerate(each):
        for f, expected in ((by_length, 1 / mpf(value)), (by_number, mpf(value) / (2 * mpmath.pi))):
            found = mpf(f.turns[i]) + mpf(f.turns_low[i])
            assert abs(found - expected) <= mpmath.mpf(2) ** -105 * expected
            assert f.omega[i] == pytest.approx(float(2 * mpmath.pi * expected), rel=EPS)


def test_terms_without_amplitude_are_left_out_and_none_is_smooth() -> None:
    f = surface([1e-6, 0.0, -2e-6], wavelengths=[0.1, 0.2, 0.3], phases_deg=[0.0, 1.0, 90.0])
    assert f.g.tolist() == [1e-6, -2e-6]
    assert f.turns.tolist() == [10.0, 1 / 0.3]
    assert f.phase.tolist() == [0.0, math.pi / 2]
    for smooth in (surface(), surface([]), surface([0.0], wavelengths=[1.0])):
        assert [column.size for column in smooth] == [0] * 5
        assert height(smooth, np.linspace(-1, 1, 3)).tolist() == [0.0, 0.0, 0.0]


def test_lists_of_unequal_length_are_refused() -> None:
    with pytest.raises(ValueError, match="zip"):
        surface([1e-6, 2e-6], wavelengths=[0.1])


@given(waves, st.floats(-1e7, 1e7), st.floats(-1e-10, 1e-10))
def test_the_wheel_s_phases_stay_exact_over_ten_thousand_kilometres(
    terms: list[tuple[float, float, float]], travel: float, travel_low: float
) -> None:
    g, length, phase = (list(column) for column in zip(*terms, strict=True))
    wheel = surface(g, wavelengths=length, phases_deg=phase)
    angles = np.full(wheel.g.size, np.nan)
    wheel_angles(wheel.waves, travel, travel_low, angles)
    way = mpf(travel) + mpf(travel_low)
    for i, each in enumerate(length):
        assert abs(angles[i] - wheel.phase[i]) <= 2 * math.pi * (1 + 4 * EPS)  # reduced
        exact = mpf(wheel.phase[i]) - 2 * mpmath.pi * way / mpf(each)
        # 32 digits of up to 1e11 waves leave 1e-20; then a few roundings of up to 2 pi + the phase given.
        off = mpmath.sin((mpf(float(angles[i])) - exact) / 2)
        assert abs(off) <= 4 * EPS * (2 * math.pi + abs(wheel.phase[i]))


# --- the force after ten thousand kilometres -----------------------------------------------------------------


def travelled(times: list[float], speeds: list[float], radius: float, t: Fraction) -> Fraction:
    """The wheel's exact way from 0 to t, after the last knot; the first knot is at 0."""
    at = [(Fraction(time), Fraction(speed) * Fraction(radius)) for time, speed in zip(times, speeds, strict=True)]
    way = sum(((v + w) / 2 * (end - start) for (start, v), (end, w) in pairwise(at)), Fraction(0))
    return way + at[-1][1] * (t - at[-1][0])
