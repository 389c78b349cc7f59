"""Vibrations that no branch from flutter reaches: where pushes find them, and what is said of the search."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.branches import explore, islands
from brakecli.analysis.branches import thresholds as module
from brakecli.analysis.branches.explore import Explorer
from brakecli.analysis.branches.islands import LARGEST, PARTS, VALUES, places, pushes, try_pushes
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.sliding import Sliding
from brakecli.analysis.branches.thresholds import FRICTION, Thresholds, thresholds
from brakecli.analysis.stability.report import stability
from brakecli.case.system import system_of
from tests.analysis.branches.phasewise import Phasewise
from tests.analysis.branches.smooth_shoes import changed, numbered
from tests.analysis.shoes import Shoe, Tables
from tests.examples import make

pytestmark = pytest.mark.usefixtures("compiled")

ISLANDS = tomllib.loads((Path(__file__).parent / "islands.toml").read_text(encoding="utf-8"))
FROM = {"large": 0.418, "stiff": 0.315}
"""The least friction at which a search by many runs of an integrator of its own has found a vibration."""
FLUTTER = {"large": None, "stiff": 0.8767}
"""Where the fold lies of the branch from flutter, if that leads below it."""
FEW = 32
SUBCRITICAL = numbered(2500, 79)
"""A shoe whose branch from flutter leads far below it, with no other vibration."""


def found_of(tables: Tables, number: int = 128) -> Thresholds:
    case = make(tables)
    system = system_of(case)
    return thresholds(case, system, stability(system), pushes=number)


def line_of(tables: Tables) -> Line:
    lost = stability(system_of(make(tables))).critical
    assert lost is not None
    return Line(make(tables), [FRICTION], 0.0, 2.0 * lost.friction)


def explored(tables: Tables, number: int) -> Explorer:
    """The branches along friction up to twice the critical one."""
    explorer = Explorer(line_of(tables), lambda *_: None, lambda: False, points=module.POINTS)
    explorer.explore(pushes=number)
    return explorer


@pytest.mark.parametrize("name", ISLANDS)
def test_a_vibration_that_no_branch_from_flutter_reaches_is_found_from_its_fold_on(name: str) -> None:
    found = found_of(ISLANDS[name])
    assert found.coexists_from == pytest.approx(FROM[name], abs=1e-3)
    begin = f"{found.coexists_from:.4g}"
    assert f"a vibration, found in 640 pushes, can exist from {begin} on" in found.beside
    assert "other" not in found.beside
    assert (found.search.pushes, len(found.search.islands)) == (640, 1)


@pytest.mark.parametrize("name", ISLANDS)
def test_just_above_that_fold_another_scheme_returns_to_the_same_state(name: str) -> None:
    explorer = explored(ISLANDS[name], FEW)
    (island,) = explorer.search.islands
    assert island.branch is not None
    stable = [point for point in island.branch.points if point.stable]
    lowest = min(stable, key=lambda point: point.p)
    value = explorer.line.value(lowest.p)
    assert value == pytest.approx(FROM[name], rel=0.05)  # a stride above
    motion = Phasewise(Shoe.of(changed(ISLANDS[name], FRICTION, value)))
    facts: Any = lowest.facts
    way = motion(np.array(facts.state), facts.period)
    np.testing.assert_array_less(np.abs(way.end - facts.state), 1e-5 * (way.high - way.low))
    assert len(way.times) > 0


@pytest.mark.parametrize("name", ISLANDS)
def test_without_pushes_nothing_is_said_of_them(name: str) -> None:
    found = found_of(ISLANDS[name], 0)
    assert found.coexists_from == (FLUTTER[name] and pytest.approx(FLUTTER[name], abs=1e-4))
    assert "push" not in found.beside
    assert "other" not in found.beside
    assert found.search.pushes == 0


def test_a_vibration_of_a_known_branch_is_no_other_one() -> None:
    found = found_of(SUBCRITICAL, FEW)
    assert found.search.islands == []
    assert found.coexists_from == found_of(SUBCRITICAL, 0).coexists_from
    assert found.beside.endswith(f"; no other vibration found in {PARTS * FEW} pushes")


def test_where_a_branch_was_cut_pushes_find_its_continuation_and_that_is_no_other_vibration(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = found_of(SUBCRITICAL, 0).coexists_from
    monkeypatch.setattr(module, "POINTS", 60)
    assert "the branch is cut at " in found_of(SUBCRITICAL, 0).beside
    found = found_of(SUBCRITICAL, FEW)
    assert found.coexists_from == pytest.approx(whole, rel=1e-9)
    assert "no other vibration" in found.beside


def test_pushes_without_an_end_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(islands, "LONGEST", 0.0)
    found = found_of(SUBCRITICAL, 2)
    assert found.beside.endswith("no other vibration found in 10 pushes; what 10 of these come to is not known")


def test_what_is_found_and_not_followed_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explore, "MOST_PUSHED", 0)
    explorer = explored(ISLANDS["large"], FEW)
    assert explorer.search.islands == []
    assert all("comes to was not followed" in note for note in explorer.notes)
    assert explorer.notes


def test_a_search_that_is_stopped_has_tried_what_it_says() -> None:
    asked = list[int]()

    def stop() -> bool:
        asked.append(0)
        return len(asked) > FEW

    line = line_of(SUBCRITICAL)
    assert try_pushes(line.shoe(0.1), 0, 2 * FEW, stop).pushes == FEW
    explorer = Explorer(line, lambda *_: None, lambda: True)
    assert explorer.explore(pushes=FEW).search.pushes == 0


def test_values_are_the_own_one_and_others_where_sliding_is_stable() -> None:
    sliding = Sliding(line_of(SUBCRITICAL))
    slides = sliding.along()
    changes = sliding.changes(slides)
    (edge,) = [change.p for change in changes]
    assert edge == pytest.approx(0.5)
    equal = [edge * (k + 0.5) / VALUES for k in range(VALUES)]
    for own, others in ((0.7, equal), (None, equal), (0.3, [0.3, *equal])):
        found = places(slides, changes, own, FEW)
        assert [place.p for place in found] == pytest.approx(others)
        numbers = [place.first + k for place in found for k in range(place.number)]
        assert numbers == [*range(PARTS * FEW)]
    assert places(slides, changes, 0.3, FEW)[0].number == FEW
    assert places([], [], 0.3, FEW) == []


def test_pushes_are_spread_evenly_over_sizes_and_directions() -> None:
    number = 4096
    least = 1e-3
    states = pushes(0, number, least)
    np.testing.assert_array_equal(states[100:120], pushes(100, 20, least))
    sizes = np.linalg.norm(states, axis=1)
    powers = np.log(sizes / least) / np.log(LARGEST / least)
    assert 0.0 <= powers.min() < powers.max() <= 1.0
    assert np.abs(np.sort(powers) - np.linspace(0.0, 1.0, number)).max() < 0.01
    directions = states / sizes[:, None]
    assert np.abs(directions.mean(axis=0)).max() < 0.01
    np.testing.assert_allclose(directions.T @ directions / number, 0.25 * np.eye(4), atol=0.01)
