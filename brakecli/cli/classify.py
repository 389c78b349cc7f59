"""`brakecli classify`."""

import dataclasses
import difflib
import math
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

from brakecli.cli.options import AsJson, Quiet, option, source_argument
from brakecli.cli.output import announce_compilation, progress, say, show_result, warn
from brakecli.errors import UnreadableResultError, UsageError

SOURCE = "Result of a run; with --quantity a measured signal, in a CSV file or in any HDF5 file (FILE.h5:/path)."
SECOND = "Where friction or roughness may keep a vibration up, run the case once more to decide."
THRESHOLD = option("Change a threshold of the rules; repeatable.", "NAME=VALUE", "--threshold")


def command(
    source: Annotated[str, source_argument("FILE", SOURCE)],
    quantity: Annotated[str | None, option("What was measured: displacement, velocity or force.")] = None,
    column: Annotated[str | None, option("Column of the signal, by name or number.")] = None,
    time_column: Annotated[str | None, option("Column of the time (s), by name or number.")] = None,
    sample_rate: Annotated[float | None, option("Samples per second.", "HZ")] = None,
    belt_speed: Annotated[float | None, option("Speed of the wheel's surface, if known.", "M/S")] = None,
    stiffness: Annotated[float | None, option("Stiffness behind a measured force, if known.", "N/M")] = None,
    thresholds: Annotated[list[str] | None, THRESHOLD] = None,
    second_run: Annotated[bool, option(SECOND, None, "--second-run")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Regime of a run or of a measured signal, with evidence."""
    reading: dict[str, Any] = {"column": column, "time_column": time_column, "sample_rate": sample_rate}
    machine: dict[str, Any] = {"belt_speed": belt_speed, "stiffness": stiffness}
    _check(quantity, {**reading, **machine})
    if second_run and quantity is not None:
        raise UsageError("--second-run: is for the result of a run, whose case can be run again; leave it out")
    announce_compilation(quiet or quantity is not None)
    from brakecli.cli.tables import verdict_table

    if quantity is None:
        from brakecli.analysis.regime.of_run import classify_result
        from brakecli.analysis.regime.verdict import Thresholds

        try:
            limits = changed(Thresholds, thresholds)
            numbers = _twice(source, limits, quiet) if second_run else classify_result(Path(source), limits)
        except UnreadableResultError as error:
            remedy = "for a measured signal, state with --quantity what was measured"
            raise UnreadableResultError(f"{error}; {remedy}") from error
    else:
        from brakecli.analysis.regime.of_signal import Measurand, SignalThresholds, classify_signal
        from brakecli.analysis.regime.signal_file import read_signal

        if quantity not in set(Measurand):
            raise UsageError(f"--quantity {quantity}: is not known; give one of {', '.join(Measurand)}")
        signal, machine["thresholds"] = read_signal(source, **reading), changed(SignalThresholds, thresholds)
        numbers = dataclasses.asdict(classify_signal(signal, quantity=Measurand(quantity), **machine))
    warn(*numbers.get("warnings", ()))
    shown = {"source": source, **numbers}
    show_result("classify", shown, verdict_table, source, numbers, as_json=as_json, quiet=quiet)


def _twice(source: str, limits: Any, quiet: bool) -> dict[str, Any]:
    """The verdict by a second run, whose cost is said before."""
    from brakecli.runs.second import classify_twice

    with progress(quiet) as show_progress:
        return classify_twice(Path(source), limits, lambda text: None if quiet else say(text), show_progress)


def _check(quantity: str | None, given: Mapping[str, Any]) -> None:
    """Raise UsageError for options of a measured signal where there is none, and for their wrong numbers."""
    for name, value in given.items():
        where = "--" + name.replace("_", "-")
        if value is not None and quantity is None:
            raise UsageError(f"{where}: is only for a measured signal; state with --quantity what was measured")
        if name == "stiffness" and value is not None and not 0.0 < value < math.inf:
            raise UsageError(f"{where} {value}: is not a positive number; give one in SI units")
        if name == "belt_speed" and value is not None and not math.isfinite(value):
            raise UsageError(f"{where} {value}: is not a number; give one in SI units")


def changed(thresholds: type[Any], changes: list[str] | None) -> Any:
    """Thresholds with the values of NAME=VALUE; raises UsageError for what is not one of them."""
    names = [field.name for field in dataclasses.fields(thresholds)]
    found: dict[str, float] = {}
    for change in changes or ():
        name, _, text = change.partition("=")
        if name not in names:
            nearest = difflib.get_close_matches(name, names, 1)
            remedy = f"did you mean {nearest[0]}?" if nearest else f"give one of {', '.join(names)}"
            raise UsageError(f"--threshold {change}: there is no threshold {name}; {remedy}")
        found[name] = math.nan
        with suppress(ValueError):
            found[name] = float(text)
        if not 0.0 <= found[name] < math.inf:
            raise UsageError(f"--threshold {change}: is not a number of at least 0; write {name}=NUMBER")
    return thresholds(**found)
