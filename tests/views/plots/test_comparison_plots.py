"""Pictures of comparisons: what they show is what the result holds, and what cannot be drawn is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import UnreadableResultError, UsageError
from brakecli.results.field import Field
from brakecli.results.read import open_result
from brakecli.results.write import FILL, new_result
from brakecli.studies.comparison import result as comparison_result
from brakecli.studies.comparison.compare import compare
from brakecli.studies.comparison.methods import method_label
from brakecli.studies.comparison.result import ComparisonReport
from brakecli.views.plots.comparison import LARGEST
from brakecli.views.plots.result import draw, plot_result
from brakecli.views.plots.style import applied
from tests.campaign import campaign
from tests.commands import TINY
from tests.views.plots.helpers import drawn, legend, line

METHODS = {
    "two-layer (1/2, 1/2)": ("two-layer", "0.5, 0.5", "consistent", "newton", "auto", 256),
    "two-layer (1/2, 1/2), fixed point": ("two-layer", "0.5, 0.5", "consistent", "fixed-point", "auto", 256),
    "two-layer (1/2, 1/2), 64 nodes": ("two-layer", "0.5, 0.5", "consistent", "newton", "midpoint", 64),
    "two-layer (1/2, 1/2), exact contact": ("two-layer", "0.5, 0.5", "consistent", "newton", "exact", 0),
    "three-layer (1/4, 1/2, 1/4)": ("three-layer", "0.25, 0.5, 0.25", "consistent", "newton", "auto", 256),
    "three-layer (1/4, 1/2, 1/4), paper's start": (
        "three-layer", "0.25, 0.5, 0.25", "paper", "newton", "auto", 256,
    ),
    "event-driven": ("event-driven", "", "consistent", "newton", "auto", 0),
}  # fmt: skip
RUNGS = 4
BEST = "two-layer (1/2, 1/2)"  # recommended, and on the front
ASKED = "three-layer (1/4, 1/2, 1/4)"  # by the case itself
OTHERS = [label for label in METHODS if label not in (BEST, ASKED)]
CASE = parse_case(TINY, "tiny", ['solver.scheme="three-layer"']).resolved

Columns = dict[str, NDArray[Any]]


def columns() -> Columns:
    """Every column that is drawn: a method costs and errs a little more than the one before it."""
    count = len(METHODS) * RUNGS
    place = np.arange(count) // RUNGS
    rung = np.arange(count) % RUNGS
    own = place == len(METHODS) - 1
    texts = np.array([(label, *kind[:5]) for label, kind in METHODS.items()])[place].T
    found: Columns = dict(
        zip(("method", "scheme", "theta", "start", "iteration", "evaluator"), texts.copy(), strict=True)
    )
    return found | {
        "failure": np.full(count, ""),
        "nodes": np.array([kind[5] for kind in METHODS.values()])[place],
        "step": np.where(own, np.nan, 1e-5 / 2.0**rung),
        "tolerance": np.where(own, 10.0 ** (-3.0 - rung), np.nan),
        "error": 0.1 * 4.0**-rung * (1.0 + 0.1 * place),
        "wall_seconds": 1e-3 * 2.0**rung * (1.0 + 0.1 * place),
        "contact_evaluations": 100 * 2**rung * (1 + place),
        "on_front": (place == 0).astype(int),
    }


def write(path: Path, changed: Columns | None = None, **attributes: Any) -> Path:
    """A result of a comparison with what its picture shows."""
    values = columns() | (changed or {})
    known = {"title": "Größe $x_{", "target_error": 1e-2, "reference_error": 1e-6, "duration": 0.02, "left_out": 0}
    with new_result(path, force=True) as result:
        about = {"kind": "comparison", "resolved_toml": CASE, "recommended": 2}
        result.set_attributes(about | known | attributes)
        result.axis("/", Field("entry", "1", "entry"), np.arange(len(values["method"])))
        for name, array in values.items():
            data = np.where(np.isnan(array), FILL, array) if array.dtype.kind == "f" else array
            result.variable("/", Field(name, "1", name), ("entry",), data)
        result.commit()
    return path


def curves(axes: Any) -> dict[str, Any]:
    """The line of each method: those without a name lie in the order of the file."""
    grey = [each for each in axes.get_lines() if each.get_label() == "other methods"]
    named = {BEST: line(axes, BEST), ASKED: line(axes, f"{ASKED}, of the case")}
    return named | dict(zip(OTHERS, grey, strict=True))


@pytest.mark.parametrize("suffix", ["png", *(pytest.param(each, marks=campaign) for each in ("pdf", "svg"))])
@campaign
def test_each_suffix_gives_a_whole_picture_and_the_same_bytes_again(suffix: str, tmp_path: Path) -> None:
    result = write(tmp_path / "r.h5")
    for name in ("a", "b"):
        plot_result(result, tmp_path / f"{name}.{suffix}", force=False)
    assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
    if suffix == "png":
        assert imread(tmp_path / "a.png")[..., :3].std() > 0.05  # not blank


def test_curves_are_the_numbers_of_the_file_in_both_panels(tmp_path: Path) -> None:
    values = columns()
    figure = drawn(write(tmp_path / "r.h5"))
    checked = 0
    for axes, name, factor in zip(figure.axes, ("wall_seconds", "contact_evaluations"), (1e3, 1.0), strict=True):
        assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
        for label in METHODS:
            of = values["method"] == label
            curve = curves(axes)[label]
            np.testing.assert_allclose(curve.get_xdata(), factor * values[name][of], rtol=1e-12)
            np.testing.assert_array_equal(curve.get_ydata(), values["error"][of])
            checked += 1
    assert checked == 2 * len(METHODS)
    assert figure.texts[0].get_text() == "Größe $x_{"
    assert figure.axes[0].get_xlabel() == "median time of the loop (ms)"


def test_the_legend_covers_no_panel(tmp_path: Path) -> None:
    with applied():
        figure = drawn(write(tmp_path / "r.h5"))
        figure.draw_without_rendering()
    (found,) = figure.legends
    edge = found.get_window_extent().x0
    assert all(axes.get_window_extent().x1 < edge for axes in figure.axes)
    assert found.get_window_extent().x1 <= figure.bbox.x1


def test_what_is_missing_or_no_result_any_more_leaves_a_gap(tmp_path: Path) -> None:
    values = columns()
    values["error"][0] = np.nan
    values["error"][1] = 1e80
    values["failure"] = np.where(np.arange(len(values["error"])) == 0, "diverged", "")
    figure = drawn(write(tmp_path / "r.h5", values, left_out=0))
    for axes in figure.axes:
        x, y = line(axes, "two-layer (1/2, 1/2)").get_data()
        assert np.isnan(x[:2]).all()
        assert np.isfinite(x[2:]).all()
        np.testing.assert_array_equal(np.isnan(x), np.isnan(y))
    assert figure.axes[0].get_ylim()[1] < 10.0 * LARGEST
    assert "failed 1" in figure.texts[2].get_text()


def test_errors_that_the_reference_cannot_tell_are_shaded(tmp_path: Path) -> None:
    figure = drawn(write(tmp_path / "r.h5", reference_error=5e-3))
    assert "within the reference's error" in legend(figure)
    for axes in figure.axes:
        (band,) = axes.patches
        assert isinstance(band, Rectangle)
        assert band.get_bbox().y1 == pytest.approx(5e-3)


def test_without_times_the_work_is_drawn_alone(tmp_path: Path) -> None:
    missing = np.full(len(columns()["method"]), np.nan)
    figure = drawn(write(tmp_path / "r.h5", {"wall_seconds": missing}))
    assert [axes.get_xlabel() for axes in figure.axes] == ["evaluations of the contact force"]
    assert " ms" not in figure.texts[1].get_text()


def test_where_nothing_meets_the_target_the_picture_says_so(tmp_path: Path) -> None:
    with open_result(write(tmp_path / "r.h5")) as stored:
        del stored.attributes["recommended"]
        with applied():
            figure = draw(stored)
    assert figure.texts[1].get_text() == "no entry has an error of at most 0.01"
    assert "recommended" not in legend(figure)


def test_a_computed_comparison_is_drawn_with_its_own_numbers(tmp_path: Path) -> None:
    loaded = parse_case(TINY, "tiny")
    found = compare(
        system_of(loaded.case), schemes=["three-layer", "event-driven"], steps=[4e-5, 2e-5], budget=30.0
    )
    report = ComparisonReport(tmp_path / "r.h5", loaded.case, found, 1e-2)
    comparison_result.write(report.output, loaded, report, force=False)
    figure = drawn(report.output)
    assert figure.texts[0].get_text() == "Tiny"
    for label in {method_label(entry.kind) for entry in found.entries}:
        sizes = [e.errors.error for e in found.entries if e.errors and method_label(e.kind) == label]
        assert len(sizes) >= 2
        shown = [np.array(each.get_ydata()) for each in figure.axes[1].get_lines()]
        assert any(len(each) == len(sizes) and np.allclose(each, sizes, rtol=1e-12) for each in shown), label


def test_what_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    result = write(tmp_path / "r.h5")
    with pytest.raises(UsageError, match="leave it out for a comparison"):
        plot_result(result, tmp_path / "r.png", force=False, select=["a=1"])
    empty = write(tmp_path / "e.h5", {"error": np.full(len(columns()["method"]), np.nan)})
    with pytest.raises(UsageError, match="nothing to draw"):
        plot_result(empty, tmp_path / "r.png", force=False)
    beyond = write(tmp_path / "b.h5", recommended=999)
    with pytest.raises(UnreadableResultError, match="does not hold"):
        plot_result(beyond, tmp_path / "r.png", force=False)
    with new_result(tmp_path / "n.h5", force=False) as bare:
        bare.set_attributes({"kind": "comparison"})
        bare.commit()
    with pytest.raises(UnreadableResultError, match="no variable method"):
        plot_result(tmp_path / "n.h5", tmp_path / "r.png", force=False)
    assert not (tmp_path / "r.png").exists()
