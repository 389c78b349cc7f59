"""The flow on rough pads: its derivative by differences, its end by other schemes and by exponentials."""

import math
import tomllib
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.method import Method
from brakecli.solver.motion.rough import Flown, RoughFlow, Status, default_steps
from brakecli.solver.period import common_period
from brakecli.solver.phases import BACKWARD, FORWARD, STICK
from brakecli.solver.system import Initial, System
from tests.analysis.shoes import random_shoes
from tests.campaign import counts
from tests.examples import ROUGH, SQUEAL, make
from tests.studies.sweeps.shoes import drawn

Array = NDArray[np.float64]
KINDS: dict[str, Callable[[Flown], bool]] = {  # what a flow may pass through
    "backward": lambda flown: flown.word == (BACKWARD,),
    "forward": lambda flown: flown.word == (FORWARD,),
    "begins in stick": lambda flown: flown.word[0] == STICK,
    "stick begins": lambda flown: STICK in flown.word[1:],
    "stick ends": lambda flown: STICK in flown.word[:-1],
    "slip reverses": lambda flown: bool({(0, 2), (2, 0)} & set(zip(flown.word, flown.word[1:], strict=False))),
    "touches in part": lambda flown: any(
        0.0 < f < 1.0 for f in (flown.margins.contact, flown.margins.most_contact)
    ),
    "opens": lambda flown: flown.margins.open_share > 0.0,
}


def scales(system: System) -> Array:
    """Sizes of x, y, v_x and v_y: the depth that the load presses the shoe in by, and its speed at that size."""
    c = system.coefficients
    depth = system.load_at_start / (c.c_yy + system.contact_stiffness)
    return depth * np.array([1.0, 1.0, *[2.0 * math.pi * system.natural_frequencies[1]] * 2])


def rough_shoe(seed: int, state_of: float = 0.5) -> tuple[System, Array, float, np.random.Generator]:
    """A shoe whose pad opens, fast or slow, a state some depths from rest, and a span of a few periods (s)."""
    rng = np.random.default_rng(seed)
    tables, *_ = drawn(seed, "opening")
    tables["wheel"]["angular_speed"] *= float(10.0 ** rng.uniform(-2.5, 0.3))
    tables["friction"] = {"coefficient": float(rng.uniform(0.1, 1.5))}
    tables["solver"]["duration"] = 1e-3
    if rng.random() < 0.3:
        tables["roughness"]["shoe"] = {"amplitudes": [2e-5], "wavelengths": [0.011]}
    system = system_of(Case.model_validate(tables))
    size = scales(system)
    state = np.array([0.0, -size[1], 0.0, 0.0]) + size * rng.normal(size=4) * 10.0 ** rng.uniform(-1.0, state_of)
    return system, state, float(rng.uniform(0.3, 3.0)) / system.natural_frequencies[1], rng


def event_driven(system: System, state: Array, span: float, samples: int, tolerance: float = 1e-12) -> Motion:
    """The motion from a state by the event-driven scheme and the exact contact."""
    method = Method("event-driven", tolerance=tolerance)
    initial = Initial(*state.tolist())
    found = solve(replace(system, initial=initial, interval=span / samples, duration=span, method=method))
    assert not found.work.failed
    return found


# --- derivative -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("many", counts(80, 400))
def test_the_derivative_is_that_of_differences(many: int) -> None:
    """Where both sides have the same word, with a difference of 1e-6 of the sizes.

    Its rounding is 1e-10, its square 1e-12. A kink of the force's second derivative adds at most 1e-6. At an event
    the derivative is carried as the motion's, not as that of the steps, from which it differs by the error of the
    steps: on average both are as far from that of sixteen times finer steps, and no derivative twice as far.
    """
    kinds = Counter[str]()
    compared = 0
    errors = np.zeros(2)  # of derivatives, and of differences
    for seed in range(many):
        system, state, span, rng = rough_shoe(seed)
        if stuck := rng.random() < 0.3:
            state[2] = system.belt_speed
        cells = system.by(evaluator="cells", nodes=int(rng.choice([60, 96, 130]))).nodes
        flow = RoughFlow(system, cells)
        size = scales(system)
        steps = default_steps(system, span)
        begin = float(rng.uniform(0.0, 1.0))
        found = flow(state, begin, span, steps)
        finer = flow(state, begin, span, 16 * steps)
        assert found.status is finer.status is Status.DONE
        assert found.derivative is not None
        assert finer.derivative is not None
        derivative = found.derivative * size / size[:, None]
        differences = np.zeros((4, 4))
        words = {found.word, finer.word}
        for i in range(4):
            if i == 2 and stuck and found.word[0] == STICK:  # disturbed, it slips for a moment
                continue
            change = 1e-6 * size * np.eye(4)[i]
            above, below = (flow(state + s * change, begin, span, steps, tangents=False) for s in (1.0, -1.0))
            differences[:, i] = (above.state - below.state) / size / 2e-6
            words |= {above.word, below.word}
        if len(words) == 1:
            compared += 1
            known = 1e-6 * np.abs(derivative).max()
            if len(found.word) == 1:
                assert np.abs(derivative - differences).max() < known, seed
            else:
                true = finer.derivative * size / size[:, None]
                own = np.abs(derivative - true).max()
                by_differences = np.abs(differences - true).max()
                assert own < 2.0 * by_differences + known, seed
                errors += (own, by_differences)
            kinds.update(name for name, has in KINDS.items() if has(found))
    assert errors[0] < 1.05 * errors[1]
    assert compared >= 0.7 * many
    assert min(kinds[name] for name in KINDS) >= many // 40, kinds


