"""Reading a measured signal: every usual layout is read, every broken file is a named error."""

import struct
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import wavfile

from brakecli.analysis.signals import foreign
from brakecli.analysis.signals import read as signal_file
from brakecli.analysis.signals.look import Measurand, Signal, look
from brakecli.analysis.signals.read import read_signal
from brakecli.errors import UnreadableResultError, UsageError
from tests.campaign import campaign


def read(
    path: Path | str, column: str | None = None, time: str | None = None, rate: float | None = None
) -> Signal:
    return read_signal(str(path), Measurand.DISPLACEMENT, column=column, time_column=time, sample_rate=rate)


def written(tmp_path: Path, content: str | bytes) -> Path:
    path = tmp_path / "signal.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


LAYOUTS = {
    "comma": "t,x\n0,1\n0.1,2.5\n0.2,4\n",
    "semicolon": "t;x\n0;1\n0.1;2.5\n0.2;4\n",
    "decimal comma": "t;x\n0;1\n0,1;2,5\n0,2;4\n",
    "tab": "t\tx\n0\t1\n0.1\t2.5\n0.2\t4\n",
    "spaces": "t x\n0 1\n0.1  2.5\n0.2 4\n",
    "comments": "# made up\n% twice\nt,x\n0,1\n0.1,2.5\n0.2,4\n",
    "units": "t,x\ns,m\n0,1\n0.1,2.5\n0.2,4\n",
    "quotes": '"t","x"\n"0","1"\n"0.1","2.5"\n"0.2","4"\n',
    "byte order mark, CRLF": "\ufefft,x\r\n0,1\r\n0.1,2.5\r\n0.2,4\r\n",
    "trailing separator": "t,x,\n0,1,\n0.1,2.5,\n0.2,4,\n",
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_usual_layout_gives_the_same_signal(layout: str, tmp_path: Path) -> None:
    path = written(tmp_path, LAYOUTS[layout])
    for names in (("x", "t"), ("2", "1")):
        signal = read(path, *names)
        assert signal.values.tolist() == [1.0, 2.5, 4.0]
        assert signal.interval == pytest.approx(0.1)


def test_a_single_column_needs_no_name(tmp_path: Path) -> None:
    signal = read(written(tmp_path, "1\n2\n4\n"), rate=50.0)
    assert signal.values.tolist() == [1.0, 2.0, 4.0]
    assert signal.interval == 0.02


def test_missing_values_and_jumps_of_time_are_gaps(tmp_path: Path) -> None:
    missing = read(written(tmp_path, "t,x\n0,1\n1,\n2,nan\n3,4\n"), time="t").values
    assert np.isnan(missing).tolist() == [False, True, True, False]
    jump = read(written(tmp_path, "0,1\n1,2\n2,3\n6,7\n7,8\n8,10\n"), time="1")
    assert np.isnan(jump.values).tolist() == [False, False, False, True, True, True, False, False, False]
    assert jump.notes == ("jumps in time, treated as gaps: 1",)


def test_irregular_sampling_is_resampled_and_reported(tmp_path: Path) -> None:
    times = np.arange(50) + 0.2 * np.sin(np.arange(50))
    content = "\n".join(f"{t},{3.0 * t}" for t in times)
    signal = read(written(tmp_path, content), time="1")
    assert np.ptp(np.diff(signal.values)) == pytest.approx(0.0, abs=1e-9)  # a straight line stays one
    assert "resampled" in signal.notes[0]


BROKEN = {
    "empty": b"",
    "blank": b" \n\n",
    "text": b"hello\nworld\n",
    "binary": bytes(range(256)) * 4,
    "a short row": b"1,2\n3\n4,5\n",
    "a word": b"1,2\n3,x\n4,5\n",
    "one sample": b"1,2\n",
    "nothing but nan": b"1,nan\n2,nan\n",
    "constant": b"1,2\n2,2\n3,2\n",
    "time stands still": b"1,2\n1,3\n2,4\n",
    "time runs back": b"1,2\n3,3\n2,4\n",
    "no time": b"1,2\nnan,3\n2,4\n",
    "beyond all measure": b"1,2\n2,1e300\n3,4\n",
    "damaged bytes": b"1,2\n\xff\xfe,3\n2,4\n",
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_file_is_unreadable_and_never_a_number(kind: str, tmp_path: Path) -> None:
    with pytest.raises(UnreadableResultError, match=r"signal\.csv: .+; .+"):
        read(written(tmp_path, BROKEN[kind]), "2", "1")


def test_a_missing_column_is_reported_with_those_there_are(tmp_path: Path) -> None:
    with pytest.raises(UnreadableResultError, match="no column force; there are t, x"):
        read(written(tmp_path, "t,x\n0,1\n1,2\n"), "force", "t")


def test_a_column_is_found_without_its_unit_where_that_leaves_one(tmp_path: Path) -> None:
    path = written(tmp_path, "t (ms),x (mm),x (m),t [1]\n0,1,2,3\n1,2,3,4\n2,3,4,5\n")
    assert read(path, "x (m)", "t (ms)").values.tolist() == [2.0, 3.0, 4.0]
    with pytest.raises(UsageError, match="several columns are named x; give its number"):
        read(path, "x", "t (ms)")
    path = written(tmp_path, "time (ms),x (mm)\n0,1\n1,2\n2,3\n")
    assert read(path, "x", "time").interval == pytest.approx(1e-3)
    assert read(path, "x", "time").values == pytest.approx([1e-3, 2e-3, 3e-3])


def test_wrong_options_differ_from_a_wrong_file(tmp_path: Path) -> None:
    path = written(tmp_path, "a,b,c\n0,1,2\n1,2,4\n")
    with pytest.raises(UsageError, match="are not given; give --sample-rate HZ or --time-column"):
        read(path, "a")
    with pytest.raises(UsageError, match="are given twice; give --sample-rate"):
        read(path, "b", "a", 1.0)
    with pytest.raises(UsageError, match="which column"):
        read(path, time="a")
    for rate in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(UsageError, match="above 0 Hz"):
            read(path, "a", rate=rate)


def test_a_dataset_of_any_hdf5_file_is_a_signal(tmp_path: Path) -> None:
    path = tmp_path / "some.h5"
    with h5py.File(path, "w") as file:
        file["lab/force"] = np.arange(5, dtype=np.float32)
        file["table"] = np.zeros((2, 2))
        file["words"] = "hello"
    assert read(f"{path}:/lab/force", rate=10.0).values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    with pytest.raises(UnreadableResultError, match="no dataset /lab/x, only /lab/force"):
        read(f"{path}:/lab/x", rate=10.0)
    for name in ("table", "words", "lab"):
        with pytest.raises(UnreadableResultError):
            read(f"{path}:/{name}", rate=10.0)
    with pytest.raises(UsageError, match="has no columns"):
        read(f"{path}:/lab/force", "force", rate=10.0)


def test_what_is_no_file_is_unreadable(tmp_path: Path) -> None:
    for source in (tmp_path, tmp_path / "none.csv", f"{tmp_path / 'none.h5'}:/x"):
        with pytest.raises(UnreadableResultError):
            read(source, rate=1.0)


SINE = np.sin(2.0 * np.pi * 1870.0 * np.arange(4000) / 40000.0)  # 0.1 s


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("t,v\nms,mm/s", {}),
        ("t_ms,v_mm/s", {}),
        ("t (ms),v [mm/s]", {}),
        ("t,v", {"unit": "mm/s", "time_unit": "ms"}),
        ("t_ms,v", {"unit": "mm/s"}),
        ("t,v\nms,mm/s", {"unit": "mm/s", "time_unit": "ms"}),
    ],
)
def test_units_come_from_the_file_or_from_options(header: str, options: dict[str, Any], tmp_path: Path) -> None:
    rows = "\n".join(f"{0.025 * i:.6f},{3.0 * value:.9g}" for i, value in enumerate(SINE))
    path = written(tmp_path, f"{header}\n{rows}\n")
    signal = read_signal(str(path), Measurand.VELOCITY, column="2", time_column="1", **options)
    assert signal.interval == pytest.approx(1.0 / 40000.0)
    np.testing.assert_allclose(signal.values, 3e-3 * SINE, atol=1e-11)
    assert look(signal, quantity=Measurand.VELOCITY).verdict.frequency == pytest.approx(1870.0, rel=1e-3)


