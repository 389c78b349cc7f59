"""Finished points are taken up by the same sweep alone, as far as they are whole."""

import os
import pickle
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.api.inputs import load_sweep
from brakecli.case import profile
from brakecli.case.records import Record
from brakecli.errors import BrakecliError, CannotWriteError, RefusedError
from brakecli.solver.cache_folder import source_hash
from brakecli.studies.sweeps.driver import sweep
from brakecli.studies.sweeps.journal import open_journal
from brakecli.studies.sweeps.plan import Plan
from brakecli.studies.sweeps.record import record_type
from brakecli.studies.sweeps.workers.task import Finished, NextTask, compute_units, fingerprint
from tests.campaign import campaign
from tests.commands import ROOT, TINY, brakecli, left_in
from tests.studies.sweeps.helpers import Inline, axis, frictions, inline, interrupted, quick, write_sweep

pytestmark = pytest.mark.usefixtures("compiled")


def edited(path: Path, old: str, new: str) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        text = (folder / path).read_bytes()
        assert text.count(old.encode()) == 1
        (folder / path).write_bytes(text.replace(old.encode(), new.encode()))

    return edit


@pytest.mark.parametrize(
    ("edit", "difference"),
    [
        (edited(Path("tiny.toml"), "mass = 10.0", "mass = 11.0"), "shoe.mass was 10.0, is 11.0"),
        pytest.param(
            edited(Path("tiny.toml"), "damping = 300.0, ", ""),
            "link2.damping was 300.0, is not set",
            marks=campaign,
        ),
        (edited(Path("s.toml"), "num = 20", "num = 21"), "sweep axis[0].num was 20, is 21"),
        (
            edited(Path("s.h5.partial"), '"brakecli_version": "', '"brakecli_version": "7'),
            "brakecli_version was 7",
        ),
        pytest.param(
            edited(Path("s.h5.partial"), '"brakecli_sources": "', '"brakecli_sources": "7'),
            "brakecli_sources was 7",
            marks=campaign,
        ),
        pytest.param(
            edited(Path("s.h5.partial"), '"numpy_version": "', '"numpy_version": "7'),
            "numpy_version was 7",
            marks=campaign,
        ),
        (
            edited(Path("s.h5.partial"), '{"brakecli_version', '[{"brakecli_version'),
            "holds no finished points, or its first line is damaged",
        ),
    ],
    ids=["case", "default", "sweep", "version", "sources", "library", "foreign"],
)
def test_finished_points_of_another_sweep_are_refused_and_the_key_named(
    tmp_path: Path, edit: Callable[[Path], None], difference: str
) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    interrupted(loaded, tmp_path / "s.h5", compute_units, limit=4, task_size=3)
    assert left_in(tmp_path) == {"tiny.toml", "s.toml", "s.h5.partial"}
    edit(tmp_path)
    before = (tmp_path / "s.h5.partial").read_bytes()
    with pytest.raises(RefusedError, match=r"s\.h5\.partial: holds .* start again with --force") as refused:
        inline(load_sweep(str(tmp_path / "s.toml"), None), tmp_path / "s.h5", compute_units)
    assert refused.value.exit_code == 3
    assert difference in str(refused.value)
    assert (tmp_path / "s.h5.partial").read_bytes() == before
    assert left_in(tmp_path) == {"tiny.toml", "s.toml", "s.h5.partial"}
    assert (
        inline(load_sweep(str(tmp_path / "s.toml"), None), tmp_path / "s.h5", compute_units, force=True).resumed
        == 0
    )
    assert left_in(tmp_path) == {"tiny.toml", "s.toml", "s.h5"}


def test_a_long_list_that_has_changed_is_told_by_its_beginning(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, axis("shoe.mass", f"values = {[*range(5, 35)]}"))
    interrupted(loaded, tmp_path / "s.h5", compute_units, limit=4, task_size=3)
    other = write_sweep(tmp_path, axis("shoe.mass", "values = [5, 6]"))
    with pytest.raises(RefusedError, match=r"was \[5, 6, 7, 8, 9, …\], is \[5, 6\]; undo"):
        inline(other, tmp_path / "s.h5", compute_units)


def test_a_journal_of_the_same_sweep_is_taken_up(tmp_path: Path) -> None:
    """The control of the refusals above: without a change the very same journal is used."""
    loaded = write_sweep(tmp_path, frictions(20))
    interrupted(loaded, tmp_path / "s.h5", compute_units, limit=4, task_size=3)
    done = brakecli("sweep", "s.toml", "--json", cwd=tmp_path)
    assert done.told(0).endswith("; 12 of them are there already\n")
    assert done.json["resumed_points"] == 12


@pytest.mark.parametrize("cut", [1, 5, 50])
def test_a_journal_that_ends_within_a_block_loses_that_block_alone(tmp_path: Path, cut: int) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    interrupted(loaded, tmp_path / "s.h5", limit=4, task_size=1)
    path = tmp_path / "s.h5.partial"
    path.write_bytes(path.read_bytes()[:-cut])
    assert inline(loaded, tmp_path / "s.h5").resumed == 3


