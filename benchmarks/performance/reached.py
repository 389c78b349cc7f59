"""Ratios that may not fall: those of this run beside those that were reached before, in reached.toml.

Only ratios within one run are guarded, in which programs take turns on one machine. Absolute times are not: they
change with the machine. The numbers of the file change by `--keep` alone, which raises and adds, and never lowers:
a loss must be written into the file by hand. So small losses cannot add up unseen.
"""

import tomllib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from benchmarks.performance.matching import TARGETS, Entry, ratio
from benchmarks.performance.page import number, table

FILE = Path(__file__).with_name("reached.toml")
LOSS = 0.15  # that a ratio may have: most ratios differ by less than 10 % from run to run
GUARDED = ("numbalsoda LSODA", "numbalsoda DOP853", "heyoka.py", "SciPy")  # programs that there are goals against
Ratios = Mapping[str, float]
"""How many times longer another way takes than ours, by name: larger is better."""


def side_by_side(case: str, entries: list[Entry]) -> dict[str, float]:
    """The ratios of a case at each error that both reach."""
    both = ((who, target, ratio(entries, who, target)) for who in GUARDED for target in TARGETS)
    return {f"{who}: {case} at {target:.0e}": value for who, target, value in both if value is not None}


def fallen(old: Ratios, new: Ratios, *, whole: bool = True) -> list[str]:
    """Each ratio that fell too far; in a `whole` run also those that are not there any more."""
    measured = {*map(_program, new)}
    programs = Counter(map(_program, old))
    absent = {who: count for who, count in programs.items() if who not in measured}
    lost = [f"{who}: none of {count} ratios was measured; install it" for who, count in absent.items()]
    lost += [
        f"{name}: {number(old[name])} was reached, not measured now"
        for name in old
        if name not in new and _program(name) not in absent
    ]
    fell = [
        f"{name}: {number(old[name])} was reached, {number(new[name])} now ({_change(old[name], new[name])})"
        for name in old
        if name in new and not new[name] >= (1.0 - LOSS) * old[name]  # nor is NaN
    ]
    return fell + (lost if whole else [])


def _program(name: str) -> str:
    return name.partition(":")[0]


def raised(old: Ratios, new: Ratios) -> dict[str, float]:
    """What has been reached with a further run: the larger of both."""
    return {name: max(old.get(name, 0.0), new.get(name, 0.0)) for name in {**old, **new}}


def lines(old: Ratios, new: Ratios) -> list[str]:
    """The table that is printed: a row for the ratios that differ in their error only."""
    groups: dict[str, list[str]] = {}
    for name in {**old, **new}:
        groups.setdefault(name.partition(" at ")[0], []).append(name)
    rows = []
    for group, members in groups.items():
        both = [name for name in members if name in old and name in new]
        least = min(both, key=lambda name: new[name] / old[name], default=None)
        errors = ", ".join(name.partition(" at ")[2] for name in members)
        change = "" if least is None else _change(old[least], new[least])
        rows.append([group, errors, _told(members, old), _told(members, new), change])
    return table(["", "at errors of", "reached", "now", "largest loss or least gain"], rows)


def read() -> dict[str, float]:
    with FILE.open("rb") as file:
        return tomllib.load(file)


def written(ratios: Ratios) -> str:
    """The text of the file."""
    head = "# Ratios that were reached; `make bench BENCH_ARGS=--keep` raises them, see reached.py\n"
    return head + "".join(f'"{name}" = {value:.3g}\n' for name, value in ratios.items())


def _change(old: float, new: float) -> str:
    return f"{100.0 * (new / old - 1.0):+.0f} %"


def _told(names: list[str], ratios: Ratios) -> str:
    return ", ".join(number(ratios[name]) if name in ratios else "–" for name in names)
