"""The regime of a measured signal, which carries no flags: see docs/measured-signals.md."""

import math
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.analysis.signals.bursts import Burst, bursts
from brakecli.analysis.signals.cleaning import Velocity, cleaned, without_drift, without_spikes
from brakecli.analysis.signals.decay import Ringing, ringing
from brakecli.analysis.signals.measure import Heard, answers
from brakecli.analysis.signals.slips import Slips, seek
from brakecli.analysis.signals.table import SignalThresholds, decide
from brakecli.analysis.spectrum import Array
from brakecli.results.fields import MEASURED_UNITS

_DEFAULT = SignalThresholds()
FULL_SCALE = "of full scale"
_SUSTAINED = (Regime.RELAXATION, Regime.QUASI_HARMONIC)


class Measurand(StrEnum):
    """What was measured.

    A force is that of the spring between the belt's friction and the frame. A torque is such a force times a lever
    that is not known. A pressure is that of the sound nearby.
    """

    DISPLACEMENT = "displacement"
    VELOCITY = "velocity"
    FORCE = "force"
    TORQUE = "torque"
    ACCELERATION = "acceleration"
    PRESSURE = "pressure"

    @property
    def order(self) -> int:
        """How often it must be integrated to give a displacement; a sound goes with the velocity."""
        return {Measurand.VELOCITY: 1, Measurand.PRESSURE: 1, Measurand.ACCELERATION: 2}.get(self, 0)


@dataclass(frozen=True)
class Signal:
    """Equally spaced values in SI units, NaN where there are none; `notes` report what reading has changed."""

    values: Array
    interval: float  # s
    notes: tuple[str, ...] = ()
    relative: bool = False  # a sound file of which nobody has said what full scale means


@dataclass(frozen=True)
class SignalVerdict:
    """The regime of a measured signal, its numbers (SI units), and the reasons in plain words."""

    regime: Regime
    reasons: tuple[str, ...]
    frequency: float | None  # Hz: strongest line, or events of stick per second
    amplitude: float | None  # m, half of peak to peak of x at the tones found; of what has died out none
    stick_fraction: float | None
    bursts: tuple[Burst, ...]  # when a tone stands out
    evidence: dict[str, Any]  # row that decided, and the answers that are known
    warnings: tuple[str, ...]
    thresholds: SignalThresholds
    unit: str  # of the record, and of what is told of its bursts
    ringing_frequency: float | None = None  # Hz, of what has died out, by its logarithmic decrement
    ringing_frequency_error: float | None = None  # Hz, a standard error
    damping_ratio: float | None = None
    damping_ratio_error: float | None = None
    amplitude_spread: float | None = None  # m, by which it varies, and noise moves it
    excitation: Excitation = Excitation.NONE  # a measurement does not show where the energy comes from,
    contact_loss_fraction: None = None  # nor whether contact was lost


_Settings = tuple[Measurand, float | None, float | None, SignalThresholds]  # what is known of a signal besides it


@dataclass(frozen=True)
class SignalLook:
    """A verdict with what it was found from, for pictures."""

    verdict: SignalVerdict
    signal: Signal
    quantity: Measurand
    velocity: Velocity
    slips: Slips
    smoothing: int  # samples


def look(
    signal: Signal,
    quantity: Measurand,
    belt_speed: float | None = None,
    stiffness: float | None = None,
    thresholds: SignalThresholds = _DEFAULT,
) -> SignalLook:
    """The verdict with the velocity that it rests on; that of the strongest burst where tones come and go.

    `belt_speed` in m/s, `stiffness` in N/m (of a force) where known.
    """
    step = signal.interval
    settings = (quantity, belt_speed, stiffness, thresholds)
    judged = _judge(signal, *settings)
    tones = tuple(bursts(without_spikes(signal.values, quantity.order), step))
    verdict = replace(judged.verdict, bursts=tones)
    filled = sum(tone.end - tone.start for tone in tones)  # nearly all of it: then they are the record
    if tones and filled < 0.9 * len(signal.values) * step and verdict.regime is not Regime.RELAXATION:
        verdict = _of_bursts(signal, settings, verdict)
    return replace(judged, verdict=verdict)


