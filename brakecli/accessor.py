"""What `import brakecli` adds to xarray: typed records of a result, and how a notebook shows it.

A result stays an object of xarray, which every function of xarray takes and `to_netcdf` writes. For that, lists of
objects are JSON among its attributes; `result.brakecli` reads them.
"""

import base64
import html
import json
from collections import Counter
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from brakecli.analysis.over_time import Vibration
from brakecli.analysis.probability import Probability
from brakecli.analysis.signals.bursts import Burst
from brakecli.analysis.stability.modes import Crossing, Mode
from brakecli.analysis.stability.report import Discrete
from brakecli.errors import BrakecliError
from brakecli.files import fields
from brakecli.files.as_xarray import stored
from brakecli.files.contents import DIFFERENCE_OF_TWO, Difference
from brakecli.files.field import Field, values_of
from brakecli.files.stability_fields import BRANCH, LOCK_IN, SCATTER, STABILITY, THRESHOLDS
from brakecli.front.file_tables import diff_table
from brakecli.front.render import TERMINAL
from brakecli.front.stability_tables import advice_table
from brakecli.front.tables import Row, two_columns, verdict_table
from brakecli.runs.advise import AdviceReport
from brakecli.solver.steady_sliding import SteadySliding
from brakecli.sweeps.attractors import Attractor

_Record = TypeVar("_Record")
_APART = {
    "modes",
    "crossings",
    "equilibrium",
    "discrete",
    "eigenvalues",
    "title",
    "notes",
    "warnings",
    "indices_of",
}
_KINDS = STABILITY, THRESHOLDS, LOCK_IN, BRANCH, SCATTER, fields.SWEEP
_TOLD = {each.name: each for kind in _KINDS for each in kind if each.name not in _APART}
"""What a table says of a result that is no verdict."""


class Shown:
    """What a notebook and a terminal show: the table, and below it the picture if there is one."""

    def table(self) -> str:
        """The table as text, as wide as the terminal."""
        raise NotImplementedError

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
    """What `brakecli.advise` has found; its table is that of the command."""

    __repr__ = Shown.__repr__

    def table(self) -> str:
        """The table of the command."""
        return advice_table(self)


class Differences(Difference, Shown):
    """What `brakecli.diff` has found; its table is that of the command."""

    __repr__ = Shown.__repr__

    def table(self) -> str:
        """The table of the command."""
        return diff_table({"a": "a", "b": "b", "output": ""}, values_of(DIFFERENCE_OF_TWO, self))


@xr.register_dataset_accessor("brakecli")
@xr.register_datatree_accessor("brakecli")
class Accessor(Shown):
    """`result.brakecli`: typed records of a result of `brakecli`, its table and its picture."""

    def __init__(self, found: xr.Dataset | xr.DataTree) -> None:
        """Read nothing yet."""
        self._found = found
        self._groups = dict(found.children) if isinstance(found, xr.DataTree) else {}

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
        found = json.loads(self._found.attrs.get("attractors", "[]"))
        if "attractors" in self._groups:
            found = self._rows("attractors", fields.ATTRACTOR)
        for each in found:
            each["share"] = Probability(*map(each.pop, ("share", "share_lower", "share_upper")))
        return tuple(Attractor(**each) for each in found)

    def table(self) -> str:
        """Its single numbers, and what is said of it; a verdict as `brakecli classify` shows it, less evidence."""
        single = {name: each.item() for name, each in self._found.data_vars.items() if not each.ndim}
        held = {str(name): _known(value) for name, value in (self._found.attrs | single).items()}
        title = str(held.get("title") or "")
        if "excitation" in held:
            lists = {name: [vars(each) for each in getattr(self, name)] for name in ("vibrations", "bursts")}
            missing = dict.fromkeys(each.name for each in fields.VERDICT)
            return verdict_table(title, {**missing, **held, **lists, "reasons": self.reasons, "evidence": {}})
        told = [each for name, each in _TOLD.items() if name in held]
        rows: list[Row] = [(each.title, TERMINAL.field(each, held[each.name])) for each in told]
        regimes = Counter(np.ravel(self._found["regime"]).astype(str).tolist() if "regime" in self._found else ())
        rows += [(name, f"at {count} of {regimes.total()}") for name, count in regimes.most_common()]
        rows += [
            (f"attractor {each.attractor}", f"{each.regime}, {each.share.value:.1%}") for each in self.attractors
        ]
        rows += [("mode", f"{each.frequency:.5g} Hz, {each.growth:+.4g} 1/s") for each in self.modes]
        branches = [each for each in self._groups.values() if "kind" in each.attrs]
        rows += [(str(each.name), f"{each.attrs['kind']}, {each.sizes['point']} motions") for each in branches]
        return two_columns(title, [*rows, ("note", [*self._texts("notes"), *self.warnings])])

    def _repr_png_(self) -> bytes | None:
        from brakecli.plots.result import plot_result

        try:
            with stored(self._found, "result.h5") as path:
                picture = path.with_suffix(".png")
                plot_result(path, picture, force=True)
                return picture.read_bytes()
        except BrakecliError:  # of numbers alone there is none, and matplotlib may be missing
            return None

    def _texts(self, name: str) -> tuple[str, ...]:
        """A list of texts; xarray has saved one of a single text as this text."""
        given = self._found.attrs.get(name, ())
        return (given,) if isinstance(given, str) else tuple(map(str, given))

    def _rows(self, group: str, columns: Sequence[Field]) -> list[dict[str, Any]]:
        """The rows of a group, by the names of its columns."""
        held = self._groups[group].to_dataset()
        values = {each.name: map(_known, held[each.name].values.tolist()) for each in columns}
        return [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]

    def _records(self, name: str, kind: type[_Record]) -> tuple[_Record, ...]:
        """A list of objects, or a single one, as records."""
        given = self._found.attrs.get(name, ())
        found = json.loads(given) if isinstance(given, str) else given
        return tuple(kind(**each) for each in ([found] if isinstance(found, dict) else found))


def _known(value: Any) -> Any:
    """A value without NumPy; None where there is none."""
    value = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
    return None if value != value or value == "" else value  # NaN
