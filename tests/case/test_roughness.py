"""Surfaces given as orders of a turn, as a self-affine spectrum, or as a measured profile."""

import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

import brakecli
from brakecli.case.case import resolved_toml
from brakecli.case.read import LoadedCase, parse_case, parse_resolved, read_text
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver import roughness
from brakecli.solver.roughness import Surface
from brakecli.studies.runs.limits import adjustments
from brakecli.studies.sweeps.journal import identity
from brakecli.studies.sweeps.plan import parse_sweep
from brakecli.studies.sweeps.point import compute
from tests.case.examples import ORDERS, SMALL, SPECTRA, messages

RADIUS = 0.5  # m, of the wheel of SMALL
TURN = 2.0 * math.pi * RADIUS
ROUNDING = 1e-12
SPECTRUM = {"rms": 2e-6, "hurst": 0.7, "shortest": 1e-3, "longest": 0.1, "terms": 100, "seed": 7}


def height(surface: Surface, places: Any) -> Any:
    return roughness.height(surface, np.asarray(places))


def wheel(*overrides: str) -> Surface:
    return system_of(parse_case(SMALL, "small", overrides).case).wheel


def spectrum(**changes: float) -> Surface:
    text = ", ".join(f"{key}={value!r}" for key, value in (SPECTRUM | changes).items())
    return wheel(f"roughness.wheel.spectrum={{{text}}}")


def saved(path: Path, header: str, *columns: Any, separator: str = ",") -> str:
    np.savetxt(path, np.transpose(columns), "%.15g", separator, header=header, comments="")
    return f'roughness.wheel.profile="{path}"'


def loaded(*overrides: str) -> LoadedCase:
    return parse_case(SMALL, "small", overrides)


def test_orders_are_waves_around_the_wheel() -> None:
    found = wheel("roughness.wheel={amplitudes=[1e-6, 2e-6, 3e-6], orders=[1, 2, 7], phases_deg=[0, 90, 180]}")
    np.testing.assert_allclose(found.turns, np.array([1, 2, 7]) / TURN, rtol=ROUNDING)
    around = height(found, np.array([0.1, 0.1 + TURN]))  # the turn closes
    assert around[0] == pytest.approx(around[1], abs=1e-6 * ROUNDING * 1e6)
    higher = system_of(loaded("wheel.radius=0.25", "roughness.wheel={amplitudes=[1.0], orders=[3]}").case)
    assert higher.wheel.turns[0] * higher.fastest_belt == pytest.approx(3 * 4 / (2 * math.pi))  # order x rotation


def test_orders_are_whole_and_belong_to_the_wheel_alone() -> None:
    (line,) = messages(ORDERS, "roughness.wheel.orders=[1, 1.5]")
    assert (
        "roughness.wheel.orders[1]: is not a whole number (found 1.5); give a whole number of at least 1" in line
    )
    line, _ = messages(SMALL, "roughness.shoe={amplitudes=[1e-6], orders=[1]}")
    assert "roughness.shoe.orders: is unknown" in line
    line, *_ = messages(ORDERS, "roughness.wheel={amplitudes=[1e-6], orders=[1], wavelengths=[1.0]}")
    assert "orders: is given together with amplitudes and wavelengths" in line


@pytest.mark.parametrize("hurst", [0.0, 0.5, 1.0])
def test_the_density_of_a_self_affine_surface_falls_as_its_exponent_says(hurst: float) -> None:
    found = spectrum(hurst=hurst, terms=100)  # harmonics of the longest wave: one period shows them apart
    points = np.arange(1024) * (SPECTRUM["longest"] / 1024)
    heights = height(found, points)
    assert math.sqrt(np.mean(heights**2)) == pytest.approx(SPECTRUM["rms"], rel=1e-10)
    density = np.abs(np.fft.rfft(heights))[1:101] ** 2
    slope, _ = np.polyfit(np.log(np.arange(1, 101)), np.log(density), 1)
    assert slope == pytest.approx(-1.0 - 2.0 * hurst, abs=1e-6)
    assert np.abs(np.fft.rfft(heights))[101:].max() < 1e-9 * np.abs(np.fft.rfft(heights)).max()


