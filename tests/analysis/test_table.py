"""The table: each row and each threshold by a record of answers that trips it."""

import math
import re
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.regime.answers import Answers, Continuation
from brakecli.analysis.regime.decision import Excitation, Regime, Thresholds
from brakecli.analysis.regime.shapes import SHAPES
from brakecli.analysis.regime.table import CONTACT, ROUGH, SMOOTH, decide
from tests import sentences

LIMITS = Thresholds()
MOVING = Answers(
    duration=10.0,
    samples=10_000,
    growth_rate=-1.0,
    ringing_frequency=100.0,
    level_change=0.0,
    level_change_error=0.01,
    amplitude=1.0,
    level=1.0,
    settled_duration=5.0,
    settled=True,
    cycles=100.0,
    frequency=100.0,
    samples_per_cycle=20.0,
    stick_cycles=0.0,
    harmonic_share=1.0,
)
LASTS: dict[str, Any] = {
    "without_waves": Continuation.LASTS,
    "amplitude_without_waves": 1.0,
    "level_without_waves": 1.0,
}
SHAKEN: dict[str, Any] = {
    "waves": True,
    "slowest_wave_period": 1.0,
    "lyapunov_exponent": 0.0,
    "lyapunov_error": 0.01,
    "lyapunov_by_line": 0.0,
    "lyapunov_by_line_error": 0.01,
    "power_of_friction": 1.0,
    "power_of_friction_error": 0.1,
    "power_of_roughness": 0.1,
    "power_of_roughness_error": 0.1,
    "power_stored": 0.0,
}
FADING: dict[str, Any] = {**SHAKEN, "lyapunov_exponent": -1.0}
SMOOTH_ROWS: dict[str, dict[str, Any]] = {
    "failed": {"failure": "it broke"},
    "older file": {"unasked": "run it"},
    "never touched": {"never_touched": True, "contact_lost": True},
    "lost": {"contact_lost": True},
    "left": {"contact_left": True},
    "at rest": {"carried_along": True, "wheel_stands": True},
    "not held": {"carried_along": True, "held_by_link": False},
    "locks itself": {"carried_along": True, "locking_friction": 0.5},
    "carried": {"carried_along": True},
    "few samples": {"few_samples": True},
    "changes": {"constant_speed_and_load": False},
    "nothing moves yet": {"moves": False, "growth_rate": 1.0},
    "nothing moves": {"moves": False},
    "standing wheel": {"wheel_stands": True},
    "standing wheel, no dashpots": {"wheel_stands": True, "undamped": True},
    "linear, held by the steps": {"linear": True, "growth_rate": 1.0, "steadier": "take half weights"},
    "linear, grows": {"linear": True, "growth_rate": 1.0, "time_to_limit": 3.0},
    "linear, decays": {"linear": True},
    "linear, neutral": {"linear": True, "growth_rate": 0.0},
    "no friction": {"frictionless": True},
    "no friction, no dashpots": {"frictionless": True, "undamped": True},
    "no dashpots": {"undamped": True, "growth_rate": 0.0},
    "fades": {"without_waves": Continuation.DIES},
    "lasts: quasi-harmonic": LASTS,
    "on its way: quasi-harmonic": {**LASTS, "level_without_waves": 2.0},
    "lasts, irregular: quasi-harmonic": {"without_waves": Continuation.LASTS},
    "comes and goes": {"level_change": math.nan, "level_change_error": math.nan},
    "undecided": {"level_change": 0.5},
}
ROUGH_ROWS: dict[str, dict[str, Any]] = {
    "failed": {"failure": "it broke"},
    "shorter than a wave": {"slowest_wave_period": 11.0},
    "linear, held by the steps": {"linear": True, "growth_rate": 1.0, "steadier": "take half weights"},
    "linear, forced": {"linear": True},
    "linear, grows": {"linear": True, "growth_rate": 1.0, "time_to_limit": 3.0},
    "linear, open": {"linear": True, "growth_rate_error": 2.0},
    "forced, no friction": {"frictionless": True},
    "no friction, no dashpots": {"frictionless": True, "undamped": True},
    "bounces": {"touches_in_sliding": False},
    "forced, neighbours": {**FADING, "without_waves": Continuation.DIES, "level_change": 0.5},
    "forced, level": {"without_waves": Continuation.DIES, "level_change": -0.5, "power_of_friction": 0.1},
    "forced, friction takes": {"power_of_friction": -1.0, "power_of_roughness": 2.0},
    "forced, roughness gives": {**FADING, "power_of_roughness": 3.0},
    "forced, another level": {**FADING, **LASTS, "level_without_waves": 2.0},
    "dies out, not yet": {"without_waves": Continuation.DIES, "level_change": 0.5},
    "no dashpots, rough": {"undamped": True},
    "self-excited: quasi-harmonic": LASTS,
    "locked to the waves: quasi-harmonic": {**FADING, **LASTS},
    "comes and goes": {"level_change": math.nan, "level_change_error": math.nan},
    "kept up by friction: quasi-harmonic": {**LASTS, "lyapunov_exponent": -0.1},
    "still changes": {"level_change": 0.5},
    "energy still changes": {"power_stored": 1.0},
    "phase not known": {"lyapunov_exponent": -0.1},
    "either": {},
}
SHAPE_ROWS: dict[str, dict[str, Any]] = {
    "limit cycle with stick": {"sticks_without_waves": 1.0, "period_without_waves": 0.01},
    "limit cycle without stick": {"sticks_without_waves": 0.0, "period_without_waves": 0.01},
    "on its way": {**SHAKEN, "growth_rate": 1.0, "level_change": 0.5},
    "few cycles": {"cycles": 9.0},
    "few steps in a cycle": {"steps_per_cycle": 7.0},
    "few samples in a cycle": {"samples_per_cycle": 7.0},
    "shorter than two waves": {"slowest_wave_period": 3.0},
    "relaxation": {"stick_cycles": 0.9},
    "quasi-harmonic": {},
    "torus": {"stick_cycles": 0.5, "frequency_of_modulation": 27.0},
    "some cycles stick": {"stick_cycles": 0.5},
    "irregular": {"harmonic_share": 0.5},
}
POWERS = (
    "forced, level",
    "forced, friction takes",
    "forced, roughness gives",
    "locked to the waves: quasi-harmonic",
    "kept up by friction: quasi-harmonic",
)
FALLS = "forced, level", -3.0
"""Of the rows that rest on powers the one that holds as well where dashpots take more than both give."""
FORCED = Regime.DAMPED, Excitation.FORCED


