"""Linear stability of steady sliding, against closed forms, eigenvalues and runs."""

import math
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.stability.modes import crossings, modes
from brakecli.analysis.stability.report import stability, step_limit, undamped_critical
from brakecli.case.system import system_of
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.contact.pad import build_layer
from brakecli.solver.links import coefficients, natural_frequencies
from brakecli.solver.steady_sliding import PLACES, add_places, averaged_length
from brakecli.solver.system import System
from tests.analysis.mirrored import mirrored
from tests.analysis.shoes import Tables
from tests.campaign import counts
from tests.examples import MODE_COUPLING, ROUGH, SQUEAL, make


def random_shoe(rng: np.random.Generator, damping: float) -> tuple[Coefficients, float]:
    c_1, c_2, k = 10.0 ** rng.uniform(5.0, 8.0, 3)
    alpha, beta = rng.uniform(-80.0, 80.0, 2)
    b_1, b_2 = damping * rng.uniform(0.1, 1.0, 2)
    shoe = coefficients(
        mass=10.0 ** rng.uniform(-1.0, 2.0),
        c_1=c_1,
        b_1=b_1,
        beta_deg=beta,
        c_2=c_2,
        b_2=b_2,
        alpha_deg=alpha,
        phi=0.5,
    )
    return shoe, k


def full_matrix(c: Coefficients, k: float, grip: float) -> Any:
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    a[2:] = -np.array([[c.c_xx, c.c_xy + grip * k, c.b_xx, c.b_xy], [c.c_xy, c.c_yy + k, c.b_xy, c.b_yy]]) / c.m
    return a


def test_minimal_model_loses_stability_at_three_quarters() -> None:
    report = stability(system_of(make(MODE_COUPLING)))
    assert report.critical is not None
    assert report.critical.friction == pytest.approx(0.75, abs=1e-12)
    assert report.critical.instability == "flutter"
    assert report.critical.frequency * 2 * math.pi == pytest.approx(math.sqrt(2.0), abs=1e-12)
    assert report.modes[0].growth == pytest.approx(0.2020717687680948, abs=1e-12)
    assert report.modes[0].frequency * 2 * math.pi == pytest.approx(1.4285772641803685, abs=1e-12)
    assert report.stable is False


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_closed_form_agrees_with_eigenvalues_on_random_undamped_shoes(sign: float) -> None:
    rng = np.random.default_rng(2)
    flutter = 0
    divergence = 0
    for _ in range(1000):
        c, k = random_shoe(rng, 0.0)
        phi_flutter, phi_divergence = undamped_critical(c, k, sign)
        phi = phi_flutter if phi_flutter is not None else phi_divergence
        assert phi is not None
        found = [crossing for crossing in crossings(c, k, sign) if crossing.lost]
        assert found[0].friction == pytest.approx(phi, rel=1e-9)
        below, above = (np.linalg.eigvals(full_matrix(c, k, sign * phi * (1.0 + e))) for e in (-1e-3, 1e-3))
        size = np.abs(above).max()
        # 10^-3 above, a pair that has met splits by about sqrt(10^-3) of its distance; rounding splits by 1e-7.
        assert below.real.max() < 1e-6 * size
        assert above.real.max() > below.real.max() + 1e-7 * size
        flutter = flutter + (phi_flutter is not None)
        divergence = divergence + (phi_divergence is not None)
    assert flutter > 300
    assert divergence > 300


