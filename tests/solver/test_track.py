"""What the loops note of a motion: works over parts, and events, against closed forms and between schemes."""

import math
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
import pytest

from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.quantities import ContactState
from brakecli.solver.records import MOST_EVENTS
from brakecli.solver.track import KINDS, LIFT, MAX, MIN, SLIP, STICK, TOUCH, TURN, Track
from tests.analysis.histories import events_from_samples
from tests.analysis.shoes import Tables, random_shoes
from tests.examples import COULOMB, MODE_COUPLING, ROUGH, SQUEAL, make

pytestmark = pytest.mark.usefixtures("compiled")
Array = Any
LAYERS = ["two-layer", "three-layer"]
SCHEMES = [*LAYERS, "event-driven", "piecewise-exact"]
STEPS = [0.05, 0.025, 0.0125, 0.00625]
FREE = {**COULOMB, "friction": {"coefficient": 0.0}, "wheel": {"radius": 1.0, "angular_speed": 100.0}}
WAVES = {"amplitudes": [2.5e-6] * 12, "wavelengths": [0.001 * n for n in range(4, 16)]}
BOUNCING = {  # rough, clear of the wheel again and again
    **ROUGH,
    "roughness": {**ROUGH["roughness"], "wheel": WAVES},
    "wheel": {"radius": 0.5, "times": [0.0, 0.01], "angular_speeds": [4.0, 0.4]},
    "initial": {"at": "equilibrium", "vx": 0.2, "vy": 0.3},
}


def by_scheme(tables: Tables, scheme: str, step: float, **changes: Any) -> Case:
    """A case with a scheme, and with a step or a tolerance."""
    own = {"step": step} if scheme in LAYERS else {"tolerance": 1e-10} if scheme == "event-driven" else {}
    solver = {"scheme": scheme, "duration": tables["solver"]["duration"], **own}
    output = {"output": {"sample_interval": 0.1}} if "output" not in tables else {}
    return make({**tables, **output, "solver": solver}, **changes)


def tracked(case: Case) -> Motion:
    return solve(replace(system_of(case), tracked=True))


def track_of(case: Case) -> Track:
    track = tracked(case).track
    assert track is not None
    return track


def of_kind(track: Track, *kinds: int) -> tuple[Array, Array]:
    """Times and places of events of some kinds."""
    chosen = np.isin(track.kept.kind, kinds)
    return track.kept.time[chosen], track.kept.x[chosen]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_bouncing_shoe_lifts_and_touches_when_the_closed_form_says_so(scheme: str) -> None:
    """ÿ + 11 y = -11 in contact and ÿ + y = -11 in flight, from the lowest point y = -3 on, without losses."""
    fast = math.sqrt(11.0)
    first = 2.0 * math.pi / 3.0 / fast
    speed = fast * math.sqrt(3.0)
    flight = 2.0 * math.atan(speed / 11.0)
    lifts = first + (2.0 * first + flight) * np.arange(8)
    errors = []
    for step in STEPS if scheme in LAYERS else STEPS[:1]:
        case = by_scheme(
            FREE, scheme, step, initial__x=0.0, initial__vx=0.0, initial__y=-2.0, solver__duration=20.0
        )
        track = track_of(case)
        assert track.kept.kind.tolist()[:16] == [LIFT, TOUCH] * 8
        errors.append(float(np.abs(track.kept.time[:16] - np.sort([*lifts, *(lifts + flight)])).max()))
    y, _, v_y = track.kept.others[:16].T
    if scheme not in LAYERS:
        np.testing.assert_allclose(y, 0.0, atol=1e-6)
        np.testing.assert_allclose(v_y, [speed, -speed] * 8, atol=1e-6)
    if scheme in LAYERS:  # in the middle of a step; the scheme turns too little, by (ωh)²/12 of ω² = 11 in 20 s
        assert all(error < 0.5 * step + 18.0 * step**2 for error, step in zip(errors, STEPS, strict=True))
    else:
        assert errors[0] < 1e-7


