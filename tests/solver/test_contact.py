"""The contact force, its derivatives, its store: evaluators against quadrature, identities and each other."""

import math
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from brakecli.case.system import system_of
from brakecli.solver.contact import CELLS, CLOSED_FORM, cells
from brakecli.solver.contact import EVALUATORS as ROWS
from brakecli.solver.contact.closed_form import CLEAR, FULL, coverage, full_contact, full_press
from brakecli.solver.contact.force import fill
from brakecli.solver.contact.pad import build_layer, build_pad, default_nodes
from brakecli.solver.roughness import Surface, surface
from tests.campaign import campaign, counts
from tests.examples import ROUGH, make
from tests.solver.rough_gap import EPS, EVALUATORS, Gap, Wave, gaps, outputs, unfilled

# Case B of the roughness: five waves on each surface.
CASE_B_SHOE = (Wave(30e-6, 0.020), Wave(21e-6, 0.011), Wave(15e-6, 0.007), Wave(9e-6, 0.005), Wave(6e-6, 0.003))
CASE_B_WHEEL = (Wave(30e-6, 0.025), Wave(24e-6, 0.013), Wave(18e-6, 0.008), Wave(12e-6, 0.006), Wave(6e-6, 0.004))

DEFAULT_RMS = {"midpoint": (1e-4, 4e-4), "cells": (1e-5, 4e-4)}


def case_b(x: float, y: float, travel: float) -> Gap:
    return Gap(CASE_B_SHOE, CASE_B_WHEEL, 0.05, x, y, travel, 5e7)


# --- exact against quadrature --------------------------------------------------------------------------------


@given(gaps())
@settings(max_examples=120)
@campaign
def test_exact_agrees_with_quadrature_between_the_roots(gap: Gap) -> None:
    found = gap.evaluate("exact")
    k = gap.k
    length = 2 * gap.a
    delta = gap.rounding
    height = abs(gap.y) + gap.crest
    steep = gap.steepest(wheel_only=True)
    # Sums of n terms round n times, and quadrature adds once its accuracy, that of the integrand.
    n = 2 + gap.sines[0].size
    force = k * gap.integral(gap.value, delta)
    assert found.normal_force == pytest.approx(force, rel=0, abs=k * length * delta * n)
    store = 0.5 * k * gap.integral(lambda xi: gap.value(xi) ** 2, height * delta)
    assert found.store == pytest.approx(store, rel=0, abs=k * length * height * delta * n)
    store_x = k * gap.integral(lambda xi: gap.value(xi) * gap.wheel_slope(xi), steep * delta)
    assert found.store_x == pytest.approx(store_x, rel=0, abs=k * length * steep * delta * n)
    # Rounding moves the gap by at most delta, so the touching set lies between those where it exceeds +-delta.
    least = gap.length(delta) - 8 * EPS * length
    most = gap.length(-delta) + 8 * EPS * length
    assert k * least <= found.stiffness <= k * most
    assert found.fraction == pytest.approx(found.stiffness / (k * length), rel=4 * EPS)
    rise = k * gap.integral(gap.wheel_slope, steep * 1e4 * EPS)  # phases up to 2000 rad
    assert found.tangential == pytest.approx(
        rise, rel=0, abs=k * (steep * (most - least) + (height + steep * length) * n * 1e4 * EPS)
    )
    assert (found.kind, found.valid) == (2, 1)


@given(gaps(-3.0, -1.01, most=4))
def test_the_evaluators_agree_where_the_pad_touches_everywhere(gap: Gap) -> None:
    closed, exact, auto = (gap.evaluate(name) for name in ("closed-form", "exact", "auto"))
    height = abs(gap.y) + gap.crest
    steep = gap.steepest(wheel_only=True)
    scale = 2 * gap.a * gap.k * np.array([height, 1, steep, 0, height**2, height * steep])
    scale[3] = 1  # fraction
    # The phases, up to 2 pi (x + travel)/wavelength = 1600, round to 1600 EPS = 4e-13 rad; four times that.
    assert np.all(np.abs(outputs(closed) - outputs(exact)) <= 2e-12 * scale)
    np.testing.assert_array_equal(auto, closed)
    assert closed.valid == 1
    assert gap.evaluate("midpoint").normal_force == pytest.approx(
        exact.normal_force, rel=0, abs=2e-12 * gap.force_scale
    )


@given(gaps(-3.0, -1.01), st.sampled_from(EVALUATORS))
def test_a_fully_touching_pad_obeys_the_closed_form(gap: Gap, evaluator: str) -> None:
    def mean(waves: tuple[Wave, ...], shift: float) -> float:
        total = 0.0
        for wave in waves:
            omega = 2 * math.pi / wave.length
            sinc = math.sin(omega * gap.a) / (omega * gap.a)
            total += wave.g * sinc * math.sin(omega * shift + math.radians(wave.phase))
        return total

    expected = 2 * gap.a * gap.k * (mean(gap.wheel, gap.x - gap.travel) - mean(gap.shoe, 0.0) - gap.y)
    # 1e-12: phases of up to 1600 rad are known to 4e-13 rad, here and there.
    found = gap.evaluate(evaluator).normal_force
    assert found == pytest.approx(expected, rel=0, abs=1e-12 * gap.force_scale)


