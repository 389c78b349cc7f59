"""Sensitivities against perturbation theory and closed forms; advised values against eigenvalues computed here."""

import math
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from itertools import islice
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.stability.advice import KEYS, advised, advised_keys, answer, changed, numbers, sensitivity
from brakecli.analysis.stability.modes import Crossing
from brakecli.case.case import Case
from brakecli.case.read import LoadedCase
from brakecli.errors import UsageError
from brakecli.studies.runs.advise import AdviceReport, advise
from tests.analysis.shoes import Shoe, random_shoes
from tests.campaign import campaign, counts
from tests.examples import MODE_COUPLING, NEVER_STABLE, ROUGH, SQUEAL, make

mpmath = import_module("mpmath")  # imported so because it has no type hints

Tables = dict[str, Any]
PRESSED = "of the load of 5000 N, 830 N press the shoe on; the links carry the rest"
ENDS = {"mass": "shoe.mass", "c_1": "link1.stiffness", "c_2": "link2.stiffness"}
ENDS |= {"beta": "link1.angle_deg", "alpha": "link2.angle_deg", "k": "contact.stiffness"}


def tell() -> None:
    pass


def advice_on(case: Case, margin: float = 0.2) -> AdviceReport:
    return advise(LoadedCase(case, "", ""), KEYS, margin, lambda what, done, total: None)


def unstable_shoes(seed: int) -> Iterator[tuple[Case, Tables]]:
    """Smooth shoes with dashpots at 1.3 times their critical friction, which is found from eigenvalues."""
    for tables in random_shoes("smooth", seed):
        critical = Shoe.of(tables).critical
        damped = all(tables[link]["damping"] > 0.0 for link in ("link1", "link2"))
        if critical is not None and critical > 1e-3 and damped and tables["wheel"]["angular_speed"] != 0.0:
            tables["friction"] = {"coefficient": 1.3 * critical}
            yield Case.model_validate(tables), tables


def test_sensitivities_of_the_minimal_model_are_those_of_its_closed_form() -> None:
    """φ of flutter without dashpots, differentiated by mpmath with 30 digits."""
    case = make(MODE_COUPLING)
    one = case.link1
    two = case.link2
    values = {
        "mass": 1.0,
        "c_1": one.stiffness,
        "c_2": two.stiffness,
        "beta": one.angle_deg,
        "alpha": two.angle_deg,
    }
    values["k"] = case.contact.stiffness

    def flutter(**v: Any) -> Any:
        beta = v["beta"] * mpmath.pi / 180
        alpha = v["alpha"] * mpmath.pi / 180
        s = (mpmath.sin(beta), mpmath.cos(beta))
        c = (mpmath.sin(alpha), mpmath.cos(alpha))
        k = 2 * case.contact.half_length * v["k"]
        xx = v["c_1"] * s[0] ** 2 + v["c_2"] * c[1] ** 2
        yy = v["c_1"] * s[1] ** 2 + v["c_2"] * c[0] ** 2
        xy = -(v["c_1"] * s[0] * s[1] - v["c_2"] * c[0] * c[1])
        return (xy + (xx - yy - k) ** 2 / (4 * xy)) / k

    with mpmath.workdps(30):
        assert float(flutter(**values)) == pytest.approx(0.75, abs=1e-12)
        for name, value in values.items():
            exact = float(mpmath.diff(lambda x, name=name: flutter(**{**values, name: x}), value))
            found = sensitivity(case, tuple(ENDS[name].split(".")), 0.75, tell)
            assert found.derivative == pytest.approx(exact, abs=1e-9 / value), name
            assert found.elasticity == pytest.approx(exact * value / 0.75, abs=1e-8), name