def answers(**changes: Any) -> Answers:
    return MOVING._replace(**changes)


@pytest.mark.parametrize("row", SMOOTH_ROWS)
def test_each_row_of_a_smooth_wheel_decides_where_it_holds(row: str) -> None:
    assert decide(answers(**SMOOTH_ROWS[row]), LIMITS).row == row


@pytest.mark.parametrize("row", ROUGH_ROWS)
def test_each_row_of_a_rough_wheel_decides_where_it_holds(row: str) -> None:
    found = decide(answers(**{**SHAKEN, **ROUGH_ROWS[row]}), LIMITS)
    assert found.row == row
    assert ((found.regime, found.excitation) == FORCED) is (row.startswith("forced") or row == "linear, forced")


@pytest.mark.parametrize("row", SHAPE_ROWS)
def test_each_row_of_looks_decides_where_it_holds(row: str) -> None:
    found = decide(answers(**{**LASTS, **SHAPE_ROWS[row]}), LIMITS)
    assert found.row.partition(": ")[2] == row
    assert (found.excitation is Excitation.SELF_EXCITED) == (found.regime is not Regime.UNDECIDED)


def test_every_row_has_a_record_that_trips_it() -> None:
    tried = {name.partition(":")[0] for name in (*SMOOTH_ROWS, *ROUGH_ROWS)} | {*SHAPE_ROWS}
    rows = {row.name for row in (*CONTACT, *SMOOTH, *ROUGH, *SHAPES)}
    assert rows == tried, "write a record of answers for each row into SMOOTH_ROWS, ROUGH_ROWS or SHAPE_ROWS"


def test_the_last_row_of_each_part_always_holds() -> None:
    for rows in (SMOOTH, ROUGH, SHAPES):
        assert rows[-1].holds(Answers(), LIMITS)
        assert rows[-1].decision(Answers()).reason


