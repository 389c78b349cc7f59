"""Results → one page: a single HTML file that needs no network, no mouse and no other file."""

import base64
import hashlib
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.about import __version__
from brakecli.errors import UsageError, installed, printable
from brakecli.results.atomic import check_target, new_output
from brakecli.results.read import StoredResult, open_result

if TYPE_CHECKING:
    from brakecli.solver.integrate import Counted
    from brakecli.views.reports.blocks import Part

LARGEST = 3_000_000  # bytes


def write_report(
    results: Sequence[Path], target: Path, *, full: bool = False, force: bool, progress: "Counted"
) -> str:
    """Write the page of some results, which is given back as HTML: their answers, or `full` all that is known.

    Two or three results of one kind share a page. Raises UsageError for another suffix, an existing target without
    `force`, a page that would be too large, and where a library is missing; UnreadableResultError;
    CannotWriteError.
    """
    check_target(target, "a page", (".html", ".htm", ".pdf"), results)
    with installed("matplotlib", "jinja2"):
        import jinja2
        import matplotlib.figure  # noqa: F401
    printed = _printer() if target.suffix.lower() == ".pdf" else str.encode
    from brakecli.views.plots.over_each_other import MOST
    from brakecli.views.reports.of_run import part_of_run
    from brakecli.views.reports.of_several import beside
    from brakecli.views.reports.of_sweep import part_of_other, part_of_sweep

    def part_of(stored: StoredResult) -> "Part":
        kind = str(stored.attributes.get("kind"))
        if kind == "run":
            return part_of_run(stored, progress)
        if kind not in ("sweep", "comparison", "stability", "branch", "scatter"):
            what = f"holds a result of kind {printable(kind)}, of which there is no report"
            raise UsageError(f"{stored.path}: {what}")
        return part_of_sweep(stored) if kind == "sweep" else part_of_other(stored)

    with new_output(target, force=force) as file, ExitStack() as stack:
        parts = []
        opened = []
        for number, result in enumerate(results):
            progress("results", number, len(results))
            opened.append(stack.enter_context(open_result(result)))
            parts.append(part_of(opened[-1]))
        together = beside(opened, parts, full) if 2 <= len(results) <= MOST else None
        if together:
            parts = [replace(part, title=title) for part, title in zip(parts, together.titles, strict=True)]
        script = _file("report.js")
        loader = jinja2.FunctionLoader(_file)
        environment = jinja2.Environment(
            autoescape=True, undefined=jinja2.StrictUndefined, loader=loader, trim_blocks=True, lstrip_blocks=True
        )
        environment.policies["json.dumps_kwargs"] = {"ensure_ascii": False}  # in order, and short
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        page = environment.get_template("report.html").render(
            parts=parts,
            together=together,
            full=full,
            script=script,
            digest=digest,
            version=__version__,
        )
        data = printed(page)
        if len(data) >= LARGEST:
            problem = f"the page would have {len(data) / 1e6:.1f} MB, and {LARGEST / 1e6:.0f} MB are the limit"
            raise UsageError(f"{target}: {problem}; name fewer results, and write several pages")
        file.write(data)
        file.publish()
        return str(page)


def _printer() -> Callable[[str], bytes]:
    """What makes a PDF of a page; raises UsageError where it, or a library of the system for it, is missing."""
    try:
        with installed("weasyprint"):
            import weasyprint
    except OSError as error:
        what = f"weasyprint finds no library of the system that it needs ({printable(str(error).splitlines()[0])})"
        remedy = "install Pango, as with: apt install libpango-1.0-0 libpangoft2-1.0-0; or write an .html file"
        raise UsageError(f"{what}; {remedy}") from error
    alone = weasyprint.urls.URLFetcher(allowed_protocols=["data"])
    return lambda page: bytes(weasyprint.HTML(string=page, url_fetcher=alone).write_pdf())


def _file(name: str) -> str:
    return resources.files("brakecli.views.reports").joinpath(name).read_text(encoding="utf-8")