@pytest.mark.parametrize("shoes", counts(4, 40))
def test_derivatives_are_those_of_perturbation_theory(shoes: int) -> None:
    """Where a pair crosses, Re(uᴴ dA v / uᴴ v) = 0 along the change of a number and of φ together."""

    def matrix(tables: Tables, phi: float) -> Any:
        shoe = replace(Shoe.of(tables), phi=phi)
        lower = [-shoe.stiffness / shoe.m, -shoe.b / shoe.m]
        return np.block([[np.zeros((2, 2)), np.eye(2)], lower])

    compared = 0
    for case, tables in islice(unstable_shoes(3), shoes):
        found = answer(case)
        assert found is not None
        phi = found.critical or 0.0
        assert phi == pytest.approx(Shoe.of(tables).critical, rel=1e-6)
        a = matrix(tables, phi)
        values, right = np.linalg.eig(a)
        worst = int(np.argmax(values.real))
        left = np.linalg.inv(right)[worst]

        def slope(change: Any, left: Any = left, right: Any = right, worst: int = worst) -> float:
            return float((left @ change @ right[:, worst]).real)

        by_friction = slope((matrix(tables, 1.001 * phi) - matrix(tables, 0.999 * phi)) / (0.002 * phi))
        for path in (("shoe", "mass"), ("link1", "stiffness"), ("link2", "damping"), ("link2", "angle_deg")):
            value = tables[path[0]][path[1]]
            ends = [{**tables, path[0]: {**tables[path[0]], path[1]: value * (1.0 + e)}} for e in (1e-5, -1e-5)]
            by_value = slope((matrix(ends[0], phi) - matrix(ends[1], phi)) / (2e-5 * value))
            given = sensitivity(case, path, phi, tell)
            if given.derivative is None:  # two crossings are about to meet: the error is above five per cent
                continue
            assert given.error is not None
            expected = -by_value / by_friction
            # the matrix's own central difference is good to 1e-9, its eigenvectors to 1e-10 of their condition
            bound = (given.error + 1e-5) * abs(expected) + 1e-7 * phi / abs(value)
            assert given.derivative == pytest.approx(expected, abs=bound), path
            compared += 1
    assert compared > 3 * shoes


@pytest.mark.parametrize("shoes", counts(2, 50))
def test_an_advised_value_is_stable_up_to_the_margin_and_unstable_just_beyond(shoes: int) -> None:
    """By growth rates of matrices that are built here, up to 1.2 times the friction, and 10⁻⁶ before the value."""
    helped = 0
    for case, tables in islice(unstable_shoes(4), shoes):
        target = 1.2 * tables["friction"]["coefficient"]
        for path in advised_keys(case, ("link2.angle_deg", "link*.stiffness")):
            found = advised(case, path, 0.2, tell)
            if found.to is None:
                continue

            def rate(value: float, phi: float, path: Any = path, tables: Tables = tables) -> float:
                there = {**tables, path[0]: {**tables[path[0]], path[1]: value}}
                return replace(Shoe.of(there), phi=phi).rate

            rounding = 1e-9 * 2.0 * math.pi * Shoe.of(tables).fast
            assert max(rate(found.to, phi) for phi in np.linspace(0.0, target, 50)) <= rounding, found
            back = found.to + 1e-6 * (found.start - found.to)
            assert rate(back, target * (1.0 + 1e-12)) > -rounding, found
            assert found.lowest <= found.to <= found.highest
            helped += 1
    assert helped > shoes


def test_a_damping_of_zero_has_a_derivative_where_the_other_link_is_damped_and_none_where_it_jumps() -> None:
    damped = make(SQUEAL, link1__damping=0.0)
    found = answer(damped)
    assert found is not None
    assert found.critical is not None
    given = sensitivity(damped, ("link1", "damping"), found.critical, tell)
    near = answer(make(SQUEAL, link1__damping=0.01))
    assert given.elasticity is None
    assert near is not None
    assert near.critical is not None
    assert given.derivative == pytest.approx((near.critical - found.critical) / 0.01, rel=1e-3)
    jumps = sensitivity(make(MODE_COUPLING, link1__damping=0.0), ("link1", "damping"), 0.75, tell)
    assert (jumps.elasticity, jumps.derivative) == (
        None,
        None,
    )  # one dashpot alone, however weak, moves it at once


