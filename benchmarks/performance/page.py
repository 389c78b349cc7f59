"""The part of docs/performance.md that `make bench` writes: between two marks, whatever else the page holds."""

import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks.performance import in_c
from benchmarks.performance.ensembles import Rate
from benchmarks.performance.matching import TARGETS, US, Entry, cheapest, names, ratio
from benchmarks.performance.rows import Table

PAGE = Path(__file__).parents[2] / "docs" / "performance.md"
BEGIN = "<!-- bench: written by `make bench` -->"
END = "<!-- end of bench -->"
PACKAGES = ("numbalsoda", "heyoka", "diffrax", "jax", "scikit-sundae", "scipy", "numba", "numpy")
Goal = tuple[str, str, str, bool]
"""What, the goal, what was measured, whether it is reached."""


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    heads = list(heads)
    return [f"| {' | '.join(each)} |" for each in (heads, ["---"] * len(heads), *map(list, rows))] + [""]


def number(value: float) -> str:
    """Three digits, without an exponent where it reads well."""
    return f"{value:,.0f}" if value >= 1000.0 else f"{value:.3g}" if value >= 1e-3 else f"{value:.1e}"


def milliseconds(entry: Entry | None) -> str:
    return "not reached" if entry is None else f"{number(1e3 * entry.time)} ms"


def versions() -> str:
    found = []
    for name in PACKAGES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} is not installed")
    return ", ".join(found)


def head(load: float, minutes: float) -> list[str]:
    busy = "Other work was running at the same time." if load > 1.0 else "The machine had nothing else to do."
    where = f"{processor()}, Python {platform.python_version()}"
    return [
        f"One run of `make bench`, {minutes:.0f} minutes on {where}. {busy}",
        f"Peers: {versions()}.",
        "",
    ]


def processor() -> str:
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{len(models)} cores of {models[0]}" if models else platform.processor()


def absent(found: dict[tuple[str, float], list[Entry]]) -> list[str]:
    """What is not in the tables."""
    some = next(iter(found.values()))
    present = {who.split()[0] for who in names(some)}
    gone = [who for who in ("numbalsoda", "heyoka.py", "diffrax", "scikit-sundae", "SciPy") if who not in present]
    told = f"Not installed, and so not measured: {', '.join(gone)}; `make bench` says why. " if gone else ""
    return [f"{told}heyoka.py knows no distributed contact, so that it computes S alone.", ""]


def side_by_side(name: str, duration: float, entries: list[Entry]) -> list[str]:
    """Times of all programs by error, and how many times longer each takes than we do."""
    rows = []
    for who in names(entries):
        found = [cheapest(entries, who, target) for target in TARGETS]
        if who == US:
            rows.append([f"**{who}**", *(milliseconds(each) for each in found)])
            continue
        times = [milliseconds(each) for each in found]
        ratios = [ratio(entries, who, target) for target in TARGETS]
        rows.append(
            [who, *(f"{t} ({number(r)})" if r is not None else t for t, r in zip(times, ratios, strict=True))]
        )
    lines = [f"### {name}, {duration:g} s", ""]
    lines += table(["", *(f"{target:.0e}" for target in TARGETS)], rows)
    lines += ["What is the cheapest at 1e-3 and at 1e-6:", ""]
    for target in (1e-3, 1e-6):
        best = [(who, cheapest(entries, who, target)) for who in names(entries)]
        told = [f"{who} {each.label} (error {each.error:.0e})" for who, each in best if each]
        lines += [f"- {target:.0e}: " + ("; ".join(told) or "none reaches it") + "."]
    return [*lines, ""]


def goals(found: list[Goal]) -> list[str]:
    rows = [(what, goal, measured, "yes" if kept else "**no**") for what, goal, measured, kept in found]
    return table(["", "goal", "measured", "reached"], rows)


def rates(found: list[Rate]) -> list[str]:
    rows = [(each.who, each.what, number(each.per_second), number(each.per_cpu_second)) for each in found]
    return table(["", "how", "cases/s, all cores", "cases per second of a core"], rows)


def in_c_rows(found: list[in_c.Beside]) -> list[str]:
    rows = [
        (b.what, f"{1e9 * b.ours:.0f} ns", f"{1e9 * b.theirs:.0f} ns", number(b.ours / b.theirs), f"{b.apart:.0e}")
        for b in found
    ]
    return table(["", "brakecli", "C", "ratio", "apart"], rows)


def growth(tables: Iterable[Table]) -> list[str]:
    lines = []
    for title, heads, rows in tables:
        lines += [f"{title}:", "", *table(heads, rows)]
    return lines


def write(lines: list[str]) -> None:
    """Replace what stands between the marks."""
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    after = rest.split(END)[1]
    text = "\n".join(lines).rstrip()
    PAGE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")
