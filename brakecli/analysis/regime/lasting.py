"""The numbers of what lasts: amplitude, its spread, whether it is settled, and from where on."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from brakecli.analysis.regime.answers import QUARTER, Answers, shown_after
from brakecli.analysis.regime.cycles import DRIFT, SIZE_OFF, Cycles, contact_time, in_lines, median, swings
from brakecli.analysis.regime.decision import Decision, Excitation, Regime, Thresholds
from brakecli.analysis.regime.evidence import Stretch, tenths
from brakecli.analysis.regime.forced_linear import RELAXED, ROOM, Lasting, forced_linear
from brakecli.analysis.regime.measure import Shown
from brakecli.analysis.stability.linear import parts
from brakecli.solver.alike import at_once
from brakecli.solver.history import History, stacked
from brakecli.solver.motion.flow import Orbit

_VAGUE = "the amplitude may be off by as much as itself: run longer, or take a smaller solver.step"


def lasting(
    shown: Sequence[Shown], answers: Sequence[Answers], decisions: Sequence[Decision], *, in_full: bool
) -> list[Lasting]:
    """The numbers of motions that have been decided on."""
    linear = [
        (motion.samples, motion.interval, motion.linear.belt, motion.linear.passing.tobytes())
        if decision.excitation is Excitation.FORCED and motion.linear
        else None
        for motion, decision in zip(shown, decisions, strict=True)
    ]
    closed = at_once(linear, lambda at: forced_linear([shown[i] for i in at], [answers[i].decay for i in at]))
    results = [_lasting(*row, in_full=in_full) for row in zip(shown, answers, decisions, closed, strict=True)]
    forces = at_once(
        [(numbers.stretch.stop, numbers.stretch.start, numbers.force_from) for numbers in results],
        lambda at: _forces([shown[i].history for i in at], results[at[0]]),
    )
    for motion, what, decision, force in zip(shown, results, decisions, forces, strict=True):
        _add_force(motion, what, *force, lasts=decision.regime is not Regime.UNDECIDED)
    return results


def _lasting(
    shown: Shown, answers: Answers, decision: Decision, closed: Lasting | None, *, in_full: bool
) -> Lasting:
    """The numbers of a motion, but those of its forces; `closed` where they have a closed form."""
    forced = decision.excitation is Excitation.FORCED
    lines: Sequence[float] = shown.context.forced if forced else ()
    if forced:
        numbers = closed or _forced(shown, answers)
    elif decision.excitation is Excitation.SELF_EXCITED and shown.cycles:
        numbers = _self_excited(shown, answers, shown.cycles)
    else:
        stretch = shown.stretch(shown.half) if answers.linear else shown.judged
        stays = not answers.moves or answers.carried_along  # all else dies, or is not known
        numbers = Lasting(stretch, answers.settled and stays, stretch.amplitude("x"))
        if decision.regime is Regime.DAMPED:  # amplitude and variation are those of the same time
            numbers.amplitude = shown.statistics.final
            numbers.force_from = tenths(shown.samples)[1]
        return numbers
    if forced and numbers.settled and numbers.forced is None:  # its neighbours come together: nothing else is left
        numbers.forced = numbers.amplitude
    if numbers.cycles and shown.context.forced and _holds_two(shown, numbers.stretch):
        split = numbers.stretch.split(shown.context.forced)
        numbers.forced, numbers.own = split if split and split[0] <= split[1] else (None, None)
    if forced and in_full:
        numbers.forced_frequency = _wave(shown, numbers.stretch)
    _add_ripple(shown, numbers, lines)
    # where it spreads by as much as itself, not even its order is known
    if numbers.spread is not None and 0.0 < numbers.amplitude <= numbers.spread:
        numbers.notes["settled"] = numbers.notes.get("settled") or (_VAGUE if numbers.settled else None)
        numbers.spread = None
        numbers.settled = False
    return numbers


def _wave(shown: Shown, stretch: Stretch) -> float | None:
    """The passing frequency (Hz) of the wave that moves x most; where many pass, of those that should do so."""
    likely = sorted(shown.context.waves, key=lambda wave: -wave[1])[:16]
    if not likely:
        return None
    x, time = stretch.places()
    lines = np.exp(-2j * np.pi * np.outer([frequency for frequency, _ in likely], time))
    sizes = np.abs(lines @ ((x - x.mean()) * np.hanning(len(x))))
    return likely[int(np.argmax(sizes))][0]


def _holds_two(shown: Shown, stretch: Stretch) -> bool:
    """Whether a part holds two periods of the slowest wave."""
    slow = min((frequency for frequency, _ in shown.context.waves), default=0.0)
    return (stretch.stop - stretch.start) * shown.history.interval * slow >= 2.0


def _forced(shown: Shown, answers: Answers) -> Lasting:
    """A forced motion of a pad that opens: its cycle is the slowest wave, or the slowest beat."""
    stretch = shown.judged
    interval = shown.history.interval
    history = shown.history
    rate = -answers.lyapunov_exponent if math.isfinite(answers.lyapunov_exponent) else -shown.context.growth()
    fading = 0.25 * shown.duration * rate < RELAXED  # too slowly to be seen within a quarter of the run
    chaos = answers.lyapunov_exponent > shown.limits.sure_errors * answers.lyapunov_error
    numbers = Lasting(stretch, answers.settled, 0.0)
    if not numbers.settled and not fading:
        numbers.settled = shown.changes() <= shown.limits.settled_within
    seconds = (stretch.stop - stretch.start) * interval
    if not chaos and (not numbers.settled or seconds * rate < RELAXED):
        numbers.settled = False
        text = "it is not certain that what the shoe adds dies away: run longer"
        if rate > 0.0:
            needed = shown_after(shown.duration, rate)
            text = f"what the shoe adds dies away at only {rate:.3g} 1/s: run at least {needed:.3g} s"
            text += " to see the amplitude that lasts"
        numbers.notes["settled"] = text
    elif numbers.settled and seconds < (beat := shown.beat()):
        numbers.settled = False
        numbers.notes["beat"] = f"the waves beat every {beat:.3g} s: run longer"
    end = stretch.stop * interval
    begin = max(stretch.start * interval, shown.track.since)
    period = max(min(shown.beat(), end - begin), interval)
    edges = np.asarray(end - period * np.arange(int((end - begin) / period), -1, -1), np.float64)
    sizes = swings(shown.events, edges)
    numbers.amplitude, spread = median(sizes if len(sizes) else np.array([stretch.amplitude("x")]))
    if (numbers.settled or not fading) and len(edges) >= 3 - numbers.settled:
        off = SIZE_OFF * numbers.amplitude * shown.context.step / contact_time(shown.events, begin, end)
        numbers.spread = off + max(spread, _beating(shown, stretch) * stretch.amplitude("x") - numbers.amplitude)
    _settle_force(shown, numbers, history.samples)
    return numbers


def _beating(shown: Shown, stretch: Stretch) -> float:
    """Amplitude of a longer motion over that of the settled part, as waves beat that force a linear one."""
    if not (theory := shown.context.linear()):
        return 1.0
    x, time = stretch.places()
    (forced,), (lasting,), _ = parts([theory], x[None, ::8], time[::8])  # one place of eight suffices
    return 2.0 * float(forced) / max(float(np.ptp(lasting)), 1e-300)


def _settle_force(shown: Shown, numbers: Lasting, stop: int) -> None:
    """Find from where on the friction force has settled: it may ring longer than x.

    From there on it swings no wider, within 4 to 16 pieces of the settled part, than in the last half of them.
    """
    stretch = numbers.stretch
    interval = shown.history.interval
    seconds = max(shown.context.pattern, shown.beat())
    count = min(int((stretch.stop - stretch.start) * interval / seconds), 16) if seconds else 0
    if count < 4:
        return
    ends = np.linspace(stretch.start, stop, count + 1).astype(int).tolist()
    pieces = (replace(stretch, start=start, stop=stop) for start, stop in pairwise(ends))
    widths = np.array([piece.amplitude("friction_force") for piece in pieces])
    late = widths[count // 2 :]
    wider = 1.02
    first = int(np.flatnonzero(np.append(True, widths > wider * late.max()))[-1])
    if (np.diff(widths[: first + 1]) < 0.0).all():  # not the chance of waves that meet
        numbers.force_from = ends[first]
    if len(late) >= 4 and (np.diff(late) < 0.0).all() and late[0] > wider * late[-1]:
        numbers.force_rings = shown.duration


def _self_excited(shown: Shown, answers: Answers, cycles: Cycles) -> Lasting:
    """A vibration that lasts by itself: medians of its cycles, with what a drift becomes in the spreads."""
    stretch = shown.judged
    seconds = answers.settled_duration
    interval = shown.history.interval
    rate = 0.0 if answers.undamped else min(abs(answers.growth_rate), shown.context.settles)
    if math.isfinite(answers.rate_without_waves):
        rate = min(rate, answers.rate_without_waves) if answers.waves else answers.rate_without_waves
    lasts = answers.settled and rate * seconds >= RELAXED
    numbers = Lasting(stretch, lasts, cycles.amplitude, cycles=cycles)
    numbers.evidence = cycles.evidence | {"stick_cycles": answers.stick_cycles}
    changed = max(_surely(cycles.drift, shown.limits), _surely(cycles.detuning, shown.limits))
    off = abs(cycles.amplitude - answers.amplitude_without_waves)
    turns = answers.period_without_waves * cycles.frequency
    whole = round(turns) if math.isfinite(turns) else 0
    detuned = abs(turns - whole) / turns
    nearest = min(off, abs(answers.amplitude - answers.amplitude_without_waves))  # cycles may be parts of it
    apart = max(nearest / (shown.limits.settled_within * answers.amplitude_without_waves), detuned / DRIFT)
    far = not apart <= 1.0  # also where it is not known
    turns_for_good = math.isfinite(answers.frequency_of_modulation)
    if lasts and not (answers.waves or shown.context.step or far) and whole >= 1:
        return _on_orbit(numbers, shown.fate.orbit)
    longer = f"run at least {shown_after(shown.duration, max(rate, 1e-9)):.3g} s for numbers that last"
    text: str | None = None
    if not lasts:
        text = f"this vibration may settle at only {rate:.2g} 1/s: {longer}" if answers.settled else None
    elif not answers.waves and far and not turns_for_good:
        text = f"continued, this vibration comes to {answers.limit}: {longer}"
        if shown.context.step and apart < math.inf:
            # to a third of what may be off; a choice, as large shifts grow less than with the square of the step
            finer = shown.context.step * 0.3 / apart
            text += f"; if it stays as it is, its steps shift it: take a solver.step of {finer:.2g} s, or a"
            text += " solver.tolerance"
    elif changed > DRIFT:
        text = f"its amplitude or frequency still changes by {changed:.1%} within the settled part: {longer}"
    elif answers.waves and seconds < (beat := shown.beat(0.1 * cycles.amplitude)):  # smaller waves change it, too
        text = f"the waves beat every {beat:.3g} s: run at least {ROOM * (stretch.start * interval + beat):.3g} s"
        text += " for numbers that last"
    numbers.settled = lasts and text is None
    numbers.notes["settled"] = text

    def with_drift(spread: float, value: float, drift: tuple[float, float]) -> float | None:
        """A spread with what a drift becomes until small disturbances have changed by a factor of e."""
        if lasts:
            return spread + _surely(drift, shown.limits) * value
        if answers.undamped:
            return None  # there is no end to it
        return min(spread + abs(drift[0]) * value / max(min(rate * seconds, 1.0), 1e-9), value)

    wander = cycles.evidence["frequency_spread"]
    spread = with_drift(wander, cycles.frequency, cycles.detuning)
    wander = (wander if spread is None else spread) + cycles.frequency_off
    numbers.frequency = cycles.frequency
    if cycles.evidence["harmonic_share"] < 0.5 and answers.stick_cycles < shown.limits.stick_cycles:
        numbers.frequency, wander = stretch.strongest
        numbers.evidence |= in_lines(stretch, numbers.frequency)
    short = seconds < shown.slowest(0.0) or abs(answers.level_change) > shown.limits.settled_within
    if lasts or not short:  # otherwise the run does not show where it ends
        numbers.spread = with_drift(cycles.amplitude_spread, cycles.amplitude, cycles.drift)
    orbit = shown.fate.orbit if not answers.waves and math.isfinite(turns) else None
    if orbit is not None:  # how far the run is from it
        turns = orbit.period * numbers.frequency
        wander += abs(turns - round(turns)) / orbit.period
        if numbers.spread is not None and (far or whole == 1):
            numbers.spread += off
        numbers.evidence["stick_spread"] += abs(cycles.stick_fraction - orbit.stick_fraction)
        numbers.evidence["contact_loss_spread"] += abs(cycles.contact_loss_fraction - orbit.contact_loss_fraction)
    numbers.evidence["frequency_spread"] = min(wander, numbers.frequency)
    return numbers


def _on_orbit(numbers: Lasting, orbit: Orbit | None) -> Lasting:
    """The numbers of a motion that follows the equations and has come to its orbit: those of the orbit.

    A scheme at a step has a motion of its own, which samples show.
    """
    if orbit is not None:
        numbers.orbit = orbit
        numbers.frequency = orbit.frequency
        numbers.spread = orbit.error * orbit.amplitude
        numbers.evidence["frequency_spread"] = orbit.error * orbit.frequency
        graze = math.sqrt(orbit.error)  # part of a period in a phase that only just comes about
        numbers.evidence["stick_spread"] = graze
        numbers.evidence["contact_loss_spread"] = graze
    return numbers


def _surely(change: tuple[float, float], limits: Thresholds) -> float:
    """The size of a change with its error, as far as it is no chance."""
    return abs(change[0]) if abs(change[0]) > limits.sure_errors * change[1] else 0.0


def _add_ripple(shown: Shown, numbers: Lasting, lines: Sequence[float]) -> None:
    """What nodes and steps change in a motion forced on lines (Hz), or in one that lasts by itself."""
    context = shown.context
    stretch = numbers.stretch
    opens = shown.statistics.full_from > stretch.start  # otherwise it has none
    ripple = context.ripple(stretch, lines) if opens and not numbers.cycles else None
    if numbers.spread is not None and lines and not (shown.linear and numbers.forced == numbers.amplitude):
        numbers.spread += numbers.amplitude * context.detuned(stretch, lines) + (ripple.size if ripple else 0.0)
    if ripple and ripple.counts:
        numbers.evidence |= {f"ripple_{name}": getattr(ripple, name) for name in ("x", "vx", "force")}
        numbers.longer &= not numbers.settled
        numbers.notes["ripple"] = ripple.sentence
        numbers.settled = False


def _forces(histories: Sequence[History], alike: Lasting) -> list[tuple[float, float]]:
    """Mean and variation (N, peak to peak) of the friction force in the settled part, which all have in common."""
    stretch = replace(alike.stretch, history=stacked(histories))
    low, high = replace(stretch, start=max(stretch.start, alike.force_from)).extremes("friction_force")
    return [*zip(stretch.mean("friction_force").tolist(), (high - low).tolist(), strict=True)]


def _add_force(shown: Shown, numbers: Lasting, mean: float, variation: float, *, lasts: bool) -> None:
    """Add mean and variation of the friction force, and why it is missing or may be too small."""
    interval = shown.interval
    pattern = shown.context.pattern
    seconds = (shown.samples - max(numbers.stretch.start, numbers.force_from)) * interval
    numbers.mean_force = mean
    numbers.variation = variation
    if numbers.cycles:
        numbers.variation = numbers.cycles.force_variation
        if numbers.variation is None:
            finer = f"give an output.sample_interval of {0.25 * interval:.2g} s"  # a choice
            text = f"samples miss impacts of the friction force, and torque_variation is missing: {finer}"
            numbers.notes["torque_variation"] = text
    elif numbers.force_rings is not None:
        numbers.variation = None
        longer = QUARTER * (shown.duration + numbers.force_rings)
        text = f"the friction force still rings, and torque_variation is missing: run at least {longer:.3g} s"
        numbers.notes["torque_variation"] = text
    elif lasts and shown.context.steady and seconds < 0.999 * pattern:  # samples may miss the rest
        numbers.notes["torque_variation"] = (
            f"torque_variation needs {pattern:.3g} s, until the waves repeat: run longer"
        )
