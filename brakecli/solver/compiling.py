"""What a program says before it compiles its first kernel; only the standard library is imported here."""

from collections.abc import Callable

_notice: Callable[[], None] | None = None


def set_notice(notice: Callable[[], None] | None) -> None:
    """Have this process call `notice` before it compiles its first kernel; None: it compiles in silence."""
    global _notice
    _notice = notice


def begins() -> None:
    """Call the notice once: a kernel is being compiled, as no cache holds it."""
    global _notice
    notice, _notice = _notice, None
    if notice is not None:
        notice()