def test_the_end_does_not_jump_where_a_kink_passes_into_another_step() -> None:
    """A pad that lands and lifts off some thirty times in a period of its waves, from states 1e-4 sizes apart.

    Where a derivative rises or falls from D to D' over a stretch d, the end changes by d (D + D')/2, but for at
    most d |D' - D|/2. What is more is a jump, or a derivative of something else.
    """
    windows = Path(__file__).parents[1] / "studies" / "sweeps" / "windows.toml"
    shoe = tomllib.loads(windows.read_text())["doubling"]["case"]
    system = system_of(make(shoe, link2__stiffness=3466000.0))
    flow = RoughFlow(system)
    size = scales(system)
    way = size * [1.0, 0.5, 0.3, 0.0]
    span = common_period(system)
    assert span is not None
    span /= 3.0
    apart = 1e-4
    state = np.array([2.698e-05, -6.659e-05, -0.07198, 0.1221])
    runs = [flow(state + k * apart * way, 0.0, span, default_steps(system, span)) for k in range(-100, 101)]
    assert all(run.margins.open_share > 0.2 for run in runs)
    ends = np.array([run.state for run in runs]) / size
    slopes = np.array([run.derivative for run in runs]) @ way / size
    beyond = np.diff(ends, axis=0) - 0.5 * apart * (slopes[1:] + slopes[:-1])
    assert np.abs(beyond).max() < 0.5 * apart * np.abs(np.diff(slopes, axis=0)).max()


def test_without_the_derivative_the_end_is_the_same() -> None:
    for seed in range(10):
        system, state, span, _ = rough_shoe(seed)
        flow = RoughFlow(system)
        one, other = (flow(state, 0.1, span, default_steps(system, span), tangents) for tangents in (True, False))
        assert other.derivative is None
        assert one.word == other.word
        np.testing.assert_allclose(one.state, other.state, rtol=0.0, atol=1e-12 * np.abs(one.state).max())


def test_the_velocity_is_that_of_differences_in_the_span() -> None:
    """With equal steps, whose number grows with the span, to the error of the steps."""
    system, state, span, _ = rough_shoe(2)
    flow = RoughFlow(system)
    steps = 400
    found = flow(state, 0.0, span, steps)
    ends = [flow(state, 0.0, span * (steps + n) / steps, steps + n, tangents=False).state for n in (-1, 1)]
    slope = (ends[1] - ends[0]) / (2.0 * span / steps)
    np.testing.assert_allclose(found.velocity / scales(system), slope / scales(system), rtol=1e-3)


@pytest.mark.parametrize("times", [1.0, 30.0, 1000.0])
def test_strong_dashpots_do_not_blow_up_the_steps(times: float) -> None:
    """Dashpots of so many times critical damping: what decays within a step does not grow in it."""
    for seed in range(6):
        system, state, span, _ = rough_shoe(seed)
        c = system.coefficients
        critical = 2.0 * c.m * 2.0 * math.pi * system.natural_frequencies[1]
        strong = c._replace(b_xx=times * critical, b_xy=0.2 * times * critical, b_yy=0.5 * times * critical)
        system = replace(system, coefficients=strong)
        flow = RoughFlow(system)
        steps = default_steps(system, span)
        runs = [flow(state, 0.0, span, finer * steps) for finer in (1, 4)]
        assert [each.status for each in runs] == [Status.DONE, Status.DONE]
        apart = np.abs((runs[0].state - runs[1].state) / scales(system)).max()
        assert apart < 1e-2
        assert runs[0].derivative is not None
        assert np.abs(runs[0].derivative * scales(system) / scales(system)[:, None]).max() < 10.0