@pytest.mark.parametrize(
    ("header", "quantity", "options", "word"),
    [
        ("t,v\nms,mm/s", "velocity", {"unit": "m/s"}, "another unit"),
        ("t,v\nms,mm/s", "velocity", {"time_unit": "s"}, "another unit"),
        ("t,v\nms,mm/s", "acceleration", {}, "not meter / second"),
        ("t,v\nmm,mm/s", "velocity", {}, "not second"),
        ("t_ms,v\ns,mm/s", "velocity", {}, "keep one"),
        ("t,v", "velocity", {"unit": "mm"}, "is meter, not"),
        ("t,v", "velocity", {"unit": "furlongs per nothing"}, "no such unit"),
        ("t,v", "acceleration", {"unit": "kg"}, "not in kilograms"),
    ],
)
def test_units_that_contradict_are_refused_and_never_ignored(
    header: str, quantity: str, options: dict[str, Any], word: str, tmp_path: Path
) -> None:
    path = written(tmp_path, f"{header}\n0,1\n1,2\n2,4\n")
    with pytest.raises((UsageError, UnreadableResultError), match=word):
        read_signal(str(path), Measurand(quantity), column="2", time_column="1", **options)


@pytest.mark.parametrize(
    ("quantity", "unit", "size"),
    [("force", "kN", 1e3), ("acceleration", "g", 9.80665), ("pressure", "bar", 1e5), ("displacement", "um", 1e-6)],
)
def test_every_quantity_has_its_units(quantity: str, unit: str, size: float, tmp_path: Path) -> None:
    path = written(tmp_path, "1\n2\n4\n")
    signal = read_signal(str(path), Measurand(quantity), sample_rate=1.0, unit=unit)
    np.testing.assert_allclose(signal.values, np.array([1.0, 2.0, 4.0]) * size, rtol=1e-12)


