"""What the loops note of a motion: works over parts, and events, against closed forms and between schemes."""

import math
from dataclasses import replace
from itertools import islice, product
from typing import Any

import numpy as np
import pytest

from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.quantities import ContactState
from brakecli.solver.records import MOST_EVENTS, PARTS, Works
from brakecli.solver.track import KINDS, LIFT, MAX, MIN, SLIP, STICK, TOUCH, TURN, Track
from tests.analysis.histories import events_from_samples
from tests.analysis.shoes import Tables, random_shoes
from tests.campaign import campaign
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


def falls_with_the_square(errors: list[float], within: float = 0.15) -> bool:
    """Whether errors fall with h² as steps are halved."""
    halvings = np.arange(len(errors))
    return bool(abs(np.polyfit(halvings, np.log2(errors), 1)[0] + 2.0) < within)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_turning_points_of_a_damped_oscillation_lie_where_the_closed_form_has_them(scheme: str) -> None:
    """ẍ + 0.2 ẋ + x = 0 from x = 12, ẋ = 6 on: ẋ = 0 after t with tan(ωt) = 6ω/(12 + 0.6), and each π/ω."""
    omega = math.sqrt(1.0 - 0.1**2)
    times = (math.atan2(6.0 * omega, 12.0 + 0.6) + math.pi * np.arange(19)) / omega
    phases = omega * times
    places = np.exp(-0.1 * times) * (12.0 * np.cos(phases) + (6.0 + 1.2) / omega * np.sin(phases))
    errors = []
    for step in STEPS if scheme in LAYERS else STEPS[:1]:
        track = track_of(by_scheme(FREE, scheme, step, link2__damping=0.2))
        time, x = of_kind(track, MAX, MIN)
        assert track.counts.tolist() == [10, 9, 0, 0, 0, 0, 0]
        assert track.kept.kind.tolist() == [MAX, MIN] * 9 + [MAX]
        errors.append((float(np.abs(time - times).max()), float(np.abs(x - places).max())))
    if scheme in LAYERS:
        for each in zip(*errors, strict=True):
            assert falls_with_the_square(list(each))
    else:
        assert max(errors[0]) < 1e-6


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_shoe_that_turns_through_the_velocity_of_the_wheel_does_not_stick_until_it_stops(scheme: str) -> None:
    """ẍ + x = -sign ẋ: extremes come closer by 2 each time, and between -1 and 1 friction holds."""
    places = np.array([math.hypot(13.0, 6.0) - 1.0 - 2.0 * n for n in range(8)]) * (-1.0) ** np.arange(8)
    times = math.atan2(6.0, 13.0) + math.pi * np.arange(8)
    track = track_of(by_scheme(COULOMB, scheme, 0.005))
    assert track.counts.tolist() == [4, 3, 1, 0, 0, 0, 0 if scheme in LAYERS else 7]
    time, x = of_kind(track, MAX, MIN, STICK)
    assert track.kept.kind[track.kept.kind < TURN].tolist() == [MAX, MIN, MAX, MIN, MAX, MIN, MAX, STICK]
    np.testing.assert_allclose(time, times, atol=0.015 if scheme in LAYERS else 1e-7)
    np.testing.assert_allclose(x, places, atol=5e-3 if scheme in LAYERS else 1e-7)
    if scheme not in LAYERS:  # on a wheel at rest sliding turns where x does
        time, x = of_kind(track, TURN)
        np.testing.assert_allclose(time, times[:7], atol=1e-7)
        np.testing.assert_allclose(x, places[:7], atol=1e-7)
        y, v_x, v_y = track.kept.others[track.kept.kind >= STICK].T
        np.testing.assert_allclose(y, -1.0, atol=1e-7)  # 11 N press, and 11 N/m bear them
        assert np.abs([v_x, v_y]).max() < 1e-7


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


