"""How much there is to read: `make words`.

Counted are words of the pages outside code, tables, formulas and the targets of links, with the median length of a
sentence and the number of sentences beyond 30 words. Pages that a program writes are left out.
"""

import json
import re
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[1]
WRITTEN = {"extremes.md", "paper-claims.md", "performance.md", "statistics.md"}
"""Pages of `make extremes`, `make paper`, `make bench` and `make statistics`."""
NO_PROSE = (
    r"\A---\n.*?\n---\n",
    r"(?ms)^(`{3,}|~{3,}|:{3,}).*?^\1",
    r"(?s)<!--.*?-->",
    r"(?m)^\|.*$",
    r"(?s)\$\$.*?\$\$",
    r"\$[^$\n]*\$",
    r"\]\([^)]*\)",
    r"(?m)^#.*$",
)


def prose(path: Path) -> str:
    """The sentences of a page or a notebook."""
    text = path.read_text()
    if path.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    for pattern in NO_PROSE:
        text = re.sub(pattern, " ", text)
    return text


def main() -> None:
    """Print words, the median of sentences and long sentences of each page, and the sum."""
    pages = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("docs/*.ipynb")]
    total = 0
    print(f"{'words':>6} {'median':>7} {'beyond 30':>10}")
    for path in sorted(pages):
        if path.name not in WRITTEN | {"CHANGELOG.md"} and ".template" not in path.name:
            sentences = [len(each.split()) for each in re.split(r"(?<=[.?!:])\s+|\n\s*\n|\n[-*]\s", prose(path))]
            sentences = [count for count in sentences if count > 1]
            words = sum(sentences)
            long = sum(count > 30 for count in sentences)
            total += words
            print(f"{words:6d} {median(sentences):7.0f} {long:10d} {path.relative_to(ROOT)}")
    print(f"{total:6d} in all")


if __name__ == "__main__":
    main()
