"""Pictures of sweeps: what they show is what the result holds, and what cannot be drawn is refused."""

import math
from collections.abc import Callable
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from matplotlib.colors import to_rgb
from matplotlib.contour import ContourSet
from matplotlib.image import imread
from numpy.typing import NDArray

from brakecli.case.case import resolved_toml
from brakecli.case.read import parse_case
from brakecli.errors import UnreadableResultError, UsageError
from brakecli.results.read import open_result
from brakecli.results.write import new_result
from brakecli.studies.sweeps.margin import margins
from brakecli.studies.sweeps.plan import parse_sweep
from brakecli.studies.sweeps.workers.task import compute_units
from brakecli.views.plots.axis import Axis
from brakecli.views.plots.result import draw, plot_result
from brakecli.views.plots.style import applied, headed, prefixed, readable, rendered
from brakecli.views.plots.sweep import REGIMES
from tests.campaign import campaign
from tests.examples import NEVER_STABLE, SQUEAL, make
from tests.studies.sweeps.helpers import frictions, inline, write_sweep
from tests.views.plots.helpers import ANGLE, CRITICAL, SCHEME, SPEED, columns, drawn, gathered, legend, line, write


@campaign
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
    case = Path(__file__).parents[3] / "cases" / "relaxation.toml"
    text = f"""
        case = '{case}'
        [[axis]]
        parameter = "friction.coefficient"
        values = [0.9, 0.3, 0.6]
    """
    loaded = parse_sweep(text, "s.toml", tmp_path, ["solver.duration=0.02"])
    inline(loaded, tmp_path / "s.h5", compute_units)
    figure = drawn(tmp_path / "s.h5")
    with open_result(tmp_path / "s.h5") as result:
        amplitude = result.read("/", "amplitude")
    curve = np.array(figure.axes[0].get_lines()[0].get_xydata())
    np.testing.assert_array_equal(curve[:, 0], [0.3, 0.6, 0.9])  # in rising order
    np.testing.assert_allclose(curve[1:, 1], 1e6 * amplitude[[2, 0]], rtol=1e-12)
    assert np.isnan(curve[0, 1])  # damped, and nothing forces it: no line leads there, and a mark says so
    (mark,) = (line for line in figure.axes[0].get_lines() if line.get_label() == "damped: nothing lasts")
    assert np.ravel(mark.get_xdata()).tolist() == [0.3]
    assert figure.axes[0].get_ylabel() == "amplitude (µm)"
    assert figure.axes[1].get_xlabel() == "friction.coefficient"
    assert figure.texts[0].get_text() == loaded.title


def test_edges_lie_half_way_between_values_and_around_the_outer_ones() -> None:
    linear = Axis("a", "a", "1", np.array([1.0, 2.0, 4.0]))
    np.testing.assert_allclose(linear.edges, [0.5, 1.5, 3.0, 5.0])
    logarithmic = Axis("a", "a", "1", np.array([1.0, 100.0, 1e4]))
    np.testing.assert_allclose(logarithmic.edges, [0.1, 10.0, 1000.0, 1e5])


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
        ({"axis": [ANGLE, SPEED]}, ["link2.angle_deg=8.6"], "give one of 1, 2, 3, 4, 5, 6, 7, 8"),
        ({"axis": [ANGLE, SPEED]}, ["link2.angle_deg=nan"], "no point has this value"),
        ({"axis": [SCHEME, ANGLE]}, ["solver.scheme"], "give one of two-layer, three-layer"),
        ({"axis": [{**ANGLE, "direction": "both"}]}, ["direction=left"], "give one of up, down"),
        ({"axis": [ANGLE, SPEED, {**ANGLE, "parameter": "a.b"}]}, [], "one of three axes may have 5 values"),
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
    with pytest.raises(UnreadableResultError, match="the sweep in it is not valid"):
        gathered(result)
    with new_result(tmp_path / "b.h5", force=False) as empty:
        empty.set_attributes(
            {"kind": "sweep", "resolved_sweep_toml": tomli_w.dumps({"case": "c", "axis": [ANGLE]})}
        )
        empty.commit()
    with pytest.raises(UnreadableResultError, match="status is missing"):
        gathered(tmp_path / "b.h5")


def test_select_takes_the_nearest_value_and_says_so(tmp_path: Path) -> None:
    result = write(tmp_path / "r.h5", {"axis": [ANGLE, SPEED]})
    for value, place, words in (
        ("2.4", 1, "2 deg (nearest to 2.4)"),
        ("8.49", 7, "8 deg (nearest to 8.49)"),
        ("3", 2, "3 deg"),
    ):
        picture = gathered(result, [f"link2.angle_deg={value}"])
        np.testing.assert_array_equal(picture["amplitude"][0], columns((8, 7), critical=False)["amplitude"][place])
        assert picture.chosen == (f"link2.angle_deg = {words}",)