@pytest.mark.parametrize(("kind", "largest"), [("u1", 128), ("i2", 1 << 15), ("i4", 1 << 31), ("f4", 1)])
def test_a_sound_file_gives_its_rate_and_numbers_up_to_one(kind: str, largest: int, tmp_path: Path) -> None:
    path = str(tmp_path / "squeal.wav")
    wave = 0.5 * SINE
    stored = wave * largest + (128.0 if kind == "u1" else 0.0)
    wavfile.write(path, 40000, (stored if kind == "f4" else np.round(stored)).astype(kind))
    signal = read_signal(path, Measurand.PRESSURE, sample_rate=40000.0)
    assert signal.interval == 1.0 / 40000.0
    np.testing.assert_allclose(signal.values, wave, atol=0.6 / largest + 1e-7)  # half of a step
    with pytest.raises(UsageError, match="the file has 40000 Hz"):
        read_signal(path, Measurand.PRESSURE, sample_rate=44100.0)


@pytest.mark.parametrize(("unit", "told"), [(None, "of full scale"), ("Pa", "Pa")])
def test_a_sound_without_a_unit_is_relative_to_full_scale(unit: str | None, told: str, tmp_path: Path) -> None:
    path = str(tmp_path / "squeal.wav")
    wavfile.write(path, 40000, (0.5 * SINE).astype(np.float32))
    signal = read_signal(path, Measurand.PRESSURE, unit=unit)
    assert signal.relative is (unit is None)
    assert look(signal, Measurand.PRESSURE).verdict.unit == told


def test_a_channel_is_chosen_and_a_damaged_sound_file_is_unreadable(tmp_path: Path) -> None:
    path = tmp_path / "two.wav"
    wavfile.write(path, 8000, np.stack([SINE, 2.0 * SINE], axis=1).astype(np.float32))
    signal = read_signal(str(path), Measurand.PRESSURE, column="2")
    np.testing.assert_allclose(signal.values, 2.0 * SINE, atol=1e-6)
    with pytest.raises(UsageError, match="which channel"):
        read_signal(str(path), Measurand.PRESSURE)
    path.write_bytes(path.read_bytes()[:30])
    with pytest.raises(UnreadableResultError, match="intact WAV file"):
        read_signal(str(path), Measurand.PRESSURE, column="1")


def test_the_unit_of_a_dataset_counts(tmp_path: Path) -> None:
    path = tmp_path / "some.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(5.0)
        file["x"].attrs["units"] = "mm"
        file["odd"] = np.arange(5.0)
        file["odd"].attrs["units"] = "blips"
    signal = read_signal(f"{path}:/x", Measurand.DISPLACEMENT, sample_rate=1.0)
    np.testing.assert_allclose(signal.values, 1e-3 * np.arange(5.0))
    for name, quantity, unit, word in (
        ("x", "velocity", None, "correct --quantity"),
        ("x", "displacement", "m", "another unit"),
        ("odd", "displacement", None, "say with --unit"),
    ):
        with pytest.raises((UsageError, UnreadableResultError), match=word):
            read_signal(f"{path}:/{name}", Measurand(quantity), sample_rate=1.0, unit=unit)
    read_signal(f"{path}:/odd", Measurand.DISPLACEMENT, sample_rate=1.0, unit="mm")


