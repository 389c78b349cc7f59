"""Sweeps from their files to their results: every point as its own run gives it."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from brakecli.case.case import resolved_toml
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import key_text
from brakecli.studies.sweeps.driver import TaskQueue
from brakecli.studies.sweeps.plan import LoadedSweep, Plan, parse_sweep, plan_of
from brakecli.studies.sweeps.point import line_points, next_start
from brakecli.studies.sweeps.record import Status, blank, record_type
from brakecli.studies.sweeps.result import SweepReport, _hysteresis, _on_lasting_vibration
from brakecli.studies.sweeps.simulate import simulate
from brakecli.studies.sweeps.workers.task import Task, compute_units
from tests.campaign import campaign
from tests.commands import TINY, attributes, brakecli, left_in
from tests.studies.sweeps.helpers import inline

CASE = TINY.replace("0.02", "0.4").replace("1e-5", "2e-5").replace("1e-4", "2e-4")
GRID = """\
title = "Speed and friction"
case = "tiny.toml"
[[axis]]
parameter = "wheel.angular_speed"
values = [0.1, 0.6]
[[axis]]
parameter = "friction.coefficient"
start = 0.4
stop = 0.8
num = 3
"""


def load(folder: Path, text: str, case: str = CASE, *overrides: str) -> LoadedSweep:
    (folder / "tiny.toml").write_text(case)
    return parse_sweep(text, "sweep.toml", folder, overrides)


def run(folder: Path, text: str, case: str = CASE, **options: Any) -> SweepReport:
    loaded = load(folder, text, case)
    return inline(loaded, folder / "sweep.h5", compute_units, **options)


def opened(path: Path) -> xr.Dataset:
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        return dataset.load()


def test_a_point_is_the_case_with_its_values(tmp_path: Path) -> None:
    """Also where a table that no point changes follows from others: orders from the radius, samples from modes."""
    text = TINY.replace("step = 1e-5", "tolerance = 1e-3").replace("output.sample_interval = 1e-4", "")
    text += "[roughness.wheel]\namplitudes = [1e-6]\norders = [40]\n"
    axes = (("wheel.radius", "[0.4, 0.6]"), ("link2.stiffness", "[1e7, 3e8]"))
    tables = [f'[[axis]]\nparameter = "{key}"\nvalues = {values}\n' for key, values in axes]
    plan = load(tmp_path, 'case = "tiny.toml"\n' + "".join(tables), text).plan
    intervals = set()
    for point in range(plan.points):
        settings = plan.settings(point)
        alone = parse_case(text, "c", [f"{key_text(path)}={value}" for path, value in settings.items()]).case
        assert plan.case(settings) == alone
        intervals.add(alone.output.sample_interval)
    assert len(intervals) > 1


def test_every_point_is_what_a_run_of_its_own_gives(tmp_path: Path) -> None:
    report = run(tmp_path, GRID)
    found = opened(tmp_path / "sweep.h5")
    assert found.regime.dims == ("wheel_angular_speed", "friction_coefficient")
    assert (found.status == "done").all()
    tried = 0
    for speed in found.wheel_angular_speed.values:
        for friction in found.friction_coefficient.values:
            overrides = [f"wheel.angular_speed={speed}", f"friction.coefficient={friction}"]
            outcome = simulate(parse_case(CASE, "tiny", overrides).case)
            point = found.sel(wheel_angular_speed=speed, friction_coefficient=friction)
            verdict = outcome.verdict
            assert str(point.regime.values) == verdict.regime
            assert str(point.excitation.values) == verdict.excitation
            assert float(point.amplitude) == verdict.amplitude
            assert float(point.stick_fraction) == verdict.stick_fraction
            assert int(point.steps) == outcome.motion.work.steps
            assert int(point.contact_evaluations) == outcome.motion.work.contact_evaluations
            assert str(point.reason.values) == "; ".join(verdict.reasons)
            frequency = float(point.frequency)
            assert np.isnan(frequency) if verdict.frequency is None else frequency == verdict.frequency
            tried += 1
    assert tried == report.findings.points == 6
    assert set(report.findings.regimes) >= {"damped", "relaxation"}


def test_the_file_says_what_it_holds_and_nothing_is_left_beside_it(tmp_path: Path) -> None:
    run(tmp_path, GRID)
    assert left_in(tmp_path) == {"tiny.toml", "sweep.h5"}
    found = attributes(tmp_path / "sweep.h5")
    loaded = load(tmp_path, GRID)
    assert (found["kind"], found["complete"], found["format_version"]) == ("sweep", 1, 1)
    assert (found["sweep_toml"], found["case_toml"]) == (GRID, CASE)
    assert found["resolved_toml"] == resolved_toml(loaded.base.case)
    assert (found["points"], found["failed_points"], found["title"]) == (6, 0, "Speed and friction")
    variables = opened(tmp_path / "sweep.h5")
    for name, variable in variables.variables.items():
        assert "long_name" in variable.attrs, name
        assert "units" in variable.attrs, name
    assert variables.wheel_angular_speed.units == "rad/s"
    assert variables.wheel_angular_speed.parameters == "wheel.angular_speed"


def test_an_axis_of_texts_and_a_search_without_axes_have_their_dimension(tmp_path: Path) -> None:
    text = 'case = "tiny.toml"\n[[axis]]\nparameter = "solver.scheme"\nvalues = ["two-layer", "three-layer"]\n'
    run(tmp_path, text)
    assert list(opened(tmp_path / "sweep.h5").solver_scheme.values) == ["two-layer", "three-layer"]
    (tmp_path / "sweep.h5").unlink()
    text = 'case = "tiny.toml"\n[critical]\nparameter = "friction.coefficient"\nlower = 0.3\nupper = 0.9\n'
    report = run(tmp_path, text)
    found = opened(tmp_path / "sweep.h5")
    assert found.critical.dims == ("point",)
    assert float(found.critical[0]) == pytest.approx(0.5753762, abs=5e-8)  # stability's answer
    assert float(found.critical_lower[0]) < float(found.critical[0]) < float(found.critical_upper[0])
    assert str(found.critical_status.values[0]) == "found"
    assert found.critical.parameter == "friction.coefficient"
    assert report.findings.critical is not None
    assert report.findings.critical[0] == 1


@campaign
def test_a_search_says_what_it_does_not_find_without_dashpots(tmp_path: Path) -> None:
    text = 'case = "tiny.toml"\n[critical]\nparameter = "friction.coefficient"\nlower = 0.3\nupper = 0.9\n'
    rough = CASE + "\n[roughness.wheel]\namplitudes = [1e-9]\nwavelengths = [0.02]\n"
    for case, bare, warned in ((rough, True, True), (rough, False, False), (CASE, True, False)):
        loaded = load(tmp_path, text, case, *(["link1.damping=0", "link2.damping=0"] if bare else []))
        told = inline(loaded, tmp_path / "s.h5", compute_units, force=True).findings.sentences
        assert any("no dashpot acts: growth that a damping ratio of 1e-05" in each for each in told) is warned


def test_a_case_that_is_not_there_is_reported_at_the_key_of_the_sweep(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(
        'title = "a"\ncase = "gone.toml"\n[[axis]]\nparameter = "load.force"\nvalues = [1]'
    )
    done = brakecli("sweep", "s.toml", cwd=tmp_path)
    done.told(2, "s.toml:2: case: ", "gone.toml cannot be read: no such file or directory; name a TOML file")


def test_points_that_fail_are_listed_and_the_others_are_there(tmp_path: Path) -> None:
    text = 'case = "tiny.toml"\n[[axis]]\nparameter = "output.sample_interval"\nvalues = [2e-4, 1e-6, 4e-4]\n'
    assert run(tmp_path, text.replace("1e-6", "1e-4")).findings.failed == 0
    text += '[[axis]]\nparameter = "solver.step"\nvalues = [2e-5, 5e-7]\n'
    (tmp_path / "s.toml").write_text(text)
    done = brakecli("sweep", "s.toml", "--json", cwd=tmp_path)
    done.told(
        1, "point 2 (output.sample_interval = 1e-06, solver.step = 2e-05)", "is below the time step", "1 of 6"
    )
    assert done.json["failed_points"] == 1
    assert done.json["failures"][0]["point"] == 2
    assert done.json["regime"][0] == ["undecided", "undecided"] or len(done.json["regime"]) == 3
    found = opened(tmp_path / "s.h5")
    assert (found.status == "done").sum() == 5
    assert np.isnan(found.amplitude.values[1, 0])


def test_a_run_that_fails_numerically_fails_its_point(tmp_path: Path) -> None:
    text = 'case = "tiny.toml"\n[[axis]]\nparameter = "contact.stiffness"\nvalues = [2e7, 4e12]\n'
    case = CASE.replace("solver = {", 'solver = { iteration = "fixed-point", ')
    report = run(tmp_path, text, case)
    assert report.findings.failed == 1
    assert "did not converge" in report.findings.failures[0]["reason"]


@pytest.mark.parametrize("direction", ["up", "down"])
def test_each_point_of_a_followed_axis_starts_where_the_one_before_has_ended(
    tmp_path: Path, direction: str
) -> None:
    text = GRID + f'direction = "{direction}"\n'
    report = run(tmp_path, text)
    found = opened(tmp_path / "sweep.h5")
    order = [0.4, 0.6, 0.8] if direction == "up" else [0.8, 0.6, 0.4]
    for speed in (0.1, 0.6):
        initial: dict[str, float] = {}
        for friction in order:
            overrides = [f"wheel.angular_speed={speed}", f"friction.coefficient={friction}"]
            overrides += [f"initial.{key}={value!r}" for key, value in initial.items()]
            outcome = simulate(parse_case(CASE, "tiny", overrides).case)
            end = outcome.motion.rows[-1, :4].tolist()
            initial = dict(zip(("x", "y", "vx", "vy"), end, strict=True))
            place = list(found.friction_coefficient.values.round(6)).index(friction)
            point = found.sel(wheel_angular_speed=speed).isel(friction_coefficient=place)
            assert float(point.amplitude) == pytest.approx(outcome.verdict.amplitude, rel=1e-9)
    assert report.findings.failed == 0


def test_the_wheel_goes_on_turning_from_one_point_to_the_next(tmp_path: Path) -> None:
    """Following a key that changes nothing is one long run: also its second half starts on the waves it met."""
    waves = "roughness.wheel = { amplitudes = [2e-6, 0.0, 1e-6], wavelengths = [0.013, 0.5, 0.0071] }\n"
    case = CASE + waves
    text = 'case = "tiny.toml"\n[[axis]]\nparameter = "solver.allow_unconverged"\nvalues = [false, true]\n'
    loaded = load(tmp_path, text, case)
    whole = simulate(parse_case(case, "tiny", ["solver.duration=0.8"]).case)
    first = simulate(loaded.base.case)
    second = simulate(loaded.plan.case(next_start(first)))
    # Phases pass through degrees, and the second run starts anew from four numbers: rounding, times its growth.
    end = second.motion.rows[-1, :4]
    other = whole.motion.rows[-1, :4]
    np.testing.assert_allclose(end, other, rtol=1e-6, atol=1e-9 * np.abs(other).max())


def test_along_wavelengths_each_wave_goes_on_with_its_phase(tmp_path: Path) -> None:
    """What a point of the wheel meets changes in its slope there, but not in its height."""
    waves = "roughness.wheel = { amplitudes = [2e-6], wavelengths = [0.013] }\ninitial.wheel_angle = 0.7\n"
    text = 'case = "tiny.toml"\n[[axis]]\nparameter = "roughness.wheel.wavelengths"\nvalues = [[0.013], [0.02]]\n'
    loaded = load(tmp_path, text, CASE + waves)
    first = simulate(loaded.base.case)
    nxt = system_of(loaded.plan.case({("roughness", "wheel", "wavelengths"): [0.02], **next_start(first)}))
    system = first.motion.system
    case = loaded.base.case
    met = 0.7 * case.wheel.radius + system.belt_speed * system.sampled_duration
    assert np.sin(nxt.wheel.phase[0]) == pytest.approx(np.sin(-2.0 * np.pi * met / 0.013), abs=1e-9)


def test_lines_go_up_and_down_through_every_point_once() -> None:
    axes = '[[axis]]\nparameter = "link2.angle_deg"\nvalues = [1.0, 2.0]\n'
    followed = '[[axis]]\nparameter = "friction.coefficient"\nvalues = [0.5, 0.1, 0.9]\ndirection = "both"\n'
    last = '[[axis]]\nparameter = "shoe.mass"\nvalues = [1.0, 2.0, 3.0, 4.0]\n'
    plan = plan_of(f'case = "x"\n{axes}{followed}{last}', "")
    lines = [line_points(plan, line) for line in range(plan.units)]
    assert (plan.units, plan.unit_length, plan.passes) == (16, 3, 2)
    for way in (lines[:8], lines[8:]):
        assert sorted(point for line in way for point in line) == list(range(24))
    value = plan.sweep.axis[1].value
    for line in lines:
        others = {(plan.places(point)[0], plan.places(point)[2]) for point in line}
        assert len(others) == 1
    assert [value(plan.places(point)[1]) for point in lines[0]] == [0.1, 0.5, 0.9]
    assert [value(plan.places(point)[1]) for point in lines[8]] == [0.9, 0.5, 0.1]


GROWING = """\
shoe.mass = 10.0
wheel = { radius = 0.5, angular_speed = 2.0 }
link1 = { stiffness = 1e7, damping = 300.0 }
link2 = { stiffness = 1.2e7, damping = 300.0, angle_deg = 5.0 }
load.force = 5000.0
friction.coefficient = 0.5
contact = { half_length = 0.05, stiffness = 2e7 }
initial.at = "equilibrium"
initial.x = 1e-8
solver = { step = 2e-5, duration = 0.2 }
output.sample_interval = 1e-4
"""


@pytest.mark.parametrize("steps", ["step = 2e-5", "tolerance = 1e-3"])
def test_hysteresis_between_up_and_down_is_found_and_reported(tmp_path: Path, steps: str) -> None:
    """A shoe that vibrates on a stiff contact goes on doing so where one at rest on it stays at rest."""
    case = """\