def test_no_sentence_has_a_number_that_is_not_known() -> None:
    """Whatever is not known; `sentences.read_all` reads what each record of the tests is told."""
    rng = np.random.default_rng(47)
    numbers = [name for name, value in MOVING._asdict().items() if type(value) is float]
    records = [{**SHAKEN, **each} for each in ROUGH_ROWS.values()] + [*SMOOTH_ROWS.values(), *SHAPE_ROWS.values()]
    for record in records:
        for _ in range(20):
            drawn = rng.choice([math.nan, math.inf, -math.inf, 0.5, 0.5, 0.5], len(numbers)).tolist()
            lost = {name: value for name, value in zip(numbers, drawn, strict=True) if not math.isfinite(value)}
            found = decide(answers(**{**record, **lost}), LIMITS)
            assert sentences.unknown_in(found.sentence) == []


@pytest.mark.parametrize(
    ("name", "value", "changes", "rows"),
    [
        (
            "settled_within",
            0.3,
            {"level_change": 0.5, "without_waves": Continuation.LASTS},
            ("undecided", "lasts, irregular"),
        ),
        (
            "sure_errors",
            60.0,
            {"level_change": 0.5, "without_waves": Continuation.LASTS},
            ("undecided", "lasts, irregular"),
        ),
        ("same_level", 0.6, {**LASTS, "level_without_waves": 2.0}, ("on its way", "lasts")),
        ("comes_together", 6.0, {**FADING, **LASTS}, ("locked to the waves", "kept up by friction")),
        ("most", 20.0, {**FADING, **LASTS}, ("locked to the waves", "either")),
        ("fewest_cycles", 200.0, LASTS, ("quasi-harmonic", "few cycles")),
        ("samples_per_cycle", 30.0, LASTS, ("quasi-harmonic", "few samples in a cycle")),
        ("stick_cycles", 0.4, {**LASTS, "stick_cycles": 0.5}, ("some cycles stick", "relaxation")),
        ("harmonic_share", 0.4, {**LASTS, "harmonic_share": 0.5}, ("irregular", "quasi-harmonic")),
        (
            "band_share",
            0.7,
            {**LASTS, "harmonic_share": 0.5, "band_share": 0.8},
            ("irregular", "quasi-harmonic"),
        ),
    ],
)
def test_each_threshold_moves_what_it_stands_for(
    name: str, value: float, changes: dict[str, Any], rows: tuple[str, str]
) -> None:
    found = [decide(answers(**changes), limits).row for limits in (LIMITS, replace(LIMITS, **{name: value}))]
    for row, expected in zip(found, rows, strict=True):
        assert expected in (row, *row.split(": "))


@pytest.mark.parametrize(("sticks", "regime"), [(0.0, Regime.QUASI_HARMONIC), (1.0, Regime.RELAXATION)])
def test_what_still_grows_on_a_rough_wheel_looks_as_the_limit_cycle_to_which_it_comes(
    sticks: float, regime: Regime
) -> None:
    """Its own cycles are those of a transient."""
    changes = {**SHAKEN, **LASTS, "growth_rate": 1.0, "level_change": 0.5, "stick_cycles": 1.0 - sticks}
    assert decide(answers(**changes), LIMITS).row == "self-excited: on its way"
    known = {"sticks_without_waves": sticks, "period_without_waves": 0.01}
    assert decide(answers(**changes, **known), LIMITS).regime is regime


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, True),
        ({"lyapunov_exponent": 0.3, "lyapunov_error": 0.05}, False),  # chaos
        ({"harmonic_share": 0.5, "band_share": 0.95}, True),
        ({"harmonic_share": 0.5, "band_share": 0.5}, False),
    ],
)
def test_a_regular_motion_of_a_phase_of_its_own_is_on_a_torus(changes: dict[str, Any], said: bool) -> None:
    """A free phase is not locked to the waves, so that no whole numbers bind both frequencies."""
    decided = decide(answers(**{**SHAKEN, **LASTS, "frequency": 171.6, **changes}), LIMITS)
    assert decided.row.startswith("self-excited")
    assert ("a torus: 171.6 Hz and the frequencies of the waves" in decided.sentence) is said


