"""What `import brakecli` adds to xarray: typed records of a result, and how a notebook shows it.

A result stays an object of xarray, which every function of xarray takes. For that, lists of objects are JSON among
its attributes; `result.brakecli` reads them, and keeps the result as a file.
"""

import base64
import html
import json
from collections import Counter
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from brakecli.analysis.over_time import Vibration
from brakecli.analysis.probability import Probability
from brakecli.analysis.signals.bursts import Burst
from brakecli.analysis.stability.modes import Crossing, Mode
from brakecli.analysis.stability.report import Discrete
from brakecli.errors import BrakecliError
from brakecli.faces import in_python
from brakecli.results import fields
from brakecli.results.as_xarray import save, stored
from brakecli.results.contents import DIFFERENCE_OF_TWO, Difference
from brakecli.results.field import Field, values_of
from brakecli.results.stability_fields import BRANCH, LOCK_IN, SCATTER, STABILITY, THRESHOLDS
from brakecli.solver.steady_sliding import SteadySliding
from brakecli.studies.runs.advise import AdviceReport
from brakecli.studies.sweeps.attractors import Attractor
from brakecli.views.file import of_difference
from brakecli.views.motion import of_verdict
from brakecli.views.points import regimes_sentence
from brakecli.views.render import EXACT, TERMINAL, Renderer
from brakecli.views.stability import of_advice, of_stability
from brakecli.views.terminal import terminal_text
from brakecli.views.view import Row, View, sentences

_Record = TypeVar("_Record")
_APART = {
    "modes",
    "crossings",
    "equilibrium",
    "discrete",
    "eigenvalues",
    "title",
    "notes",
    "sentence",
    "warnings",
    "indices_of",
}
_KINDS = STABILITY, THRESHOLDS, LOCK_IN, BRANCH, SCATTER, fields.SWEEP
_SHOWN_FIELDS = {field.name: field for kind in _KINDS for field in kind if field.name not in _APART}
"""What a table says of a result that is no verdict."""


class Shown:
    """What a notebook and a terminal show: the view, and below it the picture if there is one."""

    def view(self, show: Renderer) -> View:
        """Its view: the answer, then numbers and tables."""
        raise NotImplementedError

    def table(self, *, details: bool = False) -> str:
        """The view as text, as wide as the terminal; with all that is known if `details`."""
        return terminal_text(self.view(EXACT if details else TERMINAL), details=details)

    def __repr__(self) -> str:
        """Show the table."""
        return self.table()

    def _repr_png_(self) -> bytes | None:
        """The picture; None where there is none."""
        return None

    def _repr_html_(self) -> str:
        """The table and the picture."""
        png = self._repr_png_()
        text = f"<pre>{html.escape(self.table())}</pre>"
        data = base64.b64encode(png).decode() if png else ""
        return text + f'<img src="data:image/png;base64,{data}" style="max-width: 100%">' * bool(png)


class Advice(AdviceReport, Shown):
    """What `brakecli.advise` has found; its view is that of the command."""

    __repr__ = Shown.__repr__

    def view(self, show: Renderer) -> View:
        """The view of the command."""
        return of_advice(self, show)


class Differences(Difference, Shown):
    """What `brakecli.diff` has found; its view is that of the command."""

    __repr__ = Shown.__repr__

    def view(self, show: Renderer) -> View:
        """The view of the command."""
        return of_difference(values_of(DIFFERENCE_OF_TWO, self), {"a": "a", "b": "b", "output": ""}, show)


