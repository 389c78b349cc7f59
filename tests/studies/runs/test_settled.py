"""A run that is long enough by itself ends where its verdict is decided; a case with that duration repeats it."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.branches.thresholds import thresholds
from brakecli.analysis.regime.decision import Decision, Excitation, Regime
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.stability.report import stability
from brakecli.case.case import Case, resolved_toml
from brakecli.case.parts import MOST_BUDGET
from brakecli.case.read import parse_case, starters
from brakecli.case.system import system_of
from brakecli.results.read import open_result
from brakecli.solver.integrate import Motion
from brakecli.solver.quantities import Failure
from brakecli.solver.system import System
from brakecli.studies.runs.judge import motion_of, to_judge, verdict_in_memory
from brakecli.studies.runs.limits import check
from brakecli.studies.runs.settled import MOST_SAMPLES, Judged, Settled, longest, settle
from brakecli.studies.sweeps.plan import parse_sweep
from brakecli.studies.sweeps.workers.task import compute_units
from tests.analysis.test_verdicts import RINGS
from tests.campaign import campaign
from tests.commands import TINY, brakecli
from tests.examples import ROUGH, SQUEAL, make
from tests.studies.sweeps.helpers import axis, inline, write_sweep
from tests.studies.sweeps.made_up import CYCLE, SPEEDS, made_of
from tests.studies.sweeps.made_up import DAMPED as DIES

pytestmark = pytest.mark.usefixtures("compiled")

EXACT: dict[str, Any] = {**SQUEAL, "solver": {"tolerance": 1e-4, "duration": "settled"}}
STEPS: dict[str, Any] = {**SQUEAL, "solver": {"step": 1e-4, "duration": "settled"}}
OPEN = TINY.replace("duration = 0.02", 'duration = "settled"')


def judge(part: System) -> Judged[Motion]:
    motion, certificate = motion_of(part)
    return Judged(verdict_in_memory(motion, part), motion, certificate)


def settle_case(case: Case) -> Settled[Motion]:
    return settle(to_judge(system_of(case)), judge)


def made_up(*durations: float, failure: Failure = Failure.NONE) -> list[float]:
    """The durations (s) of the runs of a case that takes two seconds at first, until one is of these durations."""
    system = replace(to_judge(system_of(make(EXACT))), duration=2.0)
    tried = list[float]()
    judged = judge(replace(system, duration=0.05))

    def run(part: System) -> Judged[Motion]:
        tried.append(part.duration)
        open_ = Decision("", longer=part.duration not in durations)
        done = Decision("", Regime.DAMPED)
        verdict = replace(judged.verdict, decision=done if part.duration in durations else open_)
        motion = replace(judged.motion, work=replace(judged.motion.work, failure=failure))
        return judged._replace(verdict=replace(verdict, remaining=0.0), motion=motion)

    settle(system, run)
    return tried


@pytest.mark.parametrize("base", [EXACT, STEPS])
def test_a_damped_run_lasts_until_the_vibration_has_faded_and_no_twice_as_long(base: dict[str, Any]) -> None:
    """The mean level of the last quarter, of one that falls as exp(-r t), lies between its ends.

    It is down to a hundredth in a run of T where r T > ln 100, and not yet in half of it where 3/4 r T/2 < ln 100.
    A tenth is for the start, which is not linear yet.
    """
    case = make(base, friction__coefficient=0.56)
    found = settle_case(case)
    rate = -stability(found.system).modes[0].growth
    assert found.judged.verdict.regime is Regime.DAMPED
    assert found.warnings == ()
    assert math.log(100.0) < rate * found.system.duration < 1.1 * 2.0 * math.log(100.0) / 0.75
    assert found.system.duration / system_of(case).duration == pytest.approx(2.0, rel=1e-3)


def test_a_vibration_that_lasts_is_run_until_its_numbers_are_those_of_any_longer_run() -> None:
    found = settle_case(make(EXACT))
    verdict = found.judged.verdict
    long = judge(replace(found.system, duration=8.0 * found.system.duration)).verdict
    assert (verdict.regime, verdict.settled) == (Regime.RELAXATION, True)
    assert verdict.amplitude == pytest.approx(long.amplitude, rel=1e-4)


def test_a_run_goes_on_while_the_friction_force_rings_beside_a_settled_x() -> None:
    """Its torque's variation is not known before; half of the run does not know it."""
    found = settle_case(make({**RINGS, "solver": {"step": 1e-4, "duration": "settled"}}))
    assert found.warnings == ()
    assert found.judged.verdict.torque_variation is not None
    half = judge(replace(found.system, duration=0.5 * found.system.duration)).verdict
    assert half.settled
    assert half.unfinished
    assert half.torque_variation is None


