"""Reproduces the paper's claims: runs the sweeps of cases/paper and writes docs/paper-claims.md with its pictures.

`--keep` takes the results that are there, and computes only what is missing. All numbers of the page come from the
results.
"""

from pathlib import Path

from paper_page import page, touching_by_load
from paper_pictures import draw
from paper_results import compute


def main() -> None:
    """Run, draw and write."""
    results = compute()
    touching = touching_by_load(results)
    draw(results, touching)
    Path(__file__).with_name("paper-claims.md").write_text(page(results, touching))


if __name__ == "__main__":
    main()