@given(gaps(1.01, 3.0), st.sampled_from(EVALUATORS))
def test_an_open_pad_gives_nothing_at_all(gap: Gap, evaluator: str) -> None:
    found = gap.evaluate(evaluator)
    np.testing.assert_array_equal(outputs(found), 0.0)
    assert found.valid == 1


@given(gaps(-3.0, -1.01), st.floats(-0.01, 0.01), st.sampled_from(EVALUATORS))
def test_the_shoe_s_own_roughness_drops_out_of_full_contact_but_for_a_constant(
    gap: Gap, dx: float, evaluator: str
) -> None:
    smooth = Gap((), gap.wheel, gap.a, gap.x, gap.y, gap.travel, gap.k)
    assume(smooth.crest > 0)
    rough = [gap.evaluate(evaluator, dx=each).normal_force for each in (0.0, dx)]
    bare = [smooth.evaluate(evaluator, dx=each).normal_force for each in (0.0, dx)]
    # Rounding of the same phases cancels; the tables' and the sums' remain: a few EPS per wave.
    tolerance = 1e-13 * gap.force_scale
    assert rough[1] - bare[1] == pytest.approx(rough[0] - bare[0], rel=0, abs=2 * tolerance)
    if all(wave.phase == 0.0 for wave in gap.shoe):
        assert rough[0] == pytest.approx(bare[0], rel=0, abs=tolerance)


# --- midpoint against exact ----------------------------------------------------------------------------------


@given(gaps(), st.sampled_from([64, 128, 512]))
@campaign
def test_the_midpoint_rule_errs_downwards_and_by_no_more_than_its_kinks_explain(gap: Gap, nodes: int) -> None:
    """On a cell the rule takes max(mean gap, 0), at most the mean of max(gap, 0); they differ only where the gap
    changes its sign in the cell, by min(∫ gap+, ∫ gap-) <= slope spacing²/8.
    """
    # Two surfaces that match exactly leave a gap that is rounding alone: whether it touches is chance.
    assume(np.abs(gap.values(np.linspace(-gap.a, gap.a, 33))).max() > gap.rounding)
    exact = gap.evaluate("exact")
    found = gap.evaluate("midpoint", nodes=nodes)
    spacing = 2 * gap.a / nodes
    roots = 2 * len(gap.extremes)
    # Rounding of the gap, and of the sum over the nodes: half a unit in the last place for each addition.
    rounding = 2 * gap.a * gap.k * gap.rounding * (1 + gap.sines[0].size) + nodes * EPS / 2 * exact.normal_force
    error = exact.normal_force - found.normal_force
    assert -rounding <= error <= gap.k * gap.steepest() * spacing**2 / 8 * roots + rounding
    # A cell counts as touching as a whole: wrong by less than a cell at each root.
    assert found.stiffness == pytest.approx(exact.stiffness, rel=0, abs=gap.k * spacing * (roots + 1e-9))
    assert found.fraction == pytest.approx(found.stiffness / (2 * gap.a * gap.k), rel=4 * EPS)


@campaign
def test_the_midpoint_error_falls_with_the_square_of_the_spacing() -> None:
    """A root where the gap has the slope s, at v spacings from the nearest edge of a cell, makes the force
    k |s| spacing² v²/2 too small. v is uniform in 0 ... 1/2, so that the mean error is k spacing² sum |s| / 24.
    """
    nodes = (64, 128, 256, 512, 1024, 2048, 4096)
    positions = 400
    rng = np.random.default_rng(20)
    pads = [case_b(0.0, 0.0, 0.0).pad(n) for n in nodes]
    errors = np.zeros((positions, len(nodes)))
    slopes = np.zeros(positions)
    forces = np.zeros(positions)
    xi = np.linspace(-0.05, 0.05, 5001)
    for i in range(positions):
        at = case_b(rng.uniform(-1e-3, 1e-3), rng.uniform(-60e-6, 0.0), rng.uniform(0.0, 1.0))
        forces[i] = at.evaluate("exact", pad=pads[0]).normal_force
        errors[i] = [forces[i] - at.evaluate("midpoint", pad=pad).normal_force for pad in pads]
        slopes[i] = np.sum(np.abs(at.values(xi, 1)[:-1])[np.diff(at.values(xi) > 0)])
    rms = np.sqrt(np.mean(errors**2, axis=0))
    order = -np.polyfit(np.log2(nodes), np.log2(rms), 1)[0]
    assert order == pytest.approx(2.0, abs=0.1)
    for coarse, fine in pairwise(rms):  # every doubling; the scatter of 400 positions is below a tenth
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.15)
    # v² scatters by 0.9 of its mean: by one hundredth over 400 positions with some 20 roots; four times that.
    for n, error in list(zip(nodes, errors.T, strict=True))[2:]:
        assert error.mean() == pytest.approx(5e7 * (0.1 / n) ** 2 / 24 * slopes.mean(), rel=0.04)
    assert 0.25 < np.mean(forces > 0) <= 1.0