@pytest.mark.parametrize("shoes", counts(60, 300))
def test_every_crossing_of_random_damped_shoes_is_found(shoes: int) -> None:
    rng = np.random.default_rng(3)
    lost = 0
    for _ in range(shoes):
        c, k = random_shoe(rng, 10.0 ** rng.uniform(1.0, 4.0))
        found = crossings(c, k, 1.0)
        frictions = np.linspace(0.0, 3.0, 3001)[1:]
        frictionless = full_matrix(c, k, 0.0)
        with_unit_grip = full_matrix(c, k, 1.0)
        matrices = frictionless + frictions[:, None, None] * (with_unit_grip - frictionless)
        rates = np.linalg.eigvals(matrices).real.max(axis=1)
        changes = frictions[1:][(rates[1:] > 0.0) != (rates[:-1] > 0.0)]
        inside = [crossing.friction for crossing in found if crossing.friction < 3.0]
        assert len(inside) == len(changes)
        assert np.allclose(inside, changes, atol=1.1e-3)
        lost += len(inside)
    assert lost > shoes / 6


def test_positive_coupling_diverges_and_does_not_flutter() -> None:
    report = stability(system_of(make(SQUEAL, link2__angle_deg=-5.0)))
    assert report.critical is not None
    assert report.critical.instability == "divergence"
    assert report.undamped_flutter is None
    assert report.critical.friction == pytest.approx(report.undamped_divergence, rel=1e-12)


def test_a_standing_wheel_has_no_critical_friction() -> None:
    report = stability(system_of(make(SQUEAL, wheel__angular_speed=0.0)))
    assert report.critical is None
    assert report.discrete is None


def test_a_shoe_that_clears_the_wheel_says_so() -> None:
    lifted = stability(system_of(make(SQUEAL, load__force=-1.0)))
    assert lifted.equilibrium is None
    assert "nothing presses the shoe" in str(lifted.no_equilibrium)
    assert (lifted.critical, lifted.stable, lifted.contact_stiffness) == (None, None, 0.0)
    free = stability(system_of(make(SQUEAL, load__force=-1.0, link1__stiffness=0.0, link2__angle_deg=0.0)))
    assert free.equilibrium is None
    assert "lifts the shoe" in str(free.no_equilibrium)
    assert free.stable is None


def test_links_in_one_line_press_nothing_whatever_rounding_makes_of_what_they_leave() -> None:
    """Link 2 is along link 1: across both there is no spring and no load, but for rounding."""
    rng = np.random.default_rng(3)
    for _ in range(200):
        beta = float(rng.uniform(1.0, 89.0))
        c_1, c_2 = (10.0 ** rng.uniform(5.0, 8.0, 2)).tolist()
        changes = {
            "link1__stiffness": c_1,
            "link2__stiffness": c_2,
            "wheel__angular_speed": float(rng.choice([-4.0, 4.0])),
        }
        found = stability(system_of(make(SQUEAL, link1__angle_deg=beta, link2__angle_deg=beta - 90.0, **changes)))
        assert (found.stable, found.equilibrium) == (None, None)
        assert found.no_equilibrium


def test_a_shoe_is_pressed_from_a_millionth_of_its_load_on() -> None:
    """Link 1 is turned to the friction plane but for an angle δ, to which F_y is proportional."""

    def shoe(delta: float) -> System:
        return system_of(make(SQUEAL, link1__angle_deg=90.0 - math.degrees(delta), link2__angle_deg=0.0))

    system = shoe(1e-3)
    c = system.coefficients
    k = system.contact_stiffness
    load = system.load_at_start
    equations = [[c.c_xx, c.c_xy + c.phi * k], [c.c_xy, c.c_yy + k]]  # Eqs. (6) and (7) without motion
    _, y = np.linalg.solve(equations, [-load * c.sin_beta, -load * c.cos_beta])
    least = 1e-6 * load * 1e-3 / (-k * y)  # to the curvature of that, some parts in a thousand
    assert stability(shoe(0.98 * least)).stable is None
    assert stability(shoe(1.02 * least)).stable is not None


@pytest.mark.parametrize(("theta", "critical"), [((1.0, 1.0), 0.8115), ((0.5, 0.5), 0.75)])
def test_weights_move_the_critical_friction_as_published(theta: tuple[float, float], critical: float) -> None:
    report = stability(system_of(make(MODE_COUPLING, solver__theta=theta, solver__step=0.1)))
    assert report.discrete is not None
    assert report.discrete.critical_friction == pytest.approx(critical, abs=5e-5)
    assert report.discrete.bias == pytest.approx(critical - 0.75, abs=5e-5)


