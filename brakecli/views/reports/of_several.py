"""Two or three results of one kind beside each other: what was changed, and what became of it."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

from brakecli.errors import UsageError
from brakecli.results.contents import keys
from brakecli.results.read import StoredResult
from brakecli.studies.runs.advise import AdviceReport
from brakecli.studies.scattering.answers import listed
from brakecli.views.plots import over_each_other
from brakecli.views.reports.blocks import (
    PER_CENT,
    Beside,
    Block,
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
DIGITS = 4  # to which numbers are compared
_MOST_KEYS = 5  # on a single page
_CHOSEN = "solver.duration", "output.sample_interval"  # by the program, where a file gives no numbers
_SAME = "same"
_ABOUT = "key", "parameter"  # of the tables of a study and of a sweep
_IN_ITS_UNIT = "low", "high", "mean", "mode", "deviation", "start", "stop", "values"


class _Row(NamedTuple):
    """The values that all results have under one name."""

    name: str
    values: Sequence[object]
    unit: str


def beside(results: Sequence[StoredResult], parts: Sequence[Part], full: bool) -> Beside | None:
    """What a page says of all of them together, if they are of one kind; rows that are many only if it is `full`.

    Raises UnreadableResultError.
    """
    if len({str(result.attributes.get("kind")) for result in results}) != 1:
        return None
    sources = [keys(result, ("case_toml",)) for result in results]
    fixed = [name for name in _CHOSEN if any(isinstance(source.get(name), int | float) for source in sources)]
    case = list[_Row]()
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
            label, unit = _with_its_key(name, every)
            case.append(_Row(label, values, unit))
    units = {name: unit for part in parts for name, (_, unit) in part.numbers.items()}
    numbers = []
    for name, unit in units.items():
        values = [rounded(part.numbers.get(name, (None,))[0], DIGITS) for part in parts]
        if {*map(str, values)} - {"None", ""}:
            numbers.append(_Row(name, values, unit))
    single = [row for row in case if all(isinstance(value, str | int | float) for value in row.values)]
    single = single[:2]  # by which the results are named
    apart = [_changes(single, side) for side in range(len(parts))]
    names = [", ".join(filter(None, pair)) for pair in zip((part.name for part in parts), apart, strict=True)]
    letters = "ABC"[: len(parts)]
    files = [f"{letter}: {part.name}" for letter, part in zip(letters, parts, strict=True)]
    try:
        three = len(parts) > 2  # of which the picture stands below their numbers, and not beside them
        draw = partial(over_each_other.draw, results, "", files, in_a_row=three)
        pictures = [picture(PICTURE + THIRD * three, draw)]
    except UsageError:  # no curves that could be drawn over each other
        pictures = [part.picture for part in parts if part.picture]
    titles = [part.title for part in parts]
    title = " – ".join(titles)
    if len({*titles}) == 1:
        steps = [f"{name} {' → '.join(shown(v, unit) for v in values)}" for name, values, unit in single]
        title = f"{titles[0]}: {', '.join(steps) or ' – '.join(names)}"
        titles = [", ".join(filter(None, pair)) for pair in zip(files, apart, strict=True)]
    head = ("", *letters, *(f"{letter} against A" for letter in letters[1:]))
    most = len(case) if full else _MOST_KEYS
    blocks: list[Block] = [_table(case[:most], head) if case else Texts(["The cases are the same."])]
    if more := ", ".join(row.name for row in case[most:]):
        blocks.append(Texts([f"Different, too: {textwrap.shorten(more, 180, placeholder=' …')}."]))
    if not full:  # what is the same is no news, and more does not fit on a single page
        numbers = [row for row in numbers if len({*map(str, row.values)}) > 1][:9]
    if chosen:
        blocks.append(Texts([f"Not given as numbers in the files, and different, too: {', '.join(chosen)}."]))
    advice = [part.advice for part in parts if part.advice]
    best = best_of(dict(zip(letters, advice, strict=True))) if len(advice) == len(parts) else ""
    squeal = [part.squeal for part in parts if part.squeal]
    if len(squeal) == len(parts):
        best = seldom_of(dict(zip(letters, squeal, strict=True)))
    return Beside(title, best, names, titles, blocks, _table(numbers, head), pictures)


def _changes(rows: Sequence[_Row], side: int) -> str:
    """The changed keys of one result with their values; both ends of a range together."""
    said = list[str]()
    for row, after in zip(rows, [*rows, None][1:], strict=True):
        value = shown(row.values[side], row.unit)
        key, _, end = row.name.rpartition(", ")
        if end == "low" and after and after.name == f"{key}, high":
            said.append(f"{key} {shown(row.values[side])} … {shown(after.values[side], after.unit)}")
        elif end != "high" or not said or not said[-1].startswith(f"{key} "):
            said.append(f"{row.name} = {value}")
    return ", ".join(said)


def _with_its_key(name: str, every: Sequence[Mapping[str, object]]) -> tuple[str, str]:
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


def _table(rows: Sequence[_Row], head: Sequence[str]) -> Table:
    """Names, all values, and by how much they differ from the first."""
    changes = [[_change(row.values[0], value, row.unit) for value in row.values[1:]] for row in rows]
    marked = [number for number, of_row in enumerate(changes) if {*of_row} != {_SAME}]
    cells = [
        (row.name, *(shown(value, row.unit) for value in row.values), *of_row)
        for row, of_row in zip(rows, changes, strict=True)
    ]
    return Table(cells, head, marked=marked)


def _change(a: object, b: object, unit: str) -> str:
    """What became of a number: by how much it changed, in per cent of what it was where that says more or less.

    A number below 0 has no per cent, and a part of a whole has its own: their difference is said, in points.
    """
    if a == b:
        return _SAME
    if not isinstance(a, int | float) or not isinstance(b, int | float) or bool in (type(a), type(b)):
        return "differs"
    if unit == PER_CENT or min(a, b) < 0.0:
        more = float(f"{float(b - a):.3g}")
        sign = "+" if more > 0.0 else ""
        return sign + shown(more, "points" if unit == PER_CENT else unit)
    # an increase of many times says nothing in per cent
    return percent(b / a - 1.0) if a and b / a - 1.0 < 10.0 else "differs"
