"""Numbers that no brake has are told with the usual slip, and no case that ships has any."""

import math
import tomllib
from typing import Any

import pytest

from brakecli.case.read import parse_case, starters
from brakecli.case.system import system_of
from brakecli.solver.system import System
from brakecli.studies.runs.limits import check
from brakecli.studies.runs.plausible import RANGES, implausible
from tests.commands import ROOT, TINY, brakecli
from tests.examples import SQUEAL, make

JUST = 1e-9
"""Relative distance from a bound, far above the rounding of the few operations that lead to it."""
CASES = {str(path.relative_to(ROOT)): path.read_text() for path in sorted(ROOT.glob("cases/**/*.toml"))}
SHIPPED = {f"starter {name}": text for name, text in starters().items()} | CASES
DIMENSIONLESS = {"cases/coulomb-oscillator.toml", "cases/mode-coupling.toml"}
"""Published problems in numbers without units: loads of 2 and 1, and pads pressed in by whole half lengths."""

# The shoe of SQUEAL with both links along the axes: c_xx = 1.2e7, c_yy = 1e7 and 2ak = 2e6 N/m.
UPRIGHT = {"link2__angle_deg": 0.0}
CRITICAL = 2.0 * math.sqrt(10.0 * 1.2e7)  # 2 √(m c_xx), N·s/m
BOUNDS: list[tuple[str, float, int, dict[str, Any], str]] = [
    # the key, where its bound lies, the side that is wrong, other keys, what is said
    ("shoe__mass", 300.0, 1, {}, "shoe.mass: 300 kg is more than 300 kg; were grams meant?"),
    ("wheel__radius", 20.0, 1, {}, "wheel.radius: 20 m is more than 20 m; were millimetres meant?"),
    ("friction__coefficient", 2.0, 1, {}, "friction.coefficient: 2 is more than 2; were per cent meant?"),
    ("load__force", 20.0, -1, {}, "load.force: 20 N is less than 20 N; were kilonewtons meant?"),
    ("load__force", -20.0, -1, {}, "load.force: 20 N is less than 20 N; were kilonewtons meant?"),
    ("load__force", 1e6, 1, {"contact__stiffness": 1e10}, "load.force: 1e+06 N is more than 1e+06 N; was a"),
    (
        "wheel__angular_speed",
        -200.0,  # R = 0.5 m
        1,
        {},
        "wheel.angular_speed: a surface speed of 100 m/s is more than 100 m/s; were revolutions per minute meant?",
    ),
    (
        "contact__stiffness",
        1e6,  # 2ak = 0.1 m k is a hundredth of c_yy
        -1,
        UPRIGHT,
        "contact.stiffness: a whole pad of 0.01 times the links' stiffness is less than 0.01 times the links' "
        "stiffness; were N/mm² meant?",
    ),
    (
        "load__force",
        0.1 * 0.05 * 1.2e7,  # a tenth of a, on c_yy + 2ak
        1,
        UPRIGHT,
        "contact.stiffness: a pad pressed in by 0.1 half lengths is more than 0.1 half lengths; were N/mm and",
    ),
    (
        "link2__damping",
        CRITICAL,
        1,
        UPRIGHT,
        "link1.damping, link2.damping: a damping ratio of 1 is more than 1; were N/mm meant?",
    ),
]


def said(**changes: Any) -> list[str]:
    """What is said of a shoe with some keys changed."""
    return [*implausible(system_of(make(SQUEAL, **changes)))]


@pytest.mark.parametrize(("key", "bound", "wrong", "others", "words"), BOUNDS, ids=lambda value: str(value)[:24])
def test_a_number_is_told_just_beyond_its_bound_and_not_just_within(
    key: str, bound: float, wrong: int, others: dict[str, Any], words: str
) -> None:
    assert said(**others, **{key: bound * (1.0 - wrong * JUST)}) == []
    (warning,) = said(**others, **{key: bound * (1.0 + wrong * JUST)})
    assert warning.startswith(words)


def test_every_row_is_tried() -> None:
    for row in RANGES:
        begin = f"{row.key}: {row.what}{row.bound:g}{row.unit} is {row.side} than "
        assert any(words.startswith(begin) for *_, words in BOUNDS), row


@pytest.mark.parametrize("name", [name for name, text in SHIPPED.items() if "shoe" in tomllib.loads(text)])
def test_no_case_that_ships_is_strange_but_the_dimensionless_ones(name: str) -> None:
    warnings = [*implausible(system_of(parse_case(SHIPPED[name], name).case))]
    keys = [warning.partition(":")[0] for warning in warnings]
    assert keys == (["load.force", "contact.stiffness"] if name in DIMENSIONLESS else [])