# --- end ------------------------------------------------------------------------------------------------------


def errors_of(system: System, state: Array, span: float, tries: list[tuple[int, int]]) -> list[float]:
    """Errors of the end, in sizes, with some cells and so many times the default steps."""
    end = event_driven(system, state, span, 1).rows[-1, :4]
    found = []
    for cells, finer in tries:
        steps = finer * default_steps(system, span)
        flown = RoughFlow(system, cells)(state, 0.0, span, steps, tangents=False)
        found.append(float(np.abs((flown.state - end) / scales(system)).max()))
    return found


def order(errors: Array, finer: float) -> float:
    """The mean order of rows of errors, the second with so much finer steps or cells."""
    return float(np.log(errors[:, 0] / errors[:, 1]).mean() / math.log(finer))


@pytest.mark.parametrize("many", counts(12, 40))
def test_the_end_comes_to_that_of_the_event_driven_scheme(many: int) -> None:
    """By order five in full contact, and by about three where the pad opens.

    Each kink of the force's second derivative adds an error of third order in the steps, and the edge of what
    touches one of third order in the cells.
    """
    tries = [(96, 20), (288, 20), (800, 1), (800, 3)]
    errors = np.array([errors_of(*rough_shoe(seed)[:3], tries) for seed in range(many)])
    part = errors[:, 0] > 1e-8  # in full contact the number of cells has no influence
    assert part.mean() > 0.5
    assert order(errors[part, :2], 3.0) > 2.7
    assert order(errors[part, 2:], 3.0) > 2.7
    assert order(errors[~part, 2:], 3.0) > 4.4
    assert np.quantile(errors[:, [1, 3]], 0.9) < 1e-5


def test_a_common_period_later_everything_is_the_same() -> None:
    for seed in (0, 1, 2, 7, 8, 12):
        system, state, span, _ = rough_shoe(seed)
        flow = RoughFlow(system)
        steps = default_steps(system, span)
        period = common_period(system)
        assert period is not None, seed
        one, other, third = (
            flow(state, begin, span, steps) for begin in (0.02, 0.02 + period, 0.02 + 0.4 * period)
        )
        size = scales(system)
        np.testing.assert_allclose(one.state / size, other.state / size, atol=1e-9)
        assert one.word == other.word
        assert np.abs((one.state - third.state) / size).max() > 1e-6


# --- word, margins and statuses -------------------------------------------------------------------------------

STATES = {-1: BACKWARD, 0: STICK, 1: FORWARD}
SLOW: dict[str, Any] = {  # sticks and slips on a slow rough wheel
    "wheel__angular_speed": 0.05,
    "friction__coefficient": 0.7,
    "roughness__wheel": {"amplitudes": [2e-5, 1e-5], "wavelengths": [0.004, 0.0025]},
}


def slow() -> tuple[System, Array, float]:
    system = system_of(make(SQUEAL, **SLOW))
    size = scales(system)
    return system, size * np.array([-1.0, -1.0, 0.0, 0.0]), 0.05


def test_word_and_times_are_those_of_the_event_driven_scheme() -> None:
    system, state, span = slow()
    found = RoughFlow(system, 200)(state, 0.0, span, 1000)
    samples = 20_000
    motion = event_driven(system, state, span, samples)
    phases = np.array([STATES[int(each)] for each in motion.rows[:, 7]])
    after = np.flatnonzero(np.diff(phases)) + 1
    assert len(found.word) > 5
    assert found.word == (phases[0], *phases[after])
    np.testing.assert_allclose(found.times, after * span / samples, atol=1.01 * span / samples)


def check_margins(found: Flown, system: System, rows: Array) -> None:
    """Margins and extremes are those of many samples, each of which misses its least value by its curvature."""
    x, y, v_x, _, friction, normal, fraction, phase = rows.T
    size = scales(system)
    slip = np.abs(v_x - system.belt_speed)
    stick = phase == 0.0
    np.testing.assert_allclose(found.x, [x.min(), x.max()], atol=2e-5 * size[0])
    np.testing.assert_allclose(found.y, [y.min(), y.max()], atol=2e-5 * size[1])
    if found.word in ((BACKWARD,), (FORWARD,)):
        assert found.margins.slide == pytest.approx(slip.min(), abs=1e-4 * size[2])
        assert found.margins.hold == math.inf
    if found.word == (STICK,):
        cone = system.coefficients.phi * normal - np.abs(friction)
        assert found.margins.hold == pytest.approx(cone.min(), rel=1e-3)
        assert found.margins.slide == math.inf
    assert found.margins.stick_share == pytest.approx(stick.mean(), abs=5e-3)
    assert found.margins.open_share == pytest.approx((fraction == 0.0).mean(), abs=0.02)
    assert found.margins.contact == pytest.approx(fraction.min(), abs=0.02)
    assert found.margins.most_contact == pytest.approx(fraction.max(), abs=0.02)


