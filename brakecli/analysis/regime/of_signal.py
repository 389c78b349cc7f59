"""The regime of a measured signal, which carries no flags: see docs/measured-signals.md."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from brakecli.analysis.regime.bursts import Burst, bursts
from brakecli.analysis.regime.cleaning import Velocity, cleaned, without_drift
from brakecli.analysis.regime.signal_rules import FEWEST_SAMPLES, SignalRules, SignalThresholds
from brakecli.analysis.regime.spectra import Array
from brakecli.analysis.regime.stick import Slips, seek
from brakecli.analysis.regime.table import Excitation, Regime

_MOST_OF_IT = 0.9  # of the record: a burst that fills as much is the record
_MOST_ENERGY = 0.5  # of all bursts in one that speaks for the record
_INSIDE = 0.05  # of a burst, left out at either end
_LEVEL = 1.33  # its last third over its first, or the reverse; a ring-down that is cut at half has 1.5
_DEFAULT = SignalThresholds()
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


@dataclass(frozen=True)
class SignalVerdict:
    """The regime of a measured signal, its numbers (SI units), and the reasons in plain words."""

    regime: Regime
    reasons: tuple[str, ...]
    frequency: float | None  # Hz: strongest line, or events of stick per second
    amplitude: float | None  # m, half of peak to peak of x
    stick_fraction: float | None
    bursts: tuple[Burst, ...]  # when a tone stands out
    evidence: dict[str, float]
    warnings: tuple[str, ...]
    thresholds: SignalThresholds
    excitation: Excitation = Excitation.NONE  # a measurement does not show where the energy comes from,
    contact_loss_fraction: None = None  # nor whether contact was lost


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
    """The verdict with the velocity that it rests on; that of the longest burst where all else is silence.

    `belt_speed` in m/s, `stiffness` in N/m (of a force) where known.
    """
    step, good = signal.interval, np.flatnonzero(np.isfinite(signal.values))
    found = _judge(signal, quantity, belt_speed, stiffness, thresholds)
    filled = np.interp(np.arange(len(signal.values)), good, signal.values[good]) if len(good) else signal.values
    tones = tuple(bursts(filled, step))
    verdict = replace(found.verdict, bursts=tones)
    steep = [tone for tone in tones if tone.steep and tone.end - tone.start < _MOST_OF_IT * len(filled) * step]
    burst = max(steep, key=lambda tone: tone.energy, default=None)
    rare = burst and burst.energy >= _MOST_ENERGY * sum(tone.energy for tone in tones)
    if not burst or not rare or verdict.regime in _SUSTAINED:
        return replace(found, verdict=verdict)
    begin, end = (int(time / step) for time in (burst.start, burst.end))
    margin = int(_INSIDE * (end - begin))
    part = replace(signal, values=signal.values[begin + margin : end - margin])
    if np.isfinite(part.values).sum() >= FEWEST_SAMPLES:
        inside = _judge(part, quantity, belt_speed, stiffness, thresholds).verdict
        if inside.regime in _SUSTAINED and 1.0 / _LEVEL < inside.evidence["envelope_ratio"] < _LEVEL:
            when = f"in a burst from {burst.start:.4g} to {burst.end:.4g} s: {inside.reasons[0]}"
            line = burst.frequency if inside.regime is Regime.QUASI_HARMONIC else inside.frequency
            verdict = replace(inside, reasons=(when,), frequency=line, bursts=tones, warnings=verdict.warnings)
    return replace(found, verdict=verdict)


def _judge(
    signal: Signal,
    quantity: Measurand,
    belt_speed: float | None,
    stiffness: float | None,
    thresholds: SignalThresholds,
) -> SignalLook:
    """The verdict on a whole signal."""
    size = float(np.nanmax(np.abs(signal.values), initial=0.0)) or 1.0  # squares of the smallest must not vanish
    order, step = quantity.order, signal.interval
    velocity, notes = cleaned(signal.values / size, order)
    spring = np.nan if quantity in (Measurand.PRESSURE, Measurand.TORQUE) else 1.0
    if quantity is Measurand.FORCE:
        spring = np.nan if stiffness is None else stiffness
    belt = np.nan if belt_speed is None else abs(belt_speed) * spring * step ** (1 - order) / size
    enough = len(velocity.values) >= FEWEST_SAMPLES
    slips = seek(velocity, thresholds.skewness_certain) if enough else Slips()
    certain = slips.skewness >= thresholds.skewness_certain and slips.enough
    velocity = without_drift(velocity, slips.period if certain and slips.stick_slip else 0.0, notes)
    if enough and not certain:
        slips = seek(velocity, thresholds.skewness_certain)  # drift may have hidden them
    rules = SignalRules(velocity, slips, step, belt, thresholds)
    rules.has_belt = quantity is not Measurand.PRESSURE
    decision = rules.short() or rules.unsettled() or rules.sticking() or rules.without_stick()
    amplitude = np.nan
    if rules.above_noise:
        moved = velocity.amplitude(rules.smoothing, rules.start, rules.windows)
        amplitude = moved * size * step**order / spring
    verdict = SignalVerdict(
        regime=decision.regime,
        reasons=(decision.sentence,),
        frequency=decision.frequency,
        amplitude=amplitude if np.isfinite(amplitude) else None,
        stick_fraction=decision.stick_fraction,
        bursts=(),
        evidence={**rules.evidence, "noise": size * step ** max(order - 1, 0) * velocity.noise},
        warnings=(*signal.notes, *notes),
        thresholds=thresholds,
    )
    return SignalLook(verdict, signal, quantity, velocity, slips, rules.smoothing)