def test_the_waves_of_a_spectrum_reach_from_the_longest_to_the_shortest() -> None:
    found = spectrum(terms=37)
    assert (found.turns[0], found.turns[-1]) == pytest.approx((10.0, 1000.0))
    np.testing.assert_allclose(np.diff(found.turns), 990.0 / 36.0)
    assert math.sqrt(0.5 * np.sum(found.g**2)) == pytest.approx(SPECTRUM["rms"], rel=1e-14)


def test_the_phases_of_a_spectrum_are_those_of_its_seed() -> None:
    expected = np.random.default_rng(7).uniform(0.0, 2.0 * math.pi, 100)
    np.testing.assert_allclose(spectrum().phase, expected, rtol=1e-14)
    assert not np.allclose(spectrum(seed=8).phase, expected)


def test_the_resolved_case_of_a_spectrum_holds_its_sines_to_the_last_bit() -> None:
    first = parse_case(SPECTRA, "case.toml")
    again = parse_case(first.resolved, "resolved")
    assert again.case.roughness.wheel is not None
    assert again.case.roughness.wheel.spectrum is None
    assert again.resolved == first.resolved
    for one, other in zip(system_of(first.case).wheel, system_of(again.case).wheel, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ("shortest=0.1", "shortest: is not below longest (found 0.1)"),
        ("hurst=1.1", "hurst: is out of range (found 1.1); give a number from 0 to 1"),
        ("terms=2001", "terms: is out of range (found 2001); give a whole number from 2 to 2000"),
        ("seed=1.5", "seed: is not a whole number (found 1.5)"),
        ("rms=-1", "rms: is out of range"),
    ],
)
def test_a_wrong_spectrum_is_reported_at_its_key(change: str, what: str) -> None:
    (line,) = messages(SPECTRA, f"roughness.wheel.spectrum.{change}")
    assert f"roughness.wheel.spectrum.{what}" in line


def test_an_override_of_a_spectrum_or_of_sines_takes_the_place_of_the_other() -> None:
    resolved = parse_case(SPECTRA, "case.toml").resolved
    text = ", ".join(f"{key}={value!r}" for key, value in SPECTRUM.items())
    case = parse_case(resolved, "r", [f"roughness.wheel.spectrum={{{text}}}"]).case.roughness.wheel
    assert case is not None
    assert (case.amplitudes, case.wavelengths, case.phases_deg) == (None, None, None)
    sines = ["roughness.wheel.amplitudes=[1e-6]", "roughness.wheel.orders=[4]"]
    other = parse_case(SPECTRA, "case.toml", sines).case.roughness.wheel
    assert other is not None
    assert (other.spectrum, other.orders, other.phases_deg) == (None, (4.0,), (0.0,))


ANGLES = np.arange(0.0, 360.0, 2.0)
RUNOUT = 30.0 + 20.0 * np.sin(np.radians(ANGLES + 25.0)) + 4.0 * np.sin(np.radians(9.0 * ANGLES - 70.0))  # um
FILES = {  # the same runout as laboratories write it
    "names": ("angle_deg,height_um", ANGLES, RUNOUT, ","),
    "row of units": ("angle;runout\n°;mm", ANGLES, 1e-3 * RUNOUT, ";"),
    "brackets": ("angle [rad]\theight (µm)", np.radians(ANGLES), RUNOUT, "\t"),
    "superscripts": ("angle [rad],height [mm²·m⁻¹]", np.radians(ANGLES), RUNOUT, ","),
    "comment": ("# phi_mrad, z_nm", 1e3 * np.radians(ANGLES), 1e3 * RUNOUT, ","),
    "position": ("s_mm,h_mm", 1e3 * RADIUS * np.radians(ANGLES), 1e-3 * RUNOUT, ","),
    "metres": ("s,h", RADIUS * np.radians(ANGLES), 1e-6 * RUNOUT, ","),
    "no names": ("", RADIUS * np.radians(ANGLES), 1e-6 * RUNOUT, " "),
    "last repeats first": ("deg,um", np.append(ANGLES, 360.0), np.append(RUNOUT, RUNOUT[0]), ","),
    "backwards": ("angle_deg,height_um", ANGLES[::-1], RUNOUT[::-1], ","),
    "from elsewhere": ("angle_deg,height_um", ANGLES + 360.0, RUNOUT, ","),
}


