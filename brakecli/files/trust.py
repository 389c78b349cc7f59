"""Which of the results that were read no digest vouches for: all that is made of them says so.

Only the standard library is imported here.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

MISSING, DIFFERS = "missing", "does not fit"
_SAID = {
    MISSING: "has no digest, as files that another program has saved; what it holds is unchecked",
    DIFFERS: "its digest does not fit: it is damaged or was altered; nothing that is made of it can be trusted",
}
_forced = False
_tell: Callable[[str], None] | None = None
_read: dict[str, str] = {}  # path and digest of the files for which none vouches


def begin(tell: Callable[[str], None], forced: bool = False) -> None:
    """Forget what was read, and have `tell` say what no digest vouches for."""
    global _tell
    _tell = tell
    _read.clear()
    force(forced)


def force(wanted: bool) -> bool:
    """Whether files whose digest does not fit are read all the same from now on."""
    global _forced
    _forced = wanted
    return wanted


def admits(path: Path, digest: str) -> bool:
    """Whether a file with such a digest may be read; it is remembered, and said once."""
    if digest == DIFFERS and not _forced:
        return False
    if digest and str(path) not in _read:
        _read[str(path)] = digest
        if _tell is not None:
            _tell(f"{path}: {_SAID[digest]}")
    return True


def noted() -> dict[str, Any]:
    """What `--json` and a file say of the files that were read; nothing where digests vouch for all of them."""
    found = next((digest for digest in (DIFFERS, MISSING) if digest in _read.values()), "")
    return {"digest": found} if found else {}


def mark() -> str:
    """What a picture or a page says where it is made of a file whose digest does not fit."""
    names = ", ".join(Path(path).name for path, digest in _read.items() if digest == DIFFERS)
    return f"read by force, the digest does not fit: {names}" if names else ""
