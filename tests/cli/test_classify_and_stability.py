"""`classify` and `stability`, as their users meet them."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from tests.campaign import campaign
from tests.commands import ROOT, brakecli, each

RELAXATION = ROOT / "cases" / "relaxation.toml"
MODE_COUPLING = ROOT / "cases" / "mode-coupling.toml"


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the result of a short run and a measured signal."""
    folder: Path = tmp_path_factory.mktemp("classify")
    run = brakecli("run", RELAXATION, "-o", "run.h5", "--set", "solver.duration=1.0", "--quiet", cwd=folder)
    assert run.code == 0, run
    time = np.arange(4000) / 1000.0
    table = np.column_stack([time, np.mod(time, 0.05) - 0.025])  # a sawtooth of 20 Hz
    np.savetxt(folder / "saw.csv", table, delimiter=",", header="t,force", comments="")
    return folder


def test_classify_repeats_the_verdict_of_the_run(here: Path) -> None:
    run, again = each(
        here,
        [
            ["run", RELAXATION, "-o", "b.h5", "--set", "solver.duration=1.0", "--json"],
            ["classify", "run.h5", "--json"],
        ],
    )
    shared = (
        "regime",
        "excitation",
        "frequency",
        "amplitude",
        "stick_fraction",
        "contact_loss_fraction",
        "evidence",
    )
    assert {name: run.json[name] for name in shared} == {name: again.json[name] for name in shared}
    assert again.json["regime"] == "relaxation"


def test_a_rough_wheel_is_asked_whether_neighbours_come_together(here: Path) -> None:
    """A forced motion in full contact is linear: they fade as its slowest mode does, by its eigenvalue."""
    rough = ROOT / "cases" / "rough-full-contact.toml"
    smooth = RELAXATION
    said, told, again, listed, none = each(
        here,
        [
            ["run", rough, "-o", "rough.h5", "--set", "solver.duration=0.5", "--details"],
            ["run", rough, "-o", "rough.h5", "--set", "solver.duration=0.5", "--force", "--json"],
            ["classify", "rough.h5", "--json"],
            ["classify", "rough.h5", "--details"],
            ["run", smooth, "-o", "smooth.h5", "--set", "solver.duration=0.1", "--json"],
        ],
    )
    rate, error = (told.json[name] for name in ("lyapunov_exponent", "lyapunov_error"))
    assert rate == pytest.approx(told.json["growth_rate"], abs=3.0 * error)
    assert f"small ones fade at {-rate:.3g}" in said.out
    assert again.json["lyapunov_exponent"] == rate
    assert "small ones" in listed.out
    assert again.json["lyapunov_error"] == error
    assert none.json["lyapunov_exponent"] is None


def test_thresholds_are_options_and_are_reported(here: Path) -> None:
    strict, wrong, bad, again = each(
        here,
        [
            ["classify", "run.h5", "--threshold", "fewest_cycles=1e6", "--json"],
            ["classify", "run.h5", "--threshold", "fewest_cycle=3"],
            ["classify", "run.h5", "--threshold", "fewest_cycles=-1"],
            ["classify", "run.h5", "--threshold", "fewest_cycles=1", "--threshold", "fewest_cycles=few"],
        ],
    )
    assert strict.json["regime"] == "undecided"
    assert strict.json["thresholds"]["fewest_cycles"] == 1e6
    wrong.told(2, "did you mean fewest_cycles")
    bad.told(2, "is not a number of at least 0")
    again.told(2, "fewest_cycles=few: is not a number of at least 0")


def test_a_result_that_is_no_run_is_told_from_a_damaged_one(here: Path) -> None:
    along = ["--vary", "friction.coefficient=0:1:3", "-o", "curves.h5"]
    brakecli("stability", MODE_COUPLING, *along, "--quiet", cwd=here).told(0)
    for command in ("classify", "run"):
        done = brakecli(command, "curves.h5", cwd=here)
        done.told(
            4, "curves.h5: holds a result of kind 'stability', and 'run' is needed; name the result of a run"
        )
        assert "intact" not in done.err
        assert "--quantity" not in done.err


