"""Who can write where compiled kernels lie can run code as the user: such a folder is not used."""

import grp
import os
import pwd
from pathlib import Path
from types import SimpleNamespace

import pytest

from brakecli.solver import cache_folder

ME = "somebody"


@pytest.fixture
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that the environment names, in one of the user's own."""
    tmp_path.chmod(0o700)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "caches"))
    return tmp_path / "caches"


def modes(base: Path) -> list[int]:
    return [path.stat().st_mode & 0o777 for path in (base, base / "brakecli", cache_folder.prepare())]


def test_folders_are_the_users_own_though_the_process_hides_no_permission(base: Path) -> None:
    before = os.umask(0)
    try:
        cache_folder.prepare()
    finally:
        os.umask(before)
    assert modes(base) == [0o700, 0o700, 0o700]


@pytest.mark.parametrize(
    ("shared", "mode", "used"),
    [
        ("caches", 0o777, False),
        ("caches", 0o1777, True),  # with the sticky bit others may add, but not swap
        ("caches/brakecli", 0o722, False),
        ("", 0o702, False),
        ("", 0o1702, True),
    ],
)
def test_a_folder_is_not_used_where_others_may_swap_one_above_it(
    base: Path, shared: str, mode: int, used: bool
) -> None:
    folder = cache_folder.prepare()
    (base.parent / shared).chmod(mode)
    if used:
        assert cache_folder.prepare() == folder
    else:
        with pytest.raises(PermissionError, match="others may write there") as refused:
            cache_folder.prepare()
        assert refused.value.filename == str(base.parent / shared)


def test_a_folder_of_another_user_is_not_used(base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    owner = cache_folder.prepare().stat().st_uid
    monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
    with pytest.raises(PermissionError):
        cache_folder.prepare()


def test_a_folder_behind_a_link_is_known_by_its_own_name(base: Path, tmp_path: Path) -> None:
    """Who swaps the link then swaps nothing."""
    (tmp_path / "real").mkdir(mode=0o700)
    base.symlink_to(tmp_path / "real")
    assert cache_folder.prepare().is_relative_to(tmp_path / "real")


@pytest.mark.parametrize(
    ("name", "members", "private"),
    [(ME, [], True), (ME, [ME], True), (ME, [ME, "another"], False), ("staff", [], False)],
)
def test_a_group_is_private_that_has_the_users_name_and_no_other_member(
    name: str, members: list[str], private: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pwd, "getpwuid", lambda number: SimpleNamespace(pw_name=ME, pw_gid=7))
    monkeypatch.setattr(grp, "getgrgid", lambda number: SimpleNamespace(gr_name=name, gr_mem=members))
    assert cache_folder.is_private(7) == private
    assert not cache_folder.is_private(8)
