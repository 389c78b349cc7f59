"""What a motion comes to: against motions by other schemes, and what is not known."""

import math
from itertools import islice
from typing import Any

import numpy as np
import pytest

from brakecli.analysis import fate as room
from brakecli.analysis import rough_fate
from brakecli.analysis.branches.forced import Forced
from brakecli.analysis.branches.line import Line
from brakecli.analysis.fate import Fate, Kind, fate, fate_on_smooth_pads
from brakecli.analysis.shoe import Shoe
from brakecli.case.system import system_of
from brakecli.solver.steady_sliding import steady_sliding
from tests.analysis.branches.phasewise import AHEAD, BEHIND, OPEN, STICK, Phasewise
from tests.analysis.branches.smooth_shoes import FRICTION, changed, drawn
from tests.analysis.shoes import Shoe as Drawn
from tests.analysis.shoes import Tables
from tests.campaign import campaign
from tests.examples import SQUEAL, make
from tests.studies.sweeps.shoes import drawn as rough_drawn

BUMPS = {"amplitudes": [2e-6], "wavelengths": [0.05]}
WAVES = {"amplitudes": [2e-5], "wavelengths": [0.03]}

pytestmark = pytest.mark.usefixtures("compiled")

HYSTERETIC, CRITICAL = next(islice(drawn(1), 1, None))
"""A shoe that vibrates far below its critical friction, from its own start from 0.176 on."""


def of_smooth(friction: float, tables: Tables = HYSTERETIC) -> tuple[Shoe, Any]:
    """The shoe, and its own start."""
    system = system_of(make(changed(tables, FRICTION, friction)))
    shoe = Shoe.of(system)
    assert shoe.rest is not None
    return shoe, system.initial.beside(shoe.rest)


@pytest.mark.parametrize(
    ("friction", "lasts"),
    [(0.18, True), *(pytest.param(*each, marks=campaign) for each in ((0.17, False), (0.33, True)))],
)
def test_a_motion_on_smooth_pads_comes_to_what_another_scheme_shows(friction: float, lasts: bool) -> None:
    end = fate_on_smooth_pads(*of_smooth(friction))
    assert end.lasts is lasts
    motion = Phasewise(Drawn.of(changed(HYSTERETIC, FRICTION, friction)))
    if end.state is None:
        _, state = of_smooth(friction)
        for _ in range(30):
            way = motion(state, 0.35)
            state = way.end
        assert not way.times
        return
    orbit = end.orbit
    assert orbit is not None
    way = motion(end.state, orbit.period)
    sizes = 0.5 * (way.high - way.low)
    np.testing.assert_array_less(np.abs(way.end - end.state), 1e-7 * sizes)
    assert [(BEHIND, STICK, AHEAD, OPEN)[phase] for phase in orbit.word] == list(way.word)
    assert orbit.times == pytest.approx(way.times, abs=1e-9 * orbit.period)


def test_a_motion_that_takes_too_many_steps_is_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "MOST_STEPS", 0)
    assert fate_on_smooth_pads(*of_smooth(0.18)).lasts is None
    monkeypatch.setattr(rough_fate, "MOST_ROUGH_STEPS", 1)
    assert of_rough(1.53).lasts is None


def test_a_shoe_that_locks_or_hangs_off_the_wheel_is_named() -> None:
    shoe, state = of_smooth(0.18)
    locked = shoe._replace(coefficients=shoe.coefficients._replace(phi=1e3), belt=-shoe.belt)
    either = [each for each in (locked, locked._replace(belt=shoe.belt)) if each.rest is None]
    assert either
    assert fate_on_smooth_pads(either[0], state).kind is Kind.LOCKS
    hanging = fate_on_smooth_pads(shoe._replace(load=-shoe.load), state)
    assert hanging.kind is Kind.LEAVES
    assert hanging.lasts is None


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({}, Kind.LIMIT_CYCLE),
        ({"friction__coefficient": 0.3}, Kind.STEADY_SLIDING),
        ({"wheel__angular_speed": 0.0}, Kind.UNKNOWN),
        ({"roughness__shoe": BUMPS}, Kind.VIBRATION),
        ({"roughness__shoe": BUMPS, "friction__coefficient": 0.3}, Kind.STEADY_SLIDING),
        ({"roughness__shoe": BUMPS, "link1__damping": 0.0, "link2__damping": 0.0}, Kind.UNKNOWN),
        ({"roughness__wheel": WAVES, "friction__coefficient": 0.3}, Kind.UNKNOWN),  # nothing says what they force
    ],
)
def test_a_system_comes_to_what_its_surfaces_allow(changes: dict[str, Any], kind: Kind) -> None:
    """SQUEAL loses stability at a friction of 0.576."""
    system = system_of(make({**SQUEAL, "friction": {"coefficient": 0.7}}, **changes))
    end = fate(system, system.initial.beside(np.zeros(2)), within=1.0)
    assert end.kind is kind
    assert (end.orbit is not None) is (kind is Kind.LIMIT_CYCLE)
    assert (end.lasts is None) is (kind is Kind.UNKNOWN)


def of_rough(friction: float, given: bool = True, seed: int = 6) -> Fate:
    """What a rough shoe on a rough wheel comes to; the motion that the waves force may be given or not."""
    tables, key, low, high, _ = rough_drawn(seed, "opening")
    line = Line(make(tables), [key.replace("__", ".")], low, high)
    p = line.place(friction)
    point = Forced.along(line).begin(p)
    system = line.system(p)
    assert point is not None
    rest = steady_sliding(system)
    calm = [np.array(point.facts.state)] if given else []
    return fate(system, system.initial.beside((rest.x, rest.y)), forced=calm)


@pytest.mark.parametrize(("friction", "lasts"), [(1.525, False), (1.53, True), (1.6, True), (1.65, False)])
def test_a_motion_on_rough_pads_comes_to_what_event_driven_runs_show(friction: float, lasts: bool) -> None:
    """Runs of 10 s from the case's own start and from the forced motion keep 85 % of their distance, or 1e-3."""
    end = of_rough(friction)
    assert end.lasts is lasts
    assert (end.state is not None) is lasts


def test_what_fades_slowly_beside_the_loss_of_stability_does_not_last(monkeypatch: pytest.MonkeyPatch) -> None:
    """Event-driven runs of 20 s come nearer to the forced motion to their end: by three tenths in the last 8 s."""
    assert of_rough(2.232, seed=11).lasts is not True
    monkeypatch.setattr(rough_fate, "NOTICED", 0.0)
    assert of_rough(2.232, seed=11).lasts is True


@pytest.mark.parametrize(("friction", "lasts"), [(0.2625, False), (0.263, False), (0.2635, True)])
def test_a_vibration_that_has_just_vanished_does_not_last(friction: float, lasts: bool) -> None:
    """By a Runge-Kutta integrator of its own the start fades within 165 s; from 0.2632 on it lasts for 500 s."""
    assert of_rough(friction, seed=60283).lasts is lasts


def test_what_obeys_linear_equations_once_by_chance_does_not_fade(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rough_fate, "IN_A_ROW", 1)
    monkeypatch.setattr(rough_fate, "TURNS", math.inf)
    assert of_rough(1.53).lasts is False


def test_without_a_calm_motion_nothing_is_known() -> None:
    assert of_rough(1.53, given=False).lasts is None


def test_no_motion_fades_to_one_that_is_unstable() -> None:
    assert of_rough(2.1).lasts is not False
