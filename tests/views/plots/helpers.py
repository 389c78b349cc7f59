"""Results of sweeps for tests of pictures, and what these tests read from a picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from matplotlib.figure import Figure
from numpy.typing import NDArray

from brakecli.results.field import Field
from brakecli.results.fields import CRITICAL as CRITICAL_FIELDS
from brakecli.results.fields import POINT, WINDOWS
from brakecli.results.read import open_result
from brakecli.results.write import FILL, new_result
from brakecli.studies.sweeps.plan import label
from brakecli.studies.sweeps.tables import Sweep
from brakecli.views.plots.gather import gather
from brakecli.views.plots.result import draw
from brakecli.views.plots.style import applied
from brakecli.views.plots.sweep import SweepPicture

ANGLE = {"parameter": "link2.angle_deg", "start": 1.0, "stop": 8.0, "num": 8}
SPEED = {"parameter": "wheel.angular_speed", "start": 0.01, "stop": 10.0, "num": 7, "spacing": "log"}
SCHEME = {"parameter": "solver.scheme", "values": ["two-layer", "three-layer"]}
CRITICAL = {"parameter": "friction.coefficient", "lower": 0.0, "upper": 2.0}
REGIMES = ["damped", "relaxation", "quasi-harmonic", "undecided"]
UNITS = {"link2.angle_deg": "deg", "wheel.angular_speed": "rad/s"}

Columns = dict[str, NDArray[Any]]


def columns(shape: tuple[int, ...], *, critical: bool) -> Columns:
    """Every variable of a sweep, its numbers all different; each regime in turn."""
    count = int(np.prod(shape))
    values: Columns = {
        field.name: (np.zeros(shape) if field.kind[0] in "fi" else np.full(shape, "x"))
        for field in (*POINT, *(CRITICAL_FIELDS if critical else ()))
        if field.kind != WINDOWS
    }
    places = np.arange(count, dtype=float).reshape(shape)
    values["status"] = np.full(shape, "done", "U24")
    values["excitation"] = np.full(shape, "self-excited", "U24")
    values["regime"] = np.resize(np.array(REGIMES), shape)
    values["amplitude"] = 1e-5 * (1.0 + places)
    values["frequency"] = np.where(np.isin(values["regime"], REGIMES[1:3]), 100.0 + places, np.nan)
    if critical:
        values["critical_status"] = values["sustained_status"] = np.full(shape, "found", "U24")
        values["critical"] = values["critical_sustained"] = 0.5 + 0.01 * places
        values["critical_lower"], values["critical_upper"] = values["critical"] - 4e-4, values["critical"] + 4e-4
        values["critical_error"] = 5e-4 + 1e-6 * places
        values["critical_eigenvalue"] = values["critical"] + 1e-4 * places
    return values


def write(path: Path, table: dict[str, Any], changed: Columns | None = None, **attributes: Any) -> Path:
    """A result of a sweep with the variables that its writer gives it."""
    model = Sweep.model_validate({"case": "c.toml", **table})
    both = any(axis.direction == "both" for axis in model.axis)
    shape = (*((2,) if both else ()), *(axis.size for axis in model.axis))
    values = columns(shape or (1,), critical=model.critical is not None) | (changed or {})
    with new_result(path, force=True) as result:
        texts = {
            "kind": "sweep",
            "title": "Größe $x_{",
            "resolved_sweep_toml": tomli_w.dumps({"case": "c", **table}),
        }
        result.set_attributes(texts | attributes)
        dims = [axis.name for axis in model.axis] or ["point"]
        if both:
            dims.insert(0, "direction")
            result.axis("/", Field("direction", "", "direction"), np.array(["up", "down"]))
        for axis in model.axis:
            along = [axis.value(place) for place in range(axis.size)]
            data = np.array(along) if axis.numeric else np.array([label(each) for each in along])
            key = ", ".join(axis.parameter)
            result.axis("/", Field(axis.name, UNITS.get(axis.parameter[0], "1"), key), data)
        if not model.axis:
            result.axis("/", Field("point", "1", "the base case"), np.zeros(1))
        known = {field.name: field for field in (*POINT, *CRITICAL_FIELDS)}
        for name, array in values.items():
            field = known.get(name) or Field(name, "1", name)
            data = np.where(np.isnan(array), FILL, array) if array.dtype.kind == "f" else array
            shown = Field(name, field.units or "1", field.meaning)
            result.variable("/", shown, dims[array.ndim == len(dims) - 1 :], data)
        result.commit()
    return path


def gathered(path: Path, select: Sequence[str] = ()) -> SweepPicture:
    with open_result(path, kind="sweep") as result:
        return gather(result, select)


def drawn(path: Path, select: Sequence[str] = ()) -> Figure:
    """The picture of a result of any kind."""
    with open_result(path) as result, applied():
        return draw(result, select)


def panels(path: Path) -> list[Any]:
    """The panels of the picture of a result, and the bar of colours if there is one."""
    return list(drawn(path).axes)


def line(axes: Any, label: str) -> Any:
    """The one line with this label."""
    found = [each for each in axes.get_lines() if each.get_label() == label]
    assert len(found) == 1, label
    return found[0]


def points(axes: Any, label: str) -> NDArray[np.float64]:
    """x and y of the line of markers with this label."""
    return np.array(line(axes, label).get_xydata())


def legend(figure: Figure) -> list[str]:
    return [text.get_text() for each in figure.legends for text in each.get_texts()]
