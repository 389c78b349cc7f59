"""Results → one page: a single HTML file that needs no network, no mouse and no other file."""

import base64
import hashlib
from collections.abc import Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.about import __version__
from brakecli.errors import UsageError, installed, printable
from brakecli.files.atomic import check_target, new_output
from brakecli.files.read import StoredResult, open_result
from brakecli.files.trust import readings

if TYPE_CHECKING:
    from brakecli.reports.blocks import Part
    from brakecli.solver.integrate import Counted

LARGEST = 3_000_000  # bytes


def write_report(results: Sequence[Path], target: Path, *, force: bool, progress: "Counted") -> None:
    """Write the page of some results.

    Raises UsageError for another suffix, an existing target without `force`, a page that would be too large, and
    where a library is missing; UnreadableResultError; CannotWriteError.
    """
    check_target(target, "a page", (".html", ".htm"), results)
    with installed("matplotlib", "jinja2"):
        import jinja2
        import matplotlib.figure  # noqa: F401
    from brakecli.reports.of_run import part_of_run
    from brakecli.reports.of_sweep import part_of_other, part_of_sweep
    from brakecli.reports.of_two import pair_of

    def part(stored: StoredResult) -> "Part":
        kind = str(stored.attributes.get("kind"))
        if kind == "run":
            return part_of_run(stored, progress)
        if kind not in ("sweep", "comparison", "stability", "branch", "scatter"):
            what = f"holds a result of kind {printable(kind)}, of which there is no report"
            raise UsageError(f"{stored.path}: {what}")
        return part_of_sweep(stored) if kind == "sweep" else part_of_other(stored)

    with new_output(target, force=force) as file:
        parts = []
        pair = None
        for number, result in enumerate(results):
            progress("results", number, len(results))
            with open_result(result) as stored:
                parts.append(part(stored))
        if len(results) == 2:
            with open_result(results[0]) as a, open_result(results[1]) as b:
                pair = pair_of((a, b), parts)
        if pair:
            parts = [replace(part, title=title) for part, title in zip(parts, pair.titles, strict=True)]
        script = _file("report.js")
        loader = jinja2.FunctionLoader(_file)
        environment = jinja2.Environment(
            autoescape=True, undefined=jinja2.StrictUndefined, loader=loader, trim_blocks=True, lstrip_blocks=True
        )
        environment.policies["json.dumps_kwargs"] = {"ensure_ascii": False}  # in order, and short
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        page = environment.get_template("report.html").render(
            parts=parts, pair=pair, script=script, digest=digest, version=__version__, mark=readings.mark()
        )
        data = page.encode()
        if len(data) >= LARGEST:
            problem = f"the page would have {len(data) / 1e6:.1f} MB, and {LARGEST / 1e6:.0f} MB are the limit"
            raise UsageError(f"{target}: {problem}; name fewer results, and write several pages")
        file.write(data)
        file.publish()


def _file(name: str) -> str:
    return resources.files("brakecli.reports").joinpath(name).read_text(encoding="utf-8")