def test_a_torque_has_its_own_unit_and_no_displacement(tmp_path: Path) -> None:
    path = written(tmp_path, "time_s,torque_Nm\n0,1\n0.1,2.5\n0.2,4\n")
    signal = read_signal(str(path), Measurand.TORQUE, column="torque_Nm", time_column="time_s")
    assert signal.values.tolist() == [1.0, 2.5, 4.0]
    path = written(tmp_path, "time_s,torque_kNm\n0,1\n0.1,2.5\n0.2,4\n")
    kilo = read_signal(str(path), Measurand.TORQUE, column="torque_kNm", time_column="time_s")
    assert kilo.values.tolist() == [1000.0, 2500.0, 4000.0]
    with pytest.raises(UnreadableResultError, match="torque"):
        read(path, "torque_kNm", "time_s")


@pytest.mark.parametrize("filler", [0, 70_000])
def test_a_text_in_latin_1_keeps_its_units(tmp_path: Path, filler: int) -> None:
    comment = "# " + "x" * filler + "\n"
    text = f"t,a\ns,m/s²\n0,1\n0.1,2.5\n{comment * bool(filler)}0.2,4\n# für alle\n"
    signal = read_signal(
        str(written(tmp_path, text.encode("latin-1"))), Measurand.ACCELERATION, column="a", time_column="t"
    )
    assert signal.values.tolist() == [1.0, 2.5, 4.0]


def test_a_row_of_a_mat_file_is_a_signal_and_a_matrix_is_none(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "m.mat", "w", userblock_size=512) as file:
        file["row"] = np.eye(1, 5)
        file["column"] = np.eye(5, 1)
        file["matrix"] = np.eye(2, 5)
    for name in ("row", "column"):
        assert read(f"{tmp_path}/m.mat:/{name}", rate=10.0).values.tolist() == [1.0, 0.0, 0.0, 0.0, 0.0]
    with pytest.raises(UnreadableResultError, match="not a row of numbers"):
        read(f"{tmp_path}/m.mat:/matrix", rate=10.0)


def test_more_samples_than_the_bound_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with h5py.File(tmp_path / "s.h5", "w") as file:
        file["v"] = np.zeros(101)
    wavfile.write(tmp_path / "s.wav", 1000, np.zeros(101, dtype=np.int16))
    monkeypatch.setattr(signal_file, "_MOST_SAMPLES", 100)
    for path in (f"{tmp_path}/s.h5:/v", f"{tmp_path}/s.wav"):
        with pytest.raises(UnreadableResultError, match=r"101 samples, (and )?100 are the most"):
            read_signal(path, Measurand.PRESSURE, sample_rate=1000.0)


@pytest.mark.parametrize(("block", "bits"), [(1, 16), (0, 16), (2, 0), (3, 32)])
def test_a_sound_whose_header_contradicts_itself_is_refused(tmp_path: Path, block: int, bits: int) -> None:
    head = b"WAVEfmt " + struct.pack("<IHHIIHH", 16, 1, 1, 2000, 2000 * block, block, bits)
    data = b"data" + struct.pack("<I", 4000) + np.arange(2000, dtype="<i2").tobytes()
    (tmp_path / "x.wav").write_bytes(b"RIFF" + struct.pack("<I", 4036) + head + data)
    with pytest.raises(UnreadableResultError, match="its header contradicts itself"):
        read_signal(f"{tmp_path}/x.wav", Measurand.PRESSURE)


@pytest.mark.parametrize("step", ["5e-324", "1e-309", "1e14"])
def test_times_in_a_wrong_unit_are_refused(tmp_path: Path, step: str) -> None:
    rows = "".join(f"{n * float(step)!r},{n % 3}\n" for n in range(20))
    with pytest.raises(UnreadableResultError, match="check the unit of the times"):
        read(written(tmp_path, rows), "2", "1")
    with pytest.raises(UsageError, match="1e-12 to 1e12"):
        read(written(tmp_path, rows), "2", rate=1e308)


def test_a_view_of_itself_and_a_link_are_no_signals(tmp_path: Path) -> None:
    """HDF5 crashes on a virtual dataset without a fixed length as soon as its shape is asked for."""
    with h5py.File(tmp_path / "s.h5", "w") as file:
        file["v"] = [1.0, 2.0]
        grows = h5py.h5s.create_simple((5,), (h5py.h5s.UNLIMITED,))
        grows.select_hyperslab((0,), (1,), block=(h5py.h5s.UNLIMITED,))
        plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plist.set_virtual(grows, b".", b"own", grows)
        h5py.h5d.create(file.id, b"own", h5py.h5t.NATIVE_DOUBLE, grows, plist)
        file["link"] = h5py.ExternalLink("/dev/zero", "/")
        file["soft"] = h5py.SoftLink("/v")
        file.create_group("loop")["up"] = file["/"]
    for name in ("own", "link", "soft", "loop"):
        with pytest.raises(UnreadableResultError, match=f"there is no dataset /{name}, only /v;"):
            read(f"{tmp_path}/s.h5:/{name}", rate=10.0)


