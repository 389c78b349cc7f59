"""The tables of the documentation that the program declares: `make tables`.

What a result holds stands between `<!-- fields NAME … -->` and `<!-- end of fields -->`, where each NAME is one of
`fields`, `stability_fields` and `contents` in brakecli/results/. The rows of a verdict stand between
`<!-- rows NAME -->` and `<!-- end of rows -->`, with a NAME of brakecli/analysis/regime/table.py. Their second
column, where a row holds, is written by hand; a new row has a `?` there.

With --check nothing is written: the exit code is 1 where a page does not agree with the program, or has a `?`.
"""

import re
import sys
from pathlib import Path
from typing import Any

from brakecli.analysis.regime import table as verdicts
from brakecli.analysis.regime.decision import Excitation, Regime, Row
from brakecli.results import contents, fields, stability_fields

PLACE = re.compile(r"(<!-- fields ([A-Z_ ]+) -->\n).*?(<!-- end of fields -->)", re.DOTALL)
ROWS = re.compile(r"(<!-- rows ([A-Z]+) -->\n)(.*?)(<!-- end of rows -->)", re.DOTALL)
CELLS = re.compile(r"^\| ([^|]+) \| ([^|]+) \|", re.MULTILINE)
UNKNOWN = "?"
KNOWN = vars(contents) | vars(stability_fields) | vars(fields)
PAGES = ("result-format", "results", "regimes", "sweeps", "accuracy", "stability", "branches", "scatter")


def table(names: str) -> str:
    """The rows of one or more declarations."""
    lines = ["", "| name | unit | meaning |", "|---|---|---|"]
    for row in (row for name in names.split() for row in KNOWN[name]):
        meaning = row.meaning if row.in_file else f"{row.meaning} (JSON only)"
        lines.append(f"| `{row.name}` | {row.units} | {meaning} |".replace("|  |", "| |"))
    return "\n".join([*lines, "", ""])


def rows(name: str, old: str) -> str:
    """The rows of a table of verdicts, with the words of the old page on where each holds."""
    words = dict(CELLS.findall(old))
    lines = ["", "| row | where | verdict | what to do |", "|---|---|---|---|"]
    for row in getattr(verdicts, name):
        where = words.get(row.name, UNKNOWN)
        remedy = re.sub(r"\{.*?\}", "…", row.remedy)
        lines.append(f"| {row.name} | {where} | {verdict(row)} | {remedy} |".replace("|  |", "| |"))
    return "\n".join([*lines, "", ""])


def verdict(row: Row[Any, Any]) -> str:
    """What a row says."""
    if (row.regime, row.excitation) == (Regime.UNDECIDED, Excitation.SELF_EXCITED):
        return "self-excited; see its look"
    return str(row.regime) if row.excitation is Excitation.NONE else f"{row.regime}, {row.excitation}"


def main() -> int:
    """Write the pages, or compare them."""
    code = 0
    check = "--check" in sys.argv
    for name in PAGES:
        page = Path(__file__).parent / f"{name}.md"
        old = page.read_text()
        new = PLACE.sub(lambda place: place[1] + table(place[2]) + place[3], old)
        new = ROWS.sub(lambda place: place[1] + rows(place[2], place[3]) + place[4], new)
        if new != old and check:
            print(f"docs/{page.name}: differs from what the program declares; run make tables")  # noqa: T201
            code = 1
        elif new != old:
            page.write_text(new)
        for row in re.findall(rf"^\| ([^|]+) \| {re.escape(UNKNOWN)} \|", new, re.MULTILINE):
            print(f"docs/{page.name}: write in the second column where the row {row!r} holds")  # noqa: T201
            code = 1
    return code


if __name__ == "__main__":
    sys.exit(main())
