"""Sweeps over initial states: which of the points come to the same motion, and how many come to each."""

import math
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
import xarray as xr
from numpy.typing import NDArray

from brakecli.case.read import starters
from brakecli.results.read import open_result
from brakecli.studies.sweeps.plan import LoadedSweep, parse_sweep
from brakecli.studies.sweeps.result import SweepReport
from brakecli.studies.sweeps.workers.task import compute_units
from brakecli.views.points import of_sweep
from brakecli.views.render import TERMINAL
from brakecli.views.terminal import terminal_text
from tests.analysis.branches.smooth_shoes import FRICTION, followed
from tests.campaign import campaign
from tests.studies.sweeps.helpers import axis, inline, interrupted, write_sweep
from tests.studies.sweeps.made_up import CYCLE, DAMPED, FORCED, made_of, swept


def numbers_of(report: SweepReport) -> list[int]:
    """The number of the attractor of each point."""
    variables = report.findings.variables
    assert variables is not None
    return [int(each) for each in np.ravel(variables["attractor"])]


@cache
def beside() -> tuple[dict[str, Any], float, NDArray[np.float64], NDArray[np.float64]]:
    """The shoe, a friction, and there steady sliding and a state on the unstable cycle beside it."""
    tables = tomllib.loads(starters()["branch"])
    del tables["title"]
    found = followed(tables, FRICTION, 0.0, 1.0)
    assert found is not None
    unstable = [point for point in found.inner if not point.stable]
    point = min(unstable, key=lambda each: abs(found.line.value(each.p) - 0.4))
    friction = float(found.line.value(point.p))
    state, _, _ = found.cycle(point)
    return found.tables, friction, np.append(found.shoe(point.p).rest, [0.0, 0.0]), state


def basin(folder: Path, factors: list[float]) -> LoadedSweep:
    """A sweep over starts on the line from steady sliding through the unstable cycle, which has a factor of 1."""
    tables, friction, rest, state = beside()
    case = {**tables, "friction": {"coefficient": friction}, "initial": {"at": "equilibrium"}}
    case["solver"] = {"scheme": "piecewise-exact", "duration": 40.0}
    (folder / "case.toml").write_text(tomli_w.dumps(case))
    rows = [[repr(float(each)) for each in factor * (state - rest)] for factor in factors]
    text = "\n".join(["initial.x, initial.y, initial.vx, initial.vy", *(", ".join(row) for row in rows)])
    (folder / "starts.csv").write_text(text)
    return parse_sweep('case = "case.toml"\npoints = "starts.csv"\n', "s.toml", folder)


@pytest.mark.usefixtures("compiled")
@campaign
def test_starts_on_either_side_of_the_unstable_cycle_come_to_two_attractors(tmp_path: Path) -> None:
    """On the line through a state of the unstable cycle, its stable surface is crossed at a factor of 1."""
    factors = [0.2, 0.6, 0.9, 0.97, 1.03, 1.1, 1.3]
    report = inline(basin(tmp_path, factors), tmp_path / "s.h5", compute_units)
    assert numbers_of(report) == [1 + (factor > 1.0) for factor in factors]
    sliding, cycle = report.findings.attractors or []
    assert (sliding.regime, sliding.amplitude, sliding.frequency, sliding.points) == ("damped", 0.0, None, 4)
    assert cycle.regime in ("relaxation", "quasi-harmonic")
    assert sliding.share.value == pytest.approx(4.0 / 7.0, rel=1e-12)