@campaign
@pytest.mark.parametrize("name", ["midpoint", "cells"])
def test_default_nodes_keep_the_force_to_a_few_parts_in_ten_thousand(name: str) -> None:
    """The figure that `nodes_per_wave` is chosen by: rms 3e-4 of 2ak (sum of amplitudes) over random surfaces and
    positions. With n nodes to a wave that of midpoint can never exceed 2 pi/(4 n²): two roots per shortest wave,
    slopes <= 2 pi/wave.
    """
    rng = np.random.default_rng(21)
    errors = []
    for _ in range(200):
        shoe, wheel = (
            tuple(
                Wave(rng.uniform(1e-6, 5e-5), 10 ** rng.uniform(-2.6, -1.0), rng.uniform(0, 360))
                for _ in range(rng.integers(0, 7))
            )
            for _ in range(2)
        )
        a = 10 ** rng.uniform(-2.3, -1.0)
        gap = Gap(shoe, wheel, a, 0.0, 0.0)
        pad = gap.pad(default_nodes(name, a, *gap.surfaces))
        for _ in range(10):
            at = Gap(shoe, wheel, a, rng.uniform(-1e-3, 1e-3), rng.uniform(-1, 1) * gap.crest, rng.uniform(0, 1))
            forces = [at.evaluate(each, pad=pad).normal_force for each in (name, "exact")]
            errors.append((forces[0] - forces[1]) / (2 * a * gap.k * (gap.crest or 1.0)))
    assert len(errors) == 2000
    assert DEFAULT_RMS[name][0] < np.sqrt(np.mean(np.square(errors))) < DEFAULT_RMS[name][1]
    assert max(map(abs, errors)) < 2 * math.pi / (4 * ROWS[name].nodes_per_wave ** 2)


@pytest.mark.parametrize(("waves", "nodes"), [((), 64), ((0.1,), 64), ((0.1, 0.02), 128), ((0.001,), 1600)])
def test_default_nodes_resolve_the_shortest_wave(waves: tuple[float, ...], nodes: int) -> None:
    rough = surface([1e-6] * len(waves), wavelengths=waves)
    found = [default_nodes("midpoint", 0.05, *surfaces) for surfaces in ((rough, surface()), (surface(), rough))]
    assert found == [nodes, nodes]


# --- cells against exact -------------------------------------------------------------------------------------


def open_gap(rng: np.random.Generator) -> Gap:
    """Up to four waves on each surface, 6 to 100 mm long, at any height at which the pad may touch in part."""
    sides = [
        tuple(
            Wave(rng.uniform(5e-6, 5e-5), 0.006 * 16.0 ** rng.uniform(), rng.uniform(0, 360))
            for _ in range(rng.integers(1, 5))
        )
        for _ in range(2)
    ]
    gap = Gap(sides[0], sides[1], 0.05, rng.uniform(-1e-3, 1e-3), 0.0, rng.uniform(0, 1))
    return Gap(gap.shoe, gap.wheel, gap.a, gap.x, 0.9 * rng.uniform(-1, 1) * gap.crest, gap.travel)


@pytest.mark.parametrize("many", counts(300, 1000))
def test_the_error_of_cells_falls_with_the_third_power_of_their_length(many: int) -> None:
    """In the force. An edge of a patch is misplaced by what bends the gap, with the second power: so are
    stiffness, fraction and ∂F_y/∂x. The store is the integral of the force over the height, ∂V/∂x that of ∂F_y/∂x.
    """
    rng = np.random.default_rng(50)
    nodes = (128, 256, 512, 1024)
    errors = np.zeros((many, len(nodes), 6))
    for i in range(many):
        gap = open_gap(rng)
        exact = outputs(gap.evaluate("exact"))
        steep = gap.steepest(wheel_only=True)
        size = 2 * gap.a * gap.k * np.array([gap.crest, 1, steep, 0, gap.crest**2, gap.crest * steep])
        size[3] = 1.0
        errors[i] = [(outputs(gap.evaluate("cells", nodes=n)) - exact) / size for n in nodes]
    mean = np.mean(np.abs(errors), axis=0)
    orders = -np.polyfit(np.log2(nodes), np.log2(mean), 1)[0]
    assert np.all(orders > np.array([3.0, 2.0, 2.0, 2.0, 3.0, 3.0]) - 0.1)
    assert mean[0, 0] < 3e-5  # with 7.7 cells to the shortest wave; measured 1.7e-5


@pytest.mark.parametrize("many", counts(40, 400))
def test_what_cells_leave_out_is_known(many: int) -> None:
    """It is the error of the force but for the fifth power, patches and holes within a cell included. Without the
    part of fourth power it would be off by as much as it is: that of third power is small where a gap is zero.
    """
    rng = np.random.default_rng(51)
    nodes = (256, 512)
    left = np.zeros((many, 2))
    errors = np.zeros((many, 2))
    for i in range(many):
        gap = open_gap(rng)
        exact = gap.evaluate("exact").normal_force
        for j, n in enumerate(nodes):
            layer = build_layer("cells", gap.pad(n))
            layer.angles[:] = gap.angles
            fill(gap.x, gap.y, *layer)
            errors[i, j] = (exact - layer.contact.normal_force) / gap.force_scale
            left[i, j] = cells.left_out(gap.y, layer.layer, layer.scratch) / gap.force_scale
    rms = np.sqrt(np.mean(errors**2, axis=0))
    off = np.sqrt(np.mean((left - errors) ** 2, axis=0))
    assert np.all(off < [0.05 * rms[0], 0.02 * rms[1]])
    assert math.log2(off[0] / off[1]) > 4.0


