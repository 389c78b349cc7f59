"""`brakecli classify`."""

import dataclasses
import difflib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from brakecli.cli.options import AsJson, Quiet, option, source_argument
from brakecli.cli.output import show_result, warn
from brakecli.cli.progress import announce_compilation
from brakecli.errors import UnreadableResultError, UsageError

SOURCE = "Result of a run; with --quantity a measured signal: CSV, or FILE.h5:/path in any HDF5 file."

_Options = Mapping[str, Any]


def command(
    source: Annotated[str, source_argument("FILE", SOURCE)],
    quantity: Annotated[str | None, option("What was measured: displacement, velocity or force.")] = None,
    column: Annotated[str | None, option("Column of the signal, by name or number.")] = None,
    time_column: Annotated[str | None, option("Column of the time (s), by name or number.")] = None,
    sample_rate: Annotated[float | None, option("Samples per second.", "HZ")] = None,
    belt_speed: Annotated[float | None, option("Speed of the wheel's surface, if known.", "M/S")] = None,
    stiffness: Annotated[float | None, option("Stiffness behind a measured force, if known.", "N/M")] = None,
    thresholds: Annotated[
        list[str] | None, option("Move a threshold of the rules; repeatable.", "NAME=VALUE", "--threshold")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Report the regime of the run in a result file, or of a measured signal, with the evidence."""
    reading = {"column": column, "time_column": time_column, "sample_rate": sample_rate}
    machine = {"belt_speed": belt_speed, "stiffness": stiffness}
    announce_compilation(quiet or quantity is not None)
    from brakecli.cli.tables import verdict_table

    if quantity is None:
        numbers = _classify_run(source, {**reading, **machine}, thresholds or ())
    else:
        numbers = _classify_signal(source, quantity, reading, machine, thresholds or ())
    warn(*numbers.get("warnings", ()))
    shown = {"source": source, **numbers}
    show_result("classify", shown, verdict_table, source, numbers, as_json=as_json, quiet=quiet)


def _classify_run(source: str, signal_options: _Options, changes: Sequence[str]) -> dict[str, Any]:
    """Names and values of the verdict on a result file; options of measured signals are refused."""
    from brakecli.analysis.regime.of_run import classify_result
    from brakecli.analysis.regime.rules import Thresholds

    for name, value in signal_options.items():
        if value is not None:
            option = "--" + name.replace("_", "-")
            raise UsageError(f"{option}: is for a measured signal; say with --quantity what was measured")
    thresholds = Thresholds(**_values(changes, Thresholds))
    try:
        return classify_result(Path(source), thresholds)
    except UnreadableResultError as error:
        raise UnreadableResultError(f"{error}; for a measured signal say with --quantity what it is") from error


def _classify_signal(
    source: str, quantity: str, reading: _Options, machine: _Options, changes: Sequence[str]
) -> dict[str, Any]:
    """Names and values of the verdict on a measured signal; `machine` holds what is known of the machine."""
    from brakecli.analysis.regime.of_signal import Measurand, SignalThresholds, classify_signal
    from brakecli.analysis.regime.signal_file import read_signal

    if quantity not in set(Measurand):
        raise UsageError(f"--quantity {quantity}: is not known; give one of {', '.join(Measurand)}")
    for name, value in machine.items():
        if value is not None and not (math.isfinite(value) and (value > 0.0 or name == "belt_speed")):
            raise UsageError(f"--{name.replace('_', '-')} {value}: is not a positive number; give one in SI units")
    signal = read_signal(source, **reading)
    thresholds = SignalThresholds(**_values(changes, SignalThresholds))
    verdict = classify_signal(signal, quantity=Measurand(quantity), thresholds=thresholds, **machine)
    return dataclasses.asdict(verdict)


def _values(changes: Sequence[str], thresholds: type[Any]) -> dict[str, float]:
    """The names and values of NAME=VALUE; raises UsageError for what is not one of these thresholds."""
    names = [field.name for field in dataclasses.fields(thresholds)]
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
    return found