def test_a_run_that_fails_is_not_made_longer() -> None:
    assert made_up(8.0, failure=Failure.DIVERGED) == [2.0]


def test_a_run_that_cannot_keep_its_tolerance_is_not_made_longer() -> None:
    """On rough pads, where ever finer runs have been tried; one exact run more or less does not matter."""
    system = to_judge(system_of(make(ROUGH, solver__step=None, contact__nodes=None, solver__duration="settled")))
    found = judge(replace(system, duration=0.02))
    assert found.certificate is not None
    broken = found._replace(
        verdict=replace(found.verdict, decision=Decision("", longer=True)),
        certificate=replace(found.certificate, certified=False),
    )
    ended = settle(system, lambda part: broken)
    assert ended.system.duration == pytest.approx(system.duration, rel=1e-3)
    assert "a longer run would not keep the tolerance" in ended.warnings[0]


def test_the_longest_run_is_the_limit_and_is_told() -> None:
    """Without dashpots no amplitude is that of any longer run. The verdict stays what it is."""
    system = to_judge(system_of(make(EXACT, link1__damping=0.0, link2__damping=0.0, output__sample_interval=5e-4)))
    judged = judge(replace(system, duration=0.2))
    lasting = Decision("", Regime.QUASI_HARMONIC, Excitation.SELF_EXCITED)
    open_ = judged._replace(verdict=replace(judged.verdict, decision=lasting, settled=False, longer=True))
    found = settle(system, lambda part: open_)
    assert found.judged.verdict.regime is Regime.QUASI_HARMONIC
    assert found.system.duration == pytest.approx(longest(system))
    assert MOST_SAMPLES / 2 < found.system.samples <= MOST_SAMPLES
    assert "solver.duration: not settled after" in found.warnings[0]


