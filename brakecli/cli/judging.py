"""What `brakecli classify` does: a stored run or a measured signal in, names and values of the verdict out."""

import dataclasses
import difflib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from brakecli.analysis.regime import of_signal, rules
from brakecli.analysis.regime.signal_file import read_signal
from brakecli.errors import UnreadableResultError, UsageError

_Thresholds = TypeVar("_Thresholds", rules.Thresholds, of_signal.SignalThresholds)


def judge(
    source: str,
    quantity: str | None,
    reading: Mapping[str, Any],
    known: Mapping[str, float | None],
    thresholds: Sequence[str],
) -> dict[str, Any]:
    """Verdict on `source`: a measured signal if its `quantity` is given, else a result file.

    `reading` says how a signal is read, `known` what is known of the machine. Raises UsageError for options that
    do not fit, UnreadableResultError for a file that does not.
    """
    if quantity is None:
        given = [name for name, value in {**reading, **known}.items() if value is not None]
        if given:
            option = "--" + given[0].replace("_", "-")
            raise UsageError(f"{option}: is for a measured signal; say with --quantity what was measured")
        from brakecli.analysis.regime.of_run import classify_result

        limits = _moved(rules.Thresholds(), thresholds)
        try:
            return classify_result(Path(source), limits)
        except UnreadableResultError as error:
            raise UnreadableResultError(
                f"{error}; for a measured signal say with --quantity what it is"
            ) from error
    try:
        kind = of_signal.Measurand(quantity)
    except ValueError as error:
        names = ", ".join(of_signal.Measurand)
        raise UsageError(f"--quantity {quantity}: is not known; give one of {names}") from error
    for name, value in {**known, "sample_rate": reading["sample_rate"]}.items():
        if value is not None and not (math.isfinite(value) and (value > 0.0 or name == "belt_speed")):
            raise UsageError(f"--{name.replace('_', '-')} {value}: is not a positive number; give one in SI units")
    signal = read_signal(source, **reading)
    lines = _moved(of_signal.SignalThresholds(), thresholds)
    verdict = of_signal.classify_signal(signal, quantity=kind, thresholds=lines, **known)
    numbers = dataclasses.asdict(verdict)
    return {**numbers, "regime": str(verdict.regime), "excitation": str(verdict.excitation)}


def _moved(limits: _Thresholds, changes: Sequence[str]) -> _Thresholds:
    """Thresholds with NAME=VALUE applied."""
    names = [field.name for field in dataclasses.fields(limits)]
    found: dict[str, float] = {}
    for change in changes:
        name, _, text = change.partition("=")
        if name not in names:
            nearest = difflib.get_close_matches(name, names, 1)
            remedy = f"did you mean {nearest[0]}?" if nearest else f"give one of {', '.join(names)}"
            raise UsageError(f"--threshold {change}: there is no threshold {name}; {remedy}")
        try:
            found[name] = float(text)
        except ValueError:
            found[name] = math.nan
        if not (math.isfinite(found[name]) and found[name] >= 0.0):
            raise UsageError(f"--threshold {change}: is not a number from 0 on; write {name}=NUMBER")
    return dataclasses.replace(limits, **found)