def test_a_shoe_that_nothing_presses_is_advised_an_angle_at_which_it_is_pressed_up_to_the_margin() -> None:
    """F_y det(S)/(Q K) is c2 cos(α) cos(α - β): F_y ends at |α - β| = 90°, and is a millionth of Q just before."""
    case = make(
        SQUEAL, link1__angle_deg=51.0, link2__angle_deg=-42.3, friction__coefficient=0.7, solver__duration=0.02
    )
    report = advice_on(case, 0.05)
    assert report.stability.equilibrium is None
    angles = {each.parameter: each for each in report.advice if each.to is not None}
    assert set(angles) == {"link1.angle_deg", "link2.angle_deg"}
    assert angles["link1.angle_deg"].to == pytest.approx(47.7, abs=1e-3)
    for name, found in angles.items():
        for value in (found.to, found.until):
            assert value is not None
            there = changed(case, tuple(name.split(".")), value)
            assert there is not None
            for phi in (0.0, 0.735):
                given = changed(there, ("friction", "coefficient"), phi)
                assert given is not None
                assert presses_by(given) > 1e-6 * (1.0 - 1e-6), (name, value, phi)


def presses_by(case: Case) -> float:
    """F_y over the load in steady sliding."""
    alpha = math.radians(case.link2.angle_deg)
    beta = math.radians(case.link1.angle_deg)
    c_1 = case.link1.stiffness
    c_2 = case.link2.stiffness
    k = 2.0 * case.contact.half_length * case.contact.stiffness
    slides = math.cos(alpha) + case.friction.coefficient * math.sin(alpha)
    leans = math.sin(beta) - case.friction.coefficient * math.cos(beta)
    determinant = c_1 * c_2 * math.cos(alpha - beta) ** 2
    determinant += k * (c_1 * math.sin(beta) * leans + c_2 * math.cos(alpha) * slides)
    return k * c_2 * math.cos(alpha) * math.cos(alpha - beta) / determinant


def test_a_value_of_zero_is_not_advised_to_be_next_to_nothing() -> None:
    found = advised(make(SQUEAL, link2__stiffness=0.0), ("link2", "stiffness"), 0.2, tell)
    assert found.to is not None
    assert found.to >= 1e-6 * found.highest


def test_what_cannot_help_is_no_help_within_bounds_that_are_told() -> None:
    case = make(MODE_COUPLING)
    mass = advised(case, ("shoe", "mass"), 0.2, tell)  # φ of flutter does not depend on the mass
    assert (mass.to, mass.critical_friction) == (None, None)
    assert (mass.lowest, mass.highest) == pytest.approx((0.1, 10.0))
    angle = advised(case, ("link2", "angle_deg"), 0.2, tell)
    assert (angle.lowest, angle.highest) == (-90.0, 90.0)
    assert angle.to is not None
    there = changed(case, ("link2", "angle_deg"), angle.to)
    assert there is not None
    assert angle.critical_friction == pytest.approx(1.2, rel=1e-9)


def test_every_number_has_a_sensitivity_and_those_of_the_solver_move_nothing() -> None:
    report = advice_on(make(SQUEAL, friction__coefficient=0.3))
    keys = [each.parameter for each in report.sensitivities]
    assert sorted(keys) == sorted(".".join(path) for path in numbers(make(SQUEAL)))
    assert len(keys) > 15
    by_key = {each.parameter: each for each in report.sensitivities}
    for key in ("solver.step", "initial.vx", "load.force", "friction.coefficient", "wheel.angular_speed"):
        assert by_key[key].derivative == 0.0
    ranked = [abs(each.elasticity or 0.0) for each in report.sensitivities]
    assert ranked == sorted(ranked, reverse=True)
    # growth at the case's own friction, one per cent further
    mass = by_key["shoe.mass"]
    ends = [answer(make(SQUEAL, friction__coefficient=0.3, shoe__mass=m)) for m in (9.99, 10.01)]
    assert all(end is not None and end.growth is not None for end in ends)
    rates = [end.growth for end in ends if end is not None and end.growth is not None]
    assert mass.growth_derivative == pytest.approx((rates[1] - rates[0]) / 0.02, rel=1e-5)


