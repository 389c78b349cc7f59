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

`make extremes` writes this page; all its numbers come from `benchmarks/extremes`.
One quantity at a time is varied far beyond the range of any brake, in both directions. The base case is a shoe
that sticks, slips and vibrates on a smooth wheel, or one on a rough wheel whose pad opens in part. Each scheme
computes each point from rest, over {periods:g} periods of the fastest motion with {steps} steps per period, except
where the step is varied. The event-driven scheme runs to a certified tolerance of {event:g}, as in
`brakecli run`. The outcome of a run is one of these:

- **right**: the errors of x, y, ẋ and ẏ, relative to the largest value of each, are below a bound. The reference
  is the event-driven scheme at {truth:g}. With ω of the fastest motion, r the rate of overcritical dashpots, p the
  order of the scheme, T the duration, σ the growth rate of the motion and n the nodes per wave, the bound is
  [2(ωh)^p ωT + 2(rh)^p + 2/n² + j] e^(σT), where n counts as at least {coarsest:g}. The term j is the change of ẋ
  in one step by the largest jump of friction, because steps of fixed length do not know when in a step friction
  jumps. The bound of the event-driven scheme is its tolerance. No error above {most:g} is right.
- **warned**: the error exceeds the bound, and a warning of `brakecli check` or of the run names the key and the
  number that cause this.
- **refused**: `brakecli run` refuses the case and says why.
- **failed by name**: the run ends with a failure that has a name and a remedy.
- **silently wrong**: the error exceeds the bound, and no message says so. There must be none.

The bound applies to a few periods. The phase error of an undamped vibration continues to grow at the same rate,
(ωh)²/12 per radian at weights of one half. So a run of thousands of periods needs more steps per period, or
`solver.tolerance` in place of `solver.step`.
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

The table gives the number of points that are right, and their largest error:

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

{POINTS} points on smooth surfaces are drawn with a fixed seed. At each, three of these quantities are drawn, in SI
units and evenly in their logarithms. Each of the two angles is drawn at a third of the points.

{ranges}

The bound above applies to one quantity at a time. Here a run is right if its error is at most {MOST_ERROR:g}, or,
with the event-driven scheme, at most its tolerance.

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

The table gives the largest stable step times ω of the fastest motion on the springs, without friction. The first
value is the prediction of `brakecli stability`. The second one is observed in runs of {LIMIT_STEPS} steps from a
small disturbance, by bisection. "none" means no limit up to {MOST_LIMIT:g}. The event-driven scheme finds its
steps itself and has no limit.

{table(["shoe", *(scheme.text for scheme in LIMITED)], rows)}
"""


def drift_text() -> str:
    """The drift of energy."""
    rows = [[scheme.text, *(f"{drift(scheme, count):.1e}" for count in (10, 100))] for scheme in SCHEMES]
    return f"""## Drift of energy

The table gives the relative change of the energy of a free vibration in full contact, without dashpots and
friction, over {DRIFT_STEPS} steps with 10 and with 100 steps per period. The event-driven scheme computes the
same periods in one run to {EVENT_TOLERANCE:g}. The weights (1, 1) take all of it; `brakecli check` warns of this.

{table(["scheme", "10 steps per period", "100 steps per period"], rows)}
"""


def hours_text() -> str:
    """Hours of motion."""
    rows = [[scheme.text, f"{hours(scheme):.0e}"] for scheme in SCHEMES]
    return f"""## Hours of motion

A run of a heavy shoe on a rough wheel over {HOURS:g} s is compared with a run over {SETTLING:g} s. The wheel of
the short run starts with the phases that the wheel of the long run has {SETTLING:g} s before its end; they are
computed in fractions. Both motions have settled. The table gives the largest difference in their last 10 s,
relative to the range of each quantity there. It is rounding or, with the event-driven scheme, the error of one run
to {EVENT_TOLERANCE:g}.

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
