"""Run the campaign of the extremes and write its page."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.extremes.judging import (
    COARSEST,
    EVENT_TOLERANCE,
    FLAT,
    KINDS,
    MOST_ERROR,
    PERIODS,
    SCHEMES,
    STEPS_PER_PERIOD,
    TRUTH,
    Outcome,
    Scheme,
    Tables,
    Truth,
)
from benchmarks.extremes.long_runs import (
    DRIFT_STEPS,
    HOURS,
    LIMIT_CASES,
    LIMIT_STEPS,
    LIMITED,
    MOST_LIMIT,
    SETTLING,
    drift,
    hours,
    limits,
)
from benchmarks.extremes.points import DRAWN, POINTS, Family, campaign, drawn, together

PAGE = Path(__file__).parents[2] / "docs" / "extremes.md"
INTRODUCTION = """# The extremes

What comes of numbers far beyond those of any brake? `make extremes` writes this page.

One quantity at a time is varied. The base case is a shoe that vibrates with stick on a smooth wheel, or one on a
rough wheel whose pad opens in part. Each scheme computes {periods:g} periods of the fastest motion from rest, with
{steps} steps per period unless the step is varied. The event-driven scheme has a tolerance of {event:g}.

- **right**: the errors of x, y, ẋ and ẏ, relative to the largest value of each, are below a bound. The reference
  is the event-driven scheme at {truth:g}. The bound is [2(ωh)^p ωT + 2(rh)^p + 2/n² + j] e^(σT). ω is that of the
  fastest motion, r the rate of overcritical dashpots, p the order of the scheme, T the duration, σ the growth
  rate. n is the nodes per wave, at least {coarsest:g}, and j the change of ẋ in a step by the largest jump of
  friction.
  The bound of the event-driven scheme is its tolerance. No error above {most:g} is right.
- **warned**: the error exceeds the bound, and a warning names the key and the number that cause this.
- **refused**: `brakecli run` refuses the case and says why.
- **failed by name**: the run ends with a failure that has a name and a remedy.
- **silently wrong**: the error exceeds the bound, and no message says so. There must be none.

The bound applies to a few periods. The phase error of an undamped vibration grows on, by (ωh)²/12 per radian at
weights of one half. A run of thousands of periods needs more steps per period, or `solver.tolerance`.
"""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of the page."""
    return "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---"] * len(head), *rows])


def _size(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.1e}"


Point = tuple[Family, float, Truth, dict[Scheme, Outcome]]


def outcomes_text(points: Sequence[Point]) -> str:
    """What came of the campaign, in tables."""
    counts = [
        [scheme.text, *(str(sum(point[3][scheme].kind == kind for point in points)) for kind in KINDS)]
        for scheme in SCHEMES
    ]
    ranges = []
    others = []
    for family in dict.fromkeys(point[0] for point in points):
        mine = [point for point in points if point[0] is family]
        cells = []
        for scheme in SCHEMES:
            right = [point[3][scheme].error for point in mine if point[3][scheme].kind == "right"]
            cells.append(f"{len(right)} of {len(mine)}, {max(right):.1e}" if right else f"0 of {len(mine)}")
        low = min(family.values)
        high = max(family.values)
        ranges.append([family.name, f"{low:g} to {high:g}", family.unit, *cells])
        for scheme in SCHEMES:
            for kind in KINDS[1:]:
                rest = [(point[1], point[3][scheme]) for point in mine if point[3][scheme].kind == kind]
                if not rest:
                    continue
                values = f"{rest[0][0]:g}" + (f" to {rest[-1][0]:g}, {len(rest)} points" if len(rest) > 1 else "")
                sizes = [outcome.error for _, outcome in rest]
                error = _size(min(sizes)) + (
                    f" to {_size(max(sizes))}" if len(rest) > 1 and sizes[0] == sizes[0] else ""
                )
                others.append([family.name, scheme.text, values, kind, error, rest[0][1].words])
    held = sorted(point[2].apart for point in points if not math.isnan(point[2].apart))
    without = sum(point[2].rows is None for point in points)
    return f"""## What came of it

{table(["scheme", *KINDS], counts)}

The number of points that are right, and their largest error:

{table(["varied", "range", "unit", *(scheme.text for scheme in SCHEMES)], ranges)}

At {len(held)} of the {len(points)} points the shoe slides one way in full contact, and the motion is linear.
There the reference differs from the matrix exponential by at most {held[-1]:.0e}, at half of them by at most
{held[len(held) // 2]:.0e}.
Points without a reference: {without}.

These are all runs that are not right, with the message at the first of the values:

{table(["varied", "scheme", "values", "outcome", "error", "message"], others)}
"""


