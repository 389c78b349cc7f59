"""Profiles as sums of sines, and the phases of a wheel that has travelled far."""

import math
from fractions import Fraction
from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brakecli.solver import contact
from brakecli.solver.contact.force import fill
from brakecli.solver.contact.pad import build_layer, build_pad
from brakecli.solver.roughness import PI, height, surface, wheel_angles
from brakecli.solver.schedules import integral_at, schedule
from tests.solver.rough_gap import EPS, Gap, Wave

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

SHOE = ((12e-6, 0.02, 10.0), (-7e-6, 0.0071, 200.0))
WHEEL = ((20e-6, 0.025, 0.0), (9e-6, 0.0113, 30.0), (5e-6, 0.0037, 311.0))
A = 0.03
K = 3e8


def travelled(times: list[float], speeds: list[float], radius: float, t: Fraction) -> Fraction:
    """The wheel's exact way from 0 to t, after the last knot; the first knot is at 0."""
    at = [(Fraction(time), Fraction(speed) * Fraction(radius)) for time, speed in zip(times, speeds, strict=True)]
    way = sum(((v + w) / 2 * (end - start) for (start, v), (end, w) in pairwise(at)), Fraction(0))
    return way + at[-1][1] * (t - at[-1][0])


def exact_force(numbers: list[Any], x: float, y: float, way: Fraction) -> Any:
    """F_y with 50 digits: roots refined by Newton, the integrals from their antiderivatives."""
    waves = [
        (mpf(g), omega, omega * (mpf(x) - mpf(way)) + mpf(np.radians(phase)))
        for (g, _, phase), omega in zip(WHEEL, numbers, strict=True)
    ]
    waves += [(-mpf(g), 2 * mpmath.pi / mpf(length), mpf(np.radians(phase))) for g, length, phase in SHOE]

    def gap(xi: Any) -> Any:
        return sum(g * mpmath.sin(omega * xi + psi) for g, omega, psi in waves) - mpf(y)

    def whole(xi: Any) -> Any:
        return sum(-g / omega * mpmath.cos(omega * xi + psi) for g, omega, psi in waves) - mpf(y) * xi

    reduced = tuple(  # the same gap in doubles, its phases reduced, to know about where the roots are
        Wave(float(g), float(2 * mpmath.pi / omega), float(mpmath.fmod(psi, 2 * mpmath.pi) * 180 / mpmath.pi))
        for g, omega, psi in waves
    )
    near = Gap((), reduced, A, 0.0, y).touching()
    total = mpmath.mpf(0)
    for piece in near:
        left, right = (
            mpf(end) if abs(gap(mpf(end))) > mpmath.mpf(10) ** -14 else mpmath.findroot(gap, mpf(end))
            for end in piece
        )
        total += whole(right) - whole(left)
    return mpf(K) * total


@pytest.mark.parametrize("evaluator", ["closed-form", "exact"])
@pytest.mark.parametrize("t_low", [0.0, 3.7e-12, 0.37])
@pytest.mark.parametrize(
    ("times", "speeds", "t"),
    [
        ([0.0], [91.7], 98765.4321),
        ([0.0], [-91.7], 98765.4321),
        ([0.0, 1234.5, 60000.1, 98765.1], [3.3, 120.7, 55.5, 141.3], 98765.4321),
        ([0.0, 1234.5, 98765.6, 98765.7], [3.3, 120.7, 155.5, 141.3], 98765.4321),
    ],
)
@pytest.mark.parametrize("by_number", [False, True])
def test_the_force_after_ten_thousand_kilometres_is_that_of_the_same_doubles(
    evaluator: str, t_low: float, times: list[float], speeds: list[float], t: float, by_number: bool
) -> None:
    radius = 1.1037
    x = 3.21e-5
    y = -8e-5 if evaluator == "closed-form" else -4.3e-6
    given_numbers = [2 * math.pi / length for _, length, _ in WHEEL]
    g = [each[0] for each in WHEEL]
    phase = [each[2] for each in WHEEL]
    if by_number:
        wheel = surface(g, wavenumbers=given_numbers, phases_deg=phase)
        numbers = [mpf(number) for number in given_numbers]
    else:
        wheel = surface(g, wavelengths=[each[1] for each in WHEEL], phases_deg=phase)
        numbers = [2 * mpmath.pi / mpf(each[1]) for each in WHEEL]
    shoe = surface(
        [each[0] for each in SHOE], wavelengths=[each[1] for each in SHOE], phases_deg=[each[2] for each in SHOE]
    )
    layer = build_layer(evaluator, build_pad(K, A, shoe, wheel, 0))
    wheel_angles(wheel.waves, *integral_at(schedule(times, speeds, radius), t, t_low), layer.angles)
    fill(x, y, *layer)
    found = layer.contact

    time = Fraction(t) + Fraction(t_low)
    if time > Fraction(times[-1]):
        way = travelled(times, speeds, radius, time)
    else:  # between the last knots but one and two
        reached = next(i for i in range(len(times)) if Fraction(times[i + 1]) >= time)
        start = Fraction(times[reached])
        v = Fraction(speeds[reached]) * Fraction(radius)
        w = Fraction(speeds[reached + 1]) * Fraction(radius)
        slope = (w - v) / (Fraction(times[reached + 1]) - start)
        way = travelled(times[: reached + 1], speeds[: reached + 1], radius, start)
        way += (v + slope * (time - start) / 2) * (time - start)
    assert abs(way) > 9e6
    scale = 2 * A * K * (abs(y) + 53e-6)
    assert abs(mpf(float(found.normal_force)) - exact_force(numbers, x, y, way)) <= 1e-9 * scale
    # What is really reached: phases up to 2 pi a/3.7 mm = 51 rad, in a few roundings.
    assert abs(mpf(float(found.normal_force)) - exact_force(numbers, x, y, way)) <= 8 * 51 * EPS * scale
    assert contact.kinds()[found.kind] == evaluator
    if evaluator == "exact":
        assert 0.0 < found.normal_force < 0.5 * scale


@given(st.integers(1, 10**9))
@settings(max_examples=20)
def test_whole_waves_bring_the_phases_back(turns: int) -> None:
    """A travel of whole wavelengths, 1/64 m each, is a double: the angles return to the bit."""
    wheel = surface([1e-6, 1e-6], wavelengths=[1 / 64, 1 / 32], phases_deg=[10.0, 20.0])
    start = np.zeros(2)
    later = np.zeros(2)
    wheel_angles(wheel.waves, 0.0, 0.0, start)
    wheel_angles(wheel.waves, 2 * turns / 64, 0.0, later)
    np.testing.assert_array_equal(later, start)
