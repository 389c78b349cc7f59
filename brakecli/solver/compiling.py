"""What a program says before it compiles its first kernel; only the standard library is imported here."""

from collections.abc import Callable

_notice: Callable[[str], object] | None = None
_trouble = ""


def set_notice(notice: Callable[[str], object] | None) -> None:
    """Have this process call `notice` before it compiles its first kernel; None: it compiles in silence.

    `notice` gets what keeps this process from using the cache, with the remedy; an empty text if nothing does.
    """
    global _notice
    _notice = notice


def set_trouble(text: str) -> None:
    """Remember what keeps this process from using the cache of compiled kernels."""
    global _trouble
    _trouble = text


def begins() -> None:
    """Call the notice once: a kernel is being compiled, as no cache holds it."""
    global _notice
    notice = _notice
    _notice = None
    if notice is not None:
        notice(_trouble)
