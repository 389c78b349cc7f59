"""`brakecli classify`."""

from functools import partial
from typing import Annotated

from brakecli.cli.measured import UNMEASURED, with_measured
from brakecli.cli.options import AsJson, Details, Quiet, option, source_argument
from brakecli.cli.output import show_result, warn
from brakecli.errors import UnreadableResultError, UsageError
from brakecli.front.measured import Measured
from brakecli.front.verdict import verdict_on

SOURCES = (
    "Results of runs; with --quantity measured signals: text files, .wav, datasets of HDF5 files (FILE.h5:/path)."
)
_NO_SECOND = "there is none any more: every verdict asks what the motion comes to without the waves; leave it out"
THRESHOLD = option("Change a threshold of the verdict; repeatable.", "NAME=VALUE", "--threshold")


@with_measured
def command(
    sources: Annotated[list[str], source_argument("FILE", SOURCES)],
    measured: Measured = UNMEASURED,
    thresholds: Annotated[list[str] | None, THRESHOLD] = None,
    second_run: Annotated[bool, option("Gone.", None, "--second-run", hidden=True)] = False,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Regime of runs or of measured signals, with evidence."""
    if second_run:
        raise UsageError(f"--second-run: {_NO_SECOND}")
    if len(sources) == 1:
        from brakecli.views.motion import of_verdict

        source = sources[0]
        numbers = verdict_on(sources[0], measured, thresholds)
        warn(*numbers.get("warnings", ()))
        shown = {"source": source, **numbers}
        view = partial(of_verdict, numbers, source)
        show_result("classify", shown, view, as_json=as_json, quiet=quiet, details=details)
        return
    from brakecli.views.motion import of_verdicts

    results = []
    failures = []
    for source in sources:  # one that cannot be read does not keep the others from being judged
        try:
            results.append({"source": source, **verdict_on(source, measured, thresholds)})
            warn(*results[-1].get("warnings", ()))
        except (UnreadableResultError, UsageError) as error:
            failures.append(error)
            results.append({"source": source, "error": str(error)})
    found = {"results": results}
    show_result("classify", found, lambda show: of_verdicts(results), as_json=as_json, quiet=quiet)
    if failures:
        raise type(failures[0])("\n".join(dict.fromkeys(str(error) for error in failures)))
