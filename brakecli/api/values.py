"""What options hold, in the shell as texts and in Python as objects, as what computes takes it."""

import multiprocessing
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import date, time
from itertools import pairwise
from numbers import Real
from os import PathLike
from typing import TYPE_CHECKING, Any

from brakecli.errors import UnreadableResultError, UsageError, found_text, printable, value_text
from brakecli.faces import argument

if TYPE_CHECKING:
    from brakecli.api.records import Changes, Keys, Source, Sweep
    from brakecli.case.read import LoadedCase
    from brakecli.studies.scattering.study import LoadedStudy
    from brakecli.studies.sweeps.plan import LoadedSweep
    from brakecli.studies.sweeps.point_list import Listed
    from brakecli.studies.sweeps.tables import Axis

MOST_VALUES = 10_000
"""Values along which modes are followed."""


def case_of(source: "Source | LoadedSweep", settings: "Changes | None") -> "LoadedCase":
    """The case of a path, of a loaded case or of a result, with changed settings."""
    from brakecli.api.inputs import load_case
    from brakecli.case.case import given_toml
    from brakecli.case.read import LoadedCase, parse_case, parse_resolved

    if isinstance(source, LoadedCase):
        if settings:
            changed = parse_case(given_toml(source.case), "the case", overrides(settings), source.records)
            return replace(changed, text=source.text)
        return source
    if resolved := getattr(source, "attrs", {}).get("resolved_toml"):  # a result
        return parse_resolved(str(resolved), "its case", overrides(settings))
    if not isinstance(source, str | PathLike):
        raise UsageError(f"{type(source).__name__}: is no case; give a path, or a case from brakecli.load")
    return load_case(path_of(source), overrides(settings))


def path_of(source: object) -> str:
    """The path of a file; raises UsageError for what is none."""
    if not isinstance(source, str | PathLike) or not isinstance(path := os.fspath(source), str):
        raise UsageError(f"{type(source).__name__}: is no path; give one, or what brakecli.load gave")
    return path


def study_of(source: object, settings: "Changes | None" = None) -> "LoadedStudy":
    """The study of a path, or one that was loaded, which takes no settings."""
    from brakecli.api.inputs import load_study
    from brakecli.studies.scattering.study import LoadedStudy

    if not isinstance(source, LoadedStudy):
        return load_study(path_of(source), overrides(settings))
    if settings:
        raise UsageError("settings: come too late for a study that was loaded; give them to brakecli.load")
    return source


def pushes_of(number: int) -> int:
    """A number of pushes; raises UsageError."""
    from brakecli.analysis.branches.pushes import MOST_PUSHES

    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= MOST_PUSHES:
        raise UsageError(f"pushes {number}: is no whole number from 0 to {MOST_PUSHES}")
    return number


def overrides(settings: "Changes | None") -> list[str]:
    """Settings as `--set` has them; a table replaces the one that the case has."""
    if isinstance(settings, list):
        return settings
    return [f"{key}={_toml(value, key)}" for key, value in mapping(settings, "settings").items()]


def axis_of(vary: object) -> "Axis":
    """The axis along which modes are followed; raises UsageError where values neither rise nor fall."""
    import tomli_w

    from brakecli.case.read import parse_table
    from brakecli.studies.sweeps.tables import Axis

    if isinstance(vary, str):
        return _axis_of_text(vary)
    along = mapping(vary, "vary", several=True)
    if len(along) != 1:
        raise UsageError("vary: takes one key with its values, or one tuple of keys; give the others as settings")
    [(keys, values)] = along.items()
    settings = values if isinstance(values, Mapping) else {"values": values}
    axis = parse_table(Axis, tomli_w.dumps(plain({"parameter": keys, **settings}, "vary")), "vary")
    places = axis.values or (axis.start or 0.0, axis.stop or 0.0)
    steps = [after - before for before, after in pairwise(places) if axis.numeric]
    if not axis.numeric or min(steps, default=1) * max(steps, default=1) <= 0:
        raise UsageError("vary: modes are followed along numbers that rise or fall; sort them, each once")
    return axis


