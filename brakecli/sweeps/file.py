"""Sweep file → plan, or every problem of the sweep, of its base case and of the values on its axes at once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import tomli_w

from brakecli.case.read import LoadedCase, key_path, parse_case, parse_table, read_text
from brakecli.case.toml_lines import Located, innermost
from brakecli.errors import CaseError, KeyPath, Problem
from brakecli.sweeps.plan import Plan, given_toml
from brakecli.sweeps.tables import Sweep

MOST_TRIED = 1000  # listed values of an axis that are tried before the sweep starts; of a range it is both ends


@dataclass(frozen=True)
class LoadedSweep:
    """A sweep with the texts it was read from; `resolved` is its file with every default filled in."""

    sweep: Sweep
    text: str
    resolved: str
    base: LoadedCase
    plan: Plan

    @property
    def title(self) -> str:
        """The title of the sweep, otherwise that of its case."""
        return self.sweep.title or self.base.case.title


def read_sweep(source: str, overrides: Sequence[str] = ()) -> LoadedSweep:
    """Read a sweep from a path, or from standard input where the path is "-"; see `parse_sweep`."""
    return parse_sweep(*read_text(source), Path() if source == "-" else Path(source).parent, overrides)


def parse_sweep(text: str, label: str, folder: Path, overrides: Sequence[str] = ()) -> LoadedSweep:
    """Make a sweep of its text; the path of its base case begins at `folder`. Raises `CaseError`.

    Overrides of `critical` and `case` belong to the sweep, all others to its base case.
    """
    own = [each for each in overrides if key_path(each.partition("=")[0])[:1] in (("case",), ("critical",))]
    sweep = parse_table(Sweep, text, label, own)
    others = [override for override in overrides if override not in own]
    base = parse_case(*read_text(str(folder / sweep.case)), others)
    plan = Plan(given_toml(sweep), given_toml(base.case))
    if problems := _wrong_values(plan, text, label):
        raise CaseError(problems)
    resolved = tomli_w.dumps(sweep.model_dump(mode="json", exclude_none=True))
    return LoadedSweep(sweep, text, resolved, base, plan)


def kind_of(path: str) -> str:
    """What a file is meant to be, by its keys at the top: "case", "sweep", or neither."""
    try:
        keys = set(Located(*read_text(path)).data)
    except CaseError:
        return ""
    if "shoe" in keys:
        return "" if keys & {"axis", "critical"} else "case"
    return "sweep" if keys & {"case", "axis", "critical"} else ""


def _wrong_values(plan: Plan, text: str, label: str) -> list[Problem]:
    """What is wrong with the axes and the search: keys that no case has, and values that no key takes.

    A value may need those of other axes: it is wrong if it fits neither the base case nor a corner of the grid.
    """
    tries: list[tuple[KeyPath, tuple[str, ...], tuple[object, ...]]] = []
    for index, axis in enumerate(plan.sweep.axis):
        ends = (axis.start, axis.stop) if axis.values is None else axis.values[:MOST_TRIED]
        tries.append((("axis", index, "parameter"), axis.parameter, ends))
    if (critical := plan.sweep.critical) is not None:
        tries.append((("critical", "parameter"), (critical.parameter,), (critical.lower, critical.upper)))
    lines = Located(text, label).lines
    corners = [{}, plan.settings(0), plan.settings(plan.points - 1)]
    problems: dict[tuple[int, str], Problem] = {}
    for place, parameters, values in tries:
        line = innermost(lines, place, 0)
        for value in values:
            settings = {key_path(parameter): value for parameter in parameters}
            found = [plan.problems(corner | settings) for corner in corners]
            for problem in found[0] if all(found) else ():
                problems.setdefault((line, problem.key), replace(problem, source=label, line=line))
    return list(problems.values())
