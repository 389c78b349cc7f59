"""Pictures of sweeps: what they show is what the result holds, and what cannot be drawn is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from numpy.typing import NDArray

from brakecli.case.case import resolved_toml
from brakecli.errors import UnreadableResultError, UsageError
from brakecli.results.read import open_result
from brakecli.results.write import new_result
from brakecli.studies.sweeps.margin import margins
from brakecli.studies.sweeps.plan import parse_sweep
from brakecli.studies.sweeps.workers.task import compute_units
from brakecli.views.plots.axis import Axis
from brakecli.views.plots.result import draw, plot_result
from brakecli.views.plots.style import applied, prefixed, readable
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


def test_regimes_differ_in_grey_and_cells_without_a_number_are_explained(tmp_path: Path) -> None:
    shades = sorted(float(np.dot((0.299, 0.587, 0.114), to_rgb(colour))) for colour, _ in REGIMES.values())
    assert np.diff(shades).min() > 0.1
    with open_result(write(tmp_path / "m.h5", {"axis": [ANGLE, SPEED]})) as stored, applied():
        figure = draw(stored, variable="frequency")
    assert "no value" in legend(figure)
    found = line(figure.axes[1], "no value").get_xydata()
    assert len(found) == np.isnan(columns((8, 7), critical=False)["frequency"]).sum()


def test_no_friction_is_below_the_critical_one_of_a_shoe_that_is_never_stable(tmp_path: Path) -> None:
    plan = write_sweep(tmp_path, frictions(4), case=resolved_toml(make(SQUEAL, **NEVER_STABLE))).plan
    assert margins(plan) == pytest.approx(-np.linspace(0.1, 1.0, 4))


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