@pytest.mark.parametrize("scheme", LAYERS)
@pytest.mark.parametrize("number", [7, 8])
def test_events_of_a_limit_cycle_that_sticks_agree_with_exact_ones(scheme: str, number: int) -> None:
    """That of shoe 8 also leaves the wheel. Within difference schemes, events agree with samples, too.

    A phase begins in the middle of a step: at most half a step earlier or later. The schemes are off by less than
    half a step of the longer ones, and by a quarter of that with half of it.
    """
    tables: Tables = next(islice(random_shoes("smooth", 5), number, None))
    exact = track_of(by_scheme(tables, "piecewise-exact", 0.0))
    assert exact.counts[STICK] > 200
    for parts in (8, 16):
        motion = tracked(by_scheme(tables, scheme, tables["solver"]["step"] / parts))
        track = motion.track
        step = motion.system.step
        assert track is not None
        assert track.counts[:TURN].tolist() == exact.counts[:TURN].tolist()
        for kind in range(TURN):
            if exact.counts[kind]:
                gaps = of_kind(track, kind)[0] - of_kind(exact, kind)[0]
                assert np.abs(gaps[:12]).max() < (0.5 + 4.0 / parts) * step
        time = motion.system.interval * np.arange(len(motion.rows))
        begun, ended = (np.searchsorted(of_kind(track, kind)[0], time, "right") for kind in (STICK, SLIP))
        other = (begun > ended) != (motion.rows[:, 7] == ContactState.STICK)
        changes = np.concatenate([of_kind(track, kind)[0] for kind in (STICK, SLIP)])
        for t in time[other]:
            assert np.abs(changes - t).min() < 1.5 * step


def test_event_driven_events_are_those_of_exact_steps() -> None:
    """Of a shoe that slips, sticks and leaves the wheel."""
    tables: Tables = next(islice(random_shoes("smooth", 5), 8, None))
    exact, other = (track_of(by_scheme(tables, scheme, 0.0)) for scheme in ("piecewise-exact", "event-driven"))
    assert other.counts.tolist() == exact.counts.tolist()
    for kind in range(len(KINDS)):
        gaps = np.abs(of_kind(other, kind)[0] - of_kind(exact, kind)[0])
        assert 0.0 < gaps.max() < 1e-5 * tables["output"]["sample_interval"]


@pytest.mark.parametrize(("number", "unloaded"), [(2, True), (12, False)])
def test_a_rough_pad_has_events_of_contact_where_it_touches_and_not_where_it_may(
    number: int, unloaded: bool
) -> None:
    """Between flight, in which it is clear for sure, and contact lies a height at which it need not touch.

    Samples are close enough to show every change of contact.
    """
    tables: Tables = next(islice(random_shoes("open", 991), number, None))
    interval = tables["output"]["sample_interval"]
    force = tables["load"]["force"]
    if unloaded:
        times = [0.0, 50.0 * interval, 60.0 * interval]
        tables = {**tables, "load": {"times": times, "forces": [force, force, 0.3 * force]}}
    solver = {"duration": 200.0 * interval, "scheme": "event-driven", "tolerance": 1e-6}
    case = make({**tables, "solver": solver, "output": {"sample_interval": interval / 100.0}})
    motion = solve(replace(system_of(case), tracked=True))
    assert motion.track is not None
    changes = np.diff((motion.rows[:, 6] > 0.0).astype(int))
    assert (changes < 0).sum() > 0
    assert motion.track.counts[[LIFT, TOUCH]].tolist() == [(changes < 0).sum(), (changes > 0).sum()]