@pytest.mark.parametrize(
    ("sticks", "regime"),
    [(1.0, "relaxation"), (0.5, "undecided"), (0.1, "quasi-harmonic"), (0.0, "quasi-harmonic")],
)
def test_a_torus_of_a_smooth_wheel_is_named_and_no_longer_run_is_asked_for(sticks: float, regime: str) -> None:
    turns = {"stick_cycles": sticks, "frequency_of_modulation": 27.0}
    decided = decide(answers(without_waves=Continuation.LASTS, **turns), LIMITS)
    assert decided.regime == regime
    assert "on a torus of two frequencies, 100 and 27 Hz" in decided.sentence
    assert not re.search("irregular|chaos|run ", decided.sentence)
    assert not decided.longer
    bands = decide(answers(without_waves=Continuation.LASTS, harmonic_share=0.5, band_share=0.95, **turns), LIMITS)
    assert "chaos" not in bands.sentence


@pytest.mark.parametrize(
    "changes",
    [
        {
            **LASTS,
            "lyapunov_exponent": -0.08,
            "power_of_roughness": 1.0,
        },  # together, but by less than a power of e
        {**LASTS, "level_without_waves": 2.0},  # sliding is stable, and may be what the waves shake
        {"without_waves": Continuation.DIES},  # and yet friction keeps it up, with a phase of its own
    ],
)
def test_what_shows_neither_a_phase_of_its_own_nor_that_waves_lead_is_undecided(changes: dict[str, Any]) -> None:
    assert decide(answers(**{**SHAKEN, **changes}), LIMITS).row in ("phase not known", "either")


@pytest.mark.parametrize(
    ("changes", "row"),
    [
        (
            {"lyapunov_exponent": -0.04, "lyapunov_error": 0.02},
            "self-excited",
        ),  # 0 within its errors, and never a power of e
        (
            {"lyapunov_exponent": -0.7, "lyapunov_error": 0.4},
            "phase not known",
        ),  # no proof that they come together, nor that not
        ({"lyapunov_exponent": 0.3, "lyapunov_error": 0.4}, "phase not known"),
        ({"lyapunov_exponent": 0.3, "lyapunov_error": 0.05}, "self-excited"),  # chaos
        ({"lyapunov_exponent": 0.0, "lyapunov_error": math.inf}, "either"),
        ({"lyapunov_exponent": math.nan, "lyapunov_error": math.nan}, "either"),
        (
            {
                "lyapunov_exponent": -0.7,
                "lyapunov_error": 0.4,
                "lyapunov_by_line": -0.8,
                "lyapunov_by_line_error": 0.05,
            },
            "forced, roughness gives",
        ),
        (
            {
                "lyapunov_exponent": -0.7,
                "lyapunov_error": 0.1,
                "lyapunov_by_line": -0.1,
                "lyapunov_by_line_error": 0.01,
            },
            "forced, roughness gives",
        ),
    ],
)
def test_what_is_not_known_of_neighbours_is_no_evidence(changes: dict[str, Any], row: str) -> None:
    """Friction gives 1 W and the roughness as much, so that powers decide nothing; or three times as much."""
    power = 3.0 if row.startswith("forced") else 1.0
    found = decide(
        answers(**{**SHAKEN, **LASTS, "power_of_roughness": power, "lyapunov_by_line": math.nan, **changes}),
        LIMITS,
    )
    assert found.row.partition(":")[0] == row
    assert not {"nan", "inf"} & set(found.sentence.replace(";", " ").split())


@pytest.mark.parametrize(
    ("row", "left"),
    [(row, left) for row in POWERS for left in (3.0, -3.0, math.nan, math.inf) if (row, left) != FALLS],
)
def test_no_row_rests_on_powers_that_do_not_balance(row: str, left: float) -> None:
    """What friction and the roughness give, dashpots take: what is left is as large as both."""
    given = answers(**{**SHAKEN, **ROUGH_ROWS[row], "level_change": 0.0, "power_stored": left})
    assert decide(given, LIMITS).regime is Regime.UNDECIDED


def test_where_dashpots_take_more_than_is_given_friction_does_not_keep_it_up() -> None:
    row, left = FALLS
    falls = answers(**{**SHAKEN, **ROUGH_ROWS[row], "level_change": 0.0, "power_stored": left})
    assert decide(falls, LIMITS).row == row