SQUEALS = {"friction__coefficient": 0.7, "solver__duration": 0.05}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            SQUEALS,
            [
                "squeals at 174",
                "sliding loses its stability from a friction coefficient of 0.575 on, 18 % below the case's 0.7",
                "link2.angle_deg 5 → 7.692",
            ],
        ),
        (
            {"friction__coefficient": 0.3},
            [
                "as drawn it does not squeal by itself; sliding loses",
                "at 174 Hz from a friction coefficient of 0.575 on, 92 %",
            ],
        ),
        (
            {"friction__coefficient": 0.0},
            ["without friction nothing squeals; sliding loses its stability at 174 Hz from"],
        ),
        ({"wheel__angular_speed": 0.0}, ["the wheel stands, so that nothing slides"]),
        ({"load__force": -100.0}, ["nothing presses the shoe on the wheel"]),
        ({"link2__angle_deg": 0.0}, ["stable: no friction makes it unstable"]),
        (
            {"link2__angle_deg": -5.0, "friction__coefficient": 80.0, "solver__duration": 0.05},
            [
                "at 80 there is no steady sliding: ",
                "self-locking",
                "sliding loses its stability from a friction coefficient of 68.6 on, 14 % below",
                "→",
            ],
        ),
        (
            NEVER_STABLE,
            ["squeals at", "unstable at any friction, however small", "moves the loss of stability to 0.36"],
        ),
    ],
)
def test_the_answer_is_a_sentence(changes: Tables, words: list[str]) -> None:
    report = advice_on(make(SQUEAL, **changes))
    for word in words:
        assert word in report.conclusion()
    assert (report.check is None) == ("→" not in report.conclusion())


def test_a_case_above_a_range_of_instability_is_told_so() -> None:
    """Only where surfaces open can stability be regained: otherwise Hurwitz' determinant is concave in φ."""
    report = advice_on(make(SQUEAL, friction__coefficient=0.4))
    turns = (Crossing(0.5, "flutter", 170.0, lost=True), Crossing(0.7, "flutter", 170.0, lost=False))
    stability = replace(report.stability, crossings=turns, critical=turns[0], friction=2.0)
    above = replace(report, stability=stability, critical_friction=0.5)
    assert above.margin == pytest.approx(-0.75)
    words = "the case lies above a range of instability, as stability is lost at 0.5, regained at 0.7"
    assert (
        f"at 170 Hz from a friction coefficient of 0.5 on, 75 % below the case's 2; {words}" in above.conclusion()
    )


def test_what_the_answer_rests_on_is_told() -> None:
    report = advice_on(make(SQUEAL, friction__coefficient=0.3))
    assert report.stability.equilibrium is not None
    assert report.notes() == [PRESSED]
    opens = replace(report.stability, equilibrium=replace(report.stability.equilibrium, contact_fraction=0.7))
    assert "mean stiffness of the contact" in replace(report, stability=opens).notes()[1]
    stops = {"wheel__angular_speed": None, "wheel__times": [0.0, 1.0], "wheel__angular_speeds": [0.2, 0.0]}
    other = advice_on(make(SQUEAL, friction__coefficient=0.3, link1__damping=0.0, link2__damping=0.0, **stops))
    assert [note.split(":")[0] for note in other.notes()] == [
        PRESSED,
        "no dashpot acts",
        "speed and load are those of t = 0",
    ]
    by_key = {each.parameter: each for each in other.sensitivities}
    assert by_key["wheel.angular_speeds"].value == (0.2, 0.0)
    assert by_key["wheel.angular_speeds"].elasticity == 0.0


@pytest.mark.parametrize("stiffness", [2e7, 9e7, 1.1e8, 1e9])
def test_a_load_that_the_links_carry_is_told_where_they_carry_more_of_it_than_the_pad(stiffness: float) -> None:
    """Steady sliding of two links and a pad that touches everywhere, two linear equations in x and y."""
    case = make(SQUEAL, contact__stiffness=stiffness)
    angle = math.radians(5.0)
    pad = 2.0 * 0.05 * stiffness
    across = -1.2e7 * math.sin(angle) * math.cos(angle)
    rows = [
        [1.2e7 * math.cos(angle) ** 2, across + 0.6 * pad],
        [across, 1e7 + 1.2e7 * math.sin(angle) ** 2 + pad],
    ]
    force = -pad * float(np.linalg.solve(rows, [0.0, -5000.0])[1])
    told = f"of the load of 5000 N, {float(f'{force:.3g}'):g} N press the shoe on; the links carry the rest"
    report = advise(LoadedCase(case, "", "a test"), ["shoe.mass"], 0.2, lambda what, done, total: None, most=-1.0)
    assert (told in report.notes()) is (force < 2500.0)