def test_margins_are_those_of_samples() -> None:
    words = set()
    for seed in range(14):
        system, state, span, _ = rough_shoe(seed)
        found = RoughFlow(system, 200)(state, 0.0, span, 6 * default_steps(system, span))
        words.add(found.word)
        check_margins(found, system, event_driven(system, state, span, 2000, 1e-9).rows)
    assert len(words) > 2
    system, state, span = slow()
    c = system.coefficients
    belt = system.belt_speed
    span = 5e-4
    state[[0, 2]] = -(c.c_xy * state[1] + c.b_xx * belt) / c.c_xx, belt  # no friction is needed
    found = RoughFlow(system, 200)(state, 0.0, span, 400)
    assert found.word == (STICK,)
    check_margins(found, system, event_driven(system, state, span, 2000).rows)


def test_a_phase_that_a_step_would_miss_is_found() -> None:
    """A stick that a coarse flow passes within one step has the times of a fine one."""
    system, state, span = slow()
    fine, coarse = (RoughFlow(system)(state, 0.0, span, steps) for steps in (4000, 120))
    assert coarse.word == fine.word
    np.testing.assert_allclose(coarse.times, fine.times, atol=1e-3 * span)


def flying(**changes: Any) -> System:
    """A shoe that is pulled off the wheel, which is at rest: its slip reverses twice in a period."""
    rough = {"amplitudes": [1e-6], "wavelengths": [0.01]}
    return system_of(
        make(SQUEAL, wheel__angular_speed=0.0, load__force=-5000.0, roughness__wheel=rough, **changes)
    )


def test_statuses_say_why_a_flow_has_no_end() -> None:
    system = flying(link1__damping=0.0, link2__damping=0.0)
    flow = RoughFlow(system)
    size = np.array([1e-3, 1e-3, 1.0, 1.0])
    state = size * np.array([1.0, 1.0, 0.5, 0.0])
    period = 1.0 / system.natural_frequencies[1]
    assert flow(state, 0.0, period, 40).status is Status.DONE
    for tangents in (True, False):
        assert flow(state, 0.0, 400.0 * period, 16_000, tangents).status is Status.TOO_MANY_EVENTS
        assert flow(state, 0.0, 1e6 * period, 1_000, tangents).status is Status.NOT_FINITE
        assert flow(np.array([math.nan, 0.0, 0.0, 0.0]), 0.0, period, 40, tangents).status is Status.NOT_FINITE
    failed = flow(state, 0.0, 1e6 * period, 1_000)
    assert failed.derivative is None
    assert flow(state, 0.0, period, 40).status is Status.DONE  # whatever came before


def test_what_the_flow_cannot_do_is_refused() -> None:
    changing = make(SQUEAL, wheel__angular_speed=None, wheel__times=[0.0, 1.0], wheel__angular_speeds=[1.0, 2.0])
    with pytest.raises(ValueError, match="constant speed"):
        RoughFlow(system_of(changing))
    with pytest.raises(ValueError, match="cells are too few"):
        RoughFlow(system_of(make(ROUGH)), 10)


@pytest.mark.parametrize("many", counts(15, 60))
def test_no_flow_of_a_random_shoe_fails(many: int) -> None:
    """Neither do phases that begin and end within one step pile up, nor do they graze."""
    for seed, tables in enumerate(islice(random_shoes("open", 1), many)):
        system = system_of(Case.model_validate(tables))
        rng = np.random.default_rng(seed)
        fast = system.natural_frequencies[1]
        passing = system.passing_frequency
        span = min(20.0 / fast, 1500.0 / max(passing, fast))
        start = np.array([system.initial.x, system.initial.y, system.initial.vx, system.initial.vy])
        state = start + np.abs(scales(system)) * rng.normal(size=4)
        found = RoughFlow(system)(state, 0.0, span, default_steps(system, span))
        assert found.status is Status.DONE, seed
