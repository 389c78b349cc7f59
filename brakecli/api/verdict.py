"""The verdict on a file: the result of a run, or a measured signal."""

import dataclasses
import difflib
import math
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from brakecli.api.measured import look_at, perhaps_a_signal, quantity_of
from brakecli.api.records import Classify
from brakecli.api.values import chosen_of
from brakecli.errors import UsageError
from brakecli.faces import argument

if TYPE_CHECKING:
    from brakecli.analysis.regime.decision import Thresholds
    from brakecli.analysis.signals.table import SignalThresholds

_Limits = TypeVar("_Limits", "Thresholds", "SignalThresholds")
_GONE = {
    "decayed_to": "what becomes of the motion is computed",
    "reach_within": "settled_within holds for x, too",
    "trend_errors": "it is called sure_errors",
    "forced_share": "lines of the roughness decide nothing any more",
}


def verdict_on(source: str, options: Classify) -> dict[str, Any]:
    """The verdict on one file, by the names of `--json`."""
    thresholds = chosen_of(options.thresholds, "thresholds")
    quantity = quantity_of(options, source)
    if quantity is None:
        return _on_result(source, thresholds)
    from brakecli.analysis.signals.table import SignalThresholds

    verdict = look_at(options, source, changed(SignalThresholds, thresholds)).verdict
    numbers = {**dataclasses.asdict(verdict), "bursts": [tone.numbers() for tone in verdict.bursts]}
    return {**numbers, "quantity": quantity}


def _on_result(source: str, thresholds: list[str] | None) -> dict[str, object]:
    from brakecli.analysis.regime.decision import Thresholds
    from brakecli.studies.runs.stored import classify_result

    limits = changed(Thresholds, thresholds)
    with perhaps_a_signal(source):
        return classify_result(Path(source), limits)


def changed(thresholds: type[_Limits], changes: list[str] | None) -> _Limits:
    """Thresholds with the values of NAME=VALUE; raises UsageError for what is not one of them."""
    names = [field.name for field in dataclasses.fields(thresholds)]
    values: dict[str, float] = {}
    for change in changes or ():
        name, _, text = change.partition("=")
        if name in _GONE and thresholds.__name__ == "Thresholds":
            raise UsageError(
                f"{argument('threshold')} {change}: there is no threshold {name} any more; {_GONE[name]}"
            )
        if name not in names:
            nearest = difflib.get_close_matches(name, names, 1)
            remedy = f"did you mean {nearest[0]}?" if nearest else f"give one of {', '.join(names)}"
            raise UsageError(f"{argument('threshold')} {change}: there is no threshold {name}; {remedy}")
        values[name] = math.nan
        with suppress(ValueError):
            values[name] = float(text)
        if not 0.0 <= values[name] < math.inf:
            raise UsageError(
                f"{argument('threshold')} {change}: is not a number of at least 0; write {name}=NUMBER"
            )
    return thresholds(**values)