def test_units_are_those_that_a_person_would_choose() -> None:
    expected = {
        (2e7, "N/m"): (1e-6, "MN/m"),
        (5e3, "N"): (1e-3, "kN"),
        (0.05, "m/s"): (1e3, "mm/s"),
        (3e3, "m/s"): (1.0, "m/s"),
        (1100.0, "Hz"): (1.0, "Hz"),
        (22e3, "Hz"): (1e-3, "kHz"),
        (0.02, "s"): (1e3, "ms"),
        (2.0, "rad/s"): (1.0, "rad/s"),
        (1e-5, "deg"): (1.0, "deg"),
        (1e-5, ""): (1.0, ""),
        (0.0, "m"): (1.0, "m"),
    }
    for given, wanted in expected.items():
        factor, unit = prefixed(*given)
        assert (round(factor, 12), unit) == wanted
    stiff = Axis("link2_stiffness", "link2.stiffness", "N/m", np.geomspace(4e6, 4e7, 8))
    assert stiff.named(7) == "link2.stiffness = 40 MN/m"


@campaign
def test_numbers_at_ticks_stand_apart(tmp_path: Path) -> None:
    long = {"parameter": "friction.coefficient", "values": [0.123456 + 0.1 * place for place in range(6)]}
    five = {"parameter": "wheel.radius", "values": [0.1, 0.2, 0.3, 0.4, 0.5]}
    figure = drawn(write(tmp_path / "r.h5", {"axis": [long, ANGLE, five]}))
    with applied():
        rendered(figure, ".png")
        figure.draw_without_rendering()
    checked = 0
    for axes in figure.axes:
        shown = [tick.label1 for tick in axes.xaxis.get_major_ticks() if tick.label1.get_visible()]
        boxes = [text.get_window_extent() for text in shown if text.get_text()]
        for before, after in pairwise(sorted(boxes, key=lambda box: box.x0)):
            assert before.x1 < after.x0
            checked += 1
    assert checked >= 5


@pytest.mark.parametrize(("width", "count"), [(0.1, 5), (1e-4, 9), (1.0, 9)])
@campaign
def test_ticks_tell_apart_values_that_differ_little_about_a_large_one(
    width: float, count: int, tmp_path: Path
) -> None:
    near = {"parameter": "link1.stiffness", "start": 1e6, "stop": 1e6 + width, "num": count}
    figure = drawn(write(tmp_path / "r.h5", {"axis": [near]}))
    with applied():
        rendered(figure, ".png")
    texts = [text.get_text() for text in figure.axes[-1].get_xticklabels()]
    assert len({*texts}) == len(texts) >= 2


def test_regimes_differ_in_grey_and_cells_without_a_number_are_explained(tmp_path: Path) -> None:
    shades = sorted(float(np.dot((0.299, 0.587, 0.114), to_rgb(colour))) for colour, _ in REGIMES.values())
    assert np.diff(shades).min() > 0.1
    with open_result(write(tmp_path / "m.h5", {"axis": [ANGLE, SPEED]})) as stored, applied():
        figure = draw(stored, variable="frequency")
    assert "no value" in legend(figure)
    found = line(figure.axes[1], "no value").get_xydata()
    assert len(found) == np.isnan(columns((8, 7), critical=False)["frequency"]).sum()


def test_no_power_of_ten_stands_at_the_end_of_an_axis_and_no_dot_at_that_of_a_line() -> None:
    with applied():
        figure = headed(5.0, 4.0, "A title", "   ·   ".join(["a part of the heading"] * 5))
        axes = figure.subplots()
        axes.plot([0.0, 3e-20], [0.0, 2e15])
        rendered(figure, ".png")
    assert [axis.get_offset_text().get_text() for axis in (axes.xaxis, axes.yaxis)] == ["", ""]
    assert "2·10¹⁵" in [text.get_text() for text in axes.get_yticklabels()]
    assert len(figure.texts) > 2
    assert not any(text.get_text().endswith("·") for text in figure.texts)


@campaign
def test_any_number_of_a_sweep_is_drawn(tmp_path: Path) -> None:
    values = columns((8, 7), critical=True)
    values["steps"] = np.arange(56).reshape(8, 7)
    for critical in ({}, {"critical": CRITICAL}):
        result = write(tmp_path / "m.h5", {"axis": [ANGLE, SPEED], **critical}, values)
        for name in ("steps", "frequency", *(["critical_eigenvalue"] if critical else [])):
            with open_result(result) as stored, applied():
                figure = draw(stored, variable=name)
            mesh = figure.axes[0 if critical else 1].collections[0]
            shown = np.ma.filled(mesh.get_array().reshape(7, 8).T.astype(float), np.nan)  # type: ignore[union-attr]
            np.testing.assert_allclose(shown, values[name])
            assert name.replace("_", " ") in figure.axes[-1].get_ylabel()
        with pytest.raises(UsageError, match="give one of amplitude, amplitude_first, amplitude_forced, "):
            plot_result(result, tmp_path / "r.png", force=False, variable="regime")