@campaign
def test_a_rough_shoe_leaves_the_wheel_in_event_driven_steps_where_short_steps_say_so() -> None:
    """A difference scheme with the same contact, within half of the long step."""
    exact = {"contact__evaluator": "exact", "contact__nodes": None, "solver__duration": 0.02}
    long, short = (
        track_of(by_scheme(BOUNCING, scheme, 2e-6, **exact)) for scheme in ("event-driven", "two-layer")
    )
    assert long.counts[LIFT] > 4
    assert long.counts.tolist() == short.counts.tolist()
    assert np.abs(of_kind(long, LIFT, TOUCH)[0] - of_kind(short, LIFT, TOUCH)[0]).max() < 1e-5
    assert np.abs(of_kind(long, MAX, MIN)[0] - of_kind(short, MAX, MIN)[0]).max() < 1e-6


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


@pytest.mark.parametrize("scheme", [*LAYERS, "event-driven"])
@pytest.mark.parametrize("nodes", [False, True])
def test_the_account_of_every_part_closes_on_rough_pads(scheme: str, nodes: bool) -> None:
    contact = {} if nodes else {"contact__evaluator": "exact", "contact__nodes": None}
    start = {"solver__duration": 0.02, "output__sample_interval": 4e-5, "wheel__angular_speed": 1.0}
    errors = [
        open_parts(track_of(by_scheme(ROUGH, scheme, step, **contact, **start)), 10)
        for step in ([4e-5, 2e-5, 1e-5, 5e-6] if scheme in LAYERS and not nodes else [5e-6])
    ]
    assert errors[-1] < 2e-5
    assert len(errors) == 1 or falls_with_the_square(errors, 0.4)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_works_are_those_of_the_run_and_friction_gives_what_samples_say(scheme: str) -> None:
    """The mean of F_x ẋ over samples, by the trapezoidal rule."""
    case = by_scheme(SQUEAL, scheme, 1e-5, solver__duration=0.1, output__sample_interval=1e-5)
    motion = tracked(case)
    track = motion.track
    end = motion.system.sampled_duration
    assert track is not None
    assert len(track.times) <= PARTS + 1
    assert track.times[0] <= 1e-5 < end <= track.times[-1] < end + 1e-5
    total = [getattr(motion.energy, name) for name in list(Works.layout.fields or ())[:6]]
    np.testing.assert_allclose(track.works[-1], total, rtol=1e-12)
    powers = track.powers(0.0, end)
    given = motion.rows[:, 4] * motion.rows[:, 2]
    assert powers.friction == pytest.approx(float((given[1:] + given[:-1]).mean()) / 2.0, rel=2e-3)
    assert track.powers(end, end).stored != 0.0  # over the last part


@pytest.mark.parametrize(
    ("scheme", "name"),
    [*product(SCHEMES[:3], ["smooth", "exact", "nodes", "window"]), ("piecewise-exact", "smooth")],
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


def test_events_by_samples_of_a_sine_and_of_flags() -> None:
    """A sine whose slope is exactly zero at a sample, at its extreme, and a parabola that misses by (ωh)³."""
    time = np.linspace(0.0, 4.0, 401)
    state = np.where(time < 1.0, -1.0, np.where(time < 2.0, 0.0, np.where(time < 3.0, 2.0, 1.0)))
    vx = np.where(np.arange(401) == 50, 0.0, np.cos(np.pi * time))
    time_, kind, x, _ = events_from_samples(time, np.sin(np.pi * time) / np.pi, vx, state)
    assert kind.tolist() == [MAX, STICK, MIN, SLIP, LIFT, MAX, TOUCH, MIN]
    np.testing.assert_allclose(time_, [0.5, 0.995, 1.5, 1.995, 1.995, 2.5, 2.995, 3.5], atol=1e-6)
    np.testing.assert_allclose(x[[0, 2, 5, 7]], np.array([1.0, -1.0, 1.0, -1.0]) / np.pi, atol=1e-7)


def test_a_run_that_fails_at_once_has_no_powers() -> None:
    case = by_scheme(MODE_COUPLING, "two-layer", 0.5, solver__duration=1e4, output__sample_interval=1e3)
    motion = tracked(case)
    assert motion.track is not None
    track = replace(motion.track, times=motion.track.times[:1])
    assert math.isnan(track.powers(0.0, 1.0).friction)