def test_a_block_that_is_there_twice_counts_once(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    inline(loaded, tmp_path / "expected.h5")
    interrupted(loaded, tmp_path / "s.h5", limit=4, task_size=1)
    path = tmp_path / "s.h5.partial"
    header, blocks = path.read_bytes().split(b"\n", 1)
    path.write_bytes(header + b"\n" + blocks + blocks)
    result = inline(loaded, tmp_path / "s.h5")
    assert result.resumed == 4
    assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "expected.h5").read_bytes()


def forged(name: str, value: Any) -> Callable[[bytes, np.dtype[Any]], bytes]:
    def forge(records: bytes, kind: np.dtype[Any]) -> bytes:
        found = np.frombuffer(records, kind).copy()
        found[name] = value
        return found.tobytes()

    return forge


@pytest.mark.parametrize(
    "forge",
    [
        forged("status", b"relaxati"),
        forged("regime", b"nonsense"),
        forged("amplitude", np.inf),
        forged("frequency", 1e308),
        forged("steps", -1),
        forged("reason", b"\xff\xfe"),
        lambda records, kind: records[:-1],
        lambda records, kind: records[: -kind.itemsize],
        lambda records, kind: records + records,
        lambda records, kind: b"",
    ],
    ids=["status", "regime", "infinite", "too large", "negative", "not UTF-8", "cut", "fewer", "more", "none"],
)
@pytest.mark.parametrize("by", ["a journal", pytest.param("a worker", marks=campaign)])
def test_a_block_that_holds_something_else_is_computed_again(
    tmp_path: Path, forge: Callable[[bytes, np.dtype[Any]], bytes], by: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its checksum is right: somebody has made it."""
    loaded = write_sweep(tmp_path, frictions(4))
    tried = set[int]()
    inline(loaded, tmp_path / "expected.h5")

    def wrong_once(plan: Plan, first: int, count: int) -> bytes:
        wrong = first not in tried
        tried.update(range(first, first + count))
        return forge(quick(plan, first, count), record_type(plan)) if wrong else quick(plan, first, count)

    if by == "a worker":
        assert len(inline(loaded, tmp_path / "s.h5", wrong_once, task_size=2).notes) == 1
        assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "expected.h5").read_bytes()
        return
    with open_journal(tmp_path / "s.h5.partial", loaded.plan, force=False) as journal:
        pack = zlib.compress
        monkeypatch.setattr(zlib, "compress", lambda records, level: pack(forge(records, journal.kind), level))
        journal.add(0, compute_units(loaded.plan, 0, 2))
        monkeypatch.undo()
    assert inline(loaded, tmp_path / "s.h5").resumed == 0
    assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "expected.h5").read_bytes()


PROFILE = "place [mm],height [um]\n" + "".join(f"{5 * n},{n % 7}\n" for n in range(41))


@pytest.mark.parametrize("changed", ["a/p.csv", "b/p.csv", "b/q.csv"])
def test_points_of_profiles_that_were_measured_anew_are_refused(
    tmp_path: Path, changed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a/p.csv", "b/p.csv", "b/q.csv"):
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(PROFILE)
    surfaces = "\n[roughness]\nwheel.profile = 'a/p.csv'\nshoe.profile = 'b/p.csv'\n"
    tables = axis("roughness.wheel.profile", "values = ['a/p.csv', 'b/q.csv']"), frictions(2)
    loaded = write_sweep(Path(), *tables, case=TINY + surfaces)
    interrupted(loaded, Path("s.h5"), limit=2, task_size=1)
    Path(changed).write_text(PROFILE.replace("5,1", "5,1.1"))
    with pytest.raises(RefusedError, match=f"checksum of {Path(changed).name} was "):
        inline(load_sweep("s.toml", None), Path("s.h5"))
    assert inline(loaded, Path("s.h5")).resumed == 2  # what was read before goes on as it was


def test_a_profile_that_changes_or_goes_while_a_sweep_runs_changes_no_point(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also in workers whose working directory is another one."""
    monkeypatch.chdir(tmp_path)
    for name in ("p.csv", "q.csv"):
        Path(name).write_text(PROFILE)
    surface = "\n[roughness]\nwheel.profile = 'p.csv'\n"
    profiles = axis("roughness.wheel.profile", "values = ['p.csv', 'q.csv']")
    radii = "values = [0.5, 0.6]"
    loaded = write_sweep(Path(), profiles, axis("wheel.radius", radii), case=TINY + surface)
    inline(loaded, tmp_path / "whole.h5", compute_units)

    def careless(plan: Plan, first: int, count: int) -> bytes:
        records = compute_units(pickle.loads(pickle.dumps(plan)), first, count)
        Path("p.csv").write_text(PROFILE.replace("5,1", "5,1.1"))
        Path("q.csv").unlink(missing_ok=True)
        monkeypatch.chdir("/")
        return records

    inline(loaded, tmp_path / "edited.h5", careless, task_size=1)
    assert (tmp_path / "edited.h5").read_bytes() == (tmp_path / "whole.h5").read_bytes()


def test_all_names_of_a_profile_have_one_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its file may be replaced while a sweep begins."""
    monkeypatch.chdir(tmp_path)
    Path("p.csv").write_text(PROFILE)
    Path("link.csv").symlink_to("p.csv")
    read = profile.read

    def replaced(path: Path) -> Record:
        found = read(path)
        Path("p.csv").write_text(PROFILE.replace("5,1", "5,1.1"))
        return found

    monkeypatch.setattr(profile, "read", replaced)
    names = ["p.csv", "./p.csv", "link.csv", str(tmp_path / "p.csv"), f"../{tmp_path.name}/link.csv"]
    loaded = write_sweep(Path(), axis("roughness.wheel.profile", f"values = {names}"))
    assert len({*loaded.plan.records.values()}) == 1


def test_a_sweep_goes_on_in_a_folder_that_was_moved_and_behind_a_new_link(tmp_path: Path) -> None:
    before = tmp_path / "before"
    after = tmp_path / "after"
    before.mkdir()
    (before / "p.csv").write_text(PROFILE)
    surface = "\n[roughness]\nwheel.profile = 'p.csv'\n"
    radii = axis("wheel.radius", "values = [0.5, 0.6, 0.7]")
    interrupted(write_sweep(before, radii, case=TINY + surface), before / "s.h5", limit=2, task_size=1)
    before.rename(after)
    (after / "p.csv").rename(after / "real.csv")
    (after / "p.csv").symlink_to("real.csv")
    assert inline(load_sweep(str(after / "s.toml"), None), after / "s.h5").resumed == 2


def test_every_bit_of_the_place_of_a_block_is_part_of_its_checksum(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    interrupted(loaded, tmp_path / "s.h5", limit=4, task_size=1)
    path = tmp_path / "s.h5.partial"
    whole = path.read_bytes()
    for bit in range(16 * 8):
        data = bytearray(whole)
        data[whole.index(b"\n") + 1 + bit // 8] ^= 1 << bit % 8
        path.write_bytes(data)
        with open_journal(path, loaded.plan, force=False) as journal:
            assert journal.done == 0


def test_a_change_of_any_source_is_a_change_of_the_sweep(tmp_path: Path) -> None:
    assert fingerprint()["brakecli_sources"] == source_hash(ROOT / "brakecli")
    (tmp_path / "rules.py").write_text("LIMIT = 1\n")
    before = source_hash(tmp_path)
    (tmp_path / "rules.py").write_text("LIMIT = 2\n")
    assert source_hash(tmp_path) != before


@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize("kind", ["text", "binary", "pipe", "link"])
def test_what_is_no_journal_is_named_and_left_alone(tmp_path: Path, kind: str, force: bool) -> None:
    loaded = write_sweep(tmp_path, frictions(2))
    place = tmp_path / "s.h5.partial"
    (tmp_path / "precious").write_bytes(b"kept\n")
    make: dict[str, Callable[[], object]] = {
        "text": lambda: place.write_bytes(b"kept\n"),
        "binary": lambda: place.write_bytes(b"\xff" * 1000),
        "pipe": lambda: os.mkfifo(place),
        "link": lambda: place.symlink_to(tmp_path / "precious"),
    }
    make[kind]()
    before = place.lstat()
    with pytest.raises((RefusedError, CannotWriteError), match=r"s\.h5\.partial: "):
        inline(loaded, tmp_path / "s.h5", compute_units, force=force)
    assert (place.lstat().st_mode, place.lstat().st_size) == (before.st_mode, before.st_size)
    assert (tmp_path / "precious").read_bytes() == b"kept\n"


def test_nothing_is_written_while_a_point_is_missing(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, frictions(6))

    class Forgetful(Inline):
        """An engine that loses its second task."""

        def run(self, next_task: NextTask) -> Iterator[Finished]:
            for number, finished in enumerate(super().run(next_task)):
                if number != 1:
                    yield finished

    with pytest.raises(BrakecliError, match=r"s\.h5: 2 of 6 points or lines are missing; run the same"):
        sweep(loaded, tmp_path / "s.h5", Forgetful(loaded.plan, quick), force=False, task_size=2)
    assert left_in(tmp_path) == {"tiny.toml", "s.toml", "s.h5.partial"}
    assert inline(loaded, tmp_path / "s.h5").resumed == 4


@pytest.mark.parametrize("kept", [None, -5], ids=["not packed", "without its end"])
def test_a_block_that_cannot_be_unpacked_is_computed_again(
    tmp_path: Path, kept: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded = write_sweep(tmp_path, frictions(4))
    pack = zlib.compress
    with open_journal(tmp_path / "s.h5.partial", loaded.plan, force=False) as journal:
        monkeypatch.setattr(zlib, "compress", lambda data, level: pack(data, level)[:kept] if kept else data)
        journal.add(0, compute_units(loaded.plan, 0, 2))
        monkeypatch.undo()
    assert inline(loaded, tmp_path / "s.h5").resumed == 0