def test_a_patch_and_a_hole_within_a_cell_are_known() -> None:
    """A wave of which only the crest touches, or does not, 1/300 of its height deep: 0.6 of a cell long.

    With 24 cells to a wave, z = π/24, a parabola through the heights misses a crest by some z⁴ = 3e-4 of its
    height, a tenth of the depth or less, whatever of the patch the cells see.
    """
    missed = []
    for sign in (1.0, -1.0):
        for shift in np.linspace(0.0, 1.0, 12):  # of a cell
            wheel = (Wave(sign * 1e-5, 0.02, 0.0),)
            gap = Gap((), wheel, 0.05, 0.02 * shift / 24.0, sign * 1e-5 * (1.0 - 1.0 / 300.0))
            deep = Gap((), wheel, gap.a, gap.x, -2e-5)
            whole = gap.evaluate("exact").normal_force
            if sign < 0.0:  # the hole
                whole -= gap.k * (deep.evaluate("exact").normal_force / gap.k - 2 * gap.a * (gap.y + 2e-5))
            layer = build_layer("cells", gap.pad(120))
            layer.angles[:] = gap.angles
            fill(gap.x, gap.y, *layer)
            off = gap.evaluate("exact").normal_force - layer.contact.normal_force
            assert abs(off - cells.left_out(gap.y, layer.layer, layer.scratch)) < 0.1 * whole
            missed.append(abs(off) / whole)
    assert max(missed) > 0.3
    assert min(missed) < 0.3


def test_few_nodes_tell_the_shortest_wave() -> None:
    for length, nodes, taken in ((0.01, 2, 40), (0.01, 41, 42), (1.0, 2, 2), (1.0, 3, 4), (0.001, 64, 400)):
        rough = {"amplitudes": [1e-6], "wavelengths": [length]}
        system = system_of(make(ROUGH, roughness__wheel=rough, roughness__shoe=None, contact__nodes=nodes))
        assert system.half_length == 0.05
        assert system.nodes == taken


# --- derivatives ---------------------------------------------------------------------------------------------


@given(gaps(least=1), st.sampled_from(EVALUATORS), st.floats(1e-4, 0.3))
@campaign
def test_stiffness_is_the_force_s_derivative(gap: Gap, evaluator: str, part: float) -> None:
    """F_y is convex in y, so that a difference quotient lies between the stiffnesses at its two ends."""
    eta = part * gap.crest
    pad = gap.pad()
    near, far = (gap.evaluate(evaluator, dy=dy, pad=pad) for dy in (-eta, eta))
    assume(near.valid == far.valid == 1)
    quotient = (near.normal_force - far.normal_force) / (2 * eta)
    rounding = 2 * gap.a * gap.k * gap.rounding * (1 + gap.sines[0].size) / eta
    assert far.stiffness - rounding <= quotient <= near.stiffness + rounding


@given(gaps(least=1), st.sampled_from(EVALUATORS))
@campaign
def test_tangential_is_the_force_s_derivative_along_the_wheel(gap: Gap, evaluator: str) -> None:
    """Between x - eta and x + eta the slope under the pad changes by eta times f2's curvature, and the touching
    set by no more than the gap moves: what touches at y - eta slope but not at y + eta slope.
    """
    nodes = 256
    eta = 1e-7
    steep = gap.steepest(wheel_only=True)
    curved = gap.steepest(2, wheel_only=True)
    assume(steep > 0)
    pad = gap.pad(nodes)
    before, at, after = (gap.evaluate(evaluator, dx=dx, pad=pad) for dx in (-eta, 0.0, eta))
    wide, narrow = (gap.evaluate(evaluator, dy=dy * eta * steep, pad=pad).stiffness for dy in (-1.001, 1.001))
    assume(before.valid == at.valid == after.valid == 1)
    quotient = (after.normal_force - before.normal_force) / (2 * eta)
    rounding = 2 * gap.a * gap.k * gap.rounding * (1 + gap.sines[0].size)
    tolerance = 2 * gap.a * gap.k * eta * curved + steep * (wide - narrow) + rounding / eta
    if at.kind == 1:  # f2' from neighbouring nodes: omega spacing replaced by its sine, 1 - sinc z <= z²/6
        g, omega, _ = (column[: len(gap.wheel)] for column in gap.sines)
        tolerance += 2 * gap.a * gap.k * float(np.sum(np.abs(g) * omega * (omega * 2 * gap.a / nodes) ** 2 / 6))
    assert at.tangential == pytest.approx(quotient, rel=0, abs=tolerance)


