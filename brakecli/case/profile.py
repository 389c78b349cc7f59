"""A measured profile as a sum of sines."""

import hashlib
import math
from pathlib import Path
from typing import Any

import numpy as np

from brakecli.case.records import MOST_MEASURED, Record, arrays
from brakecli.case.tables import MOST_SINES
from brakecli.errors import UsageError, printable
from brakecli.results.table import Array, TextTable, require

_ROUNDING = 1e-12  # of heights, relative to their root mean square
_FARTHEST = 1e9  # m; no wheel is larger


def sines_of(
    name: str, record: Record, error: float, radius: float, pad: float | None
) -> dict[str, str | list[float]]:
    """The keys of a surface that leaves out a part `error` of the RMS of a measured profile of some name.

    `radius` (m) makes angles lengths. `pad` is the half length of a shoe (m); without one it is the profile of a
    wheel, of which whole turns are averaged. Otherwise the profile is repeated beyond what was measured. Raises
    UnreadableResultError and UsageError.
    """
    places = np.frombuffer(record.place)
    height = np.frombuffer(record.height)
    places = places * radius if record.is_angle else places
    turn = 2.0 * math.pi * radius
    step = float(np.median(np.diff(places)))
    apart = f"its places lie {step:.3g} m apart, as a rule"
    require(step >= 1e-9, f"{apart}; check their unit")  # nothing is measured at places nearer to each other
    far = float(places[-1] - places[0])
    require(far <= _FARTHEST, f"its places reach over {far:.3g} m; check their unit")
    turns, around = _turns(places, step, turn) if pad is None else (0, 0.0)
    most = 10 * len(places)  # of the even grid
    if turns:
        count = min(round(around / step), most // turns)
        few = f"{apart}, {count} in a turn of {turn:.3g} m; check their unit, or measure 8 or more"
        require(count >= 8, few)  # fewer show none of its waves but the longest three
        inside = places - places[0] < turns * around - 0.5 * step  # the last value may repeat the first
        grid = np.arange(turns * count) * (around / count)
        rows = np.interp(grid, (places - places[0])[inside], height[inside], period=turns * around)
        rows = rows.reshape(turns, count)
        stretched = 100.0 * (turn / around - 1.0)
        profile = rows.mean(axis=0) - rows.mean()
        spread = float(np.sqrt(np.mean((rows - rows.mean(axis=0)) ** 2)))
        how = f", mean of {turns} turns, which differ from it by {spread:.3g} m (RMS)" * (turns > 1)
        how += f"; the record was stretched by {stretched:.2g} % to whole turns" * (abs(stretched) > 0.01)
        length = turn
    else:
        span = float(places[-1] - places[0])
        count = min(round(span / step) + 1, most)
        grid = np.linspace(0.0, span, count)
        profile = np.interp(grid, places - places[0], height)
        profile -= np.polyval(np.polyfit(grid, profile, 1), grid)
        length = span * count / (count - 1)
        how = f", over {length:.4g} m, beyond which it repeats; a straight line was removed"
        if pad is not None and (places[0] > -pad + step or places[-1] < pad - step):
            how += f"; the pad from {-pad:g} to {pad:g} m reaches beyond {places[0]:.4g} to {places[-1]:.4g} m"
    widest = float(np.diff(places).max())
    how += f"; a straight line bridges a gap of {widest:.3g} m" * (widest > 4.0 * step)
    rms = float(np.sqrt(np.mean(profile**2)))
    straight = "its heights lie on a straight line, which is removed; leave the surface out, which is smooth"
    require(rms > _ROUNDING * float(np.abs(height).max()), straight)
    require(rms < radius, f"its heights have an RMS of {rms:.3g} m, beyond the wheel's radius; check their unit")
    chosen, amplitudes, phases, lost = _strongest(profile, error)
    phases = (phases - 360.0 * (chosen * places[0] / length % 1.0)) % 360.0
    note = f"{len(chosen)} of {count // 2} sines leave out {100.0 * lost:.3g} % of the RMS of {rms:.3g} m{how}"
    waves = {"orders": chosen.astype(float).tolist()} if turns else {"wavelengths": (length / chosen).tolist()}
    note = f"{printable(name)}: {note}"
    return {"amplitudes": amplitudes.tolist(), **waves, "phases_deg": phases.tolist(), "note": note}


def read(path: Path) -> Record:
    """The measured profile that a file holds; raises UnreadableResultError and OSError."""
    table = TextTable(path)
    columns = f"{table.columns} column{'s' * (table.columns > 1)}"
    require(table.columns == 2, f"has {columns}; give two: position or angle, and height")
    lines = [line for line in table.header if line.strip()]
    unnamed = "its first lines do not name both columns; separate names and numbers alike, or remove these lines"
    require(table.names or not lines, unnamed)
    along = table.unit(0, "meter", "radian")
    up = table.unit(1, "meter")
    angles = ("angle", "theta", "phi", "θ", "φ")
    bare = along is None and table.names and any(word in table.names[0].lower() for word in angles)
    require(not bare, f"column {table.names[0] if bare else ''}: has no unit; name it angle_deg or angle_rad")
    sizes = (unit[0] if unit else 1.0 for unit in (along, up))
    with np.errstate(over="ignore"):
        places, height = (values * size for values, size in zip(table.numbers(), sizes, strict=True))
    return _checked(places, height, is_angle=bool(along and along[1] == "radian"))


def keep_array(value: object) -> str:
    """The name, among the `arrays`, of a profile: an array of places and heights (m), as two columns.

    Raises UnreadableResultError.
    """
    try:
        rows: Any = np.ma.array(value)
    except (TypeError, ValueError):
        rows = np.ma.array("lists of different lengths")
    columns = "; give places and heights (m), as two columns"
    require(rows.dtype.kind in "fiu", f"is no array of numbers{columns}")
    require(rows.shape[1:] == (2,), f"is an array of shape {rows.shape}{columns}")
    rows = rows.astype(np.float64).filled(np.nan)
    require(rows.nbytes <= MOST_MEASURED, f"takes more than {MOST_MEASURED / 1e6:g} MB; measure fewer places")
    record = _checked(rows[:, 0], rows[:, 1], is_angle=False)
    digest = hashlib.sha256(record.place + record.height).hexdigest()
    name = f"/array {digest[:12]}"  # absolute, and no path of a file
    arrays.get()[name] = record
    return name


def _checked(places: Array, height: Array, *, is_angle: bool) -> Record:
    """The profile of rising or falling places; raises UnreadableResultError."""
    require(len(places) > 3, f"has {len(places)} rows; measure four places or more")
    require(np.isfinite(places).all() and np.isfinite(height).all(), "a cell is empty or no number; fill it")
    for what, largest in (("place", np.abs(places).max()), ("height", np.abs(height).max())):
        require(largest <= _FARTHEST, f"a {what} is {largest:.3g} in SI units; check the unit")
    if places[-1] < places[0]:
        places = places[::-1]
        height = height[::-1]
    steps = np.diff(places)
    row = int(np.argmin(steps > 0.0)) + 2
    back = f"its places do not rise or fall throughout, see row {row} of numbers; sort the rows"
    require(steps.min() > 0.0, back)
    high = float(np.ptp(height))
    require(high > 0.0, "all heights are equal; leave the surface out, which is smooth")
    require(high >= 1e-15, f"its heights differ by {high:.3g} m; check their unit")
    return Record(places.tobytes(), height.tobytes(), is_angle)


def _turns(places: Array, step: float, turn: float) -> tuple[int, float]:
    """Whole turns in a record, and the length of each; a record that nearly is so many turns has their length."""
    span = float(places[-1] - places[0])
    off = 0.005  # part of a turn by which a record may miss a whole number of turns
    turns = math.floor((span + step) / turn + off)
    # The end may repeat the start.
    length = min((span + step, span), key=lambda length: abs(length - turns * turn))
    fits = turns and abs(length - turns * turn) <= off * turn
    return turns, length / turns if fits else turn


def _strongest(height: Array, error: float) -> tuple[Array, Array, Array, float]:
    """The fewest sines that leave out a part `error` of the RMS, and the part that they leave out.

    They are given as waves in the record, amplitudes and phases (deg).
    """
    count = len(height)
    waves = np.fft.rfft(height)[1:] / count
    twice = np.where(np.arange(1, len(waves) + 1) == 0.5 * count, 1.0, 2.0)  # the shortest wave stands alone
    power = twice * np.abs(waves) ** 2  # Parseval: these add up to the mean square
    order = np.argsort(-power, kind="stable")
    without = np.append(np.cumsum(power[order][::-1])[::-1], 0.0)
    without = np.sqrt(without / without[0])
    needed = int(np.argmax(without <= max(error, _ROUNDING)))
    if needed > MOST_SINES:
        what = f"needs {needed} sines to leave out {error:g} of its RMS, and {MOST_SINES} is the most"
        raise UsageError(f"{what}; set profile_error to {math.ceil(1e3 * without[MOST_SINES]) / 1e3:g}")
    chosen = np.sort(order[:needed])
    phases = np.degrees(np.angle(waves[chosen])) + 90.0
    return chosen + 1, (twice * np.abs(waves))[chosen], phases, float(without[needed])