@pytest.mark.parametrize(
    ("scheme", "theta", "limit"),
    [
        ("two-layer", (0.5, 0.5), None),
        ("two-layer", (0.0, 1.0), 2.0),
        ("two-layer", (0.0, 0.0), 0.0),
        ("three-layer", (0.25, 0.5, 0.25), None),
        ("three-layer", (0.0, 1.0, 0.0), 2.0),
        ("three-layer", (1 / 12, 10 / 12, 1 / 12), math.sqrt(6.0)),
    ],
)
def test_limits_of_stability_are_those_of_theory(
    scheme: str, theta: tuple[float, ...], limit: float | None
) -> None:
    report = stability(system_of(make(MODE_COUPLING, solver__scheme=scheme, solver__theta=theta)))
    assert report.discrete is not None
    step = report.discrete.step_limit
    assert (step is None) == (limit is None)
    assert limit is None or step == pytest.approx(limit / math.sqrt(3.0), rel=1e-5)  # ω² = 3 is the highest


@pytest.mark.parametrize(
    ("scheme", "theta", "limit"),
    [
        ("two-layer", (0.5, 0.5), None),
        ("two-layer", (1.0, 0.5), None),
        ("three-layer", (0.25, 0.5, 0.25), None),
        ("three-layer", (1 / 12, 10 / 12, 1 / 12), math.sqrt(6.0)),
    ],
)
def test_no_limit_is_seen_in_the_rounding_of_a_contact_that_is_all_but_rigid(
    scheme: str, theta: tuple[float, ...], limit: float | None
) -> None:
    system = system_of(make(SQUEAL, contact__stiffness=1e16, solver__scheme=scheme, solver__theta=list(theta)))
    found = step_limit(system, lambda friction: system.contact_stiffness)
    omega = 2.0 * math.pi * natural_frequencies(system.coefficients, system.contact_stiffness)[1]
    assert found == (limit if limit is None else pytest.approx(limit / omega, rel=1e-4))


def test_mean_stiffness_is_the_slope_of_the_mean_force() -> None:
    from functools import partial

    from brakecli.solver.steady_sliding import mean_contact, tabulated

    system = system_of(make(ROUGH))
    mean = partial(mean_contact, system)
    table = tabulated(system)
    tried = 0
    for y in (-1e-4, -3e-5, 1e-5, 6e-5):
        # Over 1024 places of 256 nodes each, kinks in steps of 1e-8 m average out to a relative 1e-3.
        slope = (mean(y - 1e-7)[0] - mean(y + 1e-7)[0]) / 2e-7
        assert mean(y)[1] == pytest.approx(slope, rel=2e-3)
        assert table(y)[0] == pytest.approx(mean(y)[0], rel=1e-4)
        assert table(y)[1] == pytest.approx(mean(y)[1], rel=1e-2)
        tried += 1
    assert tried == 4


OPEN: Tables = {
    "shoe": {"mass": 35.25815973711631},
    "wheel": {"radius": 0.2179679467091094, "angular_speed": 0.21091880159314244},
    "link1": {"stiffness": 1111487.9202426341, "damping": 608.2941501587975, "angle_deg": 2.14025474837392},
    "link2": {"stiffness": 1339039.0343930663, "damping": 39.22264594308555, "angle_deg": 32.0400016612693},
    "load": {"force": 283.1354567453749},
    "friction": {"coefficient": 3.5872188293373206},
    "contact": {"half_length": 0.0016370101036845138, "stiffness": 76393525.53122489},
    "roughness": {
        "wheel": {
            "amplitudes": [0.0001455176122683059, 5.785464000741007e-05, 5.15976287351854e-05],
            "wavelengths": [0.0034418222240715788, 0.00048446013498474667, 0.006081502824930711],
            "phases_deg": [211.7407489958079, 209.70739685782038, 63.68051681891786],
        }
    },
    "solver": {"duration": 1.0, "step": 1e-4},
}
"""Waves without a short common period, over which a mean depends on where it is taken."""


