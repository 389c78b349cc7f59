"""The options of a measured signal, which several commands share."""

import inspect
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import wraps
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from brakecli.cli.options import option
from brakecli.errors import UsageError, printable

if TYPE_CHECKING:
    from brakecli.analysis.regime.of_signal import SignalLook
    from brakecli.analysis.regime.signal_table import SignalThresholds

WHAT = "What was measured: displacement, velocity, acceleration, force, torque or pressure (of .wav, if left out)."
UNIT = "Unit of the signal, as mm/s or g; SI, or that of the file, if left out."
TIME_UNIT = "Unit of the time column, as ms; that of the file, or s, if left out."
NUMBERS = ("sample_rate", "belt_speed", "stiffness")


@dataclass(frozen=True)
class Measured:
    """How a signal was measured, and on what."""

    quantity: Annotated[str | None, option(WHAT, "QUANTITY")] = None
    column: Annotated[str | None, option("Column of the signal, by name or number; channel of a .wav.")] = None
    time_column: Annotated[str | None, option("Column of the time, by name or number.")] = None
    sample_rate: Annotated[float | None, option("Samples per second.", "HZ")] = None
    unit: Annotated[str | None, option(UNIT)] = None
    time_unit: Annotated[str | None, option(TIME_UNIT)] = None
    belt_speed: Annotated[float | None, option("Speed of the wheel's surface, if known.", "M/S")] = None
    stiffness: Annotated[float | None, option("Stiffness behind a measured force, if known.", "N/M")] = None

    def quantity_of(self, source: str) -> str | None:
        """What was measured, None of a result; raises UsageError for options that do not go with it."""
        quantity = self.quantity or ("pressure" if Path(source).suffix.lower() in (".wav", ".wave") else None)
        for name, value in asdict(self).items():
            where = "--" + name.replace("_", "-")
            if value is not None and quantity is None:
                remedy = "state with --quantity what was measured"
                raise UsageError(f"{where}: is only for a measured signal; {remedy}")
            if name in NUMBERS and not isinstance(value, Real | None):
                raise UsageError(f"{where} {printable(str(value))}: is not a number; give one in SI units")
            if name in NUMBERS and _overflows(value):
                raise UsageError(f"{where}: is too large for a number; give one in SI units")
            if name == "stiffness" and value is not None and not 0.0 < value < math.inf:
                raise UsageError(f"{where} {value}: is not a positive number; give one in SI units")
            if name == "belt_speed" and value is not None and not math.isfinite(value):
                raise UsageError(f"{where} {value}: is not a number; give one in SI units")
        if self.stiffness is not None and quantity != "force":
            raise UsageError(f"--stiffness: is for a measured force, not for a {quantity}; leave it out")
        if self.belt_speed is not None and quantity == "pressure":
            raise UsageError("--belt-speed: a pressure does not show the speed of the shoe; leave it out")
        return quantity

    def look_at(self, source: str, thresholds: "SignalThresholds | None" = None) -> "SignalLook":
        """What the signal of a file shows."""
        from brakecli.analysis.regime.of_signal import Measurand, look
        from brakecli.analysis.regime.signal_file import read_signal
        from brakecli.analysis.regime.signal_table import SignalThresholds

        name, reading = self.quantity_of(source), asdict(self)
        if name not in set(Measurand):
            raise UsageError(
                f"--quantity {printable(str(name))}: is not known; give one of {', '.join(Measurand)}"
            )
        del reading["quantity"]
        machine = {key: reading.pop(key) for key in ("belt_speed", "stiffness")}
        signal = read_signal(source, Measurand(name), **reading)
        return look(signal, Measurand(name), **machine, thresholds=thresholds or SignalThresholds())


def _overflows(value: Real | None) -> bool:
    """Whether a number, as a whole number of Python's may, exceeds the largest that is computed with."""
    try:
        float(value or 0.0)
    except OverflowError:
        return True
    return False


UNMEASURED = Measured()


def with_measured(command: Callable[..., None]) -> Callable[..., None]:
    """A command with the options of `Measured` in the place of its parameter `measured`."""
    own, shared = inspect.signature(command).parameters, inspect.signature(Measured).parameters
    parameters = [each for name in own for each in (shared.values() if name == "measured" else [own[name]])]

    @wraps(command)
    def called(**options: Any) -> None:
        command(measured=Measured(**{name: options.pop(name) for name in shared}), **options)

    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return called
