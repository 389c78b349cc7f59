"""What a picture of a run shows, in SI units, gathered from its result.

It is read in pieces: a run of 10^8 samples takes no more memory than a short one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.case.case import Case
from brakecli.case.read import parse_case
from brakecli.errors import CaseError, UnreadableResultError
from brakecli.files.read import StoredResult
from brakecli.solver.quantities import ContactState

Array = NDArray[np.float64]
Reader = Callable[[str, int, int], NDArray[Any]]
"""The samples start … stop - 1 of a variable of the history."""

CYCLES = 12
MOST_DETAIL = 100_000
"""Samples drawn one by one, at most."""
FEW = 4000
"""Samples of the detail where no frequency tells how long a cycle is."""
COLUMNS = 1200
"""Columns of the envelope: about the width of its panel in pixels."""
BLOCK = 1 << 20
"""Samples read at a time."""


@dataclass(frozen=True)
class Detail:
    """The part of the history that is drawn sample by sample; `belt` is U (m/s)."""

    name: str
    time: Array
    x: Array
    vx: Array
    state: NDArray[Any]
    belt: Array
    interval: float


@dataclass(frozen=True)
class Picture:
    """Everything that is drawn, in SI units."""

    title: str
    summary: str
    detail: Detail
    span: tuple[float, float]  # s, of the whole run
    time: Array  # of the envelope's columns
    lowest: Array
    highest: Array
    frequency: Array
    density: Array
    spectrum_from: float  # s
    fundamental: float | None  # Hz
    peak: float | None  # Hz
    passing: tuple[float, ...]  # Hz


def gather(result: StoredResult) -> Picture:
    """Read from a result what its picture shows; raises UnreadableResultError where it is not there."""
    variables = result.variables("history")
    needed = ("time", "x", "vx", "state")
    shapes = {variables[name].shape for name in needed if name in variables}
    if not variables.keys() >= set(needed) or len(shapes) != 1 or not (samples := max(shapes)[0]):
        raise _unreadable(result, f"its history has no {', '.join(needed)} of equal length above 0")

    def read(name: str, start: int, stop: int) -> NDArray[Any]:
        return result.read("history", name, start, stop)

    case = _case(result)
    start, end = (float(read("time", i, i + 1)[0]) for i in (0, samples - 1))
    interval = (end - start) / (samples - 1) if samples > 1 else case.output.sample_interval
    fundamental, peak = _number(result, "frequency"), _number(result, "spectrum_peak")
    places, lowest, highest = envelope(lambda first, last: read("x", first, last), samples)
    first_sample = result.group_attributes("spectrum").get("first_sample", 0)
    return Picture(
        title=case.title or "Case without a title",
        summary=_summary(result),
        detail=_detail(read, samples, interval, case, result),
        span=(start, end),
        time=start + interval * places,
        lowest=lowest,
        highest=highest,
        frequency=result.read("spectrum", "frequency"),
        density=result.read("spectrum", "vx"),
        spectrum_from=start + interval * float(first_sample),
        fundamental=fundamental,
        peak=peak,
        passing=_passing(case),
    )


def envelope(
    read: Callable[[int, int], Array], samples: int, columns: int = COLUMNS
) -> tuple[Array, Array, Array]:
    """Middle (in samples) of each column, least and greatest value of the samples that fall into it.

    Columns are equally wide; there are never more of them than samples. At most `BLOCK` samples are read at once.
    """
    columns = min(columns, samples)
    lowest: Array = np.full(columns, np.inf)
    highest: Array = np.full(columns, -np.inf)
    for begin in range(0, samples, BLOCK):
        values = read(begin, min(begin + BLOCK, samples))
        column = np.arange(begin, begin + len(values)) * columns // samples
        np.minimum.at(lowest, column, values)
        np.maximum.at(highest, column, values)
    firsts = -(-np.arange(columns + 1) * samples // columns)
    middles: Array = 0.5 * (firsts[:-1] + firsts[1:] - 1).astype(np.float64)
    return middles, lowest, highest


def episodes(state: NDArray[Any], wanted: ContactState) -> list[tuple[int, int]]:
    """First and last sample of every unbroken stretch of a state."""
    inside = np.concatenate([[False], state == wanted, [False]])
    edges = np.flatnonzero(inside[1:] != inside[:-1])
    return [(int(first), int(behind) - 1) for first, behind in edges.reshape(-1, 2)]


def _detail(read: Reader, samples: int, interval: float, case: Case, result: StoredResult) -> Detail:
    """The last cycles of the run, or of the motion where it has come to rest."""
    fundamental = _number(result, "frequency")
    frequency = fundamental or _number(result, "spectrum_peak")
    wanted = CYCLES / (frequency * interval) if frequency else FEW
    length = min(samples, MOST_DETAIL, max(2, round(min(wanted, MOST_DETAIL))))
    stop, name = samples, "End of the run" if length < samples else "Whole run"
    if fundamental:
        name = "Settled motion"
    elif result.attributes.get("status") == "failed":
        name = "Motion up to the failure"
    elif (rest := _last_motion(read, samples) + length // 8 + 1) < samples:
        stop, name = rest, "Last motion, then stick"
    first = max(0, stop - length)
    time, x, vx, state = (read(variable, first, stop) for variable in ("time", "x", "vx", "state"))
    return Detail(name, time, x, vx, state, _belt(case, time), interval)


def _last_motion(read: Reader, samples: int) -> int:
    """Samples up to the last one that does not stick, searched from the end."""
    for stop in range(samples, 0, -BLOCK):
        begin = max(0, stop - BLOCK)
        moving = np.flatnonzero(read("state", begin, stop) != ContactState.STICK)
        if moving.size:
            return begin + int(moving[-1]) + 1
    return 0


def _belt(case: Case, time: Array) -> Array:
    """U (m/s) at some times."""
    wheel = case.wheel
    speeds: Any = wheel.angular_speeds or (wheel.angular_speed or 0.0,)
    speed: Array = wheel.radius * np.interp(time, wheel.times or (0.0,), speeds)
    return speed


def _passing(case: Case) -> tuple[float, ...]:
    """Frequencies (Hz) at which the waves of the wheel pass; none where its speed changes."""
    wheel, profile = case.wheel, case.roughness.wheel
    if profile is None or (wheel.angular_speeds and len(set(wheel.angular_speeds)) > 1):
        return ()
    speed = abs(float(_belt(case, np.zeros(1))[0]))
    waves = [1.0 / length for length in profile.wavelengths or ()]
    waves += [number / (2.0 * np.pi) for number in profile.wavenumbers or ()]
    return tuple(sorted(speed * wave for wave in waves if speed > 0.0))


def _summary(result: StoredResult) -> str:
    """Regime, excitation and numbers in one line."""
    attributes = result.attributes
    if attributes.get("status") == "failed":
        return f"failed at {str(attributes.get('failure', '')).partition(';')[0]}"
    regime, excitation = str(attributes.get("regime")), str(attributes.get("excitation"))
    parts = [regime if excitation == "none" else f"{regime}, {excitation}"]
    if regime == "undecided":
        parts = [f"{parts[0]}: {'; '.join(str(reason) for reason in attributes.get('reasons', ()))}"]
    if frequency := _number(result, "frequency"):
        parts.append(f"{frequency:.4g} Hz")
    if (amplitude := _number(result, "amplitude")) and excitation != "none":
        factor, unit = prefixed(amplitude, "m")
        parts.append(f"amplitude of x {amplitude * factor:.3g} {unit}")
    for name, words in (("stick_fraction", "stick"), ("contact_loss_fraction", "contact lost")):
        if share := _number(result, name):
            parts.append(f"{words} {share:.1%} of the time")
    return "   ·   ".join(parts)


def _number(result: StoredResult, name: str) -> float | None:
    value = result.attributes.get(name)
    return float(value) if isinstance(value, int | float) else None


def _case(result: StoredResult) -> Case:
    try:
        return parse_case(str(result.attributes.get("resolved_toml", "")), "its resolved case").case
    except CaseError as error:
        raise _unreadable(result, f"the case it holds is none: {error.problems[0]}") from error


def _unreadable(result: StoredResult, reason: str) -> UnreadableResultError:
    return UnreadableResultError(f"{result.path}: cannot be drawn: {reason}; compute it again")


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """By what to multiply values up to `largest` for a unit that makes them easy to read, and its name."""
    if 0.0 < largest < 1e6:
        for exponent, prefix in ((3, "k"), (0, ""), (-3, "m"), (-6, "µ"), (-9, "n"), (-12, "p")):
            if largest >= 10.0**exponent:
                return 10.0**-exponent, prefix + unit
    return 1.0, unit