def test_mirror_images_of_an_open_pad_have_the_same_critical_friction() -> None:
    one, other = (stability(system_of(make(tables))) for tables in (OPEN, mirrored(OPEN)))
    assert one.critical is not None
    assert other.critical is not None
    assert one.critical.friction == pytest.approx(other.critical.friction, rel=1e-9)
    assert one.critical_error == pytest.approx(other.critical_error, rel=1e-6)


def test_a_mean_over_waves_has_a_bar_that_holds_a_finer_one() -> None:
    """Of 16 times as many places over 16 times as many waves."""
    system = system_of(make(OPEN))
    report = stability(system)
    assert report.equilibrium is not None
    assert report.critical_error is not None
    assert 1e-4 < report.critical_error < 1e-2
    y = report.equilibrium.y
    layer = build_layer(system.evaluator, system.pad)
    parts = (np.arange(16 * PLACES) + 0.5) / (16 * PLACES)
    sums = np.zeros(3)
    add_places(y, 16.0 * averaged_length(system) * parts, 2.0 * np.sin(np.pi * parts) ** 2, *layer, sums)
    finer = float(sums[1]) / len(parts)
    assert abs(report.contact_stiffness - finer) < report.contact_stiffness_error < 2e-3 * finer
    full = stability(system_of(make({**OPEN, "load": {"force": 1e5}})))
    assert (full.critical_error, full.contact_stiffness_error) == (0.0, 0.0)


def test_the_bar_of_a_critical_friction_holds_what_cells_leave_out() -> None:
    """A rough shoe on a smooth wheel, whose mean is a single place: nothing but cells and heights can be off."""
    tables: Tables = {
        "shoe": {"mass": 18.30469856070874},
        "wheel": {"radius": 0.5, "angular_speed": 0.20848428859820098},
        "link1": {"stiffness": 7202345.507161807, "damping": 1.8775986466040255, "angle_deg": -19.159593106909806},
        "link2": {"stiffness": 9424535.032946015, "damping": 3.5465678658878637, "angle_deg": 24.434706707090832},
        "load": {"force": 534.1413233855757},
        "friction": {"coefficient": 1.098723012284857},
        "contact": {"half_length": 0.005056943884716141, "stiffness": 386957864.32310295},
        "roughness": {
            "shoe": {
                "amplitudes": [0.00021109268790473948],
                "wavelengths": [0.005056943884716141],
                "phases_deg": [268.84170837345937],
            }
        },
        "solver": {"step": 5.485058328284037e-05, "duration": 0.765},
        "output": {"sample_interval": 1.0970011656656868e-04},
    }
    cells = stability(system_of(make(tables)))
    exact = stability(system_of(make(tables, contact__evaluator="exact")))
    assert cells.critical is not None
    assert exact.critical is not None
    assert cells.critical_error is not None
    off = abs(cells.critical.friction - exact.critical.friction)
    assert 0.5 * off < cells.critical_error < 2.0 * off


def test_zeros_have_no_sign() -> None:
    """Without dashpots and beyond divergence, as the wheel turns back: two eigenvalues are real, two are not."""
    c = Coefficients(1.0, 0.0, 0.0, 0.0, 2.0, -1.0, 2.0 - 4.0 / 3.0, 0.0, 1.0, 3.0)
    zeros = [
        n
        for mode in modes(c, 4.0 / 3.0, -3.0)
        for n in (mode.growth, mode.frequency, mode.damping_ratio)
        if n == 0.0
    ]
    assert len(zeros) == 4
    assert all(math.copysign(1.0, zero) > 0.0 for zero in zeros)
