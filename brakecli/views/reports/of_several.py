"""Two or three results of one kind beside each other: what was changed, and what became of it."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from brakecli.errors import UsageError
from brakecli.results.contents import keys
from brakecli.results.read import StoredResult
from brakecli.studies.runs.advise import AdviceReport
from brakecli.studies.scattering.answers import listed
from brakecli.views.plots import over_each_other
from brakecli.views.reports.blocks import (
    PER_CENT,
    Beside,
    Part,
    Shares,
    Table,
    Texts,
    key_unit,
    percent,
    picture,
    rounded,
    shown,
)
from brakecli.views.view import sentence

PICTURE = "All results in one picture: the first one wide, the second one dashed"
THIRD = ", the third one dotted"
# to which numbers are compared; increase above which there is no per cent
DIGITS = 4
_OF_CHANGE = 3
MOST_PART = 10.0
# rows of both tables on a single page, and letters of the keys that are left out
_MOST_KEYS = 5
_MOST_NUMBERS = 9
_MOST_LETTERS = 180
_NARROW = 2  # results whose picture stands beside their numbers, and not below them
_NAMED = 2  # changed keys by which the results are named
_CHOSEN = "solver.duration", "output.sample_interval"  # by the program, where a file gives no numbers
_SAME = "same"
_ABOUT = "key", "parameter"  # of the tables of a study and of a sweep
_IN_ITS_UNIT = "low", "high", "mean", "mode", "deviation", "start", "stop", "values"


def beside(results: Sequence[StoredResult], parts: Sequence[Part], full: bool) -> Beside | None:
    """What a page says of all of them together, if they are of one kind; rows that are many only if it is `full`.

    Raises UnreadableResultError.
    """
    if len({str(result.attributes.get("kind")) for result in results}) != 1:
        return None
    sources = [keys(result, ("case_toml",)) for result in results]
    fixed = [name for name in _CHOSEN if any(isinstance(source.get(name), int | float) for source in sources)]
    case = list[tuple[Any, ...]]()
    chosen = list[str]()
    every = [keys(result) for result in results]
    for name in dict.fromkeys(name for case_keys in every for name in case_keys):
        values = [case_keys.get(name) for case_keys in every]
        if all(value == values[0] for value in values):
            continue
        texts = [shown(value, key_unit(name)) for value in values]
        if name in _CHOSEN and name not in fixed:
            chosen += [f"{name} ({', '.join(texts)})"] * (len({*texts}) > 1)
        elif name != "title" and {} not in values:  # which stands for a table without keys
            label, units = _with_its_key(name, every)
            case.append((label, *values, units))
    units_of = {name: units for part in parts for name, (_, units) in part.numbers.items()}
    numbers = []
    for name, units in units_of.items():
        values = [rounded(part.numbers.get(name, (None,))[0], DIGITS) for part in parts]
        if {*map(str, values)} - {"None", ""}:
            numbers.append((name, *values, units))
    single = [row for row in case if all(isinstance(value, str | int | float) for value in row[1:-1])][:_NAMED]
    apart = [_changes(single, side) for side in range(1, len(parts) + 1)]
    names = [", ".join(filter(None, pair)) for pair in zip((part.name for part in parts), apart, strict=True)]
    letters = "ABC"[: len(parts)]
    files = [f"{letter}: {part.name}" for letter, part in zip(letters, parts, strict=True)]
    try:
        draw = partial(over_each_other.draw, results, "", files, in_a_row=len(parts) > _NARROW)
        pictures = [picture(PICTURE + THIRD * (len(parts) > _NARROW), draw)]
    except UsageError:  # no curves that could be drawn over each other
        pictures = [part.picture for part in parts if part.picture]
    titles = [part.title for part in parts]
    title = " – ".join(titles)
    if len({*titles}) == 1:
        steps = [f"{name} {' → '.join(shown(v, units) for v in values)}" for name, *values, units in single]
        title = f"{titles[0]}: {', '.join(steps) or ' – '.join(names)}"
        titles = [", ".join(filter(None, pair)) for pair in zip(files, apart, strict=True)]
    head = ("", *letters, *(f"{letter} against A" for letter in letters[1:]))
    most = len(case) if full else _MOST_KEYS
    blocks: list[Any] = [_table(case[:most], head) if case else Texts(["The cases are the same."])]
    if more := ", ".join(name for name, *_ in case[most:]):
        blocks.append(Texts([f"Different, too: {textwrap.shorten(more, _MOST_LETTERS, placeholder=' …')}."]))
    if not full:  # what is the same is no news
        numbers = [row for row in numbers if len({*map(str, row[1:-1])}) > 1][:_MOST_NUMBERS]
    if chosen:
        blocks.append(Texts([f"Not given as numbers in the files, and different, too: {', '.join(chosen)}."]))
    advice = [part.advice for part in parts if part.advice]
    best = best_of(dict(zip(letters, advice, strict=True))) if len(advice) == len(parts) else ""
    squeal = [part.squeal for part in parts if part.squeal]
    if len(squeal) == len(parts):
        best = seldom_of(dict(zip(letters, squeal, strict=True)))
    return Beside(title, best, names, titles, blocks, _table(numbers, head), pictures)


def _changes(rows: Sequence[tuple[Any, ...]], side: int) -> str:
    """The changed keys of one result with their values; both ends of a range together."""
    said = list[str]()
    for row, after in zip(rows, [*rows, ("",)][1:], strict=True):
        value = shown(row[side], row[-1])
        key, _, end = row[0].rpartition(", ")
        if end == "low" and after[0] == f"{key}, high":
            value = f"{shown(row[side])} … {shown(after[side], after[-1])}"
            said.append(f"{key} {value}")
        elif end != "high" or not said or not said[-1].startswith(f"{key} "):
            said.append(f"{row[0]} = {value}")
    return ", ".join(said)


def _with_its_key(name: str, every: Sequence[Mapping[str, Any]]) -> tuple[str, str]:
    """A key of a sweep or a study by the key of the case that it is about, if that is the same, and its unit."""
    table, _, what = name.rpartition(".")
    places = [f"{table}.{key}" for key in _ABOUT]
    about = [next((case_keys[name] for name in places if name in case_keys), "") for case_keys in every]
    one = about[0]
    if "[" not in table or what in _ABOUT or not isinstance(one, str) or not one or about.count(one) < len(about):
        return name, key_unit(name)
    return f"{one}, {what}", key_unit(one) if what in _IN_ITS_UNIT else ""


def best_of(designs: Mapping[str, AdviceReport]) -> str:
    """Which designs are best against squeal, and by what; empty where one of them does not slide.

    Those whose critical friction is largest, over their own, and of which fewest squeal under a scatter. Margins
    are told apart by their first digits, as numbers of a page are, and shares where their 95 % intervals do not
    meet.
    """
    if any(advice.stability.equilibrium is None or not advice.stability.belt_speed for advice in designs.values()):
        return ""
    times = {name: _times(advice) for name, advice in designs.items()}
    far = [name for name, ratio in times.items() if ratio == max(times.values())]
    finite = [f"{ratio:.4g} for {name}" for name, ratio in times.items() if math.isfinite(ratio)]
    by = [f"critical friction over own friction is {listed(finite)}"] if finite else []
    by += [f"no friction makes {name} squeal" for name, ratio in times.items() if math.isinf(ratio)]
    seldom = [*designs]
    squeals = {name: advice.squeal for name, advice in designs.items() if advice.squeal}
    if len(squeals) == len(designs):
        least = min(squeals.values(), key=lambda squeal: squeal.squeal_probability)
        seldom = [name for name, squeal in squeals.items() if squeal.squeal_lower <= least.squeal_upper]
        per_cent = {name: 100.0 * squeal.squeal_probability for name, squeal in squeals.items()}
        shares = listed([f"{probability:.2g} % of {name}" for name, probability in per_cent.items()])
        by.append(f"under a scatter {next(iter(designs.values())).scatter} {shares} squeal")
    both = [name for name in far if name in seldom]
    better, larger, fewer = ("better", "larger", "fewer") if len(designs) == 2 else ("best", "largest", "fewest")
    said = f"the {larger} margin is that of {listed(far)}, but {fewer} squeal of {listed(seldom)}"
    if len(both) == len(designs):
        said = f"{listed(both)} do not differ in what decides on squeal"
    elif both:
        said = f"{listed(both)} {'is' if len(both) == 1 else 'are'} {better} against squeal"
    return sentence(f"{said}: {'; '.join(by)}")


def seldom_of(squeal: Mapping[str, Shares]) -> str:
    """Of which designs fewest squeal; empty where the 95 % intervals of all meet that of the fewest."""
    least = min(squeal.values())
    seldom = [name for name, (_, low, _) in squeal.items() if low <= least[2]]
    if len(seldom) == len(squeal):
        return ""
    better = "better" if len(squeal) == 2 else "best"
    said = f"{listed(seldom)} {'is' if len(seldom) == 1 else 'are'} {better} against squeal"
    shares = [
        f"{100.0 * middle:.3g} % ({100.0 * low:.3g} to {100.0 * high:.3g} %) of {name}"
        for name, (middle, low, high) in squeal.items()
    ]
    return sentence(f"{said}: {listed(shares)} squeal")


def _times(advice: AdviceReport) -> float:
    """Critical friction over a design's own; infinite where no friction makes it unstable, or none acts."""
    return math.inf if advice.margin is None else float(f"{1.0 + advice.margin:.{DIGITS}g}")


def _table(rows: Sequence[tuple[Any, ...]], head: Sequence[str]) -> Table:
    """Name, all values, and by how much they differ from the first, of rows that end with the unit."""
    cells = list[tuple[str, ...]]()
    marked = list[int]()
    for name, first, *others, units in rows:
        changes = [_change(first, other, units) for other in others]
        if {*changes} != {_SAME}:
            marked.append(len(cells))
        cells.append((name, *(shown(value, units) for value in (first, *others)), *changes))
    return Table(cells, head, marked=marked)


def _change(a: Any, b: Any, units: str) -> str:
    """What became of a number: by how much it changed, in per cent of what it was where that says more or less.

    A number below 0 has no per cent, and a part of a whole has its own: their difference is said, in points.
    """
    if a == b:
        return _SAME
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in (a, b)):
        if units == PER_CENT or min(a, b) < 0.0:
            more = rounded(float(b - a), _OF_CHANGE)
            sign = "+" if more > 0.0 else ""
            return sign + shown(more, "points" if units == PER_CENT else units)
        if a and b / a - 1.0 < MOST_PART:
            return percent(b / a - 1.0)
    return "differs"