def _of_bursts(signal: Signal, settings: _Settings, whole: SignalVerdict) -> SignalVerdict:
    """The verdict where tones come and go: that of the strongest burst, if those like it have most energy."""
    tones = whole.bursts
    step = signal.interval
    burst = max(tones, key=lambda tone: tone.energy)
    like = [tone for tone in tones if tone.is_like(burst)]
    when = f"in a burst from {burst.start:.4g} to {burst.end:.4g} s"
    if len(like) > 1:
        when = f"in {len(like)} bursts, the strongest from {burst.start:.4g} to {burst.end:.4g} s"
    if sum(tone.energy for tone in like) >= 0.5 * sum(tone.energy for tone in tones):
        begin, end = (int(time / step) for time in (burst.start, burst.end))
        margin = int(0.05 * (end - begin))  # in which it begins and ends
        piece = replace(signal, values=signal.values[begin + margin : end - margin])
        inside = _judge(piece, *settings).verdict if np.isfinite(piece.values).any() else whole
        sustained = inside.regime in _SUSTAINED and inside.evidence["steady_from"] == 0.0
        if sustained and abs(inside.evidence["level_change"]) < 0.3:  # a ring-down that is cut at half has 0.7
            line = burst.frequency if inside.regime is Regime.QUASI_HARMONIC else inside.frequency
            said = (f"{when}: {inside.reasons[0]}",)
            return replace(inside, reasons=said, frequency=line, bursts=tones, warnings=whole.warnings)
    if whole.regime is Regime.DAMPED:
        return whole
    reasons = (f"{when}: {whole.reasons[0]}",)
    return replace(whole, reasons=reasons, amplitude=None, amplitude_spread=None)  # the record has pauses, too


def _judge(
    signal: Signal,
    quantity: Measurand,
    belt_speed: float | None,
    stiffness: float | None,
    thresholds: SignalThresholds,
) -> SignalLook:
    """The verdict on a whole signal."""
    size = float(np.nanmax(np.abs(signal.values), initial=0.0)) or 1.0  # squares of the smallest must not vanish
    order = quantity.order
    step = signal.interval
    certain = thresholds.skewness_certain
    velocity, notes = cleaned(signal.values / size, order)
    conversion = {Measurand.FORCE: stiffness, Measurand.TORQUE: None, Measurand.PRESSURE: None}.get(quantity, 1.0)
    spring = math.nan if conversion is None else conversion
    belt = math.nan if belt_speed is None else abs(belt_speed) * spring * step ** (1 - order) / size
    raw = velocity
    slips = seek(velocity, certain)
    sure = slips.stick_slip and slips.skewness >= certain
    velocity = without_drift(velocity, len(velocity.smoothed(slips.scale)) / slips.count if sure else 0.0, notes)
    slips = slips if sure else seek(velocity, certain)  # drift may have hidden them
    heard = Heard(velocity, slips, belt, thresholds)
    record = answers(heard, has_belt=quantity is not Measurand.PRESSURE)
    decision = decide(record, thresholds)
    per_second = None
    stick = None
    slipping = decision.row == "slips"
    if decision.regime in _SUSTAINED:
        per_second = (slips.often if slipping else heard.line) / step
        if slipping or record.knows_belt:
            stick = slips.stick if slipping else record.sticks if decision.regime is Regime.RELAXATION else 0.0
    begin = record.steady_from if decision.regime in _SUSTAINED else 0.0
    measured = raw if order < 2 else cleaned(signal.values / size, 1)[0]  # with its drift, and white noise
    amplitude = spread = math.nan
    if record.heard and decision.regime is not Regime.DAMPED:  # what has died out has none that lasts
        sizes = heard.amplitude(measured, order, begin)
        amplitude, spread = (value * size * step**order / spring for value in sizes)
    numbers = {
        name: value for name, value in asdict(record).items() if type(value) is float and math.isfinite(value)
    }
    noise = size * step ** max(order - 1, 0) * velocity.noise
    verdict = SignalVerdict(
        regime=decision.regime,
        reasons=(decision.sentence,),
        frequency=per_second,
        amplitude=amplitude if math.isfinite(amplitude) and not signal.relative else None,
        amplitude_spread=spread if math.isfinite(spread) and not signal.relative else None,
        stick_fraction=stick,
        bursts=(),
        evidence={"row": decision.row, **numbers, "noise": noise},
        warnings=(*signal.notes, *notes),
        thresholds=thresholds,
        unit=FULL_SCALE if signal.relative else MEASURED_UNITS[quantity],
    )
    if decision.regime is Regime.DAMPED and (rings := _ringing(measured, step, heard.line, thresholds)):
        verdict = replace(verdict, **asdict(rings))
    return SignalLook(verdict, signal, quantity, velocity, slips, heard.smoothing)


def _ringing(raw: Velocity, step: float, line: float, thresholds: SignalThresholds) -> Ringing | None:
    """With what it dies out, by a velocity of which nothing was taken; `line` in cycles per sample."""
    noise = raw.noise * (1.0 if raw.measured else 2.0 * math.sin(math.pi * line))  # at the line, of a difference
    return ringing(raw.values, step, line, noise, thresholds.sure_errors)
