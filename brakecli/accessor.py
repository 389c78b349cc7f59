"""What `import brakecli` adds to xarray: typed records of a result, and how a notebook shows it.

A result stays an object of xarray, which every function of xarray takes and `to_netcdf` writes. For that, lists of
objects are JSON among its attributes; `result.brakecli` reads them.
"""

import base64
import html
import json
import math
from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from brakecli.analysis.over_time import Vibration
from brakecli.analysis.regime.bursts import Burst
from brakecli.analysis.stability.modes import Crossing, Mode
from brakecli.analysis.stability.report import Discrete
from brakecli.cli.file_tables import diff_table
from brakecli.cli.stability_tables import advice_table
from brakecli.cli.tables import Row, text_of, two_columns, verdict_table
from brakecli.errors import BrakecliError
from brakecli.files import fields
from brakecli.files.as_xarray import stored
from brakecli.files.contents import Difference
from brakecli.files.field import values_of
from brakecli.runs.advise import AdviceReport
from brakecli.solver.steady_sliding import SteadySliding

_Record = TypeVar("_Record")
_TOLD = (*fields.LOCK_IN, *fields.BRANCH, *fields.SCATTER, *fields.SWEEP)
_IDLE = {
    "title",
    "warnings",
    "notes",
    "reason",
    "warning",
    "warning_count",
    "settled",
    "settled_from",
    "steps",
    "set",
}
_IDLE |= {"contact_evaluations", "unconverged_steps"}  # names that the table leaves out
_MOST = 8  # values, or kinds of text, that a row shows


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
        png, text = self._repr_png_(), f"<pre>{html.escape(self.table())}</pre>"
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
        return diff_table({"a": "a", "b": "b", "output": ""}, values_of(fields.DIFFERENCE_OF_TWO, self))


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
        held = self._groups["vibrations"].to_dataset()
        columns = [held[each.name].values.tolist() for each in fields.VIBRATION]
        return tuple(Vibration(*map(_known, row)) for row in zip(*columns, strict=True))

    def table(self) -> str:
        """What the result holds, in two columns; a verdict as `brakecli classify` shows it, without evidence."""
        held = {str(name): _known(value) for name, value in self._found.attrs.items()}
        held |= {str(name): _known(each.item()) for name, each in self._found.data_vars.items() if not each.ndim}
        title = str(held.get("title") or "")
        if "excitation" in held:
            lists = {name: [vars(each) for each in getattr(self, name)] for name in ("vibrations", "bursts")}
            missing = dict.fromkeys(each.name for each in fields.VERDICT)
            known = {**missing, **held, **lists, "reasons": self.reasons, "evidence": {}}
            return verdict_table(title, known)
        return two_columns(title, [*self._rows()])

    def _repr_png_(self) -> bytes | None:
        from brakecli.plots.result import plot_result

        try:
            with stored(self._found, "result.h5") as path:
                picture = path.with_suffix(".png")
                plot_result(path, picture, force=True)
                return picture.read_bytes()
        except BrakecliError:  # of numbers alone there is none, and matplotlib may be missing
            return None

    def _rows(self) -> Iterator[Row]:
        """What there is, of grids its range, then the records, and at the end what is said."""
        yield (
            "holds",
            ", ".join(f"{size} along {name}" for name, size in self._found.sizes.items()) or "single numbers",
        )
        for name, each in self._found.data_vars.items():
            if name not in _IDLE:
                units = str(each.attrs.get("units", "")).removeprefix("1")
                yield str(name).replace("_", " "), _range(each.values, units)
        for mode in self.modes:
            yield (
                f"mode at {mode.frequency:.5g} Hz",
                f"{mode.growth:+.4g} 1/s, damping ratio {mode.damping_ratio:.3g}",
            )
        for name, group in self._groups.items():
            if "kind" in group.attrs:
                stable = int(group["stable"].sum())
                yield (
                    name.replace("_", " "),
                    f"{group.attrs['kind']}: {group.sizes['point']} motions, {stable} stable",
                )
        for field in _TOLD:
            if field.name not in _IDLE and (value := self._found.attrs.get(field.name)) is not None:
                units = field.units if field.units != "of the key" else ""
                texts = isinstance(value, str) or not np.size(value)
                yield field.title, str(value) if texts else _listed(value, units)
        yield "note", [*self._texts("notes"), *self.warnings]

    def _texts(self, name: str) -> tuple[str, ...]:
        """A list of texts; xarray has saved one of a single text as this text."""
        given = self._found.attrs.get(name, ())
        return (given,) if isinstance(given, str) else tuple(map(str, given))

    def _records(self, name: str, kind: type[_Record]) -> tuple[_Record, ...]:
        """A list of objects, or a single one, as records."""
        given = self._found.attrs.get(name, ())
        found = json.loads(given) if isinstance(given, str) else given
        return tuple(kind(**each) for each in ([found] if isinstance(found, dict) else found))


def _known(value: Any) -> Any:
    """A value without NumPy; None where there is none."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and math.isnan(value) else value


def _listed(value: Any, units: str) -> str:
    return ", ".join(text_of(_known(each), units.removeprefix("1")) for each in np.ravel(value)[:_MOST])


def _range(values: np.ndarray[Any, Any], units: str) -> str:
    """A value with its unit; of many the least and the largest, or how often there is each text."""
    if values.dtype.kind in "OUS":
        texts, counts = np.unique(values.astype(str), return_counts=True)
        if not values.ndim:
            return str(values) or "-"
        pairs = sorted(zip(counts.tolist(), texts.tolist(), strict=True), reverse=True)
        return ", ".join(f"{text or 'none'} {count}" for count, text in pairs[:_MOST])
    if not values.ndim:
        return ("no", "yes")[bool(values)] if values.dtype.kind == "b" else text_of(_known(values[()]), units)
    known = values[np.isfinite(values)]
    none = f", {values.size - known.size} missing" * (known.size < values.size)
    return f"{known.min():.6g} to {known.max():.6g} {units}".rstrip() + none if known.size else "-"