def _axis_of_text(text: str) -> "Axis":
    """The axis of KEY,KEY=START:STOP:NUM, both ends included; raises UsageError."""
    from brakecli.case.read import key_path
    from brakecli.studies.sweeps.tables import Axis

    keys, _, numbers = text.partition("=")
    with suppress(ValueError):  # pydantic's own is one, too
        start, stop, count = numbers.split(":")
        axis = Axis(parameter=tuple(keys.split(",")), start=float(start), stop=float(stop), num=int(count))
        different = len({*map(key_path, axis.parameter)}) == len(axis.parameter)
        if different and axis.size <= MOST_VALUES and (axis.size == 1 or axis.start != axis.stop):
            return axis
    what = f"is not KEY=START:STOP:NUM with two ends, NUM from 1 to {MOST_VALUES}, and no key twice"
    remedy = "write, for instance, link2.angle_deg=1:10:10"
    raise UsageError(f"{argument('vary')} {printable(text)}: {what}; {remedy}")


def axes_of(axes: object, direction: object) -> list[dict[str, object]]:
    """The tables `[[axis]]` of a sweep."""
    by_key = mapping(axes, "axes", several=True)
    ways = dict.fromkeys(by_key, direction) if isinstance(direction, str) and len(by_key) == 1 else direction
    ways = mapping(ways, "direction", several=True)
    if unknown := [key for key in ways if key not in by_key]:
        raise UsageError(f"direction: {value_text(unknown[0])} is not among the axes; name an axis as axes does")
    return [
        {"parameter": key}
        | dict(values if isinstance(values, Mapping) else {"values": values})
        | ({"direction": ways[key]} if key in ways else {})
        for key, values in by_key.items()
    ]


def ends_of(parameter: "Mapping[Keys, tuple[float, float]] | str") -> tuple[tuple[str, ...], float, float]:
    """Keys that take the same value, and both ends of its range; raises UsageError."""
    from brakecli.studies.runs.branch import parsed

    if isinstance(parameter, str):
        return parsed(parameter)
    if len(mapping(parameter, "parameter", several=True)) != 1:
        raise UsageError("parameter: takes one key with both ends of its range, or one tuple of keys")
    [(keys, ends)] = parameter.items()
    try:
        low, high = map(float, ends)
    except (TypeError, ValueError, OverflowError):
        raise UsageError(f"parameter: is not both ends of a range{found_text(ends)}; give two numbers") from None
    return parsed(f"{keys if isinstance(keys, str) else ','.join(keys)}={low!r}:{high!r}")


def patterns_of(keys: Any) -> list[str]:
    """Patterns of keys, as one text with commas or as a list of texts."""
    patterns = keys.split(",") if isinstance(keys, str) else [*keys] if isinstance(keys, Iterable) else [keys]
    if wrong := [pattern for pattern in patterns if not isinstance(pattern, str)]:
        raise UsageError(f"keys: are no key paths{found_text(wrong[0])}; give a text, or a list of texts")
    return patterns


def margin_of(margin: object) -> float:
    """A margin of friction, as a part of it."""
    number = margin.item() if hasattr(margin, "item") else margin  # of NumPy
    if not (isinstance(number, int | float) and 0.0 <= number <= 10.0):
        raise UsageError(f"margin: is no number from 0 to 10{found_text(number)}; give one, as 0.2")
    return float(number)


def chosen_of(choices: "Changes | None", name: str) -> list[str]:
    """Values by name as options have them, as `KEY=VALUE`."""
    if isinstance(choices, list):
        return choices
    return [f"{key}={plain(value, f'{name}: {key}')}" for key, value in mapping(choices, name).items()]


def text_of(text: object, name: str) -> str:
    """A text, empty for None; raises UsageError for anything else."""
    if not isinstance(text, str | None):
        raise UsageError(f"{name}: is no text{found_text(text)}; give one, or leave it out")
    return text or ""


def sweep_of_options(options: "Sweep") -> "LoadedSweep":
    """The sweep of a file, of what was loaded, or of axes, points and a search in Python."""
    from brakecli.api.inputs import load_sweep
    from brakecli.studies.sweeps.plan import LoadedSweep, sweep_of
    from brakecli.studies.sweeps.point_list import GIVEN

    if options.axes is not None or options.points is not None or options.critical is not None:
        listed = points_of(options.points)
        tables = {
            "case": "-",
            "axis": axes_of(options.axes, options.direction),
            "critical": mapping(options.critical, "critical"),
        }
        content = plain(tables, "sweep")
        content |= {"points": GIVEN} if listed else {}
        base = case_of(options.source, options.settings)
        return sweep_of({name: table for name, table in content.items() if table}, base, listed)
    if options.direction is not None:
        raise UsageError("direction: is for axes; a sweep file states it in an axis of its own")
    if not isinstance(options.source, LoadedSweep):
        return load_sweep(path_of(options.source), overrides(options.settings))
    if options.settings:
        raise UsageError("settings: come too late for a sweep that was loaded; give them to brakecli.load")
    return options.source


