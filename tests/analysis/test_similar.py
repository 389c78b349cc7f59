"""Starters for a brake of one's own are similar to the starter: only U m ω/Q differs."""

import math
from pathlib import Path

import pytest

from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.similar import STICKS_BELOW, Brake, similar
from brakecli.analysis.stability.report import StabilityReport, stability
from brakecli.case.case import Case
from brakecli.case.read import parse_case, starters
from brakecli.case.system import system_of
from brakecli.solver.period import common_period
from brakecli.studies.runs.plausible import implausible
from brakecli.studies.sweeps.simulate import simulate
from tests.commands import brakecli

STARTERS = starters()
BRAKES = [Brake(0.4, 1900.0, 8000.0, 8.0), Brake(frequency=450.0, speed=0.02), Brake(mass=25.0, load=300.0)]


def case_of(starter: str, brake: Brake) -> Case:
    return parse_case(similar(starter, STARTERS[starter], brake).text, starter).case


def report(case: Case) -> StabilityReport:
    return stability(system_of(case))


@pytest.mark.parametrize("brake", BRAKES)
@pytest.mark.parametrize("starter", ["case", "branch", "pad", "rough"])
def test_a_brake_of_ones_own_is_similar_to_the_starter(starter: str, brake: Brake) -> None:
    """Six digits are written of each number; a root of a polynomial in some of them loses one."""
    before = parse_case(STARTERS[starter], starter).case
    after = case_of(starter, brake)
    old = report(before)
    new = report(after)
    wanted = Brake(
        brake.mass or before.shoe.mass,
        brake.frequency or old.modes[0].frequency,
        brake.load or system_of(before).load_at_start,
    )
    system = system_of(after)
    assert (after.shoe.mass, system.load_at_start) == (wanted.mass, wanted.load)
    assert new.modes[0].frequency == pytest.approx(wanted.frequency, rel=1e-5)
    assert new.modes[0].growth / new.modes[0].frequency == pytest.approx(
        old.modes[0].growth / old.modes[0].frequency, abs=1e-5
    )
    assert new.critical is not None
    assert old.critical is not None
    assert new.critical.friction == pytest.approx(old.critical.friction, rel=1e-4)
    number = similar(starter, STARTERS[starter], brake)
    omega = 2.0 * math.pi * new.modes[0].frequency
    assert number.number == pytest.approx(
        system.belt_speed * after.shoe.mass * omega / system.load_at_start, rel=1e-5
    )
    if brake.speed is None:
        assert number.number == pytest.approx(number.before, rel=1e-12)
    else:
        assert system.belt_speed == pytest.approx(brake.speed, rel=1e-5)


@pytest.mark.parametrize("brake", [*BRAKES, Brake(0.8, 1300.0, 3000.0, 5.0), Brake(0.123, 777.7, 3333.0, 7.77)])
def test_waves_repeat_together_as_those_of_the_starter_do(brake: Brake) -> None:
    """Wavelengths of 30 to 17, after 17 of the first."""
    system = system_of(case_of("rough", brake))
    period = common_period(system)
    assert period is not None
    assert period * system.belt_speed * float(system.wheel.turns[0]) == pytest.approx(17.0, rel=1e-12)


def test_radius_and_smooth_pad_keep_to_sizes_that_brakes_have() -> None:
    after = case_of("branch", Brake(0.8, 1300.0, 3000.0, 5.0))
    assert (after.wheel.radius, after.contact.half_length) == (0.5, 0.03)
    assert not [*implausible(system_of(after))]


@pytest.mark.parametrize(("part", "regime"), [(0.98, Regime.RELAXATION), (1.02, Regime.QUASI_HARMONIC)])
def test_the_regime_that_is_named_is_that_of_a_run(part: float, regime: Regime) -> None:
    """The starter's own number is 0.109 at 0.05 m/s."""
    own = similar("case", STARTERS["case"], Brake())
    speed = 0.05 * part * STICKS_BELOW / own.before
    slower = report(parse_case(STARTERS["case"], "case").case).modes[0].frequency / 1900.0
    speed *= slower * (8000.0 / 5000.0) / (0.4 / 10.0)  # Q/(m ω) of both
    found = similar("case", STARTERS["case"], Brake(0.4, 1900.0, 8000.0, speed))
    assert found.number == pytest.approx(part * STICKS_BELOW, rel=1e-3)
    assert found.sticks is (part < 1.0)
    assert regime in found.sentence
    assert simulate(parse_case(found.text, "case").case).verdict.regime is regime


