"""The branches of a case along keys: looked at beforehand, followed, and written to a file."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from brakecli.analysis.branches.answers import Answers
from brakecli.analysis.branches.explore import Explorer
from brakecli.analysis.branches.line import ALONE, Line
from brakecli.analysis.branches.rows import Followed, finer
from brakecli.case.case import Case
from brakecli.case.read import LoadedCase, key_path
from brakecli.case.restart import last_of
from brakecli.errors import UsageError, printable
from brakecli.faces import argument
from brakecli.results import stability_fields as fields
from brakecli.results.field import LARGEST_SQUARE, Field, flat, integer, values_of
from brakecli.results.write import ResultFile, new_result
from brakecli.solver.arrays import Floats
from brakecli.studies.runs.run import origin

EQUATIONS = ALONE | {"roughness"}
"""Tables of a case whose keys enter the equations of motion."""


@dataclass(frozen=True)
class Start:
    """The end of a run, from which a branch is begun."""

    state: Floats  # x, y, v_x and v_y
    value: float | None  # of the keys in the case of the run; None where they differ
    case: Case  # of the run


def line_of(loaded: LoadedCase, keys: Sequence[str], low: float, high: float, option: str) -> Line:
    """The line of cases that an option asks for; raises CaseError and UsageError where there is none."""
    for key in keys:
        if key_path(key)[0] in Case.model_fields.keys() - EQUATIONS:
            raise UsageError(
                f"{option}: {printable(key)}: is no quantity of the shoe; follow e.g. friction.coefficient"
            )
    line = Line(loaded.case, keys, low, high, option)
    for p in (0.0, 1.0):
        system = line.system(p)  # so that a wrong end is known before anything is computed
        if not system.steady:
            raise UsageError(f"{option}: branches need a constant speed and a constant load; leave times out")
    return line


def parsed(text: str) -> tuple[tuple[str, ...], float, float]:
    """Keys and both ends of KEY[,KEY]=LOW:HIGH; raises UsageError."""
    keys, _, numbers = text.partition("=")
    names = tuple(keys.split(","))
    with suppress(ValueError):
        low, high = (float(number) for number in numbers.split(":"))
        paths = [key_path(name) for name in names]
        if (
            math.isfinite(low)
            and math.isfinite(high)
            and low < high
            and all(paths)
            and len({*paths}) == len(paths)
        ):
            return names, low, high
    what = "is not KEY[,KEY]=LOW:HIGH with LOW below HIGH, and no key twice"
    raise UsageError(
        f"{argument('parameter')} {printable(text)}: {what}; write, for instance, friction.coefficient=0:1.5"
    )


def start_of(path: Path, keys: Sequence[str]) -> Start:
    """The last state of a run, and the value of the keys in its case; raises what `last_of` raises."""
    end = last_of(path, Case.model_validate)
    return Start(np.array(end.state), Line(end.case, keys, -math.inf, math.inf).own, end.case)


def states_of(line: Line, starts: Sequence[Start]) -> list[tuple[float, Floats]]:
    """Places of a line and the states there from which branches are begun; raises UsageError."""
    return [(line.place(_value(line, start)), start.state) for start in starts]


def _value(line: Line, start: Start) -> float:
    value = line.own if start.value is None else start.value
    if value is None or not line.low <= value <= line.high:
        raise UsageError(
            f"{argument('start')}: the value of {', '.join(line.keys)} in its case is not in the range; "
            f"widen {argument('parameter')}"
        )
    return value


def foreign(line: Line, starts: Sequence[Start]) -> list[str]:
    """What is to be known of runs whose case has other equations of motion than the line, in words."""
    own = _equations(line.case, line.keys)
    notes = []
    for start in starts:
        there = _equations(start.case, line.keys)
        differing = [name for name in {**own, **there} if own.get(name) != there.get(name)]
        if differing:
            shown = [_compared(name, there.get(name), own.get(name)) for name in differing]
            shown[3:] = [f"and {len(shown) - 3} more"] * (len(shown) > 3)
            value = _value(line, start)
            notes.append(f"the motion given for {value:.6g} is one of another case ({', '.join(shown)})")
    return notes


def _equations(case: Case, keys: Sequence[str]) -> dict[str, object]:
    """The keys of a case that enter the equations of motion, but for some, with their values."""
    tables = case.model_dump(mode="json", include=EQUATIONS)
    return {name: value for name, value in flat(tables) if name not in keys}


def _compared(name: str, there: object, own: object) -> str:
    """A key with both of its values, where they are numbers."""
    if isinstance(there, int | float) and isinstance(own, int | float):
        return f"{name} {there:.6g}, not {own:.6g}"
    return name


def branch(
    explorer: Explorer, states: Sequence[tuple[float, Floats]] = (), switch: bool = False, pushes: int = 0
) -> Answers:
    """Follow all branches of the line of an explorer, those that begin at some states as well.

    Others are sought by five times so many `pushes`.
    """
    explored = explorer.explore(states, switch, pushes)
    drawn = {id(followed): finer(explorer.line, followed, explorer.stop) for followed in explored.branches}
    search = replace(explored.search, islands=[drawn[id(followed)] for followed in explored.search.islands])
    return Answers(replace(explored, branches=[*drawn.values()], search=search), explorer.line.own)


def write(path: Path, loaded: LoadedCase, answers: Answers, units: str, *, force: bool) -> None:
    """Write all branches, each as a group; raises UsageError or CannotWriteError."""
    with new_result(path, force=force) as result:
        result.set_attributes(origin("branch", loaded.case.title, loaded))
        result.set_fields(fields.BRANCH, values_of(fields.BRANCH, answers))
        for number, curve in enumerate(answers.branches):
            _write_one(result, f"branch_{number}", curve, units)
        result.commit()


def _write_one(result: ResultFile, group: str, curve: Followed, units: str) -> None:
    """A branch: its motions over `point`, and a group of its special points."""
    result.axis(group, integer("point", "number of the motion along the branch"), range(len(curve.points)))
    result.set_attributes({"kind": curve.kind, "note": curve.note}, group)
    if lower := curve.unstable_lower:
        result.set_attributes({"unstable_lower": lower, "unstable_upper": curve.unstable_upper}, group)
    multipliers = range(1, 5)  # one for each of x, y, v_x and v_y
    if curve.points:
        result.axis(group, integer("multiplier", "number of the multiplier"), multipliers)
        result.axis(group, Field("part", "", "of a complex number", "S"), ["real", "imaginary"])
    for field in fields.BRANCH_POINT:
        own = replace(field, units=units or "1") if field.units == "of the key" else field
        if field.name == "multipliers":
            if curve.points:
                values = np.full((len(curve.points), len(multipliers), 2), np.nan)
                for row, point in zip(values, curve.points, strict=True):
                    for k, factor in enumerate(point.multipliers):
                        row[k] = _finite(factor.real), _finite(factor.imag)
                result.column(replace(own, kind="f8"), ("point", "multiplier", "part"), values, group)
            continue
        own = replace(own, kind="i8") if field.kind == "?" else own
        result.column(own, ("point",), [own.read(point) for point in curve.points], group)
    inner = f"{group}/special"
    marks = curve.special
    result.axis(inner, integer("special", "number of the special point"), range(len(marks)))
    for field in fields.SPECIAL:
        own = replace(field, units=units or "1") if field.units == "of the key" else field
        result.column(own, ("special",), [field.read(mark) for mark in marks], inner)


def _finite(number: float) -> float:
    """A number, or that of the largest size that a file takes."""
    return math.copysign(min(abs(number), LARGEST_SQUARE), number)