def points_of(points: "Mapping[str, Iterable[Any]] | None") -> "Listed | None":
    """Points that are given by columns; a data frame has them as well."""
    from brakecli.case.read import key_path
    from brakecli.studies.sweeps.point_list import Listed, refuse_many

    if points is None:
        return None
    if not hasattr(points, "keys"):
        raise UsageError("points: are no columns; write them as {'friction.coefficient': [0.3, 0.5]}")
    refuse_many(len(points.keys()), 0, "points")
    columns = plain({key: points[key] for key in points}, "points")
    if wrong := [key for key in columns if not key_path(key)]:
        raise UsageError(f"points: {wrong[0]!r} is no key path; name a key as in 'link2.angle_deg'")
    if len({*map(key_path, columns)}) < len(columns):
        raise UsageError("points: a key has two columns; keep one of them")
    lists = [column for column in columns.values() if isinstance(column, list)]
    if len(lists) < len(columns) or len({*map(len, lists)}) != 1 or not all(lists):
        raise UsageError("points: need a value of each key at each point, and one point at least")
    refuse_many(len(columns), len(lists[0]), "points")
    return Listed.of([*columns], columns.values())


def scheduler_of(scheduler: object) -> object:
    """The scheduler that is given, or the address in the environment; None without one."""
    if isinstance(scheduler, Real):
        raise UsageError(
            f"scheduler: is none{found_text(scheduler)}; give a client, a cluster or an address of dask"
        )
    return scheduler if scheduler is not None else os.environ.get("DASK_SCHEDULER_ADDRESS") or None


def refuse_jobs(jobs: int | None) -> None:
    """Raise UsageError for a wrong number of workers, and end a worker that is being started by a script."""
    if jobs is not None and not (isinstance(jobs, int) and 1 <= jobs <= 4096):
        raise UsageError(
            f"jobs: is no number of workers from 1 to 4096{found_text(jobs)}; give one, or leave it out"
        )
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        os._exit(os.EX_USAGE)  # which tells the caller that there is no guard


def mapping(value: object, name: str, *, several: bool = False) -> Mapping[Any, Any]:
    """A mapping by key paths, or by tuples of `several`; empty for None. Raises UsageError for anything else."""
    if not isinstance(value, Mapping | None):
        raise UsageError(f"{name}: is no mapping; write it as {{'friction.coefficient': ...}}")
    for key in value or {}:
        if not all(isinstance(path, str) for path in (key if several and isinstance(key, tuple) else (key,))):
            raise UsageError(f"{name}: a key is no text{found_text(key)}; write it as 'friction.coefficient'")
    return value or {}


def _toml(value: object, key: str) -> str:
    import tomli_w

    value = plain(value, key)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name} = {_toml(item, f'{key}.{name}')}" for name, item in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(_toml(item, key) for item in value)}]"
    return tomli_w.dumps({"value": value}).removeprefix("value = ").strip()


def plain(value: Any, key: str) -> Any:
    """The value of a key without NumPy or xarray, as TOML holds it, or UsageError."""
    if key.rpartition(".")[2] == "profile" and not isinstance(value, str | PathLike):
        from brakecli.case.profile import keep_array

        try:
            return keep_array(value)
        except UnreadableResultError as error:
            raise UsageError(f"{key}: {error}") from error
    if isinstance(value, Mapping) and hasattr(value, "attrs"):  # a dataset, or a tree of them
        what = "is a result in memory; give output to the function that computes it, and name that file"
        raise UsageError(f"{key}: {what}")
    value = value.to_numpy() if hasattr(value, "to_numpy") else value
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, Mapping):
        return {name: plain(item, f"{key}.{name}") for name, item in mapping(value, key).items()}
    if isinstance(value, Iterable) and not isinstance(value, str):
        return [plain(item, key) for item in value]
    if not isinstance(value, str | int | float | date | time | PathLike):
        raise UsageError(f"{key}: cannot be set to {type(value).__name__}; give a number, text, list or table")
    if isinstance(value, str) and not value.isascii() and any(0xD800 <= ord(sign) < 0xE000 for sign in value):
        raise UsageError(f"{key}: is not UTF-8{found_text(value)}; write it in UTF-8")
    if isinstance(value, int) and value.bit_length() >= 1024:  # no float, and too many digits to be written
        raise UsageError(f"{key}: is too large for a number{found_text(value)}; give a smaller one")
    return str(value) if isinstance(value, PathLike) else value
