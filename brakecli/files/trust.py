"""Results that no digest vouches for. Everything that is made from them says so.

Only the standard library is imported here.
"""

from collections.abc import Callable
from threading import local

MISSING = "missing"
DIFFERS = "does not fit"
_SAID = {
    MISSING: "has no digest, as files that another program has saved; what it holds is unchecked",
    DIFFERS: "its digest does not fit: it is damaged or was altered; nothing that is made of it can be trusted",
}


class Readings(local):
    """The results that a command, or a call of a function, has read; each thread has its own.

    Outside of a command or a call nothing is remembered. Otherwise a later result of the same process would be
    marked because of another file.
    """

    def __init__(self) -> None:
        """Nothing was read, and nobody is told."""
        self.begin()

    def begin(self, tell: Callable[[str], object] | None = None, *, forced: bool = False) -> None:
        """Forget what was read; `tell` says from now on that a file is unchecked."""
        # forced: files whose digest does not fit are read all the same
        self.tell = tell
        self.forced = forced
        self.unchecked: dict[str, str] = {}  # path and digest of those for which none vouches

    def force(self, wanted: bool) -> bool:
        """Have files whose digest does not fit read from now on, if that is wanted."""
        self.forced = wanted
        return wanted

    def admit(self, path: str, digest: str) -> bool:
        """Whether a file with such a digest may be read; that it is unchecked is said once."""
        if self.tell and digest and self.unchecked.get(path) != digest and (self.forced or digest == MISSING):
            self.unchecked[path] = digest
            self.tell(f"{path}: {_SAID[digest]}")
        return self.forced or digest != DIFFERS

    def noted(self) -> dict[str, str]:
        """What `--json` and a file say of it; nothing where digests vouch for all that was read."""
        return {"digest": min(self.unchecked.values())} if self.unchecked else {}

    def mark(self) -> str:
        """What stands on a picture, or a page, that is made of a file whose digest does not fit."""
        return "read by force: a digest does not fit" if DIFFERS in self.unchecked.values() else ""


readings = Readings()
