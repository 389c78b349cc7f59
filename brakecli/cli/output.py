"""Results go to standard output, everything else to standard error."""

import json
import sys
from collections.abc import Callable, Mapping
from typing import Any


def show(text: str) -> None:
    """Print a result on standard output."""
    print(text, flush=True)  # noqa: T201


def show_json(value: Mapping[str, Any], indent: int | None = None) -> None:
    """Print a result as JSON, in ASCII if standard output is not UTF-8."""
    ascii_only = (sys.stdout.encoding or "").lower().replace("-", "") != "utf8"
    show(json.dumps(value, allow_nan=False, ensure_ascii=ascii_only, indent=indent))


def show_result(
    command: str, numbers: Mapping[str, Any], table: Callable[..., str], *found: Any, as_json: bool, quiet: bool
) -> None:
    """Print what a command has found: its numbers as JSON, or the table of what was found, or nothing."""
    if as_json:
        show_json({"command": command, **numbers})
    elif not quiet:
        show(table(*found))


def say(*lines: str) -> None:
    """Print lines on standard error."""
    for line in lines:
        print(f"brakecli: {line}", file=sys.stderr, flush=True)  # noqa: T201


def warn(*warnings: str) -> None:
    """Print warnings on standard error."""
    say(*(f"warning: {warning}" for warning in warnings))
