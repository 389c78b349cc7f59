"""What a result holds, how two of them differ, and numbers for other programs."""

import csv
import math
import re
import wave
from importlib import import_module
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from brakecli.about import __version__
from brakecli.case.read import parse_case
from brakecli.results import fields
from brakecli.results.contents import INFO, Difference, difference
from brakecli.results.read import open_result
from brakecli.studies.runs.run import run
from brakecli.views.plots import over_each_other
from brakecli.views.view import sentence
from tests.campaign import campaign
from tests.commands import TINY, attributes, brakecli, each, left_in
from tests.results.results import edited
from tests.studies.sweeps.made_up import CYCLE, DAMPED, swept

pandas = import_module("pandas")
pytestmark = pytest.mark.usefixtures("compiled")

SQUEAL = TINY.replace("duration = 0.02", "duration = 0.5")
GRID = """
case = "tiny.toml"
[[axis]]
parameter = "link2.angle_deg"
values = [3.0, 6.0]
[[axis]]
parameter = "shoe.mass"
values = [8.0, 10.0, 12.0]
[critical]
parameter = "friction.coefficient"
lower = 0.0
upper = 1.0
method = "eigenvalue"
"""


@pytest.fixture(scope="module")
def folder(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs that differ in one key, and two results along a key; only to be read."""
    place = tmp_path_factory.mktemp("files")
    (place / "tiny.toml").write_text(SQUEAL)
    vary = ["stability", "tiny.toml", "-q", "--vary", "link2.angle_deg=1:10:4", "-o"]
    commands = [
        ["run", "tiny.toml", "-q", "-o", "a.h5"],
        ["run", "tiny.toml", "-q", "-o", "b.h5", "--set", "friction.coefficient=0.7"],
        ["run", "tiny.toml", "-q", "-o", "short.h5", "--set", "solver.duration=0.25"],
        [*vary, "modes.h5"],
        [*vary, "other.h5", "--set", "link2.damping=900"],
    ]
    for done in each(place, commands):
        done.told(0)
    return place


def history(path: Path, name: str, group: str = "history") -> Any:
    with h5py.File(path) as file:
        return file[group][name][:]


# export


def test_a_history_as_csv_is_the_history_to_the_last_bit(folder: Path, tmp_path: Path) -> None:
    done = brakecli("export", folder / "a.h5", cwd=tmp_path)
    assert (done.told(0), done.out) == ("", "a.csv: written\n")
    table = pandas.read_csv(tmp_path / "a.csv")
    units = {field.name: f" ({field.units})" if field.units != "1" else "" for field in fields.HISTORY}
    assert [*table.columns] == [name + unit for name, unit in units.items()]
    for name, unit in units.items():
        np.testing.assert_array_equal(table[name + unit], history(folder / "a.h5", name))


def test_a_part_of_a_history_is_exported_and_one_of_several_samples(folder: Path, tmp_path: Path) -> None:
    whole = exported(folder, tmp_path)
    part = exported(folder, tmp_path, "--from", "0.1", "--to", "0.2")
    few = exported(folder, tmp_path, "--every", "7")
    time = whole[:, 0]
    np.testing.assert_array_equal(part, whole[(time >= 0.1) & (time <= 0.2)])
    np.testing.assert_array_equal(few, whole[::7])
    lines = [
        ["export", "a.h5", "--from", "0.3", "--to", "0.2", "-o", "no.csv"],
        ["export", "a.h5", "--group", "spectrum", "--every", "2", "-o", "no.csv"],
        ["export", "a.h5", "--every", "2", "-o", "no.wav"],
    ]
    words = ["no time lies there", "are for what has a time", "would bend the tones"]
    for done, word in zip(each(folder, lines), words, strict=True):
        done.told(2, word)
    assert not (folder / "no.csv").exists()


def exported(folder: Path, tmp_path: Path, *options: str) -> Any:
    """The rows of an exported history."""
    brakecli("export", "a.h5", *options, "-o", str(tmp_path / "part.csv"), "--force", cwd=folder).told(0)
    return np.loadtxt(tmp_path / "part.csv", delimiter=",", skiprows=1)


def test_what_is_exported_can_be_classified_by_its_names_and_units(folder: Path, tmp_path: Path) -> None:
    export = ["export", folder / "b.h5", "-o", "v.csv", "--variable", "vx", "-q"]
    columns = [
        "--time-column",
        "time (s)",
        "--column",
        "vx (m/s)",
        "--quantity",
        "velocity",
        "--belt-speed",
        "0.05",
    ]
    done, verdict = (brakecli(*line, cwd=tmp_path) for line in (export, ["classify", "v.csv", *columns, "--json"]))
    assert (done.told(0), done.out) == ("", "")
    assert verdict.json["frequency"] == pytest.approx(attributes(folder / "b.h5")["frequency"], rel=1e-3)


@campaign
def test_as_many_values_as_directions_are_exported(tmp_path: Path) -> None:
    """`hysteresis` has one number for each value, alike in both directions."""
    (tmp_path / "tiny.toml").write_text(TINY)
    axis = 'parameter = "friction.coefficient"\nvalues = [0.5, 0.6]\ndirection = "both"\n'
    (tmp_path / "s.toml").write_text(f'case = "tiny.toml"\n[[axis]]\n{axis}')
    brakecli("sweep", "s.toml", "-q", cwd=tmp_path).told(0)
    brakecli("export", "s.h5", cwd=tmp_path).told(0)
    head, *rows = csv.DictReader((tmp_path / "s.csv").read_text().splitlines())
    rows = [head, *rows]
    assert len(rows) == 4
    with h5py.File(tmp_path / "s.h5") as file:
        assert [float(row["hysteresis"]) for row in rows] == [*file["hysteresis"]] * 2


def test_spectra_and_chosen_variables_are_exported(folder: Path, tmp_path: Path) -> None:
    chosen = ["--group", "spectrum", "--variable", "y", "--variable", "vx"]
    brakecli("export", folder / "a.h5", *chosen, "-o", "s.csv", cwd=tmp_path).told(0)
    table = pandas.read_csv(tmp_path / "s.csv")
    assert [*table.columns] == ["frequency (Hz)", "y (m^2/Hz)", "vx ((m/s)^2/Hz)"]
    np.testing.assert_array_equal(table["vx ((m/s)^2/Hz)"], history(folder / "a.h5", "vx", "spectrum"))


def test_the_windows_of_a_stop_are_exported(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(SQUEAL)
    stop = "wheel={radius=0.5, times=[0.0, 0.5], angular_speeds=[0.4, 0.1]}"
    groups = {"over_time": 1, "spectrogram": 2, "vibrations": 1}
    exports = [["export", "r.h5", "-q", "--group", group, "-o", f"{group}.csv"] for group in groups]
    for done in each(tmp_path, [["run", "tiny.toml", "-q", "-o", "r.h5", "--set", stop], *exports]):
        done.told(0)
    for group, axes in groups.items():
        table = pandas.read_csv(tmp_path / f"{group}.csv")
        with h5py.File(tmp_path / "r.h5") as file:
            assert {head.partition(" ")[0] for head in table.columns} == {*file[group]}
            assert [*table.columns[:axes].str.partition(" ").get_level_values(0)] == {
                "over_time": ["time"],
                "spectrogram": ["time", "frequency"],
                "vibrations": ["interval"],
            }[group]
            for head in table.columns[axes:]:
                held = file[group][head.partition(" ")[0]][:].ravel()
                np.testing.assert_array_equal(table[head].fillna(held.max()), held)


def test_a_sweep_and_modes_are_a_row_for_each_point(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "grid.toml").write_text(GRID)
    brakecli("sweep", "grid.toml", "-q", cwd=tmp_path).told(0)
    brakecli("export", "grid.h5", cwd=tmp_path).told(0)
    table = pandas.read_csv(tmp_path / "grid.csv")
    assert table["link2_angle_deg (deg)"].tolist() == [3.0] * 3 + [6.0] * 3
    assert table["shoe_mass (kg)"].tolist() == [8.0, 10.0, 12.0] * 2
    assert [*table.columns[2:5]] == ["status", "reason", "warning"]
    with h5py.File(tmp_path / "grid.h5") as file:
        np.testing.assert_array_equal(table["critical"], file["critical"][:].ravel())
        np.testing.assert_array_equal(
            table["critical_windows_lower of window 1"], file["critical_windows_lower"][..., 0].ravel()
        )
        assert table["frequency (Hz)"].isna().sum() == (file["frequency"][:] > 1e30).sum()
        assert table["regime"].tolist() == [text.decode() for text in file["regime"][:].ravel()]
    brakecli("export", folder / "modes.h5", cwd=tmp_path).told(0)
    modes = pandas.read_csv(tmp_path / "modes.csv")
    np.testing.assert_array_equal(
        modes[["frequencies of mode 1 (Hz)", "frequencies of mode 2 (Hz)"]],
        history(folder / "modes.h5", "frequencies", "/"),
    )


def sound(path: Path) -> Any:
    with wave.open(str(path)) as file:
        assert (file.getframerate(), file.getsampwidth(), file.getnchannels()) == (44100, 2, 1)
        return np.frombuffer(file.readframes(file.getnframes()), np.int16)


@pytest.mark.parametrize("interval", ["1e-5", "3e-4"])
def test_a_sound_has_the_frequency_of_the_verdict_and_a_peak_of_minus_3_db(tmp_path: Path, interval: str) -> None:
    (tmp_path / "tiny.toml").write_text(SQUEAL)
    run = ["run", "tiny.toml", "-o", "r.h5", "--json", "--set", f"output.sample_interval={interval}"]
    done, written = each(tmp_path, [run, ["export", "r.h5", "-o", "r.wav"]])
    assert written.told(0) == ""
    samples = sound(tmp_path / "r.wav")
    assert len(samples) == pytest.approx(44100 * 0.5, abs=2 * 44100 * float(interval) + 1)
    assert 20.0 * np.log10(np.abs(samples).max() / 32767) == pytest.approx(-3.0, abs=1e-3)
    late = samples[len(samples) // 2 :].astype(float)
    rises = np.flatnonzero((late[:-1] < 0) & (late[1:] >= 0))
    places = rises - late[rises] / (late[rises + 1] - late[rises])  # of zeros, between two samples
    frequency = 44100 * (len(places) - 1) / (places[-1] - places[0])
    assert frequency == pytest.approx(done.json["frequency"], rel=1e-3)


def test_a_sound_tells_what_cannot_be_heard(tmp_path: Path) -> None:
    light = TINY.replace("mass = 10.0", "mass = 2e-4").replace("step = 1e-5", "step = 2e-7")
    (tmp_path / "tiny.toml").write_text(light.replace("interval = 1e-4", "interval = 1e-6"))  # rings at 39 kHz
    start = ["--set", "initial.x=1e-6", "--set", "wheel.angular_speed=10", "--set", "friction.coefficient=0"]
    damped = ["--set", "link1.damping=0.1", "--set", "link2.damping=0.1"]
    brakecli("run", "tiny.toml", "-q", *start, *damped, cwd=tmp_path).told(0)
    done = brakecli("export", "tiny.h5", "-o", "t.wav", cwd=tmp_path)
    assert "of the power of vx is above 22050 Hz and not in the sound" in done.told(0)


@pytest.mark.parametrize("mass", [1e3, 1e7])
def test_a_tone_below_hearing_is_told_whether_it_is_sustained_or_not(tmp_path: Path, mass: float) -> None:
    (tmp_path / "tiny.toml").write_text(TINY.replace("{ step = 1e-5, duration = 0.02 }", "{ duration = 3.0 }"))
    lowest = math.sqrt(1e7 / mass) / (2.0 * math.pi)  # Hz; the stiffer spring is 1.2e7 N/m and the contact 2e6 N/m
    change = [
        "--set",
        f"shoe.mass={mass}",
        "--set",
        "output.sample_interval=1e-3",
        "--set",
        "wheel.angular_speed=1",
    ]
    done = each(tmp_path, [["run", "tiny.toml", "-q", "-o", "r.h5", *change], ["export", "r.h5", "-o", "r.wav"]])
    found = re.search(r"the vibration at (\S+) Hz cannot be heard", done[1].told(0))
    assert found
    assert 0.5 * lowest < float(found[1]) < 2.0 * lowest + 1.0 / 3.0  # Hz, the distance of lines of 3 s


@pytest.mark.parametrize("start", [0.0, 0.4])
def test_the_sound_of_what_dies_out_tells_when_it_is_heard(start: float, tmp_path: Path) -> None:
    """Of a decay by a rate a hundredth is left after log(100) over it; the part that is cut out begins anew."""
    (tmp_path / "tiny.toml").write_text(SQUEAL)
    change = [
        f"--set={each}" for each in ("friction.coefficient=0.55", "wheel.angular_speed=1", "solver.duration=1.2")
    ]
    run = brakecli("run", "tiny.toml", "-q", "-o", "r.h5", "--json", *change, cwd=tmp_path)
    run.told(0)
    done = brakecli("export", "r.h5", "-o", "r.wav", "--from", str(start), cwd=tmp_path)
    said = re.search(r"the motion dies out: it is heard from (\S+) to (\S+) s of (\S+) s", done.told(0))
    assert said
    begin, end, whole = map(float, said.groups())
    assert begin < 0.01
    assert whole == pytest.approx(1.2 - start, abs=1e-3)
    assert end == pytest.approx(
        min(math.log(100.0) / -run.json["growth_rate"], whole), rel=0.2
    )  # beside a second mode


def test_samples_that_are_not_equally_spaced_make_no_sound(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "r.h5").write_bytes((folder / "a.h5").read_bytes())
    with edited(tmp_path / "r.h5") as file:
        time = file["history/time"]
        time[:] = time[-1] * (time[:] / time[-1]) ** 1.1
    brakecli("export", "r.h5", "-o", "r.wav", cwd=tmp_path).told(2, "its samples are not equally spaced")
    brakecli("export", "r.h5", cwd=tmp_path).told(0)


ERRORS = [
    (
        ["a.h5", "-o", "a.txt"],
        "its suffix does not name a kind of file (found '.txt'); name a file that ends in .csv or .wav with -o",
    ),
    (["modes.h5", "-o", "a.wav"], "a.wav: is for runs, and modes.h5 is a stability"),
    (["modes.h5", "-o", "m.csv", "--group", "history"], "--group history: is for runs"),
    (
        ["a.h5", "-o", "a.csv", "--group", "energy"],
        "--group energy: there is none; give one of history, spectrum, over_time",
    ),
    (["a.h5", "-o", "a.wav", "--group", "spectrum"], "a.wav: a sound is one variable of the history"),
    (["a.h5", "-o", "a.wav", "--variable", "x", "--variable", "y"], "a sound is one variable"),
    (["a.h5", "-o", "a.wav", "--variable", "state"], "--variable state: a.h5 has none; give one of"),
    (["a.h5", "-o", "a.csv", "--variable", "time"], "--variable time: a.h5 has none"),
    (["tiny.toml", "-o", "a.csv"], "this is no result yet; compute it first: brakecli run tiny.toml"),
    (["a.h5", "-o", "a.h5"], "its suffix does not name"),
]


@pytest.mark.parametrize(("words", "what"), ERRORS)
def test_what_cannot_be_exported_is_refused(folder: Path, words: list[str], what: str) -> None:
    before = left_in(folder)
    done = brakecli("export", *words, cwd=folder)
    done.told(4 if "no result" in what else 2, what)
    assert left_in(folder) == before


def test_a_shoe_that_does_not_move_makes_no_sound(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    still = ["--set", "load.force=0", "--set", "friction.coefficient=0"]
    brakecli("run", "tiny.toml", "-q", *still, cwd=tmp_path).told(0)
    done = brakecli("export", "tiny.h5", "-o", "t.wav", cwd=tmp_path)
    done.told(2, "vx does not change, there is nothing to hear")


def test_an_export_is_replaced_only_by_force(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("mine")
    brakecli("export", folder / "a.h5", cwd=tmp_path).told(2, "a.csv: exists already")
    assert (tmp_path / "a.csv").read_text() == "mine"
    brakecli("export", folder / "a.h5", "--force", cwd=tmp_path).told(0)
    assert len((tmp_path / "a.csv").read_text()) > 100_000


# info


def test_info_tells_what_a_file_holds_and_what_made_it(folder: Path) -> None:
    found = brakecli("info", "a.h5", "--json", cwd=folder).json
    assert [*found] == ["command", *(field.name for field in INFO)]
    assert (found["kind"], found["status"], found["title"], found["whole"]) == ("run", "done", "Tiny", True)
    assert found["bytes"] == (folder / "a.h5").stat().st_size
    assert found["versions"]["brakecli"] == __version__
    assert found["versions"]["numpy"] == np.__version__
    x = next(each for each in found["variables"] if (each["group"], each["name"]) == ("history", "x"))
    assert (x["dims"], x["shape"], x["units"]) == (["time"], [5001], "m")
    shown = brakecli("info", "modes.h5", cwd=folder)
    assert shown.told(0) == ""
    assert "link2_angle_deg 4 x mode 2" in " ".join(shown.out.split())


def test_info_refuses_a_file_that_another_program_has_changed_and_a_damaged_one(
    folder: Path, tmp_path: Path
) -> None:
    data = (folder / "a.h5").read_bytes()
    (tmp_path / "cut.h5").write_bytes(data[:-40])
    (tmp_path / "flipped.h5").write_bytes(data[:9000] + bytes([data[9000] ^ 1]) + data[9001:])
    (tmp_path / "changed.h5").write_bytes(data)
    with h5py.File(tmp_path / "changed.h5", "r+") as file:
        file.attrs["note"] = "seen"
    brakecli("info", "changed.h5", cwd=tmp_path).told(4, "has no digest, as another program has saved it")
    for name in ("cut.h5", "flipped.h5", "absent.h5"):
        brakecli("info", name, cwd=tmp_path).told(4, "cannot be read as a result")


# diff


def test_a_result_is_the_same_as_itself_and_as_its_repetition(folder: Path, tmp_path: Path) -> None:
    brakecli("run", folder / "a.h5", "-q", "-o", "again.h5", cwd=tmp_path).told(0)
    for other in (folder / "a.h5", tmp_path / "again.h5"):
        found = brakecli("diff", folder / "a.h5", other, "--json", cwd=tmp_path)
        assert found.code == 0
        assert found.json["same"] is True
        assert [found.json[name] for name in ("case", "numbers", "variables", "versions")] == [[]] * 4
    assert "No difference" in brakecli("diff", folder / "a.h5", folder / "a.h5", cwd=tmp_path).out


def test_a_sentence_says_what_differs_in_lines_of_eighty_columns(folder: Path) -> None:
    lines = brakecli("diff", "a.h5", "b.h5", cwd=folder, COLUMNS="80").out.splitlines()
    assert max(map(len, lines)) <= 80
    head = " ".join(lines[: lines.index("")])
    found = brakecli("diff", "a.h5", "b.h5", "--json", cwd=folder).json
    most = max(
        (each["relative"], each["name"], each["largest"]) for each in found["variables"] if each["relative"]
    )
    assert head == sentence(found["sentence"])
    regimes = [attributes(folder / name)["regime"] for name in ("a.h5", "b.h5")]
    same = "is the same" if regimes[0] == regimes[1] else f"differs: {' and '.join(regimes)}"
    assert head.startswith(f"The case differs in friction.coefficient; the verdict {same}; {most[1]} differs most")
    assert f"{most[2]:.3g}" in head
    assert f"{most[0]:.3g} times its largest value" in head


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (1, "in k0"),
        (3, "in k0, k1, k2"),
        (4, "in k0, k1, k2 and 1 more key"),
        (5, "in k0, k1, k2 and 2 more keys"),
    ],
)
def test_a_sentence_names_three_keys_and_counts_the_others(count: int, words: str) -> None:
    case = [{"name": f"k{number}", "a": 1, "b": 2} for number in range(count)]
    assert Difference(case, [], [], [], judged=False).sentence == f"the case differs {words}"


def test_states_are_counted_and_have_no_size(tmp_path: Path) -> None:
    """A shoe that sticks and one that slides: their codes have no size."""
    for name, friction in (("a.h5", 0.9), ("b.h5", 0.1)):
        run(parse_case(TINY, "tiny", [f"friction.coefficient={friction}"]), tmp_path / name, force=False)
    with open_result(tmp_path / "a.h5") as a, open_result(tmp_path / "b.h5") as b:
        found = {each["name"]: each for each in difference(a, b).variables}
    assert found["state"]["different"] > 0
    assert found["state"]["largest"] is found["state"]["relative"] is None


def test_a_sentence_counts_the_points_of_sweeps_with_another_verdict(tmp_path: Path) -> None:
    reports = []
    for name, made in (("a", [CYCLE, DAMPED, CYCLE]), ("b", [DAMPED, DAMPED, CYCLE])):
        (tmp_path / name).mkdir()
        reports.append(swept(tmp_path / name, made).output)
    with open_result(reports[0]) as a, open_result(reports[1]) as b:
        said = difference(a, b).sentence
    assert "the case is the same; the verdict differs at 1 of 3 points; " in said


def test_two_runs_differ_in_the_key_that_was_changed_and_in_what_follows(folder: Path) -> None:
    done = brakecli("diff", "a.h5", "b.h5", "--json", cwd=folder)
    assert (done.code, done.json["same"]) == (0, False)
    assert done.json["case"] == [{"name": "friction.coefficient", "a": 0.6, "b": 0.7}]
    numbers = {each["name"]: (each["a"], each["b"]) for each in done.json["numbers"]}
    first, second = (attributes(folder / name) for name in ("a.h5", "b.h5"))
    assert numbers["braking_torque"] == (first["braking_torque"], second["braking_torque"])
    assert "energy/belt" in numbers
    assert "title" not in numbers
    variables = {(each["group"], each["name"]): each for each in done.json["variables"]}
    assert ("history", "time") not in variables
    a, b = (history(folder / name, "vx") for name in ("a.h5", "b.h5"))
    vx = variables["history", "vx"]
    assert vx["largest"] == np.abs(a - b).max()
    assert vx["relative"] == vx["largest"] / max(np.abs(a).max(), np.abs(b).max())
    assert (vx["compared"], vx["different"]) == (len(a), (a != b).sum())
    shown = brakecli("diff", "a.h5", "b.h5", cwd=folder).out
    assert "friction.coefficient  0.6   0.7" in shown
    assert brakecli("diff", "a.h5", "b.h5", "-q", cwd=folder).out == ""


def test_of_two_lengths_the_first_samples_are_compared(folder: Path) -> None:
    found = brakecli("diff", "a.h5", "short.h5", "--json", cwd=folder).json
    time = next(each for each in found["variables"] if (each["group"], each["name"]) == ("history", "time"))
    assert (time["shapes"], time["compared"], time["different"]) == ([[5001], [2501]], 2501, 0)


@pytest.mark.parametrize("interval", ["1.37e-4", pytest.param("2e-4", marks=campaign)])
def test_samples_are_compared_at_the_same_time_and_lines_at_the_same_frequency(
    folder: Path, tmp_path: Path, interval: str
) -> None:
    change = ["--set", f"output.sample_interval={interval}", "--set", "solver.duration=0.45"]
    coarse = tmp_path / "coarse.h5"
    fine = folder / "a.h5"
    brakecli("run", "tiny.toml", "-q", "-o", coarse, *change, cwd=folder).told(0)
    for names, swap in (((fine, coarse), 1), ((coarse, fine), -1)):
        found = brakecli("diff", *names, "--json", cwd=folder).json
        variables = {(each["group"], each["name"]): each for each in found["variables"]}
        times = history(coarse, "time")
        for name, unit in (("vx", "m/s"), ("y", "m")):
            expected = np.interp(times, history(fine, "time"), history(fine, name))
            apart = np.abs(history(coarse, name) - expected).max()
            each_ = variables["history", name]
            assert each_["largest"] == pytest.approx(apart, rel=1e-9, abs=1e-15)
            assert (
                each_["relative"] < 0.02
            )  # linear interpolation: (2 pi 174 Hz x 1e-4 s)^2 / 8 is 0.15 %, and kinks
            assert (each_["compared"], each_["units"], each_["interpolated"]) == (len(times), unit, "time")
            assert each_["shapes"][::swap] == [[5001], [len(times)]]
        assert variables["history", "time"]["different"] == 0
        lines, there = (history(path, "frequency", "spectrum") for path in (coarse, fine))
        common = lines[lines <= there[-1]] if len(lines) < len(there) else there[there <= lines[-1]]
        assert variables["spectrum", "vx"]["compared"] == len(common)
        assert variables["spectrum", "vx"]["interpolated"] == "frequency"
    numbers = {each["name"]: each.get("units") for each in found["numbers"]}
    assert numbers["amplitude"] == "m"
    shown = " ".join(brakecli("diff", fine, coarse, "--details", cwd=folder).out.split())
    assert "compared at equal time and frequency; the finer result is interpolated" in shown
    table, same, lengths = shown.partition("the same where both have values, of different lengths: ")
    assert same
    assert " 0 of " not in table
    assert f"history/time (5001 and {len(times)})" in lengths
    assert "N^2/Hz" in table
    assert "(N)2" not in table


def test_results_of_two_kinds_are_not_compared(folder: Path) -> None:
    brakecli("diff", "a.h5", "modes.h5", cwd=folder).told(2, "a.h5 is a run, and modes.h5 a stability")


@pytest.mark.parametrize("names", [("modes.h5", "other.h5"), ("b.h5", "short.h5")])
@campaign
def test_two_results_are_drawn_over_each_other(folder: Path, tmp_path: Path, names: tuple[str, str]) -> None:
    done = brakecli("diff", *(folder / name for name in names), "-o", "d.png", "--json", cwd=tmp_path)
    assert done.json["output"] == "d.png"
    assert (tmp_path / "d.png").read_bytes().startswith(b"\x89PNG")


def test_the_spectra_of_two_runs_have_the_unit_of_their_motion_and_envelopes_reach_its_end(folder: Path) -> None:
    with open_result(folder / "a.h5") as a, open_result(folder / "b.h5") as b:
        motion, whole, spectra = over_each_other.draw((a, b), "vx").axes
    unit = motion.get_ylabel().rpartition("(")[2].rstrip(")")
    assert unit == "mm/s"
    assert f"(({unit})²/Hz)" in spectra.get_ylabel()
    curves = [np.asarray(line.get_data()) for line in spectra.lines]
    highest = max(np.nanmax(curve[1]) for curve in curves)
    assert highest == pytest.approx(
        1e6 * max(history(folder / f"{name}.h5", "vx", "spectrum").max() for name in "ab")
    )
    assert {np.asarray(line.get_xdata())[-1] for line in whole.lines} == {history(folder / "a.h5", "time")[-1]}


def test_what_has_no_curves_is_refused_and_leaves_no_picture(folder: Path, tmp_path: Path) -> None:
    names = [folder / "modes.h5", folder / "other.h5"]
    for words, what in (
        (["-o", "d.png", "--variable", "instability"], "instability is not a number along the same axes"),
        (["-o", "d.txt"], "its suffix does not name a kind of picture"),
    ):
        brakecli("diff", *names, *words, cwd=tmp_path).told(2, what)
    assert left_in(tmp_path) == set()