@given(gaps(least=1), st.sampled_from(EVALUATORS))
def test_the_store_s_derivatives_are_the_forces(gap: Gap, evaluator: str) -> None:
    """V has a bounded second derivative M in x and in y, so that a central difference is right to M eta/2."""
    nodes = 256
    height = abs(gap.y) + gap.crest
    steep = gap.steepest(wheel_only=True)
    pad = gap.pad(nodes)
    stiffness = 2 * gap.a * gap.k
    at = gap.evaluate(evaluator, pad=pad)
    rounding = stiffness * height * gap.rounding * (1 + gap.sines[0].size)
    eta = 1e-4 * height
    ends = [gap.evaluate(evaluator, dy=dy, pad=pad) for dy in (-eta, eta)]
    assume(all(end.valid == 1 and end.kind == at.kind for end in (*ends, at)))
    quotient = (ends[0].store - ends[1].store) / (2 * eta)
    assert at.normal_force == pytest.approx(quotient, rel=0, abs=stiffness * eta / 2 + rounding / eta)
    eta = 1e-6
    bend = stiffness * (steep**2 + height * gap.steepest(2, wheel_only=True))
    ends = [gap.evaluate(evaluator, dx=dx, pad=pad) for dx in (-eta, eta)]
    quotient = (ends[1].store - ends[0].store) / (2 * eta)
    tolerance = bend * eta / 2 + rounding / eta
    if at.kind == 1:  # as above
        g, omega, _ = (column[: len(gap.wheel)] for column in gap.sines)
        tolerance += stiffness * height * float(np.sum(np.abs(g) * omega * (omega * 2 * gap.a / nodes) ** 2 / 6))
    assert at.store_x == pytest.approx(quotient, rel=0, abs=tolerance)


# --- auto ----------------------------------------------------------------------------------------------------


@given(gaps(least=1))
def test_auto_changes_over_without_a_jump_in_the_force(gap: Gap) -> None:
    pad = gap.pad()
    ys = [-gap.crest, gap.crest]
    # the last height at which the bound proves full contact
    low = -4 * gap.crest
    high = 4 * gap.crest
    while math.nextafter(low, high) < high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if coverage(middle, pad.constants) == FULL else (low, middle)
    ys.append(low)
    kinds = []
    for y in ys:
        at = Gap(gap.shoe, gap.wheel, gap.a, gap.x, 0.0, gap.travel, gap.k)
        forces = [at.evaluate("auto", dy=each, pad=pad) for each in (y, math.nextafter(y, math.inf))]
        kinds.append((forces[0].kind, forces[1].kind))
        tolerance = 2 * gap.a * gap.k * gap.rounding * (1 + gap.sines[0].size)
        assert forces[0].normal_force == pytest.approx(forces[1].normal_force, rel=0, abs=tolerance)
    assert kinds[2] == (CLOSED_FORM, CELLS)


@given(gaps(most=0), st.floats(-1e-3, 1e-3))
@example(Gap((), (), 0.05, 0.0, 0.0), -0.0)
def test_auto_on_smooth_surfaces_is_the_closed_form_bit_for_bit(gap: Gap, dy: float) -> None:
    assert gap.evaluate("auto", dy=dy).tobytes() == gap.evaluate("closed-form", dy=dy).tobytes()
    y = gap.y + dy
    assert gap.evaluate("auto", dy=dy).normal_force == gap.k * 2.0 * gap.a * max(-y, 0.0)


# --- bounds --------------------------------------------------------------------------------------------------


@given(gaps(least=1), st.sampled_from([1.0, 1 - 1e-15, 1 - 1e-9, 1 - 1e-4, 1 - 1e-2]))
def test_a_pad_is_never_taken_for_full_or_clear_where_a_place_contradicts(gap: Gap, part: float) -> None:
    """The worst place of the wheel may pass under any place of the shoe, so the shoe's own extremes decide."""
    pad = gap.pad(0)
    highest = sum(abs(wave.g) for wave in gap.wheel)
    bare = Gap(gap.shoe, (), gap.a, 0.0, 0.0)
    f1 = -bare.values(np.array(bare.extremes))
    claims = 0
    for edge, covered in ((-highest - f1.max(), FULL), (highest - f1.min(), CLEAR)):
        for y in (edge * part, edge, edge / part):
            if coverage(y, pad.constants) == covered:
                claims += 1
                gap_at_worst = -highest - f1.max() - y if covered == FULL else y - highest + f1.min()
                assert gap_at_worst >= -gap.rounding
    beyond = 1.05 * (highest + bare.crest)  # nothing is left undecided far away
    assert (coverage(-beyond, pad.constants), coverage(beyond, pad.constants)) == (FULL, CLEAR)


@given(gaps(-1.3, -0.3, least=1))
def test_full_contact_has_no_open_place_in_a_dense_scan(gap: Gap) -> None:
    if coverage(gap.y, gap.pad(0).constants) == FULL:
        assert gap.values(np.linspace(-gap.a, gap.a, 5001)).min() >= -gap.rounding


# --- no pair of roots is missed ------------------------------------------------------------------------------


def random_gap(rng: np.random.Generator) -> Gap:
    def waves() -> tuple[Wave, ...]:
        return tuple(
            Wave(rng.uniform(5e-6, 5e-5), 10 ** rng.uniform(-2.4, -1.3), rng.uniform(0, 360))
            for _ in range(rng.integers(1, 5))
        )

    return Gap(waves(), waves(), 0.05, rng.uniform(-1e-3, 1e-3), 0.0)


