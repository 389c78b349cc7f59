"""The two faces of the package: what messages name options, arguments and commands in the shell and in Python."""

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from brakecli.errors import UsageError

_PYTHON: ContextVar[bool] = ContextVar("python", default=False)
_SHORT = {"output": "-o"}
_ARGUMENTS = {"force": "force=True", "set": "setting", "threshold": "thresholds"}


@contextmanager
def in_python() -> Iterator[None]:
    """Let messages name functions and their arguments."""
    token = _PYTHON.set(True)
    try:
        yield
    except RecursionError:
        raise UsageError("a value lies too deep in others, or in itself; give numbers, texts and lists") from None
    finally:
        _PYTHON.reset(token)


def argument(name: str) -> str:
    """What a user writes to give an option of this name: `--sample-rate` in the shell, `sample_rate` in Python."""
    if _PYTHON.get():
        return _ARGUMENTS.get(name, name.replace("-", "_"))
    return _SHORT.get(name, f"--{name}")


def command(name: str, path: str | Path) -> str:
    """What a user writes to compute with a file: `brakecli run FILE` in the shell, `brakecli.run` in Python."""
    return f"brakecli.{name}" if _PYTHON.get() else f"brakecli {name} {as_argument(path)}"


def as_argument(path: str | Path) -> str:
    """A path as the shell takes it, and as no command takes it for an option."""
    text = str(path)
    return shlex.quote(f"./{text}" if text.startswith("-") and text != "-" else text)