def test_of_a_schedule_the_largest_value_counts() -> None:
    loads = {"load__force": None, "load__times": [0.0, 1.0]}
    speeds = {"wheel__angular_speed": None, "wheel__times": [0.0, 1.0]}
    assert said(**loads, load__forces=[0.0, -5000.0]) == []
    assert said(**speeds, wheel__angular_speeds=[8.0, 0.0]) == []
    (weak,) = said(**loads, load__forces=[-15.0, 10.0])
    assert weak.startswith("load.forces: 15 N is less than 20 N;")
    (fast,) = said(**speeds, wheel__angular_speeds=[0.0, -300.0])
    assert fast.startswith("wheel.angular_speeds: a surface speed of 150 m/s is more than")


def test_what_is_left_out_on_purpose_is_not_strange() -> None:
    assert said(load__force=0.0) == []
    assert said(wheel__angular_speed=0.0) == []
    assert said(friction__coefficient=0.0) == []
    assert said(link1__stiffness=0.0, **UPRIGHT) == []  # the pad alone carries the load
    assert (
        said(link2__stiffness=0.0, **UPRIGHT) == []
    )  # nothing holds the shoe along the wheel, and nothing is critical there


def test_the_damping_ratio_is_that_of_coupled_modes() -> None:
    # Two equal dashpots across each other damp every direction alike: b / (2 m ω) is largest in the slower mode.
    angles = {"link1__angle_deg": 35.0, "link2__angle_deg": 35.0}
    system: System = system_of(make(SQUEAL, **angles, link1__damping=5e4, link2__damping=5e4))
    ratio = 5e4 / (2.0 * 10.0 * 2.0 * math.pi * system.natural_frequencies[0])
    (row,) = (row for row in RANGES if row.key.startswith("link1"))
    assert row.number(system) == pytest.approx(ratio, rel=1e-12)
    (warning,) = implausible(system)
    assert f"a damping ratio of {ratio:.6g} is more than 1" in warning


def test_check_ends_with_what_is_strange() -> None:
    # Of a point a sweep tells the first warning alone, which should be one that another point need not have.
    coarse = {"solver__step": 1e-3, "output__sample_interval": 1e-2}
    warnings = check(system_of(make(SQUEAL, wheel__radius=25.0, **coarse))).warnings
    assert warnings[0].startswith("solver.step")
    assert [text.startswith("wheel.radius") for text in warnings] == [False] * (len(warnings) - 1) + [True]


def test_the_page_of_the_case_has_every_range() -> None:
    page = (ROOT / "docs" / "case-format.md").read_text()
    for row in RANGES:
        bound = {0.01: "a hundredth", 0.1: "a tenth", 1e6: "1 MN"}.get(row.bound, f"{row.bound:g}{row.unit}")
        side = {"more": "above", "less": "below"}[row.side]
        begin = f"| `{row.key.replace(', ', '`, `')}` |"
        lines = [line for line in page.splitlines() if line.startswith(begin)]
        assert any(f"{side} {bound}" in line for line in lines), row


def test_a_case_in_grams_is_told_so_and_a_sweep_of_it_once(compiled: None, tmp_path: Any) -> None:
    text = "shoe.mass: 10000 kg is more than 300 kg; were grams meant? Masses are in kg"
    (tmp_path / "grams.toml").write_text(TINY.replace("mass = 10.0", "mass = 10_000.0"))
    (tmp_path / "sweep.toml").write_text(
        'case = "grams.toml"\n[[axis]]\nparameter = "friction.coefficient"\nvalues = [0.3, 0.4, 0.5]\n'
    )
    case = brakecli("check", "grams.toml", "--json", cwd=tmp_path)
    assert case.told(0).splitlines() == [f"brakecli: warning: {text}"]
    assert case.json["warnings"] == [text]
    run = brakecli("run", "grams.toml", "--json", cwd=tmp_path)
    for words in ("stability grams.toml", "advise grams.toml", "branch grams.toml --parameter shoe.mass=9e3:1e4"):
        assert text in brakecli(*words.split(), "-q", cwd=tmp_path).err
    assert text in run.json["warnings"]
    sweep = brakecli("check", "sweep.toml", "--json", cwd=tmp_path)
    assert sweep.told(0).count(text) == 1
    assert sweep.json["implausible"] == [text]
    computed = brakecli("sweep", "sweep.toml", "--quiet", cwd=tmp_path)
    assert computed.err.count(text) == 1
    assert computed.told(0, "points that ran with warnings: 3, the first: ")