shoe.mass = 15.7
wheel = { radius = 0.5, angular_speed = 0.0106 }
link1 = { stiffness = 1.6e7, damping = 85.0, angle_deg = 27.8 }
link2 = { stiffness = 2.85e7, damping = 199.0, angle_deg = 16.4 }
load.force = 1144.0
friction.coefficient = 1.0
contact = { half_length = 0.05, stiffness = 6e7 }
initial.at = "equilibrium"
initial.x = 1e-9
solver = { step = 2e-5, duration = 4.0 }
output.sample_interval = 1e-4
"""
    axis = '[[axis]]\nparameter = "friction.coefficient"\nvalues = [0.2, 1.0, 2.0, 3.4]\ndirection = "both"\n'
    report = run(tmp_path, 'case = "tiny.toml"\n' + axis, case.replace("step = 2e-5", steps))
    found = opened(tmp_path / "sweep.h5")
    up = found.sel(direction="up")
    down = found.sel(direction="down")
    assert list(up.regime.values[:3]) == ["damped"] * 3
    assert list(down.regime.values[1:]) == ["relaxation"] * 3
    assert list(found.hysteresis.values[1:3]) == [1, 1]
    loop = "begins on the way up between 2 and 3.4, and ends on the way down between 1 and 0.2"
    assert (
        report.findings.sentences[0]
        == f"hysteresis at 2 of 4 points: along friction.coefficient the vibration {loop}"
    )


@pytest.mark.parametrize(
    ("up", "down", "words"),
    [
        ("ddqq", "dqqq", "ends on the way up between 2 and 3, and begins on the way down between 4 and 3"),
        ("qddd", "qqdd", "begins on the way up between 3 and 4, and ends on the way down between 3 and 2"),
        ("dqdd", "dqqd", "friction.coefficient = 2"),
        ("ddqq", "dqrq", "friction.coefficient = 3; friction.coefficient = 2"),
        ("uddq", "ddqq", "ends on the way up between 1 and 2, and begins on the way down between 3 and 2"),
        ("quddd", "qqqud", "begins on the way up between 2 and 4, and ends on the way down between 2 and 0"),
        ("udddd", "uqqdd", "has not begun on the way up at 3, and what follows is not known, and ends on the"),
        ("qdddd", "qqquu", "up between 3 and 4, and lasts on the way down at 2, and what follows is not known"),
        ("qdddd", "uqqqd", "and ends on the way down between 1 and 0"),
        ("qqqqu", "dqddd", "friction.coefficient = 4"),
    ],
)
def test_both_ends_of_a_loop_are_named_where_there_is_one_of_each(up: str, down: str, words: str) -> None:
    """Letters stand for the regimes at 4, 3, 2, 1, 0, as in the file; both ways have the same amplitude."""
    values = [4, 3, 2, 1, 0][: len(up)]
    sweep = f"""case = "-"
