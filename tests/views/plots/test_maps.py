"""Pictures of sweeps over two and three axes: the colours of cells are the numbers of the file."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.results.read import open_result
from brakecli.views.plots.result import draw
from brakecli.views.plots.style import applied
from tests.studies.sweeps.helpers import axis
from tests.studies.sweeps.made_up import CYCLE, DAMPED, swept
from tests.views.plots.helpers import (
    ANGLE,
    CRITICAL,
    REGIMES,
    SPEED,
    columns,
    drawn,
    legend,
    panels,
    points,
    write,
)


def test_maps_hold_the_values_of_their_cells(tmp_path: Path) -> None:
    values = columns((8, 7), critical=True)
    values["critical"][3, 4] = np.nan
    values["critical_status"][3, 4] = "stable throughout"
    values["status"][1, 2] = "failed"
    axes = panels(write(tmp_path / "c.h5", {"axis": [ANGLE, SPEED], "critical": CRITICAL}, values))[0]
    mesh = axes.collections[0]
    shown = np.ma.filled(mesh.get_array().reshape(7, 8).T.astype(float), np.nan)
    np.testing.assert_array_equal(shown, values["critical"])
    assert axes.get_yscale() == "log"
    assert axes.get_xscale() == "linear"
    np.testing.assert_allclose(points(axes, "stable up to 2"), [[4.0, 1.0]], rtol=1e-12)
    regime, amplitude, _ = panels(write(tmp_path / "m.h5", {"axis": [ANGLE, SPEED]}, values))
    codes = np.ma.filled(regime.collections[0].get_array().reshape(7, 8).T.astype(float), np.nan)
    for (x, y), code in np.ndenumerate(codes):
        assert np.isnan(code) if (x, y) == (1, 2) else REGIMES[int(code)] == values["regime"][x, y]
    np.testing.assert_allclose(
        amplitude.collections[0].get_array().reshape(7, 8).T, 1e6 * values["amplitude"], rtol=1e-12
    )


def test_each_attractor_has_a_colour_of_its_own_in_grey_as_well(tmp_path: Path) -> None:
    sizes = [1e-6, 2e-6, 4e-6]
    made = [DAMPED, *({**CYCLE, "amplitude": size} for size in sizes), {**CYCLE, "settled": 0}, DAMPED]
    swept(
        tmp_path, made, axis("initial.x", "values = [0.0, 1e-5]"), axis("initial.vy", "values = [0.0, 0.1, 0.2]")
    )
    figure = drawn(tmp_path / "s.h5")
    attractor, amplitude = figure.axes[:2]
    assert [each.get_title(loc="left") for each in (attractor, amplitude)] == ["Attractor", "Amplitude"]
    mesh = attractor.collections[0]
    shown = np.ma.filled(mesh.get_array().reshape(3, 2).T.astype(float), np.nan)  # type: ignore[union-attr]
    np.testing.assert_array_equal(shown, [[1, 2, 3], [4, np.nan, 1]])
    np.testing.assert_allclose(points(attractor, "no attractor known"), [[1e-5, 0.1]])
    with open_result(tmp_path / "s.h5") as stored, applied():
        again = draw(stored, variable="attractor").axes[:2]  # the same two maps
    assert [each.get_title(loc="left") for each in again] == ["Attractor", "Amplitude"]
    words = legend(figure)
    assert words[:2] == ["1: damped, 33.3% of the points", "2: relaxation, 100 Hz, 1 µm, 16.7% of the points"]
    cells = np.array(mesh.cmap(mesh.norm(np.arange(1.0, 5.0))))[:, :3]
    assert (np.diff(cells @ [0.2126, 0.7152, 0.0722]) < -0.1).all()  # luminance
    lines: list[Any] = attractor.get_lines()
    keys = [each.get_mfc()[:3] for each in lines if each.get_label()[:1].isdigit()]
    np.testing.assert_allclose(keys, cells)


def test_a_cell_where_nothing_lasts_is_empty_however_large_its_amplitude_still_is(tmp_path: Path) -> None:
    axes = (
        axis("friction.coefficient", "values = [0.1, 0.2]"),
        axis("shoe.mass", "values = [1.0, 2.0]"),
    )
    swept(tmp_path, [{**DAMPED, "amplitude": 3e-5}, CYCLE, CYCLE, CYCLE], *axes)
    with open_result(tmp_path / "s.h5") as result, applied():
        figure = draw(result)
    mesh = figure.axes[1].collections[0]
    values: Any = np.ma.asarray(mesh.get_array()).reshape(2, 2)
    assert np.ma.getmaskarray(values).tolist() == [[True, False], [False, False]]
    assert "damped: nothing lasts" in [text.get_text() for text in figure.legends[0].get_texts()]


PLAN = """\
friction.coefficient, solver.scheme, wheel.angular_speed, shoe.mass
0.5, two-layer, 4, 10
0.3, two-layer, 4, 11
0.4, three-layer, 4, 12
0.4, two-layer, 4, 10
"""


def listed(folder: Path, plan: str, points: list[dict[str, Any]], *tables: str) -> Any:
    (folder / "plan.csv").write_text(plan)
    swept(folder, points, 'points = "plan.csv"', *tables)
    return drawn(folder / "s.h5")


def dots(axes: Any) -> dict[tuple[float, float], float]:
    """The numbers of the coloured dots by their places; those without a number are another collection."""
    _, coloured = axes.collections
    pairs = zip(coloured.get_offsets().tolist(), coloured.get_array().tolist(), strict=True)
    return {(x, y): value for (x, y), value in pairs if value is not None}


def test_listed_points_are_dots_in_the_plane_of_the_first_two_keys_that_vary(tmp_path: Path) -> None:
    failed = {"status": "failed", "amplitude": np.nan}
    figure = listed(tmp_path, PLAN, [{**CYCLE, "amplitude": 2e-5}, DAMPED, CYCLE, failed])
    regime, amplitude = figure.axes[:2]
    assert [regime.get_xlabel(), regime.get_ylabel()] == ["friction.coefficient", "solver.scheme"]
    assert [each.get_text() for each in regime.get_yticklabels()] == ["three-layer", "two-layer"]
    places = [(0.5, 1.0), (0.3, 1.0), (0.4, 0.0), (0.4, 1.0)]
    assert dots(regime) == dict(zip(places[:3], [1.0, 0.0, 1.0], strict=True))
    assert dots(amplitude) == pytest.approx({places[0]: 20.0, places[2]: 10.0})
    assert sorted(map(tuple, amplitude.collections[0].get_offsets().tolist())) == [places[1], places[3]]
    np.testing.assert_array_equal(points(amplitude, "failed"), [places[3]])
    assert "at different shoe.mass" in [text.get_text() for text in figure.texts]