@campaign
def test_open_pads_rest_on_the_mean_stiffness_and_lists_are_scaled_as_a_whole() -> None:
    waves = {"amplitudes": [30e-6, 20e-6], "wavelengths": [0.02, 0.013]}
    case = make(
        SQUEAL, load__force=200.0, friction__coefficient=1.5, roughness__wheel=waves, solver__duration=0.02
    )
    report = advice_on(case)
    assert any("mean stiffness" in note for note in report.notes())
    by_key = {each.parameter: each for each in report.sensitivities}
    given = by_key["roughness.wheel.amplitudes"]
    assert given.value == (30e-6, 20e-6)
    assert given.elasticity is not None
    more = changed(case, ("roughness", "wheel", "amplitudes"), (33e-6, 22e-6))
    assert more is not None
    moved = answer(more)
    assert moved is not None
    assert moved.critical is not None
    assert report.critical_friction is not None
    part = math.log(moved.critical / report.critical_friction) / math.log(1.1)
    assert given.error is not None
    bend = 0.1 * part  # of the curve, over a tenth of the amplitudes
    assert abs(given.elasticity - part) <= given.error + bend
    best = report.advice[0]
    assert best.to is not None
    there = changed(case, tuple(best.parameter.split(".")), best.to)
    assert there is not None
    reached = answer(there)
    assert reached is not None
    assert reached.critical == pytest.approx(1.8, rel=1e-3)


def test_keys_are_chosen_by_patterns() -> None:
    case = make(ROUGH)
    assert ("load", "force") in advised_keys(case, KEYS)
    assert advised_keys(case, ("link?.angle_deg",)) == [("link1", "angle_deg"), ("link2", "angle_deg")]
    assert advised_keys(case, ("friction.coefficient",)) == [("friction", "coefficient")]
    for wrong in ("link3.*", "solver.step", "solver.scheme", "roughness.wheel.amplitudes", ""):
        with pytest.raises(UsageError, match="names no number that may be advised"):
            advised_keys(case, (wrong,))
    lower = advised(make(SQUEAL, friction__coefficient=0.7), ("friction", "coefficient"), 0.2, tell)
    assert lower.to == pytest.approx(0.57537616 / 1.2, rel=1e-7)


def test_an_angle_that_helps_at_0_alone_is_advised_so_exactly() -> None:
    """With a dashpot along the wheel alone the shoe is stable where nothing couples it: at 0, not near it."""
    case = make(SQUEAL, link1__damping=0.0, link2__angle_deg=0.7)
    found = advised(case, ("link2", "angle_deg"), 0.2, tell)
    assert (found.to, found.rounded, found.critical_friction) == (0.0, "0", None)


@pytest.mark.parametrize("shoes", counts(0, 20))
def test_no_safe_value_lies_nearer_than_the_advised_one(shoes: int) -> None:
    """400 values of each key, by growth rates at φ = 0 and at the margin of matrices that are built here."""
    helped = 0
    for case, tables in islice(unstable_shoes(6), shoes):
        target = 1.2 * tables["friction"]["coefficient"]
        for path in advised_keys(case, ("shoe.mass", "link*.angle_deg", "link*.stiffness", "link*.damping")):
            found = advised(case, path, 0.2, tell)
            angle = path[1] == "angle_deg"
            start = found.start
            grid = np.linspace(-89.0, 89.0, 357) if angle else start * np.logspace(-0.999, 0.999, 400)
            for value in grid.tolist():
                there = {**tables, path[0]: {**tables[path[0]], path[1]: value}}
                shoe = Shoe.of(there)
                rounding = 1e-7 * 2.0 * math.pi * shoe.fast
                rates = [replace(shoe, phi=phi).rate for phi in (0.0, target)]
                determinant = np.linalg.det(replace(shoe, phi=target).stiffness)
                if max(rates) < -rounding and determinant > 0.0 and presses(there):
                    assert found.to is not None, (path, value)
                    assert found.size <= (
                        math.radians(abs(value - start)) if angle else abs(math.log(value / start))
                    )
                if found.to is not None and found.until is not None and min(rates) > -math.inf:
                    inside = min(found.to, found.until) < value < max(found.to, found.until)
                    assert not inside or max(rates) < rounding, (path, value, found)
            helped += found.to is not None
    assert helped > 2 * shoes