axis = [{{ parameter = "friction.coefficient", values = {values}, direction = "both" }}]"""
    regimes = {each[:1]: each.encode() for each in ("damped", "quasi-harmonic", "relaxation", "undecided")}
    columns = {
        "regime": np.array([[regimes[each] for each in way] for way in (up, down)]),
        "status": np.full((2, len(up)), Status.DONE.encode()),
        "amplitude": np.ones((2, len(up))),
        "settled": np.ones((2, len(up))),
    }
    journal: Any = SimpleNamespace(plan=Plan(sweep, GROWING), column=columns.__getitem__)
    assert words in _hysteresis(journal)[1][0]


def test_vibration_beside_stable_sliding_is_told_apart_from_hysteresis() -> None:
    """Hysteresis is what the two ways of a followed axis differ in; a search knows one start alone."""
    columns = {"critical_sustained": [0.4, 1.0], "critical_lower": [1.0, 1.0], "critical_upper": [1.1, 1.1]}
    journal: Any = SimpleNamespace(column=lambda name: np.array(columns[name]))
    (said,) = _on_lasting_vibration(journal, 0.05)
    assert said.startswith("vibration beside stable sliding at 1 of 2 points: from the case's own start")
    assert "up to 0.6 below" in said


def test_no_hysteresis_is_said_of_points_alone_that_are_decided(tmp_path: Path) -> None:
    """Growth is undecided after so short a run; decay, below the critical friction 0.575, is not."""
    axis = '[[axis]]\nparameter = "friction.coefficient"\nvalues = {}\ndirection = "both"\n'
    sentences = []
    for number, values in enumerate(("[0.2, 0.3]", "[0.2, 0.58]", "[0.58, 0.6]")):
        (folder := tmp_path / str(number)).mkdir()
        found = run(folder, 'case = "tiny.toml"\n' + axis.format(values), GROWING).findings
        sentences.append("; ".join(found.sentences))
    decided, some, none = sentences
    assert decided == "no hysteresis: damped on the way up and on the way down"
    assert "no hysteresis at the 1 point that is decided: damped" in some
    assert "hysteresis is not known at 1 point, which failed, is undecided" in some
    assert "no hysteresis" not in none
    assert "hysteresis is not known at 2 points, which failed, are undecided" in none


def test_the_summary_and_the_json_carry_the_names_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(CASE)
    (tmp_path / "s.toml").write_text(GRID)
    done = brakecli("sweep", "s.toml", "--json", "--set", "solver.duration=0.1", cwd=tmp_path)
    assert done.code == 0
    assert "6 points: " in done.err
    found = opened(tmp_path / "s.h5")
    assert done.json["dimensions"] == list(found.regime.dims)
    assert done.json["axes"]["friction_coefficient"]["values"] == found.friction_coefficient.values.tolist()
    for name in found.data_vars:
        values = np.array(done.json[str(name)], dtype=object)
        assert values.shape == found[name].shape, name
    assert done.json["regime"] == found.regime.values.tolist()
    again = brakecli("sweep", "s.toml", cwd=tmp_path)
    again.told(2, "s.h5: exists already")
    command = ["sweep", "s.toml", "--force", "--set", "solver.duration=0.1"]
    table = brakecli(*command, cwd=tmp_path)
    for words in ("Speed and friction", "wheel.angular_speed", "friction.coefficient", "It vibrates at", "s.h5"):
        assert words in table.out
    quiet = brakecli(*command, "--quiet", cwd=tmp_path)
    assert (quiet.code, quiet.out, quiet.err) == (0, "", "")


def test_a_sweep_comes_from_standard_input_as_well(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(CASE)
    done = brakecli("sweep", "-", "--json", "--set", "solver.duration=0.05", cwd=tmp_path, stdin=GRID)
    assert done.json["output"] == "sweep.h5"
    assert left_in(tmp_path) == {"tiny.toml", "sweep.h5"}


def test_check_names_points_that_will_fail_and_a_sweep_of_them_says_that_all_have_failed(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(CASE)
    (tmp_path / "s.toml").write_text(
        'case = "tiny.toml"\n[[axis]]\nparameter = "solver.step"\nvalues = [1e-5, 2e-5]\n'
    )
    settings = (
        'solver.scheme="three-layer"',
        "solver.theta=[0.0, 0.1, 0.9]",
        "link1.damping=0",
        "link2.damping=0",
    )
    unstable = [word for each in settings for word in ("--set", each)]
    refused = "will fail: solver.theta: at this step the scheme is unstable"
    check = brakecli("check", "s.toml", *unstable, "--json", cwd=tmp_path)
    check.told(0, *(f"point {n} (solver.step = {step}) {refused}" for n, step in enumerate(("1e-05", "2e-05"))))
    assert [refused in each for each in check.json["refused"]] == [True, True]
    assert brakecli("check", "s.toml", "--json", cwd=tmp_path).json["refused"] == []
    done = brakecli("sweep", "s.toml", *unstable, cwd=tmp_path)
    assert "written" not in done.told(
        1, "point 1 (solver.step = 2e-05): solver.theta", "s.h5: all 2 points failed; correct"
    )


def test_check_reports_what_a_sweep_would_take(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(CASE)
    (tmp_path / "s.toml").write_text(GRID)
    found = brakecli("check", "s.toml", "--json", cwd=tmp_path)
    assert found.json["points"] == 6
    assert found.json["memory"] > 1e8
    assert "seconds" not in found.json
    shown = brakecli("check", "s.toml", cwd=tmp_path).out
    assert "points" in shown
    assert brakecli("info", "s.toml", cwd=tmp_path).out == shown
    (tmp_path / "s.toml").write_text(GRID.replace("coefficient", "coeficient"))
    brakecli("check", "s.toml", cwd=tmp_path).told(2, "s.toml:7: friction.coeficient: is unknown")
    (tmp_path / "s.toml").write_text(GRID.replace("num = 3", "num = 1000000000"))
    brakecli("check", "s.toml", cwd=tmp_path).told(3, "the sweep is too large: 2000000000 points")


def test_a_sweep_given_to_run_and_a_case_given_to_sweep_are_distinguished(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(CASE)
    (tmp_path / "s.toml").write_text(GRID)
    brakecli("run", "s.toml", cwd=tmp_path).told(2, "brakecli sweep s.toml")
    brakecli("sweep", "tiny.toml", cwd=tmp_path).told(2, "brakecli run tiny.toml")


def test_tasks_are_as_long_as_their_work_is_short() -> None:
    queue = TaskQueue(np.zeros(1000, dtype=bool), None)
    first = queue.next_task()
    assert first == Task(0, 1)
    queue.note_time(first, 0.004)
    assert queue.next_task() == Task(1, 50)  # 0.2 s of 4 ms each
    queue.note_time(Task(1, 50), 49.0)
    assert queue.next_task() == Task(51, 1)
    together = TaskQueue(np.zeros(40, dtype=bool), None, least=32)  # as long for fewer
    assert [together.next_task() for _ in range(3)] == [Task(0, 32), Task(32, 8), None]


def test_tasks_of_long_sweeps_last_a_second_and_get_shorter_towards_the_end() -> None:
    queue = TaskQueue(np.zeros(10**5, dtype=bool), None, workers=4)
    sizes = list[int]()
    queue.note_time(Task(0, 1000), 4.0)
    while (task := queue.next_task()) is not None:
        sizes.append(task.size)
        left = 10**5 - sum(sizes)
        assert task.size in (250, 50) or task.size <= 0.01 / 4 * (left + task.size) or not left
    assert sum(sizes) == 10**5
    assert sizes == sorted(sizes, reverse=True)
    assert (sizes[0], sizes[-2]) == (250, 50)  # 1 s and 0.2 s of 4 ms each


def test_a_thousand_workers_ask_for_no_more_tasks_than_a_scheduler_hands_out() -> None:
    queue = TaskQueue(np.zeros(10**6, dtype=bool), None, workers=1000)
    queue.note_time(Task(0, 1000), 2.0)
    assert queue.next_task() == Task(0, 5000)  # 10 s of 2 ms each: a hundred tasks a second


def test_only_what_is_missing_is_queued_and_lost_units_come_again_one_by_one() -> None:
    finished = np.zeros(10, dtype=bool)
    finished[[0, 4, 5]] = True
    queue = TaskQueue(finished, 2)
    assert [queue.next_task() for _ in range(5)] == [Task(1, 2), Task(3, 1), Task(6, 2), Task(8, 2), None]
    assert queue.retry(Task(6, 2))
    assert [queue.next_task() for _ in range(3)] == [Task(6, 1, True), Task(7, 1, True), None]
    assert not queue.retry(Task(6, 1, True))


def test_a_record_holds_text_whole_or_cut_between_characters() -> None:
    kind = record_type(plan_of('case = "x"\n[[axis]]\nparameter = "shoe.mass"\nvalues = [1.0]\n', ""))
    record = blank(kind, Status.FAILED, "ß" * 200)
    assert record["reason"][0].decode() == "ß" * 120
    assert record["status"][0] == b"failed"
