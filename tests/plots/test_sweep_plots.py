"""Pictures of sweeps: what they show is what the result holds, and what cannot be drawn is refused."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.typing import NDArray

from brakecli.errors import UnreadableResultError, UsageError
from brakecli.files.fields import CRITICAL as CRITICAL_FIELDS
from brakecli.files.fields import POINT, Field
from brakecli.files.read import open_result
from brakecli.files.write import FILL, new_result
from brakecli.plots.result import plot_result
from brakecli.plots.style import style
from brakecli.plots.sweep.curves import cell_edges, draw_critical, draw_difference, draw_motion
from brakecli.plots.sweep.figure import draw_sweep
from brakecli.plots.sweep.maps import (
    amplitude_norm,
    critical_norm,
    draw_amplitude,
    draw_critical_map,
    draw_regimes,
)
from brakecli.plots.sweep.picture import Axis, SweepPicture, gather_sweep, readable
from brakecli.sweeps.driver import choose_engine, sweep
from brakecli.sweeps.file import parse_sweep
from brakecli.sweeps.plan import label
from brakecli.sweeps.tables import Sweep

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
        return gather_sweep(result, select)


def drawn(path: Path, select: Sequence[str] = ()) -> Figure:
    with style():
        return draw_sweep(gathered(path, select))


def line(axes: Any, wanted: str) -> NDArray[np.float64]:
    """x and y of the line of markers with this label."""
    found = [each for each in axes.get_lines() if each.get_label() == wanted]
    assert len(found) == 1, wanted
    return np.array(found[0].get_xydata())


def legend(figure: Figure) -> list[str]:
    return [text.get_text() for each in figure.legends for text in each.get_texts()]


def axes_of(picture: SweepPicture, draw: Any, **options: Any) -> Any:
    with style():
        axes = Figure().subplots()
        draw(axes, picture, **options)
    return axes


def test_each_suffix_gives_a_whole_picture_and_the_same_bytes_again(tmp_path: Path) -> None:
    tables: list[tuple[dict[str, Any], str]] = [
        ({"axis": [ANGLE]}, "png"),
        ({"axis": [ANGLE], "critical": CRITICAL}, "pdf"),
        ({"axis": [ANGLE, SPEED], "critical": CRITICAL}, "svg"),
    ]
    for number, (table, suffix) in enumerate(tables):
        result = write(tmp_path / f"{number}.h5", table)
        for name in ("a", "b"):
            plot_result(result, tmp_path / f"{name}{number}.{suffix}", force=False)
        first, second = ((tmp_path / f"{name}{number}.{suffix}").read_bytes() for name in ("a", "b"))
        assert first == second
    assert imread(tmp_path / "a0.png")[..., :3].std() > 0.05  # not blank


def test_a_computed_sweep_is_drawn_with_its_own_numbers(tmp_path: Path) -> None:
    case = Path(__file__).parents[2] / "cases" / "relaxation.toml"
    text = f"""
        case = '{case}'
        [[axis]]
        parameter = "friction.coefficient"
        values = [0.9, 0.3, 0.6]
    """
    loaded = parse_sweep(text, "s.toml", tmp_path, ["solver.duration=0.02"])
    sweep(loaded, tmp_path / "s.h5", choose_engine(loaded.plan, 1), force=False)
    figure = drawn(tmp_path / "s.h5")
    with open_result(tmp_path / "s.h5") as result:
        amplitude = result.read("/", "amplitude")
    curve = np.array(figure.axes[0].get_lines()[0].get_xydata())
    np.testing.assert_array_equal(curve[:, 0], [0.3, 0.6, 0.9])  # in rising order
    np.testing.assert_allclose(curve[:, 1], 1e6 * amplitude[[1, 2, 0]], rtol=1e-12)
    assert figure.axes[0].get_ylabel() == "amplitude (µm)"
    assert figure.axes[1].get_xlabel() == "friction.coefficient"
    assert figure.texts[0].get_text() == loaded.title


def test_critical_values_and_their_error_bars_are_those_of_the_file(tmp_path: Path) -> None:
    picture = gathered(write(tmp_path / "r.h5", {"axis": [ANGLE], "critical": CRITICAL}))
    axes = axes_of(picture, draw_critical)
    np.testing.assert_array_equal(line(axes, "by eigenvalues")[:, 1], picture["critical_eigenvalue"][0])
    (container,) = axes.containers
    np.testing.assert_array_equal(container.lines[0].get_ydata(), picture["critical"][0])
    bars = np.array(container.lines[2][0].get_segments())
    np.testing.assert_allclose(np.ptp(bars[:, :, 1], axis=1), 2.0 * picture["critical_error"][0], rtol=1e-9)
    np.testing.assert_array_equal(bars[:, 0, 0], picture.axes[0].values)
    difference = axes_of(picture, draw_difference).containers[0].lines[0].get_ydata()
    np.testing.assert_allclose(difference, -1e-4 * np.arange(8), atol=1e-15)
    assert axes.get_xlabel() == "link2.angle_deg (deg)"
    assert axes.get_ylabel() == "critical friction.coefficient"


def test_points_without_a_critical_value_are_marked_by_their_reason(tmp_path: Path) -> None:
    values = columns((8,), critical=True)
    reasons = ["stable throughout", "unstable throughout", "no steady sliding", ""]
    values["critical_status"] = np.array([*reasons, *4 * ["found"]])
    values["sustained_status"] = np.array(["damped throughout", *5 * ["found"], *2 * ["sustained throughout"]])
    values["status"] = np.array(["done", "done", "done", "failed", *4 * ["done"]])
    values["critical_sustained"] = np.where(np.arange(8) == 4, 0.5, values["critical"])
    for name in ("critical", "critical_lower", "critical_upper", "critical_error", "critical_eigenvalue"):
        values[name] = np.where(values["critical_status"] == "found", values[name], np.nan)
    values["critical_sustained"][:4] = values["critical_sustained"][6:] = np.nan
    result = write(tmp_path / "r.h5", {"axis": [ANGLE], "critical": CRITICAL}, values)
    axes = axes_of(gathered(result), draw_critical)
    along = 1.0 + np.arange(8)
    expected = {
        "stable up to 2": [0],
        "unstable from 0 on": [1],
        "no steady sliding": [2],
        "failed": [3],
        "vibration lasts from 0 on": [6, 7],
    }
    for words, places in expected.items():
        np.testing.assert_array_equal(line(axes, words)[:, 0], along[places])
    assert not any("fades" in str(each.get_label()) for each in axes.get_lines())
    lasting = line(axes, "vibration lasts from here on, from the case's own start")
    np.testing.assert_array_equal(lasting, [[along[4], 0.5]])
    assert set(expected) < set(legend(drawn(result)))
    assert "failed 1" in drawn(result).texts[1].get_text()


def test_a_search_by_eigenvalues_alone_has_no_error_bars(tmp_path: Path) -> None:
    table = {"axis": [ANGLE], "critical": {**CRITICAL, "method": "eigenvalue"}}
    figure = drawn(write(tmp_path / "r.h5", table))
    assert len(figure.axes) == 1
    assert not figure.axes[0].containers
    assert legend(figure) == ["by eigenvalues"]


def test_every_point_has_the_colour_of_its_regime(tmp_path: Path) -> None:
    values = columns((8,), critical=False)
    values["status"][5] = "failed"
    values["excitation"][2] = "forced"
    result = write(tmp_path / "r.h5", {"axis": [ANGLE]}, values)
    picture = gathered(result)
    for name, factor in (("amplitude", 1e6), ("frequency", 1.0)):
        axes = axes_of(picture, draw_motion, name=name)
        for regime in REGIMES:
            colour = next(each.get_mfc() for each in axes.get_lines() if each.get_label() == regime)
            groups = [each for each in axes.get_lines() if each.get_mfc() == colour and len(each.get_xdata())]
            where = (values["regime"] == regime) & (values["status"] == "done")
            (points,) = (each for each in groups if each.get_ls() == "None")
            np.testing.assert_array_equal(points.get_xdata(), (1.0 + np.arange(8))[where])
            np.testing.assert_allclose(points.get_ydata(), factor * values[name][where], rtol=1e-12)
        np.testing.assert_array_equal(line(axes, "failed")[:, 0], [6.0])
    assert legend(drawn(result))[:4] == REGIMES
    assert "forced by the wheel's waves" in legend(drawn(result))


def test_both_ways_are_curves_of_their_own_and_their_difference_is_shaded(tmp_path: Path) -> None:
    differ = np.array([0, 0, 1, 1, 0, 0, 0, 0])
    table = {"axis": [{**ANGLE, "direction": "both"}]}
    result = write(tmp_path / "r.h5", table, {"hysteresis": differ})
    picture = gathered(result)
    axes = axes_of(picture, draw_motion, name="amplitude")
    for number, direction in enumerate(("up", "down")):
        np.testing.assert_allclose(
            line(axes, f"on the way {direction}")[:, 1], 10.0 * (1.0 + 8 * number + np.arange(8)), rtol=1e-12
        )
    bands = [patch.get_bbox().intervalx.tolist() for patch in axes.patches]
    assert bands == [[2.5, 3.5], [3.5, 4.5]]
    one_way = gathered(result, ["direction=down"])
    np.testing.assert_array_equal(one_way["amplitude"], picture["amplitude"][1:])


def test_maps_hold_the_values_of_their_cells(tmp_path: Path) -> None:
    values = columns((8, 7), critical=True)
    values["critical"][3, 4] = np.nan
    values["critical_status"][3, 4] = "stable throughout"
    values["status"][1, 2] = "failed"
    picture = gathered(write(tmp_path / "r.h5", {"axis": [ANGLE, SPEED], "critical": CRITICAL}, values))
    axes = axes_of(picture, draw_critical_map, norm=critical_norm(picture))
    mesh = axes.collections[0]
    shown = np.ma.filled(mesh.get_array().reshape(7, 8).T.astype(float), np.nan)
    np.testing.assert_array_equal(shown, values["critical"])
    assert axes.get_yscale() == "log"
    assert axes.get_xscale() == "linear"
    np.testing.assert_allclose(line(axes, "stable up to 2"), [[4.0, 1.0]], rtol=1e-12)
    axes = axes_of(picture, draw_regimes)
    codes = np.ma.filled(axes.collections[0].get_array().reshape(7, 8).T.astype(float), np.nan)
    for (x, y), code in np.ndenumerate(codes):
        assert np.isnan(code) if (x, y) == (1, 2) else REGIMES[int(code)] == values["regime"][x, y]
    axes = axes_of(picture, draw_amplitude, factor=1e6, norm=amplitude_norm(picture))
    np.testing.assert_allclose(
        axes.collections[0].get_array().reshape(7, 8).T, 1e6 * values["amplitude"], rtol=1e-12
    )


def test_edges_lie_half_way_between_values_and_around_the_outer_ones() -> None:
    np.testing.assert_allclose(cell_edges(np.array([1.0, 2.0, 4.0]), logarithmic=False), [0.5, 1.5, 3.0, 5.0])
    edges = cell_edges(np.array([1.0, 100.0]), logarithmic=True)
    np.testing.assert_allclose(edges, [0.1, 10.0, 1000.0])


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (np.geomspace(0.01, 10.0, 7), True),
        (np.array([1.0, 2.0, 5.0, 10.0, 20.0, 50.0]), True),
        (np.linspace(1.0, 10.0, 10), False),
        (np.geomspace(1.0, 2.0, 10), False),
        (np.array([0.0, 1.0, 10.0, 100.0]), False),
        (np.array([1.0, 100.0]), False),
    ],
)
def test_an_axis_is_logarithmic_where_its_values_are(values: NDArray[np.float64], expected: bool) -> None:
    assert Axis("a", "a", "1", values).logarithmic is expected


def test_numbers_read_as_people_write_them() -> None:
    numbers = {0.0: "0", 0.25: "0.25", -3.0: "−3", 1e7: "10⁷", 2.5e-6: "2.5·10⁻⁶", -1e5: "−10⁵", 99999.0: "99999"}
    assert {number: readable(number) for number in numbers} == numbers


def test_a_short_third_axis_stands_side_by_side(tmp_path: Path) -> None:
    for critical in ({}, {"critical": CRITICAL}):
        figure = drawn(write(tmp_path / "r.h5", {"axis": [SPEED, SCHEME, ANGLE], **critical}))
        titles = [axes.get_title(loc="left") for axes in figure.axes]
        assert titles[:2] == ["solver.scheme = two-layer", "solver.scheme = three-layer"]
        panels = figure.axes[:2]
        assert [axes.get_xlabel() for axes in (panels if critical else figure.axes[2:4])] == [
            "wheel.angular_speed (rad/s)"
        ] * 2
    picture = gathered(tmp_path / "r.h5", ["solver.scheme=three-layer", "link2.angle_deg=3"])
    np.testing.assert_array_equal(picture["critical"][0], columns((7, 2, 8), critical=True)["critical"][:, 1, 2])
    assert picture.chosen == ("solver.scheme = three-layer", "link2.angle_deg = 3 deg")


def test_an_axis_of_one_value_is_named_and_not_drawn(tmp_path: Path) -> None:
    single = {"parameter": "friction.coefficient", "values": [0.3]}
    figure = drawn(write(tmp_path / "r.h5", {"axis": [single, ANGLE]}))
    assert len(figure.axes) == 2
    assert "friction.coefficient = 0.3" in figure.texts[2].get_text()


@pytest.mark.parametrize(
    ("table", "select", "words"),
    [
        ({"critical": CRITICAL}, [], "a single point makes no picture"),
        ({"axis": [ANGLE]}, ["link2.angle_deg=2"], "a single point makes no picture"),
        (
            {"axis": [ANGLE, SPEED, {**SCHEME, "direction": None}]},
            ["link2.angle=2"],
            "give one of link2.angle_deg",
        ),
        ({"axis": [ANGLE, SPEED]}, ["link2.angle_deg=2.5"], "give one of 1, 2, 3, 4, 5, 6, 7, 8"),
        ({"axis": [ANGLE, SPEED]}, ["link2.angle_deg=nan"], "no point has this value"),
        ({"axis": [SCHEME, ANGLE]}, ["solver.scheme"], "give one of two-layer, three-layer"),
        ({"axis": [{**ANGLE, "direction": "both"}]}, ["direction=left"], "give up or down"),
        ({"axis": [ANGLE, SPEED, {**ANGLE, "parameter": "a.b"}]}, [], "of three axes one may have 5 values"),
        ({"axis": [{**ANGLE, "direction": "both"}, SPEED, SCHEME]}, [], "3 axes in two directions are too many"),
        ({"axis": [ANGLE, SPEED, SCHEME, {**SCHEME, "parameter": "a.b"}]}, [], "4 axes are too many"),
    ],
)
def test_what_cannot_be_drawn_is_refused_with_what_to_do(
    table: dict[str, Any], select: list[str], words: str, tmp_path: Path
) -> None:
    table = {**table, "axis": [{k: v for k, v in axis.items() if v} for axis in table.get("axis", [])]}
    result = write(tmp_path / "r.h5", table)
    with pytest.raises(UsageError, match=words) as caught:
        plot_result(result, tmp_path / "r.png", force=False, select=select)
    assert str(caught.value).startswith(f"{result}: ")
    assert [path.name for path in tmp_path.iterdir()] == ["r.h5"]


def test_a_result_without_what_is_drawn_is_unreadable(tmp_path: Path) -> None:
    result = write(tmp_path / "a.h5", {"axis": [ANGLE]}, resolved_sweep_toml="title = 1")
    with pytest.raises(UnreadableResultError, match="the sweep it holds is none"):
        gathered(result)
    with new_result(tmp_path / "b.h5", force=False) as empty:
        empty.set_attributes(
            {"kind": "sweep", "resolved_sweep_toml": tomli_w.dumps({"case": "c", "axis": [ANGLE]})}
        )
        empty.commit()
    with pytest.raises(UnreadableResultError, match="no variable status"):
        gathered(tmp_path / "b.h5")


def test_other_kinds_of_results_are_refused_and_select_is_for_sweeps(tmp_path: Path) -> None:
    refused: tuple[tuple[str, list[str], str], ...] = (
        ("other", [], "a run, of a sweep or of a comparison"),
        ("run", ["a=1"], "leave it out for a run"),
    )
    for kind, select, words in refused:
        with new_result(tmp_path / f"{kind}.h5", force=False) as result:
            result.set_attributes({"kind": kind})
            result.commit()
        with pytest.raises(UsageError, match=words):
            plot_result(tmp_path / f"{kind}.h5", tmp_path / "r.png", force=False, select=select)


def test_sweeps_of_any_values_are_drawn(tmp_path: Path) -> None:
    """All missing, all zero, all the same, of very different size; one axis and two."""
    for number, (shape, axes) in enumerate([((8,), [ANGLE]), ((7, 8), [SPEED, ANGLE])]):
        nothing, zero = np.full(shape, np.nan), np.zeros(shape)
        wide = np.geomspace(1e-12, 1e3, int(np.prod(shape))).reshape(shape)
        for critical, values in product((False, True), (nothing, zero, zero + 7e6, wide)):
            changed = columns(shape, critical=critical) | {"amplitude": values, "frequency": values}
            if critical:
                changed |= {"critical": values, "critical_eigenvalue": values, "critical_sustained": values}
            table = {"axis": axes, **({"critical": CRITICAL} if critical else {})}
            picture = gathered(write(tmp_path / f"{number}.h5", table, changed))
            with style():
                figure = draw_sweep(picture)
                figure.draw_without_rendering()
            assert figure.axes[0].get_window_extent().width > 200
