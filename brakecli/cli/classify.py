"""`brakecli classify`."""

import dataclasses
import difflib
import math
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

from brakecli.cli.measured import UNMEASURED, Measured, with_measured
from brakecli.cli.options import AsJson, ForceRead, Quiet, option, source_argument
from brakecli.cli.output import show_result, warn
from brakecli.errors import OtherKindError, UnreadableResultError, UsageError

SOURCES = (
    "Results of runs; with --quantity measured signals: text files, .wav, datasets of HDF5 files (FILE.h5:/path)."
)
_NO_SECOND = "there is none any more: every verdict asks what the motion comes to without the waves; leave it out"
_GONE = {
    "decayed_to": "what becomes of the motion is computed",
    "reach_within": "settled_within holds for x, too",
    "trend_errors": "it is called sure_errors",
    "forced_share": "lines of the roughness decide nothing any more",
}
THRESHOLD = option("Change a threshold of the verdict; repeatable.", "NAME=VALUE", "--threshold")


@with_measured
def command(
    sources: Annotated[list[str], source_argument("FILE", SOURCES)],
    measured: Measured = UNMEASURED,
    thresholds: Annotated[list[str] | None, THRESHOLD] = None,
    second_run: Annotated[bool, option("Gone.", None, "--second-run", hidden=True)] = False,
    force_read: ForceRead = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Regime of runs or of measured signals, with evidence."""
    if second_run:
        raise UsageError(f"--second-run: {_NO_SECOND}")
    options = Options(measured, thresholds)
    if len(sources) == 1:
        from brakecli.cli.tables import verdict_table

        source, numbers = sources[0], options.verdict(sources[0])
        warn(*numbers.get("warnings", ()))
        shown = {"source": source, **numbers}
        show_result("classify", shown, verdict_table, source, numbers, as_json=as_json, quiet=quiet)
        return
    from brakecli.cli.tables import verdicts_table

    results, failures = [], []
    for source in sources:  # one that cannot be read does not keep the others from being judged
        try:
            results.append({"source": source, **options.verdict(source)})
            warn(*results[-1].get("warnings", ()))
        except (UnreadableResultError, UsageError) as error:
            failures.append(error)
            results.append({"source": source, "error": str(error)})
    show_result("classify", {"results": results}, verdicts_table, results, as_json=as_json, quiet=quiet)
    if failures:
        lines = dict.fromkeys(str(error) for error in failures)
        raise type(failures[0])("\n".join(lines))


@dataclasses.dataclass(frozen=True)
class Options:
    """How to judge a file."""

    measured: Measured
    thresholds: list[str] | None

    def verdict(self, source: str) -> dict[str, Any]:
        """The verdict on one file, by the names of `--json`."""
        quantity = self.measured.quantity_of(source)
        if quantity is None:
            numbers = self._of_result(source)
        else:
            from brakecli.analysis.regime.signal_table import SignalThresholds

            limits = changed(SignalThresholds, self.thresholds)
            found = self.measured.look_at(source, limits).verdict
            numbers = {**dataclasses.asdict(found), "bursts": [tone.numbers() for tone in found.bursts]}
            numbers["quantity"] = quantity
        return numbers

    def _of_result(self, source: str) -> dict[str, Any]:
        from brakecli.analysis.regime.table import Thresholds
        from brakecli.runs.stored import classify_result

        try:
            limits = changed(Thresholds, self.thresholds)
            return classify_result(Path(source), limits)
        except OtherKindError:
            raise
        except UnreadableResultError as error:
            remedy = "for a measured signal, state with --quantity what was measured"
            raise UnreadableResultError(f"{error}; {remedy}") from error


def changed(thresholds: type[Any], changes: list[str] | None) -> Any:
    """Thresholds with the values of NAME=VALUE; raises UsageError for what is not one of them."""
    names = [field.name for field in dataclasses.fields(thresholds)]
    found: dict[str, float] = {}
    for change in changes or ():
        name, _, text = change.partition("=")
        if name in _GONE and thresholds.__name__ == "Thresholds":
            raise UsageError(f"--threshold {change}: there is no threshold {name} any more; {_GONE[name]}")
        if name not in names:
            nearest = difflib.get_close_matches(name, names, 1)
            remedy = f"did you mean {nearest[0]}?" if nearest else f"give one of {', '.join(names)}"
            raise UsageError(f"--threshold {change}: there is no threshold {name}; {remedy}")
        found[name] = math.nan
        with suppress(ValueError):
            found[name] = float(text)
        if not 0.0 <= found[name] < math.inf:
            raise UsageError(f"--threshold {change}: is not a number of at least 0; write {name}=NUMBER")
    return thresholds(**found)