def test_a_budget_of_steps_ends_what_is_not_decided_and_counts_all_runs() -> None:
    """A thousand steps for a second: runs of 2, 4 and 8 s take 14,000 in all, and with one of 16 s 30,000."""
    system = replace(to_judge(system_of(make(EXACT))), duration=2.0)
    tried = list[float]()
    judged = judge(replace(system, duration=0.05))
    open_ = replace(judged.verdict, decision=UNDECIDED)

    def run(part: System) -> Judged[Motion]:
        tried.append(part.duration)
        steps = int(800 * part.duration)
        work = replace(judged.motion.work, steps=steps, coarser_steps=steps // 4)
        return judged._replace(verdict=open_, motion=replace(judged.motion, work=work))

    (warning,) = settle(replace(system, budget=29_999), run).warnings
    assert tried == [2.0, 4.0, 8.0]
    assert warning.startswith("solver.duration: not settled after 8 s, and 14,000 steps in all; ")
    assert warning.endswith("solver.budget is 29,999 steps; solver.budget = 30000 lets it be twice as long")
    tried.clear()
    settle(replace(system, budget=30_000), run)
    assert tried == [2.0, 4.0, 8.0, 16.0]


DAMPED = Decision("decays", Regime.DAMPED)
BLANK = Verdict(DAMPED, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False, {})
UNDECIDED = Decision("grows", longer=True)
LASTS = Decision("lasts", Regime.RELAXATION, Excitation.SELF_EXCITED)


@pytest.mark.parametrize(
    ("decision", "changes", "unfinished"),
    [
        (UNDECIDED, {}, True),
        (Decision("neutral"), {}, False),
        (DAMPED, {"remaining": 0.5}, True),
        (DAMPED, {"remaining": 1e-3}, False),
        (DAMPED, {"remaining": 0.5, "settled": True}, False),
        (LASTS, {"settled": True}, False),
        (LASTS, {}, False),
        (LASTS, {"longer": True}, True),
        (LASTS, {"settled": True, "longer": True}, True),
    ],
)
def test_a_verdict_says_whether_a_longer_run_may_say_more(
    decision: Decision, changes: dict[str, Any], unfinished: bool
) -> None:
    settled_ = changes.get("settled", False)
    others = {key: changes[key] for key in changes if key != "settled"}
    assert replace(BLANK, decision=decision, settled=settled_, **others).unfinished is unfinished


def test_points_of_a_sweep_settle_each_in_its_own_time(tmp_path: Path) -> None:
    """The same as alone: one decays slowly, the other at once."""
    values = "values = [0.3, 0.565]"
    report = inline(
        write_sweep(tmp_path, axis("friction.coefficient", values), case=OPEN), tmp_path / "s.h5", compute_units
    )
    with open_result(tmp_path / "s.h5", kind="sweep") as stored:
        durations = stored.read("/", "duration")
        regimes = stored.read("/", "regime")
    assert report.findings.warnings == []
    ran = " to ".join(f"{each:.4g}" for each in durations)
    assert report.findings.sentences == [f"all 2 points are decided, in {ran} s of motion"]
    alone = [
        settle_case(parse_case(OPEN, "", [f"friction.coefficient={phi}"]).case).system for phi in (0.3, 0.565)
    ]
    assert durations.tolist() == pytest.approx([each.duration for each in alone])
    assert durations[1] >= 4.0 * durations[0]
    assert {*regimes.tolist()} == {"damped"}


def test_a_sweep_counts_the_points_that_have_not_settled(tmp_path: Path) -> None:
    """Undecided ones, and those whose numbers are not those that last; one that fails is counted elsewhere."""
    made = [{**CYCLE, "duration": 2.0}, {**DIES, "duration": 4.0}, {**CYCLE, "settled": 0, "duration": 16.0}]
    made += [{"regime": "undecided", "duration": 32.0}, {"status": "failed"}]
    loaded = write_sweep(tmp_path, SPEEDS.format(5), case=OPEN)
    said = inline(loaded, tmp_path / "s.h5", made_of(made)).findings.sentences
    ran = "2 of 5 points are decided, in 2 to 4 s of motion; "
    ran += "others ran for 16 to 32 s of it, and their reasons say more"
    assert ran in said
    numbers = write_sweep(tmp_path, axis("solver.duration", "values = [0.1, 0.2]"), case=OPEN)
    said = inline(numbers, tmp_path / "n.h5", made_of(made)).findings.sentences
    assert not any("settled" in each for each in said)


def test_check_tells_how_long_a_run_may_become_and_a_number_is_not_touched() -> None:
    system = system_of(make(EXACT))
    found = check(system)
    assert f"up to {longest(system):.6g} s, or 100,000,000 steps in all" in found.adjustments[0]
    assert settle(replace(system, budget=0), judge).system.duration == system.duration


def test_a_tolerance_is_kept_by_a_run_that_settles() -> None:
    text = starters()["rough"]
    found = settle_case(parse_case(text, "rough").case)
    assert found.judged.certificate is not None
    assert found.judged.certificate.certified
    assert found.judged.certificate.certified_until == pytest.approx(found.system.duration)
    assert found.judged.verdict.excitation is Excitation.FORCED


def test_what_changes_with_time_cannot_settle(tmp_path: Path) -> None:
    (tmp_path / "open.toml").write_text(OPEN)
    ramp = "load={times=[0.0, 1.0], forces=[0.0, 5000.0]}"
    told = brakecli("run", "open.toml", "--set", ramp, cwd=tmp_path).told(2, "solver.duration: is never reached")
    assert "as load.forces change with time" in told
    assert "give a number above 0, in s" in told
    (wrong,) = brakecli("run", "open.toml", "--set", 'solver.duration="long"', cwd=tmp_path).told(2).splitlines()
    assert wrong.endswith('is not a number (found "long"); give a number above 0, in s, or "settled"')
    assert 'or "settled"' in brakecli("check", "open.toml", "--set", "solver.duration=0", cwd=tmp_path).told(2)
    constant = "load={times=[0.0, 1.0], forces=[5000.0, 5000.0]}"
    brakecli("run", "open.toml", "--set", constant, cwd=tmp_path).told(0)


@campaign
def test_the_starter_of_hysteresis_finds_the_loop_of_the_branch(tmp_path: Path) -> None:
    """Vibration lasts on the way down where the limit cycle exists, on the way up where sliding is unstable."""
    (tmp_path / "branch.toml").write_text(starters()["branch"])
    loaded = parse_sweep(starters()["hysteresis"], "hysteresis.toml", tmp_path, [])
    report = inline(loaded, tmp_path / "h.h5", compute_units)
    case = loaded.base.case
    system = system_of(case)
    alone = stability(system)
    found = thresholds(case, system, alone)
    assert alone.critical is not None
    assert found.coexists_from is not None
    values = [loaded.sweep.axis[0].value(place) for place in range(6)]
    loop = [int(found.coexists_from < value < alone.critical.friction) for value in values]
    assert 1 < sum(loop) < 5
    assert report.findings.hysteresis is not None
    assert report.findings.hysteresis.tolist() == loop
    first = loop.index(1)
    last = loop.index(0, loop.index(1)) - 1
    up = f"begins on the way up between {values[last]:g} and {values[last + 1]:g}"
    down = f"ends on the way down between {values[first]:g} and {values[first - 1]:g}"
    where = f"along friction.coefficient the vibration {up}, and {down}"
    ran = (report.findings.variables or {})["duration"]
    ends = f"{np.min(ran):.4g} to {np.max(ran):.4g} s"
    settled_ = f"all 12 points are decided, in {ends} of motion"
    assert report.findings.sentences == [f"hysteresis at {sum(loop)} of 6 points: {where}", settled_]


def test_amplitudes_that_are_still_on_their_way_are_no_hysteresis(tmp_path: Path) -> None:
    """At 0.6 a vibration grows slowly: on the way up it has not come to what it is on the way down."""
    both = axis("friction.coefficient", "values = [0.52, 0.54, 0.56, 0.58, 0.6, 0.64]", 'direction = "both"')
    case = TINY.replace("step = 1e-5, duration = 0.02", "duration = 1.0")
    report = inline(write_sweep(tmp_path, both, case=case), tmp_path / "s.h5", compute_units)
    assert report.findings.variables is not None
    up, down = report.findings.variables["amplitude"]
    assert up[4] < 0.95 * down[4]
    assert report.findings.hysteresis is not None
    assert report.findings.hysteresis.tolist() == [0] * 6
    assert any("still on their way" in text for text in report.findings.sentences)


def test_the_pad_of_the_starter_squeals_at_2_khz_as_its_modes_couple() -> None:
    case = parse_case(starters()["pad"], "pad").case
    found = settle_case(case)
    report = stability(system_of(case))
    assert report.critical is not None
    assert report.critical.friction == pytest.approx(0.324, abs=5e-4)
    assert found.judged.verdict.regime is Regime.QUASI_HARMONIC
    assert found.judged.verdict.frequency == pytest.approx(1950.0, abs=5.0)
    assert found.warnings == ()
    assert parse_case(resolved_toml(case), "again").case.output.sample_interval == case.output.sample_interval


def test_what_does_not_settle_says_which_limit_it_has_met_and_what_would_help() -> None:
    system = to_judge(system_of(make(EXACT)))
    judged = judge(replace(system, duration=0.05))
    open_ = judged._replace(verdict=replace(judged.verdict, decision=UNDECIDED))
    (warning,) = settle(replace(system, budget=MOST_BUDGET), lambda part: open_).warnings
    assert f"no more than {MOST_SAMPLES:,} samples are tried; " in warning
    assert warning.endswith("an output.sample_interval above 0.0001 s lets it be longer")
