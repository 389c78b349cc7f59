"""The tables of the documentation that list what a result holds, from brakecli/files/fields.py: `make tables`.

A table stands between `<!-- fields NAME … -->` and `<!-- end of fields -->`, where each NAME is one of that file.
With --check nothing is written: the exit code is 1 where a page does not agree with the declaration.
"""

import re
import sys
from pathlib import Path

from brakecli.files import fields

PLACE = re.compile(r"(<!-- fields ([A-Z_ ]+) -->\n).*?(<!-- end of fields -->)", re.DOTALL)
PAGES = ("result-format", "results", "regimes", "sweeps", "accuracy", "stability", "branches")


def table(names: str) -> str:
    """The rows of one or more declarations."""
    lines = ["", "| name | unit | meaning |", "|---|---|---|"]
    for row in (row for name in names.split() for row in getattr(fields, name)):
        meaning = row.meaning if row.in_file else f"{row.meaning} (JSON only)"
        lines.append(f"| `{row.name}` | {row.units} | {meaning} |".replace("|  |", "| |"))
    return "\n".join([*lines, "", ""])


def main() -> int:
    """Write the pages, or compare them."""
    code, check = 0, "--check" in sys.argv
    for name in PAGES:
        page = Path(__file__).parent / f"{name}.md"
        old = page.read_text()
        new = PLACE.sub(lambda place: place[1] + table(place[2]) + place[3], old)
        if new != old and check:
            print(f"docs/{page.name}: differs from brakecli/files/fields.py; run make tables")  # noqa: T201
            code = 1
        elif new != old:
            page.write_text(new)
    return code


if __name__ == "__main__":
    sys.exit(main())
