"""Pictures of sweeps over one axis: curves hold the numbers of the file, and every point has its sign."""

from pathlib import Path

import numpy as np

from tests.campaign import campaign
from tests.views.plots.helpers import (
    ANGLE,
    CRITICAL,
    REGIMES,
    columns,
    drawn,
    gathered,
    legend,
    panels,
    points,
    write,
)


def test_critical_values_and_their_error_bars_are_those_of_the_file(tmp_path: Path) -> None:
    result = write(tmp_path / "r.h5", {"axis": [ANGLE], "critical": CRITICAL})
    picture = gathered(result)
    axes, below = panels(result)
    np.testing.assert_array_equal(points(axes, "by eigenvalues")[:, 1], picture["critical_eigenvalue"][0])
    np.testing.assert_array_equal(points(axes, "by simulation")[:, 1], picture["critical"][0])
    (container,) = below.containers
    bars = np.array(container.lines[2][0].get_segments())
    np.testing.assert_allclose(np.ptp(bars[:, :, 1], axis=1), 2.0 * picture["critical_error"][0], rtol=1e-9)
    np.testing.assert_array_equal(bars[:, 0, 0], picture.axes[0].values)
    np.testing.assert_allclose(bars.mean(axis=1)[:, 1], -1e-4 * np.arange(8), atol=1e-15)
    assert below.get_xlabel() == "link2.angle_deg (deg)"
    assert axes.get_ylabel() == "critical friction.coefficient"


@campaign
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
    axes = panels(result)[0]
    along = 1.0 + np.arange(8)
    expected = {
        "stable up to 2": [0],
        "unstable from 0 on": [1],
        "no steady sliding": [2],
        "failed": [3],
        "vibration lasts from 0 on": [6, 7],
    }
    for words, places in expected.items():
        np.testing.assert_array_equal(points(axes, words)[:, 0], along[places])
    assert not any("fades" in str(each.get_label()) for each in axes.get_lines())
    lasting = points(axes, "vibration lasts from here on, from the case's own start")
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
    for axes, name, factor in zip(panels(result), ("amplitude", "frequency"), (1e6, 1.0), strict=True):
        for regime in REGIMES:
            colour = next(each.get_mfc() for each in axes.get_lines() if each.get_label() == regime)
            groups = [each for each in axes.get_lines() if each.get_mfc() == colour and len(each.get_xdata())]
            where = (values["regime"] == regime) & (values["status"] == "done")
            (shown,) = (each for each in groups if each.get_ls() == "None")
            np.testing.assert_array_equal(shown.get_xdata(), (1.0 + np.arange(8))[where])
            np.testing.assert_allclose(shown.get_ydata(), factor * values[name][where], rtol=1e-12)
        np.testing.assert_array_equal(points(axes, "failed")[:, 0], [6.0])
    assert legend(drawn(result))[:4] == REGIMES
    assert "forced by the wheel's waves" in legend(drawn(result))


def test_both_ways_are_curves_of_their_own_and_their_difference_is_shaded(tmp_path: Path) -> None:
    differ = np.array([0, 0, 1, 1, 0, 0, 0, 0])
    table = {"axis": [{**ANGLE, "direction": "both"}]}
    result = write(tmp_path / "r.h5", table, {"hysteresis": differ})
    picture = gathered(result)
    axes = panels(result)[0]
    for number, direction in enumerate(("up", "down")):
        np.testing.assert_allclose(
            points(axes, f"on the way {direction}")[:, 1], 10.0 * (1.0 + 8 * number + np.arange(8)), rtol=1e-12
        )
    bands = [patch.get_bbox().intervalx.tolist() for patch in axes.patches]
    assert bands == [[2.5, 3.5], [3.5, 4.5]]
    one_way = gathered(result, ["direction=down"])
    np.testing.assert_array_equal(one_way["amplitude"], picture["amplitude"][1:])
