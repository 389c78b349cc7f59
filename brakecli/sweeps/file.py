"""Sweep file → plan, or every problem of the sweep, of its base case and of the values on its axes at once."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import tomli_w

from brakecli.case.read import LoadedCase, key_path, parse_case, parse_override, parse_table, read_text
from brakecli.case.toml_lines import Finding, KeyPath, Located, UnfitTextError, split
from brakecli.errors import CaseError, Problem
from brakecli.sweeps.plan import Plan, Settings, given_toml
from brakecli.sweeps.tables import Sweep

MOST_TRIED = 1000
"""Listed values of an axis that are tried before the start; of a range both ends are."""

_OWN_KEYS = {"case", "critical"}


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
        """The title of the sweep, or else that of its case."""
        return self.sweep.title or self.base.case.title


def read_sweep(source: str, overrides: Sequence[str] = ()) -> LoadedSweep:
    """Read a sweep from a path, or from standard input where the path is "-". Raises `CaseError`.

    Overrides set keys of the base case, those of `critical` and `case` excepted.
    """
    label = "standard input" if source == "-" else source
    folder = Path() if source == "-" else Path(source).parent
    return parse_sweep(read_text(source, label), label, folder, overrides)


def parse_sweep(text: str, label: str, folder: Path, overrides: Sequence[str] = ()) -> LoadedSweep:
    """Make a sweep of its text; its base case is looked for from `folder` on. Raises `CaseError`."""
    own = [override for override in overrides if _is_own(override)]
    sweep = parse_table(Sweep, text, label, own)
    path = str(folder / sweep.case)
    base = parse_case(read_text(path, path), path, [override for override in overrides if override not in own])
    plan = Plan(given_toml(sweep), given_toml(base.case))
    problems = _wrong_values(plan, text, label)
    if problems:
        raise CaseError(problems)
    resolved = tomli_w.dumps(sweep.model_dump(mode="json", exclude_none=True))
    return LoadedSweep(sweep, text, resolved, base, plan)


def is_sweep(path: str) -> bool:
    """Whether a file is meant to be a sweep: by the keys that no case has."""
    keys = _keys(path)
    return bool(keys & {"case", "axis", "critical"}) and "shoe" not in keys


def is_case(path: str) -> bool:
    """Whether a file is meant to be a case: by the keys that no sweep has."""
    keys = _keys(path)
    return "shoe" in keys and not keys & {"axis", "critical"}


def _keys(path: str) -> set[str]:
    """The keys at the top of a file, as far as they can be read."""
    try:
        return set(Located(split(read_text(path, path))).data)
    except (UnfitTextError, CaseError):
        return set()


def _is_own(override: str) -> bool:
    parsed = parse_override(override)
    return not isinstance(parsed, Finding) and parsed[0][0] in _OWN_KEYS


def _wrong_values(plan: Plan, text: str, label: str) -> list[Problem]:
    """What is wrong with the axes and the search: keys that no case has, and values that no key takes.

    A value may need those of other axes: it is wrong if it fits neither the base case nor a corner of the grid.
    """
    lines = Located(split(text)).lines
    corners = [{}, plan.settings(0), plan.settings(plan.points - 1)]
    problems: dict[tuple[str, str], Problem] = {}
    tries: list[tuple[KeyPath, tuple[str, ...], tuple[object, ...]]] = []
    for index, axis in enumerate(plan.sweep.axis):
        ends = (axis.start, axis.stop) if axis.values is None else axis.values[:MOST_TRIED]
        tries.append((("axis", index, "parameter"), axis.parameter, ends))
    if (critical := plan.sweep.critical) is not None:
        tries.append((("critical", "parameter"), (critical.parameter,), (critical.lower, critical.upper)))
    for place, parameters, values in tries:
        prefixes = [place[:end] for end in range(len(place), 0, -1)]
        line = next((lines[prefix] for prefix in prefixes if prefix in lines), 0)
        for value in values:
            settings = {key_path(text): value for text in parameters}
            found = [
                _problems(plan, f"{label}:{line}" if line else label, corner | settings) for corner in corners
            ]
            if all(found):
                for problem in found[0]:
                    problems.setdefault((problem.where, problem.key), problem)
    return list(problems.values())


def _problems(plan: Plan, where: str, settings: Settings) -> tuple[Problem, ...]:
    try:
        plan.case(settings)
    except CaseError as error:
        return tuple(Problem(where, each.key, each.what, each.remedy) for each in error.problems)
    return ()