def test_comments_say_the_speed_and_the_frequencies_of_the_brake() -> None:
    smooth = similar("case", STARTERS["case"], Brake(speed=8.0)).text
    assert "here the surface moves at 8 m/s" in smooth
    assert "# Does" not in smooth  # what the head of the starter says of its motion
    assert smooth.startswith("# A brake of 10 kg at 174.1 Hz, under 5000 N, at 8 m/s")
    rough = similar("rough", STARTERS["rough"], Brake(frequency=1741.1884)).text
    passing = rough.partition("here at ")[2].partition(" Hz")[0].split(" and ")
    assert [float(each) for each in passing] == pytest.approx([66.7e1, 117.6e1], rel=2e-2)  # 170 to 174 Hz there


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("sweep", "--mass", "3"), "sweep is no case, and the numbers of a brake make one"),
        (("stop", "--mass", "3"), "stop has speeds at given times; give a starter whose wheel turns evenly"),
        (("pad", "--load", "0"), "--load: has to be above 0 (found 0)"),
        (("pad", "--friction", "-0.3"), "--friction: has to be above 0 (found -0.3)"),
        (("pad", "--speed", "nan"), "--speed: has to be above 0 (found nan)"),
    ],
)
def test_what_makes_no_case_is_refused_and_nothing_is_written(
    tmp_path: Path, arguments: tuple[str, ...], told: str
) -> None:
    shown = brakecli("new", *arguments, cwd=tmp_path)
    assert shown.code == 2
    assert told in shown.err
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("brake", "said"),
    [
        (
            Brake(0.6, 2600.0),
            "load and speed were not given: 5000 N and 0.0558 m/s are those of the starter, scaled",
        ),
        (Brake(0.6, 2600.0, 300.0), "speed was not given: 0.00335 m/s is that of the starter, scaled"),
        (
            Brake(frequency=2600.0, load=300.0, speed=2.0),
            "mass was not given: 10 kg is that of the starter, scaled",
        ),
    ],
)
def test_no_regime_follows_from_what_was_not_given(brake: Brake, said: str) -> None:
    found = similar("case", STARTERS["case"], brake)
    assert found.sentence.startswith(f"{said}, so that how it vibrates is not said; ")
    assert found.sticks is None
    assert not {"relaxation", "quasi-harmonic", "U m ω/Q"} & {
        word for word in ("relaxation", "quasi-harmonic", "U m ω/Q") if word in found.sentence
    }


def test_new_says_what_is_assumed_and_what_follows(tmp_path: Path) -> None:
    numbers = ["--mass", "0.4", "--frequency", "1900", "--load", "8000", "--speed", "8"]
    shown = brakecli("new", "squeal", *numbers, cwd=tmp_path).out
    assert "U m ω/Q is 4.78 (there 0.109)" in shown
    assert "quasi-harmonic" in shown
    own = brakecli("new", "squeal", *numbers, "--friction", "0.45", "--force", cwd=tmp_path).out
    assert "critical friction, 0.575; the brake's own 0.45 lies 22 % below that: sliding is stable" in own
    text = (tmp_path / "squeal.toml").read_text()
    assert "\ncoefficient = 0.45        # φ, the same in slip and in stick\n" in text
    assert text.startswith(
        "# A brake of 0.4 kg at 1900 Hz, under 8000 N, at 8 m/s, with friction 0.45: similar to"
    )
    grams = brakecli("new", "squeal", "--mass", "400", "--load", "8", "--force", cwd=tmp_path)
    assert "--mass: 400 kg is more than 300 kg; were grams meant?" in grams.err
    assert "--load: 8 N is less than 20 N; were kilonewtons meant?" in grams.err
    scaled = brakecli("new", "squeal", "--mass", "0.5", "--speed", "150", "--load", "5e5", "--force", cwd=tmp_path)
    assert scaled.err.count("warning") == 1  # what follows from the options is not the user's slip
    assert "--speed: a surface speed of 150 m/s is more than 100 m/s" in scaled.err
    brakecli("new", "squeal", *numbers, "--force", cwd=tmp_path)
    assert parse_case((tmp_path / "squeal.toml").read_text(), "squeal").case.shoe.mass == 0.4