def together_text() -> str:
    """What came of the drawn points."""
    points = list(together(POINTS))
    rows = []
    for scheme in SCHEMES:
        mine = [point[scheme] for point in points]
        right = [outcome.error for outcome in mine if outcome.kind == "right"]
        counts = (str(sum(outcome.kind == kind for outcome in mine)) for kind in KINDS)
        rows.append([scheme.text, *counts, _size(float(np.median(right))), _size(max(right))])
    ranges = table(
        ["drawn", "from", "to"], [[f"`{key}`", f"1e{low}", f"1e{high}"] for key, (low, high) in DRAWN.items()]
    )
    wrong = [
        f"- {scheme.text}, off by {outcome.error:.2g}: {_differences(tables)}"
        for tables, point in zip(drawn(POINTS), points, strict=True)
        for scheme, outcome in point.items()
        if outcome.kind == "silently wrong"
    ]
    heading = "These points are silently wrong, with their changes of the base case:"
    told = "\n".join((heading, "", *wrong)) if wrong else "None is silently wrong."
    return f"""## Several at a time

At each of {POINTS} random points on smooth surfaces three of these quantities are drawn, in SI units and evenly in
their logarithms. Each of the two angles is drawn at a third of the points.

{ranges}

Here a run is right if its error is at most {MOST_ERROR:g}. Of the event-driven scheme it is the tolerance at most.

{table(["scheme", *KINDS, "median error of right ones", "largest"], rows)}

{told}
"""


def _differences(tables: Tables) -> str:
    """What tables change in the base case."""
    return ", ".join(
        f"{name}.{key} = {value:.6g}"
        for name, table_ in tables.items()
        for key, value in table_.items()
        if FLAT[name].get(key) != value
    )


def limits_text() -> str:
    """The limits of stability."""
    rows = []
    for name, tables in LIMIT_CASES.items():
        cells = []
        for scheme in LIMITED:
            predicted, observed = limits(tables, scheme)
            cells.append(
                " / ".join("none" if value is None else f"{value:.4g}" for value in (predicted, observed))
            )
        rows.append([name, *cells])
    return f"""## Limits of stability

The largest stable step times ω of the fastest motion, without friction: first as `brakecli stability` predicts it,
then as seen in runs of {LIMIT_STEPS} steps. "none" means no limit up to {MOST_LIMIT:g}. The event-driven scheme
has none.

{table(["shoe", *(scheme.text for scheme in LIMITED)], rows)}
"""


def drift_text() -> str:
    """The drift of energy."""
    rows = [[scheme.text, *(f"{drift(scheme, count):.1e}" for count in (10, 100))] for scheme in SCHEMES]
    return f"""## Drift of energy

The relative change of the energy of a free vibration over {DRIFT_STEPS} steps, without dashpots and friction. The
event-driven scheme computes the same periods to {EVENT_TOLERANCE:g}. The weights (1, 1) take all of it;
`brakecli check` warns of this.

{table(["scheme", "10 steps per period", "100 steps per period"], rows)}
"""


def hours_text() -> str:
    """Hours of motion."""
    rows = [[scheme.text, f"{hours(scheme):.0e}"] for scheme in SCHEMES]
    return f"""## Hours of motion

A run of a heavy shoe on a rough wheel over {HOURS:g} s ends like one over {SETTLING:g} s that begins with the
wheel's phases {SETTLING:g} s before that end. The table gives the largest difference in the last 10 s, relative to
the range of each quantity. It is rounding. With the event-driven scheme it is the error of a run to
{EVENT_TOLERANCE:g}.

{table(["scheme", "difference"], rows)}
"""


def main(page: Path = PAGE) -> None:
    """Run the campaign and write the page."""
    introduction = INTRODUCTION.format(
        truth=TRUTH,
        periods=PERIODS,
        steps=STEPS_PER_PERIOD,
        event=EVENT_TOLERANCE,
        coarsest=COARSEST,
        most=MOST_ERROR,
    )
    parts = (outcomes_text(list(campaign())), together_text(), limits_text(), drift_text(), hours_text())
    page.write_text("\n".join((introduction, *parts)))


if __name__ == "__main__":
    main()