def test_the_same_motion_has_the_same_number_by_rising_amplitude(tmp_path: Path) -> None:
    """Numbers that differ by as much as those of one motion may; each of the others differs in one of them."""
    points = [
        CYCLE,
        {**CYCLE, "frequency": 50.0, "amplitude": 1.2e-5},
        DAMPED,
        {**CYCLE, "amplitude": 1.04e-5, "frequency": 100.9, "stick_fraction": 0.34},
        FORCED,
        {**CYCLE, "stick_fraction": 0.5},
        {**DAMPED, "amplitude": 1e-4},
        {**CYCLE, "contact_loss_fraction": 0.1, "frequency": 103.0},
        {**CYCLE, "amplitude": 2e-5},
    ]
    report = swept(tmp_path, points)
    assert numbers_of(report) == [5, 6, 1, 5, 2, 3, 1, 4, 7]
    found = {each.attractor: each for each in report.findings.attractors or []}
    assert [found[number].regime for number in (1, 2, 5)] == ["damped", "damped", "relaxation"]
    assert (found[1].amplitude, found[2].excitation, found[6].frequency) == (0.0, "forced", 50.0)
    assert found[5].amplitude == pytest.approx(1.02e-5, rel=1e-12)
    assert not report.findings.sentences


def test_a_gap_that_another_motion_hides_is_found(tmp_path: Path) -> None:
    """Neighbours differ by 4 % in amplitude, but the one in the middle has another period."""
    changes = {"amplitude": 1.04e-5, "frequency": 50.0}, {"amplitude": 1.081e-5}
    assert numbers_of(swept(tmp_path, [CYCLE, *({**CYCLE, **each} for each in changes)])) == [1, 2, 3]


