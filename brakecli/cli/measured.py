"""The options of a measured signal, which several commands share."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from brakecli.cli.options import option
from brakecli.errors import UsageError

if TYPE_CHECKING:
    from brakecli.analysis.regime.of_signal import SignalLook
    from brakecli.analysis.regime.signal_rules import SignalThresholds

WHAT = "What was measured: displacement, velocity, force, acceleration or pressure (of a .wav, if left out)."
Quantity = Annotated[str | None, option(WHAT, "QUANTITY")]
Column = Annotated[str | None, option("Column of the signal, by name or number; channel of a .wav.")]
TimeColumn = Annotated[str | None, option("Column of the time, by name or number.")]
SampleRate = Annotated[float | None, option("Samples per second.", "HZ")]
Unit = Annotated[str | None, option("Unit of the signal, as mm/s or g; SI, or that of the file, if left out.")]
TimeUnit = Annotated[str | None, option("Unit of the time column, as ms; that of the file, or s, if left out.")]
BeltSpeed = Annotated[float | None, option("Speed of the wheel's surface, if known.", "M/S")]
Stiffness = Annotated[float | None, option("Stiffness behind a measured force, if known.", "N/M")]


def quantity_of(source: str, given: str | None) -> str | None:
    """What was measured; a sound file holds a pressure."""
    return given or ("pressure" if Path(source).suffix.lower() in (".wav", ".wave") else None)


def check(quantity: str | None, given: Mapping[str, Any]) -> None:
    """Raise UsageError for options of a measured signal where there is none, and for their wrong numbers."""
    for name, value in given.items():
        where = "--" + name.replace("_", "-")
        if value is not None and quantity is None:
            raise UsageError(f"{where}: is only for a measured signal; state with --quantity what was measured")
        if name == "stiffness" and value is not None and not 0.0 < value < math.inf:
            raise UsageError(f"{where} {value}: is not a positive number; give one in SI units")
        if name == "belt_speed" and value is not None and not math.isfinite(value):
            raise UsageError(f"{where} {value}: is not a number; give one in SI units")
    if given.get("stiffness") is not None and quantity != "force":
        raise UsageError(f"--stiffness: is for a measured force, not for a {quantity}; leave it out")
    if given.get("belt_speed") is not None and quantity == "pressure":
        raise UsageError("--belt-speed: a pressure does not show the speed of the shoe; leave it out")


def look_at(
    source: str,
    quantity: str,
    reading: Mapping[str, Any],
    machine: Mapping[str, Any],
    thresholds: "SignalThresholds | None" = None,
) -> "SignalLook":
    """What a measured signal shows; `reading` says how it was measured, `machine` on what."""
    from brakecli.analysis.regime.of_signal import Measurand, look
    from brakecli.analysis.regime.signal_file import read_signal
    from brakecli.analysis.regime.signal_rules import SignalThresholds

    if quantity not in set(Measurand):
        raise UsageError(f"--quantity {quantity}: is not known; give one of {', '.join(Measurand)}")
    signal = read_signal(source, Measurand(quantity), **reading)
    return look(signal, Measurand(quantity), **machine, thresholds=thresholds or SignalThresholds())
