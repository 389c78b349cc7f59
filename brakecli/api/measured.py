"""How a signal was measured: what options of `classify` and `plot` say of it."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brakecli.api.records import Classify, Plot, Signal
from brakecli.api.values import plain, text_of
from brakecli.errors import OtherKindError, UnreadableResultError, UsageError, printable
from brakecli.faces import argument
from brakecli.results.opening import is_hdf5

if TYPE_CHECKING:
    from brakecli.analysis.signals.look import SignalLook
    from brakecli.analysis.signals.table import SignalThresholds

NUMBERS = ("sample_rate", "belt_speed", "stiffness")
OF_MACHINE = ("belt_speed", "stiffness")


@contextmanager
def perhaps_a_signal(source: str) -> Iterator[None]:
    """Say of a file that is no result how a measured signal is named."""
    try:
        yield
    except OtherKindError:
        raise
    except UnreadableResultError as error:
        remedy = f"for a measured signal, state with {argument('quantity')} what was measured"
        problem, _, otherwise = str(error).rpartition("; ")
        if is_hdf5(Path(source)) or not problem:
            raise UnreadableResultError(f"{error}; {remedy}") from error
        raise UnreadableResultError(f"{problem}; {remedy}; or {otherwise}") from error


def quantity_of(options: Classify | Plot, source: str) -> str | None:
    """What was measured, None of a result; raises UsageError for options that do not go with it."""
    stated = text_of(options.quantity, "quantity") or None
    quantity = stated or ("pressure" if Path(source).suffix.lower() in (".wav", ".wave") else None)
    for name, value in _stated(options).items():
        where = argument(name.replace("_", "-"))
        if value is not None and quantity is None:
            remedy = f"state with {argument('quantity')} what was measured"
            raise UsageError(f"{where}: is only for a measured signal; {remedy}")
        if name in NUMBERS and not isinstance(value, Real | None):
            raise UsageError(f"{where} {printable(str(value))}: is not a number; give one in SI units")
        if name in NUMBERS and _overflows(value):
            raise UsageError(f"{where}: is too large for a number; give one in SI units")
        if name == "stiffness" and value is not None and not 0.0 < value < math.inf:
            raise UsageError(f"{where} {value}: is not a positive number; give one in SI units")
        if name == "belt_speed" and value is not None and not math.isfinite(value):
            raise UsageError(f"{where} {value}: is not a number; give one in SI units")
    if options.stiffness is not None and quantity != "force":
        raise UsageError(f"{argument('stiffness')}: is for a measured force, not for a {quantity}; leave it out")
    if options.belt_speed is not None and quantity == "pressure":
        raise UsageError(f"{argument('belt-speed')}: a pressure does not show the speed of the shoe; leave it out")
    return quantity


def look_at(options: Classify | Plot, source: str, thresholds: "SignalThresholds | None" = None) -> "SignalLook":
    """What the signal of a file shows."""
    from brakecli.analysis.signals.look import Measurand, look
    from brakecli.analysis.signals.read import read_signal
    from brakecli.analysis.signals.table import SignalThresholds

    name = quantity_of(options, source)
    if name not in set(Measurand):
        raise UsageError(
            f"{argument('quantity')} {printable(str(name))}: is not known; give one of {', '.join(Measurand)}"
        )
    reading = _stated(options)
    machine = {key: reading.pop(key) for key in OF_MACHINE}
    signal = read_signal(source, Measurand(name), **reading)
    if signal.relative and machine["belt_speed"] is not None:
        what = "a sound file without a unit is relative, so that no speed can be compared with it"
        raise UsageError(f"{source}: {what}; give {argument('unit')}, or leave out {argument('belt-speed')}")
    return look(signal, Measurand(name), **machine, thresholds=thresholds or SignalThresholds())


def _stated(options: Signal) -> dict[str, Any]:
    """What is said of the signal; a column may be named by its number."""
    stated = {}
    for field in fields(Signal):
        value = getattr(options, field.name)
        if value is not None and field.name not in NUMBERS:
            value = plain(value, field.name)
            value = str(value) if isinstance(value, int) else text_of(value, field.name)
        stated[field.name] = value
    return stated


def _overflows(value: Real | None) -> bool:
    """Whether a number, as a whole number of Python's may, exceeds the largest that is computed with."""
    try:
        float(value or 0.0)
    except OverflowError:
        return True
    return False