def test_a_measured_signal_is_classified(here: Path) -> None:
    options = ["--quantity", "force", "--time-column", "t", "--column", "force"]
    done = brakecli("classify", "saw.csv", *options, "--json", cwd=here)
    assert done.json["regime"] == "relaxation"
    assert done.json["frequency"] == pytest.approx(20.0, rel=0.02)
    inside = ["classify", "run.h5:/history/vx", "--quantity", "velocity", "--sample-rate", "20000"]
    table, known = each(here, [["classify", "saw.csv", *options], [*inside, "--belt-speed", "0.05", "--json"]])
    assert "relaxation" in table.out
    assert known.json["regime"] == "relaxation"


def _squeal(path: Path, start: float, end: float) -> None:
    time = np.arange(16000) / 16000.0
    tone = np.where((start <= time) & (time < end), np.sin(2.0 * np.pi * 1500.0 * time), 0.0)
    noise = np.random.default_rng(1).normal(0.0, 1e-3, len(time))
    wavfile.write(path, 16000, np.round(2e4 * (0.5 * tone + noise)).astype(np.int16))


def test_many_files_give_a_verdict_each_and_one_that_cannot_be_read_does_not_stop_the_others(here: Path) -> None:
    _squeal(here / "a.wav", 0.2, 0.6)
    _squeal(here / "b.wav", 0.0, 1.0)
    (here / "c.wav").write_bytes(b"RIFF")
    one, both, broken = each(
        here,
        [
            ["classify", "a.wav", "--json"],
            ["classify", "a.wav", "b.wav"],
            ["classify", "c.wav", "a.wav", "b.wav", "--json"],
        ],
    )
    (burst,) = one.json["bursts"]
    assert sorted(burst) == ["end", "frequency", "level", "start"]
    assert (burst["start"], burst["end"]) == pytest.approx((0.2, 0.6), abs=0.005)
    assert burst["frequency"] == pytest.approx(1500.0, rel=1e-3)
    assert burst["level"] == pytest.approx(2e4 / 2**15 * 0.5 / np.sqrt(2.0), rel=0.02)
    assert both.out.count("quasi-harmonic") == 2
    assert "b.wav" in both.out
    broken.told(4, "intact WAV file")
    results = json.loads(broken.out)["results"]
    assert [found.get("regime") for found in results] == [None, "quasi-harmonic", "quasi-harmonic"]


@campaign
def test_a_measured_signal_is_drawn_as_it_is_classified(here: Path) -> None:
    _squeal(here / "a.wav", 0.2, 0.6)
    options = ["--quantity", "force", "--time-column", "t", "--column", "force"]
    sound, text, again, wrong = each(
        here,
        [
            ["plot", "a.wav"],
            ["plot", "saw.csv", *options, "-o", "saw.svg"],
            ["plot", "a.wav"],
            ["plot", "saw.csv", "--unit", "mm"],
        ],
    )
    assert (sound.out, text.out) == ("a.png: written\n", "saw.svg: written\n")
    drawn = (here / "saw.svg").read_text()
    assert all(
        f"<!-- {word}" in drawn for word in ("Record", "events found", "Spectrum of the force", "relaxation")
    )
    again.told(2, "--force")
    wrong.told(2, "--quantity")


def test_options_that_do_not_fit_are_bad_usage(here: Path) -> None:
    done = each(
        here,
        [
            ["classify", "run.h5", "--column", "1"],
            ["classify", "saw.csv", "--quantity", "speed", "--time-column", "t"],
            ["classify", "saw.csv", "--quantity", "force", "--sample-rate", "-5"],
            ["classify", "saw.csv", "--quantity", "force"],
            ["classify", "saw.csv", "--quantity", "force", "--sample-rate", "5", "--time-column", "t"],
            ["stability", RELAXATION, "--vary", "link2.angle_deg=1:2"],
            ["stability", RELAXATION, "--vary", "link2.angle_deg=80:100:3"],
            ["stability", RELAXATION, "--vary", "link2.angle=1:2:2"],
        ],
    )
    once = [
        f"of the samples are {given}; give --sample-rate HZ or --time-column NAME"
        for given in ("not given", "given twice")
    ]
    words = ["--quantity", "displacement", "above 0 Hz", *once, "START:STOP:NUM", "from -90 to 90", "angle_deg"]
    assert len(done) == len(words)
    for result, word in zip(done, words, strict=True):
        result.told(2, word)


