"""`brakecli classify`."""

from functools import partial
from typing import Annotated, cast

import typer

from brakecli.api.records import Classify
from brakecli.api.verdict import verdict_on
from brakecli.cli.options import AsJson, Details, Quiet, with_options
from brakecli.cli.output import show_result, warn
from brakecli.errors import UnreadableResultError, UsageError

_NO_SECOND = "there is none any more: every verdict asks what the motion comes to without the waves; leave it out"


@with_options
def command(
    options: Classify,
    second_run: Annotated[bool, typer.Option("--second-run", help="Gone.", hidden=True)] = False,
    details: Details = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Regime of runs or of measured signals, with evidence."""
    if second_run:
        raise UsageError(f"--second-run: {_NO_SECOND}")
    sources = cast(list[str], options.source)
    if len(sources) == 1:
        from brakecli.views.motion import of_verdict

        source = sources[0]
        numbers = verdict_on(source, options)
        warn(*numbers.get("warnings", ()))
        view = partial(of_verdict, numbers, source)
        shown = {"source": source, **numbers}
        show_result("classify", shown, view, as_json=as_json, quiet=quiet, details=details)
        return
    from brakecli.views.motion import of_verdicts

    results = []
    failures = []
    for source in sources:  # one that cannot be read does not keep the others from being judged
        try:
            results.append({"source": source, **verdict_on(source, options)})
            warn(*results[-1].get("warnings", ()))
        except (UnreadableResultError, UsageError) as error:
            failures.append(error)
            results.append({"source": source, "error": str(error)})
    show_result("classify", {"results": results}, lambda show: of_verdicts(results), as_json=as_json, quiet=quiet)
    if failures:
        raise type(failures[0])("\n".join(dict.fromkeys(str(error) for error in failures)))