@pytest.mark.parametrize("error", [0.1, 0.3])
def test_what_surely_takes_energy_gives_none_of_it(error: float) -> None:
    """Twice what it may give is asked of the other: 1 W that is taken within 0.3 W of three errors is none."""
    shaken = {**SHAKEN, "power_of_roughness": 1.0, "power_of_friction": -1.0, "power_of_friction_error": error}
    assert decide(answers(**shaken), LIMITS).row == "forced, friction takes"
    locked = {**SHAKEN, **FADING, **LASTS, "power_of_roughness": -1.0, "power_of_roughness_error": error}
    assert decide(answers(**locked), LIMITS).row == "locked to the waves: quasi-harmonic"


@pytest.mark.parametrize("undamped", [False, True])
@pytest.mark.parametrize(("roughness", "row"), [(-0.5, "self-excited: quasi-harmonic"), (-0.2, "either")])
def test_where_waves_surely_take_energy_friction_gives_what_lasts(
    roughness: float, row: str, undamped: bool
) -> None:
    """Its own power is known to 0.9 W, that of the waves to 0.3 W: nothing else gives, also without dashpots."""
    unsure = {"power_of_friction": 0.6, "power_of_friction_error": 0.3, "power_of_roughness": roughness}
    given = {**SHAKEN, **LASTS, **unsure, "undamped": undamped, "growth_rate": 1.0}
    assert decide(answers(**given), LIMITS).row == row
    falls = {**given, "level_change": -0.5}
    assert decide(answers(**falls), LIMITS).regime is Regime.UNDECIDED


@pytest.mark.parametrize(
    ("left", "row"), [(0.0, "kept up by friction: quasi-harmonic"), (0.4, "energy still changes")]
)
def test_waves_are_idle_beside_the_power_of_the_settled_motion(left: float, row: str) -> None:
    """0.035 W are less than a twentieth of 1 W that friction gives, not of 0.6 W where 0.4 W are stored."""
    idle = {
        **SHAKEN,
        **LASTS,
        "lyapunov_exponent": -0.1,
        "level_without_waves": math.nan,
        "power_of_roughness": 0.035,
    }
    powers = {"power_of_friction_error": 1e-3, "power_of_roughness_error": 1e-6, "power_stored": left}
    assert decide(answers(**{**idle, **powers}), LIMITS).row == row


def test_no_threshold_is_left_out_and_there_are_no_more_than_twelve() -> None:
    mark = test_each_threshold_moves_what_it_stands_for.pytestmark[0]
    assert {each[0] for each in mark.args[1]} == {each.name for each in fields(Thresholds)}
    assert len(fields(Thresholds)) <= 12


def test_a_record_that_was_stored_decides_the_same() -> None:
    for changes in (*SMOOTH_ROWS.values(), *({**SHAKEN, **each} for each in ROUGH_ROWS.values())):
        given = answers(**changes)
        stored = given.known()
        assert all(isinstance(value, str) or math.isfinite(value) for value in stored.values())
        assert decide(Answers.of(stored), LIMITS) == decide(given, LIMITS), changes


def test_where_theory_does_not_know_the_growth_neighbours_decide_and_say_how_fast() -> None:
    for rate, row, word in (
        (-0.4, "linear, forced", "decays at 0.4 1/s"),
        (0.4, "linear, grows", "growing at 0.4 1/s"),
    ):
        given = answers(**{**SHAKEN, "linear": True, "growth_rate": math.nan, "lyapunov_by_line": rate})
        found = decide(Answers.of(given.known()), LIMITS)
        assert found.row == row
        assert word in found.sentence
        assert "nan" not in found.sentence


def test_a_row_whose_remedy_is_a_longer_run_says_so_to_runs_that_settle() -> None:
    rows = [*CONTACT, *SMOOTH, *ROUGH, *SHAPES]
    asked = {row.name for row in rows if "run " in row.remedy}
    named = {row.name for row in rows if row.longer}
    assert asked < named
    assert named - asked == {"either", "nothing moves yet"}
    (rests,) = (row for row in rows if row.name == "nothing moves yet")
    grows = Answers(growth_rate=10.0, duration=1.0)
    assert [rests.decision(grows._replace(duration=each)).longer for each in (1.0, 1e3)] == [True, False]


def test_bands_that_are_no_multiples_of_one_frequency_are_those_of_a_torus_or_chaos() -> None:
    decided = decide(answers(**LASTS, harmonic_share=0.5, band_share=0.95), LIMITS)
    assert "95% of the energy of vx in three narrow bands, not multiples of one frequency" in decided.sentence