def open_parts(track: Track, parts: int) -> float:
    """The largest closing error of a part, over the largest item of its account."""
    errors = list[float]()
    begin = track.times[:-1]
    for first in range(0, len(begin) - len(begin) // parts, len(begin) // parts):
        last = first + len(begin) // parts
        powers = track.powers(track.times[first], track.times[last])
        span = track.times[last] - track.times[first]
        items = [
            *powers[:-1],
            *(track.works[last] - track.works[first])[:2] / span,
            track.stored[last].sum() / span,
        ]
        errors.append(abs(powers.closing) / max(map(abs, items)))
    assert len(errors) >= parts - 1
    return max(errors)


@pytest.mark.parametrize(
    ("scheme", "error"),
    [("two-layer", 1e-12), ("three-layer", 1e-10), ("event-driven", 1e-9), ("piecewise-exact", 1e-12)],
)
def test_the_account_of_every_part_closes_on_smooth_pads_that_stick(scheme: str, error: float) -> None:
    motion = tracked(by_scheme(SQUEAL, scheme, 1e-5, solver__duration=0.2))
    track = motion.track
    assert track is not None
    assert track.counts[STICK] > 10
    for parts in (2, 10, 50):
        assert open_parts(track, parts) < error


@pytest.mark.parametrize(
    ("scheme", "name"),
    [*zip(SCHEMES, ["window", "exact", "nodes", "smooth"], strict=True), ("event-driven", "window")],
)
def test_histories_are_the_same_bits_with_it_and_without(scheme: str, name: str) -> None:
    tables: Tables = {"smooth": SQUEAL, "exact": ROUGH, "nodes": ROUGH, "window": BOUNCING}[name]
    exact = {"contact__evaluator": "exact", "contact__nodes": None} if name == "exact" else {}
    system = system_of(by_scheme(tables, scheme, 1e-5, solver__duration=0.02, **exact))
    plain = solve(system)
    noted = solve(replace(system, tracked=True))
    assert plain.track is None
    assert noted.track is not None
    assert (plain.rows == noted.rows).all()
    assert plain.work.contact_evaluations == noted.work.contact_evaluations


def test_a_ring_that_overflows_says_since_when_it_is_complete() -> None:
    """A shoe that oscillates without friction, two turning points in each period."""
    case = by_scheme(FREE, "piecewise-exact", 0.0, solver__duration=1.1e5, output__sample_interval=1.0)
    track = track_of(case)
    expected = np.arctan2(6.0, 12.0) + math.pi * np.arange(track.counts.sum())
    lost = len(expected) - MOST_EVENTS
    assert 1000 < lost < MOST_EVENTS
    assert len(track.kept.time) == MOST_EVENTS
    np.testing.assert_allclose(track.kept.time, expected[lost:], atol=1e-4)
    assert track.since == pytest.approx(expected[lost - 1], abs=1e-4)
    time, kind, x, _ = track.events(1e5)
    assert time[0] == pytest.approx(expected[expected >= 1e5][0], abs=1e-4)
    assert (np.abs(x) - math.hypot(12.0, 6.0) < 1e-6).all()
    assert set(kind[::2]) | set(kind[1::2]) == {MAX, MIN}
    assert track_of(by_scheme(FREE, "piecewise-exact", 0.0)).since == -math.inf


def test_samples_tell_of_the_same_events_as_the_loop() -> None:
    tables: Tables = next(islice(random_shoes("smooth", 5), 7, None))
    motion = tracked(by_scheme(tables, "piecewise-exact", 0.0))
    track = motion.track
    interval = motion.system.interval
    rows = motion.rows
    assert track is not None
    times: Array = interval * np.arange(len(rows))
    found = events_from_samples(times, rows[:, 0], rows[:, 2], rows[:, 7])
    assert found.time.tolist() == sorted(found.time)
    for kind in (MAX, MIN, STICK, SLIP):
        time, x = of_kind(track, kind)
        chosen = found.kind == kind
        assert len(time) == chosen.sum() > 300
        gaps = np.abs(found.time[chosen] - time) / interval
        assert gaps.max() < (0.5 + 1e-6 if kind in (STICK, SLIP) else 1.0)  # a kink may be near an extreme
        assert np.median(gaps) < (0.5 if kind in (STICK, SLIP) else 0.02)
        assert np.abs(found.x[chosen] - x).max() < 3e-3 * np.abs(x).max()


def test_a_run_that_fails_at_once_has_no_powers() -> None:
    case = by_scheme(MODE_COUPLING, "two-layer", 0.5, solver__duration=1e4, output__sample_interval=1e3)
    motion = tracked(case)
    assert motion.track is not None
    track = replace(motion.track, times=motion.track.times[:1])
    assert math.isnan(track.powers(0.0, 1.0).friction)