@xr.register_dataset_accessor("brakecli")
@xr.register_datatree_accessor("brakecli")
class Accessor(Shown):
    """`result.brakecli`: typed records of a result of `brakecli`, its table, its picture, and its file."""

    def __init__(self, result: xr.Dataset | xr.DataTree) -> None:
        """Read nothing yet."""
        self._result = result
        self._groups = dict(result.children) if isinstance(result, xr.DataTree) else {}

    def save(self, path: str | PathLike[str], force: bool = False) -> None:
        """Keep the result as a file, as the commands write it, which replaces another one where `force` is set.

        It may have been changed since a function gave it: every variable along all of its axes, without infinite
        numbers, and without NaN in a history. Raises UsageError for what is no result, and CannotWriteError.
        """
        with in_python():
            save(self._result, Path(path), force=force)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the regime is as it is."""
        return self._texts("reasons")

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a careful user should know."""
        return self._texts("warnings")

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Of `stability`: growth rate (1/s), frequency (Hz), damping ratio and shape of each mode."""
        return self._records("modes", Mode)

    @property
    def crossings(self) -> tuple[Crossing, ...]:
        """Of `stability`: each friction coefficient at which stability changes."""
        return self._records("crossings", Crossing)

    @property
    def equilibrium(self) -> SteadySliding | None:
        """Of `stability`: position (m), normal force (N), stiffness (N/m) of steady sliding, if it exists."""
        return next(iter(self._records("equilibrium", SteadySliding)), None)

    @property
    def discrete(self) -> Discrete | None:
        """Of `stability`: what the scheme of the case makes of it, where it has a step."""
        return next(iter(self._records("discrete", Discrete)), None)

    @property
    def bursts(self) -> tuple[Burst, ...]:
        """Of a measured signal: start, end (s), frequency (Hz) and level (its unit) of each loud tone."""
        return self._records("bursts", Burst)

    @property
    def vibrations(self) -> tuple[Vibration, ...]:
        """Where speed or load change: start, end (s), frequency (Hz), amplitude (m), speed (m/s)."""
        if "vibrations" not in self._groups:
            return self._records("vibrations", Vibration)
        return tuple(Vibration(**row) for row in self._rows("vibrations", fields.VIBRATION))

    @property
    def attractors(self) -> tuple[Attractor, ...]:
        """Of a sweep over initial states: each motion that its points come to, and their share."""
        attractors = json.loads(self._result.attrs.get("attractors", "[]"))
        if "attractors" in self._groups:
            attractors = self._rows("attractors", fields.ATTRACTOR)
        for attractor in attractors:
            attractor["share"] = Probability(*map(attractor.pop, ("share", "share_lower", "share_upper")))
        return tuple(Attractor(**attractor) for attractor in attractors)

    def view(self, show: Renderer) -> View:
        """Its answer, its single numbers, and what is said of it; a verdict as `brakecli classify` shows it."""
        single = {name: variable.item() for name, variable in self._result.data_vars.items() if not variable.ndim}
        contents = {str(name): _without_numpy(value) for name, value in (self._result.attrs | single).items()}
        title = str(contents.get("title") or "")
        if "excitation" in contents:
            lists = {name: [vars(record) for record in getattr(self, name)] for name in ("vibrations", "bursts")}
            return of_verdict(
                {**contents, **lists, "reasons": self.reasons, "evidence": self._evidence()}, title, show
            )
        if "undamped_flutter_friction" in contents:
            objects = {name: self._parsed(name) for name in ("modes", "crossings", "equilibrium", "discrete")}
            return of_stability({**contents, **objects}, title, show)
        answer = [str(contents.get("sentence") or "")]
        if "regime" in self._result:
            regimes = Counter(np.ravel(self._result["regime"]).astype(str).tolist())
            answer.append(regimes_sentence(dict(sorted(regimes.items())), regimes.total()))
        shown = [field for name, field in _SHOWN_FIELDS.items() if name in contents]
        rows = [Row(field.title, show.field(field, contents[field.name])) for field in shown]
        rows += [
            Row(f"attractor {attractor.attractor}", f"{attractor.regime}, {attractor.share.value:.1%}")
            for attractor in self.attractors
        ]
        branches = [group for group in self._groups.values() if "kind" in group.attrs]
        rows += [Row(str(one.name), f"{one.attrs['kind']}, {one.sizes['point']} motions") for one in branches]
        rows += [Row("note", note) for note in (*self._texts("notes"), *self.warnings)]
        return View(title, sentences(answer), rows)

    def _evidence(self) -> dict[str, object]:
        """The numbers by which a verdict was decided."""
        if "regime" in self._groups and "evidence" in self._groups["regime"].children:
            evidence = self._groups["regime"]["evidence"].attrs
            return {str(name): _without_numpy(value) for name, value in evidence.items()}
        return dict(self._parsed("evidence") or {})

    def _parsed(self, name: str) -> Any:
        """A list or an object among the attributes."""
        value = self._result.attrs.get(name)
        return json.loads(value) if isinstance(value, str) and value else value

    def _repr_png_(self) -> bytes | None:
        from brakecli.views.plots.result import plot_result

        try:
            with stored(self._result, "result.h5") as path:
                picture = path.with_suffix(".png")
                plot_result(path, picture, force=True)
                return picture.read_bytes()
        except BrakecliError:  # of numbers alone there is none, and matplotlib may be missing
            return None

    def _texts(self, name: str) -> tuple[str, ...]:
        """A list of texts; xarray has saved one of a single text as this text."""
        texts = self._result.attrs.get(name, ())
        return (texts,) if isinstance(texts, str) else tuple(map(str, texts))

    def _rows(self, group: str, columns: Sequence[Field]) -> list[dict[str, Any]]:
        """The rows of a group, by the names of its columns."""
        dataset = self._groups[group].to_dataset()
        values = {column.name: map(_without_numpy, dataset[column.name].values.tolist()) for column in columns}
        return [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]

    def _records(self, name: str, kind: type[_Record]) -> tuple[_Record, ...]:
        """A list of objects, or a single one, as records."""
        stored_records = self._result.attrs.get(name, ())
        records = json.loads(stored_records) if isinstance(stored_records, str) else stored_records
        return tuple(kind(**record) for record in ([records] if isinstance(records, dict) else records))


def _without_numpy(value: object) -> object:
    """A value without NumPy; None where there is none."""
    value = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
    return None if value != value or value == "" else value  # NaN