def test_files_that_are_not_results_end_in_four_and_never_in_a_number(here: Path) -> None:
    (here / "empty.h5").write_bytes(b"")
    (here / "text.csv").write_text("no numbers here\n")
    whole = (here / "run.h5").read_bytes()
    (here / "half.h5").write_bytes(whole[: len(whole) // 2])
    (here / "changed.h5").write_bytes(whole[:5000] + bytes([whole[5000] ^ 1]) + whole[5001:])
    names = ["empty.h5", "text.csv", "half.h5", "changed.h5", "absent.h5", "saw.csv"]
    done = each(here, [["classify", name, "--json"] for name in names])
    signal = each(
        here, [["classify", name, "--quantity", "force", "--sample-rate", "9", "--json"] for name in names[:2]]
    )
    assert len(done) == 6
    for result in (*done, *signal):
        result.told(4)
        assert result.out == ""


def test_stability_has_no_critical_friction_on_a_standing_wheel(here: Path) -> None:
    done = brakecli("stability", RELAXATION, "--set", "wheel.angular_speed=0", "--json", cwd=here)
    assert done.json["critical_friction"] is None


def test_a_force_of_the_contact_is_not_taken_for_that_of_the_spring_without_a_word(here: Path) -> None:
    brakecli("export", "run.h5", "-o", "run.csv", "-q", cwd=here).told(0)
    table = ["classify", "run.csv", "--time-column", "time (s)", "--column"]
    done = each(
        here,
        [
            [*table, "friction_force (N)", "--quantity", "force"],
            [*table, "normal_force (N)", "--quantity", "force"],
            ["classify", "run.h5:/history/friction_force", "--sample-rate", "20000", "--quantity", "force"],
            [*table, "vx (m/s)", "--quantity", "velocity"],
            ["classify", "saw.csv", "--time-column", "t", "--column", "force", "--quantity", "force"],
        ],
    )
    said = ["a force of the contact jumps where slip ends" in each.err for each in done]
    assert said == [True, True, True, False, False]


def test_stability_and_advise_name_both_thresholds_as_branch_does(here: Path) -> None:
    brakecli("new", "branch", cwd=here).told(0)
    along = ["--parameter", "friction.coefficient=0:1"]
    table, stable, advised, branch = each(
        here,
        [
            ["stability", "branch.toml", "--details"],
            ["stability", "branch.toml", "--json"],
            ["advise", "branch.toml", "--json"],
            ["branch", "branch.toml", *along, "--json"],
        ],
    )
    for found in (stable.json, advised.json):
        assert found["coexists_from"] == pytest.approx(branch.json["coexists_from"], rel=1e-8)
        assert found["barrier"] == pytest.approx(branch.json["barrier"], rel=1e-6)
    words = (
        "a vibration can exist from 0.1688 on; at the case's 0.4 an unstable cycle of 1.4 µm lies between the two"
    )
    sought = "no other vibration found in 640 pushes"
    assert stable.json["sentence"] == f"sliding loses stability at 0.4877; {words}; {sought}"
    assert branch.json["sentence"].endswith(f"; {sought}")
    assert (stable.json["pushes"], branch.json["pushes"]) == (640, 640)
    assert words in advised.json["conclusion"]
    assert words in " ".join(table.out.split())
    assert re.search(r"search for other vibrations +640 pushes\n", table.out)
    assert "pushes" not in advised.out


def test_where_no_vibration_exists_below_both_names_are_null(here: Path) -> None:
    standing = ["--set", "wheel.angular_speed=0"]
    stable, stands, advised, varied = each(
        here,
        [
            ["stability", RELAXATION, "--json"],
            ["stability", RELAXATION, *standing, "--json"],
            ["advise", RELAXATION, "--set", "solver.duration=0.1", "--json"],
            ["stability", RELAXATION, "--vary", "link2.angle_deg=1:5:2", "--json"],
        ],
    )
    for found in (stable.json, stands.json, advised.json):
        assert (found["coexists_from"], found["barrier"]) == (None, None)
    below = "the vibration that begins there does not exist below it"
    sought = "no other vibration found in 640 pushes"
    assert stable.json["sentence"] == f"sliding loses stability at 0.5754; {below}; {sought}"
    assert stands.json["sentence"] is None
    assert below in advised.json["conclusion"]
    assert not {"coexists_from", "barrier", "sentence"} & varied.json.keys()