@campaign
def test_a_file_on_which_hdf5_never_ends_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a heap of texts, free space that claims no length makes HDF5 read the same place again and again."""
    path = tmp_path / "s.h5"
    with h5py.File(path, "w") as file:
        file["v"] = [1.0, 2.0]
        file["v"].attrs["units"] = np.array("m/s", h5py.string_dtype())
    data = bytearray(path.read_bytes())
    place = data.index(b"GCOL") + 16
    while number := int.from_bytes(data[place : place + 2], "little"):
        assert 0 < number < 1000
        place += 16 + (int.from_bytes(data[place + 8 : place + 16], "little") + 7) // 8 * 8
    data[place + 8 : place + 16] = bytes(8)
    path.write_bytes(data)
    monkeypatch.setattr(foreign, "SHORTEST_TRIAL", 1.0)
    with pytest.raises(UnreadableResultError, match="HDF5 cannot read it"):
        read(f"{path}:/v", rate=10.0)


def test_what_is_wrong_with_a_dataset_is_said_in_words(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "s.h5", "w") as file:
        file["empty"] = h5py.Empty("f8")
    with pytest.raises(UnreadableResultError, match="not a row of numbers"):
        read(f"{tmp_path}/s.h5:/empty", rate=10.0)
    with pytest.raises(UnreadableResultError, match="there is no dataset"):
        read(f"{tmp_path}/s.h5:/{'d' * 5000}", rate=10.0)
    with pytest.raises(UnreadableResultError, match=r"absent\.h5:/v: no such file"):
        read(f"{tmp_path}/absent.h5:/v", rate=10.0)


QUOTED = '"0,000050","0,123456"\n"0,000100","-0,5"\n"0,000150","1,25e-1"\n'


@pytest.mark.parametrize("head", ["", "t,x\n", '"t","x"\n'])
def test_quoted_decimal_commas_between_commas_are_numbers(tmp_path: Path, head: str) -> None:
    signal = read(written(tmp_path, head + QUOTED), "2", "1")
    assert signal.values.tolist() == [0.123456, -0.5, 0.125]
    assert signal.interval == pytest.approx(5e-5)


REFUSED = {
    "a longer row": ("t,x\n0,1\n1,2,3\n2,4\n", "line 3: has 3 cells, and the first line of numbers 2"),
    "a shorter row": ("t,x\n0,1\n\n1\n2,4\n", "line 4: has 1 cells, and the first line of numbers 2"),
    "a longer row of white space": ("0 1\n1 2 3\n", "line 2: has 3 cells"),
    "bare decimal commas": ("t,x\n0,5,1,25\n1,5,2,25\n", "has 2 cells, and line 2 has 4"),
    "thousands": ('t,x\n0,"1,000"\n1,"2,500"\n', "line 2: commas in 1,000 may part thousands"),
    "two decimal signs": (
        "t;x\n0;1,5\n1;2.5\n",
        r"line 3, column 2: is no number \(found '2\.5'\).* decimal comma",
    ),
    "Arabic digits": ("t,x\n0,1\n1,٢\n2,4\n", "line 3, column 2: is no number"),
    "grouped digits": ("t,x\n0,1\n1,1_000\n2,4\n", r"line 3, column 2: is no number \(found '1_000'\)"),
    "an open quote": ('t,x\n0,1\n1,"2\n' + "2,4\n" * 50_000, "behind line 2: field larger than field limit"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_may_be_read_in_two_ways_is_refused_with_its_line(kind: str, tmp_path: Path) -> None:
    text, said = REFUSED[kind]
    with pytest.raises(UnreadableResultError, match=said):
        read(written(tmp_path, text), "2", "1")


def test_a_comment_behind_numbers_and_lines_that_are_empty_are_passed_over(tmp_path: Path) -> None:
    signal = read(written(tmp_path, "t,x\n0,1 # first\n\n% between\n   \n1,2\n2,4\n"), "2", "1")
    assert signal.values.tolist() == [1.0, 2.0, 4.0]


def test_a_number_of_thousands_of_digits_is_no_column(tmp_path: Path) -> None:
    path = written(tmp_path, "t,x\n0,1\n1,2\n2,4\n")
    with pytest.raises(UnreadableResultError, match=r"--column: there is no column 9{79}…; there are t, x"):
        read(path, "9" * 5000, "t")
    wavfile.write(tmp_path / "s.wav", 1000, np.zeros((10, 2), np.int16))
    with pytest.raises(UsageError, match="which channel is the signal"):
        read(tmp_path / "s.wav", "9" * 5000)