def test_the_order_of_the_points_does_not_matter(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    sizes = rng.choice([1e-6, 1.2e-6, 4e-6], 60)
    tones = rng.choice([50.0, 100.0], 60)
    spread = rng.uniform(0.99, 1.01, (2, 60))
    points = [
        {**CYCLE, "amplitude": size, "frequency": tone}
        for size, tone in zip(sizes * spread[0], tones * (1.0 + 0.1 * (spread[1] - 1.0)), strict=True)
    ]
    order = rng.permutation(60)
    one = swept(tmp_path, points)
    other = swept(tmp_path, [points[place] for place in order])
    assert one.findings.attractors == other.findings.attractors
    assert [numbers_of(one)[place] for place in order] == numbers_of(other)
    kinds = [*zip(sizes.tolist(), tones.tolist(), strict=True)]
    medians = {
        kind: np.median([p["amplitude"] for p, own in zip(points, kinds, strict=True) if own == kind])
        for kind in kinds
    }
    rising = sorted(medians, key=lambda kind: medians[kind])
    assert numbers_of(one) == [1 + rising.index(kind) for kind in kinds]


def test_points_that_are_not_decided_have_no_attractor_and_widen_the_shares(tmp_path: Path) -> None:
    points = [*6 * [DAMPED], *2 * [CYCLE], {**CYCLE, "settled": 0}, {**CYCLE, "regime": "undecided"}]
    report = swept(tmp_path, [*points, {**CYCLE, "status": "failed"}])
    assert numbers_of(report) == [1, 1, 1, 1, 1, 1, 2, 2, 0, 0, 0]
    sliding, cycle = report.findings.attractors or []
    (said,) = report.findings.sentences
    assert said.startswith("3 of 11 points fail, are undecided or have not settled")

    def ends(hits: int) -> tuple[float, float]:
        """Wilson's: where the share differs from p by 1.96 standard deviations of p itself, a quadratic in p."""
        part = hits / 11
        z2 = 1.959963984540054**2
        n = 11
        roots = np.roots([1.0 + z2 / n, -2.0 * part - z2 / n, part * part]).tolist()
        return min(roots), max(roots)

    assert tuple(sliding.share) == pytest.approx((6 / 11, ends(6)[0], ends(9)[1]), rel=1e-9)
    assert tuple(cycle.share) == pytest.approx((2 / 11, ends(2)[0], ends(5)[1]), rel=1e-9)
    assert "attractor  regime      Hz   amplitude of x, m  share  95 % interval" in terminal_text(
        of_sweep(report, TERMINAL)
    )


def test_motions_without_a_gap_between_them_are_told(tmp_path: Path) -> None:
    """A family of cycles side by side, as where nothing damps: neighbours differ by 4 %."""
    report = swept(tmp_path, [{**CYCLE, "amplitude": 1e-5 * 1.04**place} for place in range(10)])
    assert set(numbers_of(report)) == {1}
    (said,) = report.findings.sentences
    assert said.startswith("attractor 1 holds motions with amplitudes of 1e-05 to 1.42e-05 m, and no gap")


def test_a_sweep_without_any_decided_point_has_no_attractor(tmp_path: Path) -> None:
    report = swept(tmp_path, 3 * [{**CYCLE, "regime": "undecided"}])
    assert (numbers_of(report), report.findings.attractors) == ([0, 0, 0], [])
    assert report.numbers()["attractors"] == []


@pytest.mark.parametrize(
    "tables",
    [
        (axis("friction.coefficient", "values = [0.1, 0.2]"),),
        (axis("initial.vx", "values = [0.0, 1.0]"), axis("load.force", "values = [900.0]")),
        (axis("initial.vx", "values = [0.0, 1.0]", 'direction = "up"'),),
    ],
)
def test_other_sweeps_have_none(tmp_path: Path, tables: tuple[str, ...]) -> None:
    report = swept(tmp_path, [DAMPED, CYCLE], *tables)
    assert report.numbers()["attractors"] is None
    assert "attractor" not in (report.findings.variables or {})
    with open_result(tmp_path / "s.h5") as stored:
        assert "attractor" not in stored.variables("/")


def test_the_file_holds_them_and_an_interruption_changes_no_byte_of_it(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    points = [{**CYCLE, "amplitude": size} for size in rng.choice([1e-6, 2e-6, 3e-6], 12)]
    grid = axis("initial.x", "values = [0.0, 1e-5, 2e-5]"), axis("initial.vy", "values = [0.0, 0.1, 0.2, 0.3]")
    report = swept(tmp_path, points, *grid)
    whole = (tmp_path / "s.h5").read_bytes()
    loaded = write_sweep(tmp_path, *grid)
    (tmp_path / "s.h5").unlink()
    interrupted(loaded, tmp_path / "s.h5", made_of(points), limit=2, task_size=3)
    inline(loaded, tmp_path / "s.h5", made_of(points))
    assert (tmp_path / "s.h5").read_bytes() == whole
    with xr.open_dataset(tmp_path / "s.h5", engine="h5netcdf") as found:
        assert found.attractor.dims == ("initial_x", "initial_vy")
        assert found.attractor.to_numpy().ravel().tolist() == numbers_of(report)
    with xr.open_dataset(tmp_path / "s.h5", engine="h5netcdf", group="attractors") as table:
        given = report.numbers()["attractors"]
        for name in ("attractor", "regime", "amplitude", "frequency", "points", "share", "share_lower"):
            assert table[name].to_numpy().tolist() == [each[name] for each in given], name
        assert math.fsum(table.share.to_numpy()) == pytest.approx(1.0, rel=1e-12)


def test_many_undecided_points_are_told_with_their_most_frequent_reason_and_the_longest_run(
    tmp_path: Path,
) -> None:
    grows = "still growing at 3.1 1/s (140 Hz); run at least {} s"
    reasons = [grows.format("0.9"), "irregular", grows.format("1.54"), grows.format("1.2e-1")]
    points = [{"regime": "undecided", "excitation": "none", "reason": each} for each in reasons]
    said = swept(tmp_path, [*points, DAMPED]).findings.sentences[0]
    assert said.startswith(f"4 of 5 points are undecided, 3 of them: {grows.format('1.54')}")
    assert 'solver.duration = "settled"' in said
    few = swept(tmp_path, [*points[:1], *[DAMPED] * 4]).findings.sentences
    assert not any("points are undecided," in each for each in few)
