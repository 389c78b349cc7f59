"""docs/statistics.md, from all that was judged."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.statistics.cases import KINDS
from benchmarks.statistics.judging import BETTER, Judged

PAGE = Path(__file__).parents[2] / "docs" / "statistics.md"
QUANTILES = (0.0, 0.05, 0.5, 0.95)
BAR = 40  # signs of the longest bar
MOST = 10  # half decades of the largest ratios that are told apart: a shoe at rest has no error
INTRODUCTION = """# Estimates and errors

Does a run keep its tolerance, and is its estimate above its error? `make statistics` runs {runs} random cases of
ten kinds as `brakecli run` does, with tolerances between 1e-2 and 1e-10. It writes this page.

The reference shares no code with `brakecli`. It integrates the contact force exactly, in steps of order 8 that end
at events. It runs a second time with ten times the error in a step, and from one rounding away. The difference
counts as its error.

- The **error** is the largest deviation of $x$, $y$, $\\dot x$ and $\\dot y$ over all samples, each relative to
  its largest value.
- The **estimate** is the `estimated_error` of the run.
- A promise is **broken** if the error exceeds the tolerance, before `certified_until` where the run is not
  certified.
- An estimate is **low** if the error exceeds it by more than the error of the reference.

A run is compared as long as the reference is {better:g} times better than the tolerance. Cases *near grazing* just
reach stick or lift-off, or just miss it, by 1e-2 to 1e-10 of the wheel's speed or of the start. *Amplifying*
motions are self-excited, for up to 250 periods.
"""


def page(found: Sequence[Judged], unknown: int) -> str:
    """The page; `unknown` is the number of cases without a reference."""
    parts = [INTRODUCTION.format(runs=len(found) + unknown, better=BETTER), _summary(found, unknown)]
    parts += ["## By kind\n", _by(found, "kind", KINDS, lambda each: each.drawn.kind)]
    parts += ["## By tolerance\n", by_tolerance(found)]
    parts += ["## By method\n", _by(found, "method", tuple(sorted({_method(each) for each in found})), _method)]
    parts += ["## The ratio of estimate to error\n", _histogram(found)]
    if faults := [each for each in found if each.faulty]:
        parts += ["## Exceptions\n", *(f"- {each}" for each in faults), ""]
    return "\n".join(parts)


def by_tolerance(found: Sequence[Judged]) -> str:
    """A table with a row for each pair of decades."""
    scales = tuple(f"{10.0**-n:g} to {10.0 ** -(n + 2):g}" for n in (2, 4, 6, 8))
    return _by(found, "tolerance", scales, lambda each: scales[_scale(each)])


def _scale(each: Judged) -> int:
    """Which pair of decades holds the tolerance."""
    return min(3, int((-math.log10(each.drawn.tolerance) - 2.0) // 2.0))


def _method(each: Judged) -> str:
    """How the error was estimated."""
    for sign, name in (
        ("held against", "a difference scheme, held against one of these"),
        ("nodes", "the error carried along, on nodes"),
        ("carried", "the error carried along, exact or closed-form contact"),
        ("rounding", "exact steps"),
        ("piecewise", "exact steps, twice"),
    ):
        if sign in each.method:
            return name
    return "steps"


def _summary(found: Sequence[Judged], unknown: int) -> str:
    """The result in a few sentences."""
    broken = sum(each.broken or each.broken_early for each in found)
    low = sum(each.low for each in found)
    sure = sum(each.certified for each in found)
    part = sum(each.compared < 1.0 for each in found)
    hidden = sum(each.error <= each.own for each in found)
    words = [
        f"Of {len(found)} runs {sure} are certified. Broken promises: **{broken}**. Low estimates: **{low}**.",
        f"In {part} runs only a part is compared. In {hidden} runs the error is below that of the reference.",
        "There the error of the reference takes its place in the ratios.",
    ]
    if unknown:
        words.append(f"{unknown} more cases have no reference: they grow beyond bounds or take too many steps.")
    return "\n".join(words) + "\n"


def _by(found: Sequence[Judged], head: str, names: Sequence[str], name_of: Callable[[Judged], str]) -> str:
    """A table with one row for each name."""
    quantiles = ["least estimate / error", *(f"{100 * q:.0f} %" for q in QUANTILES[1:])]
    lines = [
        f"| {head} | runs | certified | broken | low | largest error / tolerance | "
        + " | ".join(quantiles)
        + " |",
        "|---" * (6 + len(quantiles)) + "|",
    ]
    for name in names:
        rows = [each for each in found if name_of(each) == name]
        if not rows:
            continue
        sure = [each.error / each.drawn.tolerance for each in rows if each.certified]
        numbers = [
            len(rows),
            len(sure),
            sum(each.broken or each.broken_early for each in rows),
            sum(each.low for each in rows),
        ]
        ratios = np.quantile([each.ratio for each in rows], QUANTILES)
        texts = [*map(str, numbers), f"{max(sure):.2g}" if sure else "", *(f"{each:.2g}" for each in ratios)]
        lines.append(f"| {name} | " + " | ".join(texts) + " |")
    return "\n".join(lines) + "\n"


def _histogram(found: Sequence[Judged]) -> str:
    """How many runs have a ratio in each half decade. Errors that the reference cannot see stand apart."""
    binned = [(min(math.floor(2.0 * math.log10(each.ratio)), MOST), each.error > each.own) for each in found]
    seen, unseen = (Counter(n for n, known in binned if known == is_seen) for is_seen in (True, False))
    most = max(seen[n] + unseen[n] for n in {*seen, *unseen})
    lines = ["| estimate / error | runs | of these at least | |", "|---|---|---|---|"]
    for n in range(min({*seen, *unseen}), max({*seen, *unseen}) + 1):
        bar = "█" * math.ceil(BAR * (seen[n] + unseen[n]) / most)
        low = 10.0 ** (n / 2.0)
        high = 10.0 ** ((n + 1) / 2.0)
        ratio = f"{low:.2g} to {high:.2g}" if n < MOST else f"{low:.2g} and more"
        lines.append(f"| {ratio} | {seen[n] + unseen[n]} | {unseen[n]} | {bar} |")
    note = "The third column counts errors below that of the reference: their ratio is larger."
    return "\n".join([*lines, "", note, ""])