def presses(tables: Tables) -> bool:
    """Whether the load presses the shoe on: F_y det(S)/(Q K) is c2 cos(α) cos(α - β)."""
    alpha, beta = (math.radians(tables[link].get("angle_deg", 0.0)) for link in ("link2", "link1"))
    return math.cos(alpha) * math.cos(alpha - beta) > 1e-3


def with_a_narrow_interval() -> list[Case]:
    """Shoes whose damping of link 1 is 0; from 5e-5 to 5e-4 of critical damping it helps, more does not."""
    return [
        make(
            SQUEAL,
            shoe__mass=mass,
            link1__stiffness=c_1,
            link2__stiffness=c_2,
            contact__stiffness=k / 0.1,
            link1__damping=0.0,
            link2__damping=b_2,
            link1__angle_deg=beta,
            link2__angle_deg=alpha,
            friction__coefficient=phi,
        )
        for mass, c_1, c_2, k, b_2, beta, alpha, phi in (
            (0.5795, 1.0689e6, 1.3112e6, 1.4625e5, 0.11542, 2.8966, 6.0083, 0.54396),
            (30.586, 2.1066e6, 1.835e6, 3.9682e6, 0.84585, 33.027, 31.66, 1.1749),
            (24.644, 1.0908e6, 1.649e6, 3.3557e6, 3.2486, 25.4, 20.877, 1.043),
        )
    ]


def test_a_safe_decade_of_a_damping_that_is_zero_is_found_between_its_roots() -> None:
    """A thousandth of critical damping and less; both ends by eigenvalues on a fine grid."""
    for case in with_a_narrow_interval():
        found = advised(case, ("link1", "damping"), 0.2, tell)
        assert found.to is not None
        assert found.until is not None
        assert found.until < 20.0 * found.to
        least = 1.2 * case.friction.coefficient
        for value, safe in ((0.99 * found.to, False), (1.01 * found.to, True), (0.99 * found.until, True)):
            there = changed(case, ("link1", "damping"), value)
            assert there is not None
            reached = answer(there)
            assert reached is not None
            assert reached.safe(least) is safe


def test_an_interval_ends_where_the_shoe_locks_though_rounding_leaves_a_power_too_much() -> None:
    """det(S) is linear in the stiffness of a link, but computed as a difference of squares."""
    case = make(
        SQUEAL,
        shoe__mass=12.098,
        wheel__angular_speed=-0.94722,
        link1__stiffness=6973400.0,
        link1__damping=1.5145,
        link1__angle_deg=-24.495,
        link2__stiffness=8633700.0,
        link2__damping=9.8552,
        link2__angle_deg=-44.531,
        friction__coefficient=1.4944,
        contact__half_length=0.011912,
        contact__stiffness=424610000.0,
    )
    found = advised(case, ("link2", "stiffness"), 0.2, tell)
    beta = math.radians(-24.495)
    alpha = math.radians(-44.531)
    k = 2.0 * 0.011912 * 424610000.0
    grip = -1.2 * 1.4944
    c_1 = 6973400.0
    # det(S) = c1 c2 cos²(α - β) + K (cxx - grip cxy)
    slope = c_1 * math.cos(alpha - beta) ** 2 + k * math.cos(alpha) * (math.cos(alpha) + grip * math.sin(alpha))
    root = -k * c_1 * math.sin(beta) * (math.sin(beta) - grip * math.cos(beta)) / slope
    assert found.to is not None
    assert root < found.to < found.start
    assert found.until == pytest.approx(root, rel=1e-9)