@pytest.mark.parametrize("name", FILES)
def test_a_runout_becomes_the_orders_that_it_was_made_of(tmp_path: Path, name: str) -> None:
    header, places, heights, separator = FILES[name]
    case = loaded(saved(tmp_path / "runout.csv", header, places, heights, separator=separator)).case
    found = case.roughness.wheel
    assert found is not None
    assert found.orders == (1.0, 9.0)
    assert found.amplitudes == pytest.approx([20e-6, 4e-6], rel=1e-9)
    assert found.phases_deg == pytest.approx([25.0, 290.0], abs=1e-6)


def test_turns_are_averaged_and_what_is_left_of_one_is_not_used(tmp_path: Path) -> None:
    angles = np.arange(0.0, 3.25 * 360.0, 2.0)
    wobble = 3.0 * np.sin(np.radians(angles / 3.0))  # not of the wheel: gone in the mean of three turns
    heights = np.interp(angles, ANGLES, RUNOUT, period=360.0) + wobble
    found = loaded(saved(tmp_path / "turns.csv", "angle_deg,height_um", angles, heights)).case.roughness.wheel
    assert found is not None
    assert found.orders is not None
    by_order = dict(zip(found.orders, found.amplitudes or (), strict=True))
    assert by_order[9.0] == pytest.approx(4e-6, rel=0.05)
    assert max(found.orders) < 180
    assert "mean of 3 turns, which differ from it by 2.12e-06 m (RMS)" in (found.note or "")  # 3 / sqrt(2) um


def test_a_profile_of_the_shoe_loses_its_line_and_repeats_beyond_its_length(tmp_path: Path) -> None:
    x = (np.arange(200) - 99.5) * 1e-3  # m; cosines about the middle have no part of a line in them
    heights = 5e-6 * np.cos(2.0 * math.pi * 6.0 * x / 0.2) + 1e-3 * x + 4e-4
    path = tmp_path / "shoe.csv"
    saved(path, "x_m,z_m", x, heights)
    case = loaded(f'roughness.shoe.profile="{path}"').case
    assert case.roughness.shoe is not None
    assert case.roughness.shoe.wavelengths == pytest.approx([0.2 / 6.0])
    surface = system_of(case).shoe
    np.testing.assert_allclose(height(surface, x), 5e-6 * np.cos(2.0 * math.pi * 6.0 * x / 0.2), atol=1e-15)
    assert "reaches beyond" not in (case.roughness.shoe.note or "")
    saved(path, "x_m,z_m", x - x[0], heights)
    assert "the pad from -0.05 to 0.05 m reaches beyond 0 to 0.199 m" in str(
        adjustments(system_of(loaded(f'roughness.shoe.profile="{path}"').case))
    )


def test_a_gap_in_a_profile_is_told(tmp_path: Path) -> None:
    places = np.arange(0.0, TURN, TURN / 360)
    places = places[(places < 0.5) | (places > 0.7)]
    case = loaded(saved(tmp_path / "p.csv", "m,um", places, np.sin(2 * np.pi * places / TURN)))
    assert "a straight line bridges a gap of 0.20" in case.resolved


@pytest.mark.parametrize("turns", [1, 2])
@pytest.mark.parametrize("missed", [0.0, 0.001, -0.001])
def test_a_record_that_misses_a_turn_by_a_little_tells_that_it_was_stretched(
    tmp_path: Path, turns: int, missed: float
) -> None:
    angles = (
        np.arange(180 * turns) * 2.0 * (1.0 - missed / turns)
    )  # its end misses a whole number of turns so much
    note = loaded(saved(tmp_path / "p.csv", "angle_deg,um", angles, np.cos(np.radians(angles)))).resolved
    assert (f"the record was stretched by {'-' * (missed < 0)}" in note) == (missed != 0.0)
    assert f"{100.0 * abs(missed) / turns:.1g} % to whole turns" in note or not missed


@pytest.mark.parametrize("error", [0.5, 0.1, 0.01])
def test_no_fewer_sines_leave_out_so_little_of_a_profile(tmp_path: Path, error: float) -> None:
    heights = np.random.default_rng(3).normal(size=400)
    override = saved(tmp_path / "noise.csv", "angle_deg,height_um", np.arange(400) * 0.9, heights)
    surface = system_of(loaded(override, f"roughness.wheel.profile_error={error}").case).wheel
    heights = 1e-6 * (heights - heights.mean())
    left = heights - height(surface, np.arange(400) * (TURN / 400))
    total = np.mean(heights**2)
    assert math.sqrt(np.mean(left**2) / total) <= error
    assert math.sqrt((np.mean(left**2) + 0.5 * np.min(surface.g) ** 2) / total) > error


