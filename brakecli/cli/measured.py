"""The options of a measured signal, which several commands share."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

from brakecli.cli.options import option
from brakecli.front.measured import Measured

WHAT = "What was measured: displacement, velocity, acceleration, force, torque or pressure (of .wav, if left out)."
UNIT = "Unit of the signal, as mm/s or g; SI, or that of the file, if left out."
TIME_UNIT = "Unit of the time column, as ms; that of the file, or s, if left out."
OPTIONS = {
    "quantity": option(WHAT, "QUANTITY"),
    "column": option("Column of the signal, by name or number; channel of a .wav."),
    "time_column": option("Column of the time, by name or number."),
    "sample_rate": option("Samples per second.", "HZ"),
    "unit": option(UNIT),
    "time_unit": option(TIME_UNIT),
    "belt_speed": option("Speed of the wheel's surface, if known.", "M/S"),
    "stiffness": option("Stiffness behind a measured force, if known.", "N/M"),
}
UNMEASURED = Measured()


def with_measured(command: Callable[..., None]) -> Callable[..., None]:
    """A command with the options of `Measured` in the place of its parameter `measured`."""
    own = inspect.signature(command).parameters
    shared = {
        name: parameter.replace(annotation=Annotated[parameter.annotation, OPTIONS[name]])
        for name, parameter in inspect.signature(Measured).parameters.items()
    }
    parameters = [each for name in own for each in (shared.values() if name == "measured" else [own[name]])]

    @wraps(command)
    def called(**options: Any) -> None:
        command(measured=Measured(**{name: options.pop(name) for name in shared}), **options)

    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return called