def test_the_line_of_critical_friction_is_the_closed_form(tmp_path: Path) -> None:
    """Flutter of the undamped shoe at |cxy|/K + (cxx - cyy - K)²/(4 |cxy| K), at every stiffness of link 2."""
    case = (Path(__file__).parents[3] / "cases" / "relaxation.toml").read_text()
    resolved = parse_case(case, "case", ["link1.damping=0", "link2.damping=0"]).resolved
    friction = {"parameter": "friction.coefficient", "start": 0.0, "stop": 2.0, "num": 5}
    stiffness = {"parameter": "link2.stiffness", "values": [1.15e7, 1.2e7, 1.25e7]}
    result = write(tmp_path / "r.h5", {"axis": [friction, stiffness]}, resolved_toml=resolved)
    k = 2e6
    c1 = 1e7
    angle = np.radians(5.0)
    c2 = np.array(stiffness["values"])
    cxy = c2 * np.sin(angle) * np.cos(angle)
    difference = c2 * np.cos(2.0 * angle) - c1 - k
    expected = cxy / k + difference**2 / (4.0 * cxy * k)
    (line,) = [each for each in drawn(result).axes[0].collections if isinstance(each, ContourSet)]
    points = np.concatenate([path.vertices for path in line.get_paths()])
    for place, phi in zip(c2, expected, strict=True):
        on_it = points[np.abs(points[:, 1] - place) < 1.0]
        assert on_it[:, 0] == pytest.approx(phi, rel=1e-6)
        assert len(on_it)
    assert "critical friction" in legend(drawn(result))
    along = drawn(result, ["link2.stiffness=1.2e7"]).axes[0]
    assert line_at(along, "critical friction") == pytest.approx(expected[1], rel=1e-6)


def test_no_friction_is_below_the_critical_one_of_a_shoe_that_is_never_stable(tmp_path: Path) -> None:
    plan = write_sweep(tmp_path, frictions(4), case=resolved_toml(make(SQUEAL, **NEVER_STABLE))).plan
    assert margins(plan) == pytest.approx(-np.linspace(0.1, 1.0, 4))


def line_at(axes: Any, label: str) -> float:
    return float(line(axes, label).get_xdata()[0])


def test_other_kinds_of_results_are_refused_and_select_is_for_sweeps(tmp_path: Path) -> None:
    refused: tuple[tuple[str, list[str], str], ...] = (
        ("other", [], "a run, of a sweep, of a comparison, of stability, of branches or of scatter"),
        ("run", ["a=1"], "leave it out for a run"),
    )
    for kind, select, words in refused:
        with new_result(tmp_path / f"{kind}.h5", force=False) as result:
            result.set_attributes({"kind": kind})
            result.commit()
        with pytest.raises(UsageError, match=words):
            plot_result(tmp_path / f"{kind}.h5", tmp_path / "r.png", force=False, select=select)
    with new_result(tmp_path / "modes.h5", force=False) as result:
        result.set_attributes({"kind": "stability"})
        result.commit()
    with pytest.raises(UsageError, match="for runs, sweeps and branches"):
        plot_result(tmp_path / "modes.h5", tmp_path / "r.png", force=False, variable="x")


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=campaign)])
@campaign
def test_sweeps_of_any_values_are_drawn(tmp_path: Path, every: int) -> None:
    """All missing, all zero, all the same, of very different size; one axis and two."""
    values: list[Callable[[int], Any]] = [
        lambda count: np.full(count, np.nan),
        np.zeros,
        lambda count: np.full(count, 7e6),
        lambda count: np.geomspace(1e-12, 1e3, count),
    ]
    for axes, critical, drawn_by in list(product(([ANGLE], [SPEED, ANGLE]), (False, True), values))[::every]:
        shape = (8,) if len(axes) == 1 else (7, 8)
        same = drawn_by(math.prod(shape)).reshape(shape)
        changed = columns(shape, critical=critical) | {"amplitude": same, "frequency": same}
        if critical:
            changed |= {"critical": same, "critical_eigenvalue": same, "critical_sustained": same}
        table = {"axis": axes, **({"critical": CRITICAL} if critical else {})}
        figure = drawn(write(tmp_path / "r.h5", table, changed))
        with applied():
            figure.draw_without_rendering()
        assert figure.axes[0].get_window_extent().width > 200