def test_a_result_repeats_without_the_profile_and_tells_what_was_lost(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    saved(tmp_path / "sub" / "runout.csv", "angle_deg,height_um", ANGLES, RUNOUT)
    (tmp_path / "sub" / "case.toml").write_text(SMALL + '\nroughness.wheel.profile = "runout.csv"\n')
    first = parse_case(*read_text(str(tmp_path / "sub" / "case.toml")))  # the profile lies beside the case
    (tmp_path / "sub" / "runout.csv").unlink()
    again = parse_case(first.resolved, "resolved")
    for one, other in zip(system_of(first.case).wheel, system_of(again.case).wheel, strict=True):
        np.testing.assert_array_equal(one, other)
    assert again.resolved == first.resolved
    assert str(tmp_path) not in first.resolved
    (note,) = adjustments(system_of(again.case))
    assert note.startswith("roughness.wheel: runout.csv: 2 of 90 sines leave out ")
    assert note.endswith(" % of the RMS of 1.44e-05 m")  # sqrt((20^2 + 4^2) / 2) um


def test_heights_whose_sines_are_beyond_all_numbers_are_reported() -> None:
    (line,) = messages(SPECTRA, "roughness.wheel.spectrum.rms=9e99")
    assert "spectrum.rms: is too large for the amplitudes of its sines" in line


WRONG = {
    "a;b\n1;2\n2;3\n": "has 2 rows; measure four places or more",
    "": "the file is empty",
    "1,2,3\n4,5,6\n": "has 3 columns; give two: position or angle, and height",
    "angle,um\n0,1\n1,2\n2,1\n3,5\n": "column angle: has no unit; name it angle_deg or angle_rad",
    "theta,um\n0,1\n1,2\n2,1\n3,5\n": "column theta: has no unit; name it angle_deg or angle_rad",
    "x_mm,z_V\n0,1\n1,2\n2,1\n3,5\n": "not meter; correct the unit",
    "x_mm,z_mV\n0,1\n1,2\n2,1\n3,5\n": "column z_mV: mV is",
    "x (mm),z (qq)\n0,1\n1,2\n2,1\n3,5\n": "column z (qq): there is no unit qq",
    "x (mm),z (qq) rms\n0,1\n1,2\n2,1\n3,5\n": "column z (qq) rms: there is no unit qq",
    "x_mm,z_mm\nmm,um\n0,1\n1,2\n2,1\n3,5\n": "column z_mm: has the units um and mm; keep one",
    "position (mm) height (um)\n0 1\n1 2\n2 1\n3 5\n": "its first lines do not name both columns",
    "0,1\n1,\n2,1\n3,5\n": "a cell is empty or no number",
    "0,1\n1,nan\n2,1\n3,5\n": "a cell is empty or no number",
    "0,1\n1,2\n1,3\n3,5\n": "see row 3 of numbers; sort the rows",
    "0,1\n1,1\n2,1\n3,1\n": "all heights are equal",
    "\n".join(f"{0.001 * i},{0.3 * i}" for i in range(300)): "its heights lie on a straight line",
    "1\n2\n3\n4\n": "has 1 column (found",
    "angle_turn,height_um\n0,0\n3,1\n6,0\n9,1\n": "in a turn of 3.14 m; check their unit",
    "angle_deg,height_um\n0,0\n200,1\n400,0\n600,1\n800,3\n": "2 in a turn of 3.14 m",
    "0,0\n1e-300,1\n2e-300,0\n3e-300,1\n": "its places lie 1e-300 m apart",
    "0,1e308\n1,-1e308\n2,1e308\n3,0\n": "a height is 1e+308 in SI units; check the unit",
    "0,1e-108\n1,-1e-108\n2,1e-108\n3,0\n": "its heights differ by 2e-108 m; check their unit",
    "0,1\n1e299,2\n2e299,1\n3e299,0\n": "a place is 3e+299 in SI units; check the unit",
    "angle_deg,height_um\n0,0\n4e-6,1\n8e-6,0\n400,1\n": "its heights lie on a straight line",
    "angle_deg,z\n0,1\n45,-1\n90,1\n135,-1\n180,1\n225,-1\n270,1\n315,-1\n": "an RMS of 1 m; check their unit",
    "t,x (" + "   ".join("m" * 22) + "!)\n1,2\n2,3\n3,1\n4,5\n": "there is no unit m   m",
    "\0\0": "this is not text",
}


@pytest.mark.parametrize("text", WRONG)
def test_a_profile_that_cannot_be_used_is_reported_at_its_key(tmp_path: Path, text: str) -> None:
    (tmp_path / "p.csv").write_text(text)
    (line,) = messages(SMALL, f'roughness.wheel.profile="{tmp_path}/p.csv"')
    assert ": roughness.wheel.profile: " in line
    assert all(part in line for part in WRONG[text].split("; "))


def test_a_profile_that_is_not_there_or_not_a_file_is_reported_with_all_other_problems(tmp_path: Path) -> None:
    for place, what in (
        (tmp_path / "absent.csv", "cannot be read: no such file"),
        (tmp_path, "not a regular file"),
    ):
        found = messages(SMALL, f'roughness.wheel.profile="{place}"', "shoe.mass=-1")
        assert len(found) == 2
        assert what in found[0]


def test_more_sines_than_a_case_may_hold_are_refused_with_the_error_that_fits(tmp_path: Path) -> None:
    heights = np.random.default_rng(0).normal(size=8000)
    override = saved(tmp_path / "noise.csv", "x_mm,z_um", np.arange(8000) * 0.01, heights)
    (line,) = messages(SMALL, override)
    assert "needs " in line
    assert "2000 is the most" in line
    error = line.rpartition(" ")[2]
    assert loaded(override, f"roughness.wheel.profile_error={error}").case.roughness.wheel is not None


def test_keys_that_belong_to_a_profile_or_exclude_it_are_reported(tmp_path: Path) -> None:
    override = saved(tmp_path / "p.csv", "angle_deg,height_um", ANGLES, RUNOUT)
    (line,) = messages(SMALL, override, "roughness.wheel.phases_deg=[1]")
    assert "phases_deg: is given together with profile" in line
    (line,) = messages(ORDERS, "roughness.wheel.profile_error=0.1")
    assert "profile_error: is only for a profile" in line
    (line,) = messages(SMALL, "roughness.wheel={}")
    assert (
        "give amplitudes and wavelengths, or amplitudes and wavenumbers, or amplitudes and orders, or profile"
        in line
    )


def test_phases_beside_a_spectrum_take_the_place_of_random_ones() -> None:
    phases = [float(place) for place in range(50)]
    found = system_of(parse_case(SPECTRA, "case.toml", [f"roughness.wheel.phases_deg={phases}"]).case).wheel
    np.testing.assert_allclose(np.degrees(found.phase), phases)
    (line,) = messages(SPECTRA, "roughness.wheel.phases_deg=[1, 2]")
    assert "phases_deg: has 2 entries, but spectrum.terms is 50" in line


def test_a_sweep_varies_a_spectrum_and_the_radius_of_orders(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(SPECTRA)
    axes = "".join(
        f"[[axis]]\nparameter = '{key}'\nvalues = {values}\n"
        for key, values in (
            ("roughness.wheel.spectrum.seed", [1, 2]),
            ("roughness.wheel.spectrum.rms", [1e-6, 2e-6]),
        )
    )
    plan = parse_sweep(f"case = 'case.toml'\n{axes}", "sweep.toml", tmp_path).plan
    waves = [system_of(plan.case(plan.settings(point))).wheel for point in range(4)]
    assert [math.sqrt(0.5 * np.sum(each.g**2)) for each in waves] == pytest.approx([1e-6, 2e-6, 1e-6, 2e-6])
    np.testing.assert_array_equal(waves[0].phase, waves[1].phase)
    assert not np.allclose(waves[0].phase, waves[2].phase)


def profiled(folder: Path) -> Path:
    """A case with a profile in metres: a turn of the wheel of SMALL, an arc of a larger one."""
    saved(folder / "runout.csv", "s_m,h_um", RADIUS * np.radians(ANGLES), RUNOUT + np.tile([0.4, -0.4], 90))
    path = folder / "case.toml"
    path.write_text(SMALL + '\nroughness.wheel.profile = "runout.csv"\n')
    return path


AXES: dict[str, list[Any]] = {
    "wheel.radius": [0.25, 0.5, 0.6],
    "roughness.wheel.profile_error": [0.5, 0.05, 0.001],
    "roughness.wheel.spectrum": [SPECTRUM, SPECTRUM | {"seed": 8}],
    "wheel": [{"radius": 0.6, "angular_speed": 3.0}],
}


@pytest.mark.parametrize("key", AXES)
def test_a_point_of_a_sweep_has_the_surface_of_its_own_case(tmp_path: Path, key: str) -> None:
    path = profiled(tmp_path)
    values = AXES[key]
    text = tomli_w.dumps({"case": "case.toml", "axis": [{"parameter": key, "values": values}]})
    plan = pickle.loads(pickle.dumps(parse_sweep(text, "sweep.toml", tmp_path).plan))
    for point, value in enumerate(values):
        here = plan.case(plan.settings(point))
        assert resolved_toml(here) == brakecli.load(path, {key: value}).resolved


def test_a_sweep_of_other_keys_needs_no_file_of_a_profile(tmp_path: Path) -> None:
    profiled(tmp_path)
    text = "case = 'case.toml'\n[[axis]]\nparameter = 'shoe.mass'\nvalues = [1.0, 2.0]\n"
    plan = parse_sweep(text, "sweep.toml", tmp_path).plan
    before = plan.case(plan.settings(1)).roughness.wheel
    (tmp_path / "runout.csv").unlink()
    assert plan.case(plan.settings(1)).roughness.wheel == before


def test_a_profile_that_was_changed_is_read_again_and_ends_a_continuation(tmp_path: Path) -> None:
    path = profiled(tmp_path)
    text = "case = 'case.toml'\n[[axis]]\nparameter = 'wheel.radius'\nvalues = [0.5, 0.6]\n"
    plan = parse_sweep(text, "sweep.toml", tmp_path).plan
    before = parse_case(*read_text(str(path))).resolved
    was = identity(plan)
    surfaces = [plan.case(plan.settings(point)) for point in range(2)]
    saved(tmp_path / "runout.csv", "s_m,h_um", RADIUS * np.radians(ANGLES), 2.0 * RUNOUT)
    assert parse_case(*read_text(str(path))).resolved != before
    assert identity(plan) == was
    assert [plan.case(plan.settings(point)) for point in range(2)] == surfaces
    again = identity(parse_sweep(text, "sweep.toml", tmp_path).plan)
    assert {key for key, value in again.items() if was[key] != value} == {"checksum of runout.csv"}


def test_a_result_says_why_it_does_not_take_what_its_surface_was_made_of(tmp_path: Path) -> None:
    resolved = parse_case(*read_text(str(profiled(tmp_path)))).resolved
    for key in ("roughness.wheel.profile_error=0.1", "roughness.wheel.spectrum.seed=5", "wheel.radius=0.6"):
        with pytest.raises(CaseError, match="a result holds the sines of a surface alone; run the case file anew"):
            parse_resolved(resolved, "r.h5", [key])
    whole = "roughness.wheel={amplitudes=[1e-6], wavelengths=[0.1]}"
    assert parse_resolved(resolved, "r.h5", ["wheel.radius=0.6", whole]).case.wheel.radius == 0.6
    assert parse_resolved(resolved, "r.h5", ["shoe.mass=7"]).case.shoe.mass == 7.0
    smooth = parse_resolved(SMALL, "r.h5", ["wheel.radius=0.6"])
    assert smooth.case.wheel.radius == 0.6


def test_a_wheel_with_a_profile_goes_on_turning_along_a_line(tmp_path: Path) -> None:
    profiled(tmp_path)
    axes = [
        {"parameter": "roughness.wheel.profile_error", "values": [0.5, 0.05]},
        {"parameter": "friction.coefficient", "values": [0.1, 0.2], "direction": "up"},
    ]
    plan = parse_sweep(tomli_w.dumps({"case": "case.toml", "axis": axes}), "sweep.toml", tmp_path).plan
    records = compute(plan, 0, plan.units)
    assert {*records["status"].tolist()} == {b"done"}