@pytest.mark.parametrize("depth", [1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_exact_finds_a_patch_however_narrow(depth: float) -> None:
    """Under the highest place of the gap, a patch of depth d is a parabola: width 2 sqrt(2d/c), force 4d/3
    sqrt(2d/c) k, c the curvature. The next terms of the gap are smaller by d (|f'''|²/c³, f''''/c²).
    """
    rng = np.random.default_rng(22)
    found = 0
    while found < 40:
        gap = random_gap(rng)
        tops = sorted((gap.value(xi), xi) for xi in gap.extremes)
        (second, _), (top, xi) = tops[-2:]
        d = depth * gap.crest
        if abs(xi) > 0.99 * gap.a or top - second < 2 * d:
            continue
        found += 1
        curvature = -gap.value(xi, 2)
        third = gap.value(xi, 3)
        fourth = gap.value(xi, 4)
        half = math.sqrt(2 * d / curvature)
        result = gap.evaluate("exact", dy=top - d, pad=gap.pad(0))
        following = d * (third**2 / curvature**3 + abs(fourth) / curvature**2)
        tolerance = following + 4 * gap.rounding / d
        assert result.stiffness == pytest.approx(2 * half * gap.k, rel=tolerance)
        assert result.normal_force == pytest.approx(4 / 3 * d * half * gap.k, rel=tolerance)


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
def test_exact_finds_every_patch_and_hole_at_grazing_extremes(depth: float) -> None:
    """Heights at which some extreme of the gap, high or low, is passed by a hair on either side."""
    rng = np.random.default_rng(23)
    checked = 0
    for _ in range(4):
        gap = random_gap(rng)
        inner = gap.extremes[1:-1]
        pad = gap.pad(0)
        for xi in inner:
            for side in (-1.0, 1.0):
                y = gap.value(xi) + side * depth * gap.crest
                delta = 4 * EPS * (abs(y) + gap.crest) * 100  # phases up to 100 rad
                touching = gap.evaluate("exact", dy=y, pad=pad).stiffness / gap.k
                assert gap.length(y + delta) - 1e-16 <= touching <= gap.length(y - delta) + 1e-16
                checked += 1
    assert checked > 80


def test_the_force_is_never_below_zero_by_rounding() -> None:
    """A patch whose depth is its own rounding: friction phi F_y would feed the motion."""
    rng = np.random.default_rng(26)
    positive = 0
    for _ in range(60):
        gap = random_gap(rng)
        pad = gap.pad(0)
        top = max(gap.value(xi) for xi in gap.extremes)
        for ulps in range(-40, 41, 4):
            force = gap.evaluate("exact", dy=top + ulps * math.ulp(gap.crest), pad=pad).normal_force
            assert force >= 0.0
            positive += force > 0.0
    assert positive > 100


@pytest.mark.parametrize("depth", [1e-2, 1e-3, 1e-4, 1e-6])
def test_exact_finds_the_edges_of_a_hole_with_a_flat_bottom(depth: float) -> None:
    """Three derivatives vanish at the bottom, so that only the fourth tells that the pad touches beside it:
    g (cos wξ - cos(2wξ)/4) is 3g/4 - g w⁴ ξ⁴/8 there, here upside down and anywhere on the pad.
    """
    rng = np.random.default_rng(25)
    length = 0.05
    g = 4e-5
    omega = 2 * math.pi / length
    half = (8 * depth) ** 0.25 / omega
    for _ in range(300):
        shift = rng.uniform(-0.01, 0.01)  # cosines are sines with phases: f2 = -g (cos - cos/4)
        wheel = (Wave(g, length, -90.0), Wave(g / 4, length / 2, 90.0))
        gap = Gap((), wheel, 0.02, shift, -g * (0.75 - depth))
        found = gap.evaluate("exact")
        hole = 2 * gap.a - found.stiffness / gap.k
        # The next term makes the hole wider by (w half)²/24 of itself; rounding of the bottom, to the fourth root.
        assert hole == pytest.approx(2 * half, rel=(omega * half) ** 2 / 12 + 0.25 * gap.rounding / (depth * g))


def test_exact_agrees_with_a_brute_force_scan() -> None:
    """A sum over 400 000 places knows the touching length to a spacing per root, and the force to slope h²/8."""
    rng = np.random.default_rng(24)
    places = 400_000
    for _ in range(10):
        gap = random_gap(rng)
        y = rng.uniform(-0.7, 0.7) * gap.crest
        spacing = 2 * gap.a / places
        xi = np.linspace(-gap.a + 0.5 * spacing, gap.a - 0.5 * spacing, places)
        values = gap.values(xi) - y
        roots = int(np.count_nonzero(np.diff(values > 0)))
        found = gap.evaluate("exact", dy=y)
        assert found.stiffness / gap.k == pytest.approx(np.sum(values > 0) * spacing, rel=0, abs=spacing * roots)
        curved = gap.steepest(2) * spacing**2 / 24 * 2 * gap.a  # the midpoint rule on smooth pieces
        assert found.normal_force / gap.k == pytest.approx(
            np.sum(np.maximum(values, 0)) * spacing, rel=0, abs=gap.steepest() * spacing**2 / 8 * roots + curved
        )


@pytest.mark.parametrize("pads", counts(10, 300))
def test_exact_finds_on_the_way_what_it_finds_from_nothing(pads: int) -> None:
    """What is kept from one evaluation to the next, along paths of small and large moves, some past an extreme of
    the gap by a hair, against a layer that knows nothing.
    """
    rng = np.random.default_rng(29)
    checked = 0
    for _ in range(pads):
        gap = random_gap(rng)
        pad = gap.pad(0)
        levels = [gap.value(xi) for xi in gap.extremes]
        steep = gap.steepest()
        crest = gap.crest
        layer = build_layer("exact", pad)
        x = gap.x
        y = 0.0
        layer.angles[:] = gap.angles
        scale = 2 * gap.a * gap.k * np.array([crest, 1, steep, 0, crest**2, crest * steep])
        scale[3] = 1  # fraction
        move = 10 ** rng.uniform(-8, -3)
        lift = crest * 10 ** rng.uniform(-5, -1)
        for _ in range(60):
            where = rng.random()
            if where < 0.3:  # there and back, or past an extreme
                x = gap.x
                y = rng.choice(levels) + crest * 10 ** rng.uniform(-9, -2) * rng.choice([-1, 1])
            elif where < 0.35:
                x = rng.uniform(-1, 1)
                y = crest * rng.uniform(-1.2, 1.2)
            else:
                x = x + move * rng.normal()
                y = y + lift * rng.normal()
            fresh = unfilled("exact", pad)
            fresh.angles[:] = layer.angles
            for each in (layer, fresh):
                fill(x, y, *each)
            assert np.all(np.abs(outputs(layer.contact) - outputs(fresh.contact)) <= 1e-11 * scale)
            checked += 0 < fresh.contact.fraction < 1
    assert checked > 10 * pads


@pytest.mark.parametrize("shift", [0.0, 1e-15, 1e-12, 1e-9, 1e-6])
def test_exact_ends_where_two_equal_profiles_meet(shift: float) -> None:
    """The gap is its own rounding all over the pad, and no cell small enough has a sign: it must not be sought."""
    profile = (Wave(30e-6, 0.02), Wave(10e-6, 0.003))
    gap = Gap(profile, profile, 0.05, shift, 0.0)
    found = gap.evaluate("exact")
    highest = gap.steepest() * shift + gap.rounding
    assert np.isfinite(outputs(found)).all()
    assert 0.0 <= found.normal_force <= 2 * gap.a * gap.k * highest
    assert 0.0 <= found.fraction <= 1.0


def test_exact_ends_where_profiles_of_almost_equal_length_meet() -> None:
    """A gap that is small everywhere but not zero: waves that differ in the 12th digit."""
    gap = Gap((Wave(30e-6, 0.02),), (Wave(30e-6, 0.02 * (1 + 1e-12)),), 0.05, 0.0, 0.0)
    assert 0.0 <= gap.evaluate("exact").normal_force <= 2 * gap.a * gap.k * 30e-6 * 2e-11


# --- extremes ------------------------------------------------------------------------------------------------


@example(
    Gap((), (Wave(2.0**-15, 0.06640625, 3.694680824522566e-304),), 0.03125, 0.0, 0.0, k=1.0), "closed-form", 1, 0
)
@given(gaps(), st.sampled_from(EVALUATORS), st.integers(-20, 20), st.integers(-20, 30))
@campaign
def test_heights_and_stiffness_scale_exactly(gap: Gap, evaluator: str, height: int, stiffness: int) -> None:
    """Amplitudes and y times 2^p, k times 2^q: no threshold in metres or newtons, so not a bit changes but the
    exponent. A number below the smallest normal one has lost bits: its rounding, 5e-324, times 2^70 at most.
    """
    assume(gap.y == 0.0 or abs(gap.y) > 1e-200)

    def scaled(waves: tuple[Wave, ...]) -> tuple[Wave, ...]:
        return tuple(Wave(math.ldexp(wave.g, height), wave.length, wave.phase) for wave in waves)

    other = Gap(
        scaled(gap.shoe),
        scaled(gap.wheel),
        gap.a,
        gap.x,
        math.ldexp(gap.y, height),
        gap.travel,
        math.ldexp(gap.k, stiffness),
    )
    force = height + stiffness
    energy = 2 * height + stiffness
    powers = [force, stiffness, force, 0, energy, energy]
    expected = np.ldexp(outputs(gap.evaluate(evaluator)), powers)
    np.testing.assert_allclose(outputs(other.evaluate(evaluator)), expected, rtol=0.0, atol=5e-324 * 2.0**70)


def many_waves(seed: int, count: int) -> Surface:
    rng = np.random.default_rng(seed)
    return surface(
        rng.uniform(1e-9, 1e-6, count).tolist(),
        wavelengths=(10 ** rng.uniform(-3, -1, count)).tolist(),
        phases_deg=rng.uniform(0, 360, count).tolist(),
    )


@pytest.mark.parametrize("level", [-1.0, -0.1, 0.0, 0.1])
def test_hundreds_of_waves_are_summed_as_well_as_one(level: float) -> None:
    """Two ways to the same integrals: in full contact tables against pairs of waves, else a fine sum."""
    a = 0.02
    k = 1e8
    shoe = many_waves(1, 60)
    wheel = many_waves(2, 140)
    pad = build_pad(k, a, shoe, wheel, 0)
    angles = np.random.default_rng(3).uniform(-6, 0, 140)
    crest = float(shoe.g.sum() + wheel.g.sum())
    layer = build_layer("exact", pad)
    layer.angles[:] = angles
    fill(1e-4, level * crest, *layer)
    found = layer.contact
    if level == -1.0:
        other = build_layer("closed-form", pad)
        other.angles[:] = angles
        fill(1e-4, level * crest, *other)
        steep = float(wheel.g @ wheel.omega)
        scale = 2 * a * k * np.array([crest, 1, steep, 1, crest**2, crest * steep])
        # Phases of up to 2 pi a/1 mm = 126 rad; sums over 200 waves and their pairs.
        assert np.all(np.abs(outputs(found) - outputs(other.contact)) <= 126 * 20 * EPS * scale)
        return
    places = 200_000
    spacing = 2 * a / places
    xi = -a + spacing * np.arange(0.5, places)
    values = np.full(places, -level * crest)
    for f, sign, phase in ((wheel, 1.0, wheel.omega * 1e-4 + angles), (shoe, -1.0, shoe.phase)):
        for g, omega, shift in zip(f.g, f.omega, phase, strict=True):
            values += sign * g * np.sin(omega * xi + shift)
    roots = int(np.count_nonzero(np.diff(values > 0)))
    steep, curved = (sum(float(f.g @ f.omega**n) for f in (shoe, wheel)) for n in (1, 2))
    tolerance = k * spacing**2 * (steep / 8 * roots + curved / 24 * 2 * a)
    assert found.normal_force == pytest.approx(k * spacing * np.maximum(values, 0).sum(), rel=0, abs=tolerance)
    assert found.stiffness == pytest.approx(k * spacing * np.sum(values > 0), rel=0, abs=k * spacing * roots)


@pytest.mark.parametrize("apart", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1e-2])
def test_waves_of_almost_equal_length_lose_no_digits(apart: float) -> None:
    """Quotients sin z/z with z near 0, in the store's products; quadrature knows nothing of them."""
    gap = Gap((Wave(2e-5, 0.02, 40.0),), (Wave(3e-5, 0.02 * (1 + apart), 10.0),), 0.03, 1e-3, -5e-6)
    found = gap.evaluate("exact")
    height = abs(gap.y) + gap.crest
    store = 0.5 * gap.k * gap.integral(lambda xi: gap.value(xi) ** 2, height * gap.rounding)
    assert found.store == pytest.approx(store, rel=0, abs=2 * gap.a * gap.k * height * gap.rounding)
    full = Gap(gap.shoe, gap.wheel, gap.a, gap.x, -6e-5, 0.0, gap.k)
    expected = 0.5 * full.k * full.integral(lambda xi: full.value(xi) ** 2, height * full.rounding)
    for evaluator in ("closed-form", "exact"):
        found = full.evaluate(evaluator)
        assert found.store == pytest.approx(expected, rel=0, abs=2 * full.a * full.k * 1.2e-4 * full.rounding)


def press(x: float, y: float, *layer: Any, steeply: bool) -> None:
    """`cells.press`, with its last argument by name."""
    cells.press(x, y, layer[0], layer[1], layer[2], steeply)


@pytest.mark.parametrize(("waves", "nodes"), [(1, 128), (5, 128), (7, 576), (0, 64), (5, 2), (5, 146)])
def test_the_force_alone_is_that_of_the_whole_evaluation(waves: int, nodes: int) -> None:
    """Of nodes, whatever is open, and of the closed form; sums in another order differ by their rounding."""
    rng = np.random.default_rng(41)
    more = Wave(4e-6, 0.0031), Wave(3e-6, 0.0027)
    gap = Gap((*CASE_B_SHOE, *more), (*CASE_B_WHEEL, *more)[:waves], 0.05, 0.0, 0.0, 0.0, 5e7)
    pad = gap.pad(nodes)
    pairs: list[tuple[str, Any, Any]] = [
        ("cells", cells.evaluate, partial(press, steeply=False)),
        ("cells", cells.evaluate, partial(press, steeply=True)),
        ("closed-form", full_contact, full_press),
    ]
    for name, whole, alone in pairs:
        layers = [build_layer(name, pad) for _ in range(2)]
        for _ in range(50):
            x = rng.uniform(-0.02, 0.02)
            y = gap.crest * (rng.uniform(-1, 1) if name == "cells" else -2.0)
            for evaluate, layer in zip((whole, alone), layers, strict=True):
                layer.angles[:] = gap.angles
                evaluate(x, y, *layer)
            one, other = (layer.contact for layer in layers)
            rounding = (128 + nodes) * EPS * 2 * gap.a * gap.k * gap.crest
            assert other.normal_force == pytest.approx(one.normal_force, rel=0, abs=4.0 * rounding)
            np.testing.assert_allclose(other.stiffness, one.stiffness, rtol=nodes * EPS)
            np.testing.assert_allclose(other.fraction, one.fraction, rtol=nodes * EPS)
            if getattr(alone, "keywords", {"steeply": True})["steeply"]:
                steep = gap.steepest(wheel_only=True)
                apart = 4.0 * rounding * (steep / gap.crest + nodes / gap.a)
                assert other.tangential == pytest.approx(one.tangential, rel=0, abs=apart)
            assert (other.kind, other.valid) == (one.kind, one.valid)
