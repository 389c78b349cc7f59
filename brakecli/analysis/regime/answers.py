"""The record of answers by which a motion is judged, and the words and times that follow from them."""

import math
from collections.abc import Mapping
from enum import StrEnum
from typing import NamedTuple

from brakecli.analysis.regime.decision import Thresholds, fill

QUARTER = 4.0 / 3.0  # a run whose last quarter is settled, over what comes before
FADED = 3.0  # powers of e after which a change has ended: 5 % of it are left
LONGER = 1.4  # a run whose last quarter and the window before it are settled, over what comes before

RENAMED = {
    "stands": "wheel_stands",
    "steady": "constant_speed_and_load",
    "slowest": "slowest_wave_period",
    "locks": "locking_friction",
    "held": "held_by_link",
    "touches": "touches_in_sliding",
    "growth": "growth_rate",
    "growth_error": "growth_rate_error",
    "ringing": "ringing_frequency",
    "never": "never_touched",
    "lost": "contact_lost",
    "left": "contact_left",
    "carried": "carried_along",
    "to_limit": "time_to_limit",
    "change": "level_change",
    "change_error": "level_change_error",
    "exponent": "lyapunov_exponent",
    "exponent_error": "lyapunov_error",
    "even": "lyapunov_by_line",
    "even_error": "lyapunov_by_line_error",
    "power_left": "power_stored",
    "friction_error": "power_of_friction_error",
    "roughness_error": "power_of_roughness_error",
    "seconds": "settled_duration",
}
"""Names of answers in results of 0.7.0 and before, and what they are called now."""


def shown_after(duration: float, rate: float) -> float:
    """Duration (s) of a run that shows what lasts, where something changes at this rate (1/s) after so long."""
    return QUARTER * (duration + FADED / max(rate, 1e-300))


class Continuation(StrEnum):
    """What becomes of a motion on the smooth wheel."""

    DIES = "dies"
    LASTS = "lasts"
    UNKNOWN = "unknown"


class Answers(NamedTuple):
    """What is known of a motion, in SI units; nan where a number is not known."""

    failure: str = ""  # why the run has failed
    unasked: str = ""  # the command that asks what an older file does not hold
    duration: float = math.nan
    samples: int = 0
    few_samples: bool = False  # too few for an envelope
    constant_speed_and_load: bool = True
    wheel_stands: bool = False
    waves: bool = False  # whether the roughness of a turning wheel shakes the shoe
    slowest_wave_period: float = 0.0  # period of the slowest wave that counts
    frictionless: bool = False
    undamped: bool = False
    locking_friction: float = math.nan  # coefficient from which on the shoe locks itself, where its own is larger
    held_by_link: bool = True  # whether a link holds the shoe along the wheel
    touches_in_sliding: bool = True  # whether the shoe touches the wheel where it slides steadily
    growth_rate: float = math.nan  # of a small disturbance of steady sliding, 1/s
    growth_rate_error: float = 0.0  # by which the slopes of the waves may change it
    ringing_frequency: float = math.nan  # frequency of that disturbance
    steadier: str = ""  # what to do where the steps damp what grows
    never_touched: bool = False  # the shoe has never touched the wheel
    contact_lost: bool = False  # no contact in the second half
    contact_left: bool = False  # no contact in the last quarter
    carried_along: bool = False  # stick in the second half, of a standing wheel in the last quarter
    moves: bool = True  # beyond rounding
    linear: bool = False  # slips to one side in full contact, at last
    time_to_limit: float = math.nan  # time until stick or loss of contact limits what grows
    level_change: float = math.nan  # of the logarithm of the level within the second half
    level_change_error: float = math.nan
    lyapunov_exponent: float = math.nan  # of neighbours, 1/s
    lyapunov_error: float = math.nan
    lyapunov_by_line: float = math.nan  # the same of a linear motion, by a line
    lyapunov_by_line_error: float = math.nan
    without_waves: Continuation = Continuation.UNKNOWN  # of the motion on the smooth wheel
    amplitude: float = math.nan  # of x at the end
    level: float = math.nan  # standard deviation of vx there
    amplitude_without_waves: float = math.nan  # that it comes to on the smooth wheel
    level_without_waves: float = math.nan  # and the standard deviation of vx
    rate_without_waves: float = math.nan  # at which it does
    period_without_waves: float = math.nan  # of the limit cycle that this is
    sticks_without_waves: float = math.nan  # in a period
    power_of_friction: float = math.nan  # power that friction gives, W
    power_of_roughness: float = math.nan  # that the roughness gives
    power_stored: float = math.nan  # what dashpots and scheme leave of both; nothing where the motion has settled
    power_of_friction_error: float = math.nan
    power_of_roughness_error: float = math.nan
    settled_duration: float = math.nan  # of the settled part
    settled: bool = False  # whether such a part was found
    cycles: float = 0.0  # in it
    frequency: float = math.nan  # of them
    samples_per_cycle: float = 0.0
    steps_per_cycle: float = math.inf  # where the case gives a step
    frequency_of_modulation: float = math.nan  # at which their size turns on a torus, on a smooth wheel
    stick_cycles: float = math.nan
    harmonic_share: float = math.nan  # of one line and its multiples
    band_share: float = math.nan  # in three narrow bands, where the frequency does not wander

    def known(self) -> dict[str, str | float]:
        """What is known, by name: numbers, texts, and 1 for what holds."""
        stored = {name: value for name, value in self._asdict().items() if value != self._field_defaults[name]}
        return {
            name: str(value) if isinstance(value, str) else float(value)
            for name, value in stored.items()
            if isinstance(value, str) or math.isfinite(value)
        }

    @classmethod
    def of(cls, stored: Mapping[str, object]) -> "Answers":
        """The record of what is known by name; what else there is does not matter."""
        defaults = cls._field_defaults.items()
        return cls(**{name: type(value)(stored[name]) for name, value in defaults if name in stored})

    def powers(self, rate: float) -> float:
        """Powers of e by which something changes in half of the run."""
        return 0.5 * rate * self.duration

    def rate(self, errors: float) -> tuple[float, float]:
        """Growth rate of what a linear motion holds beside the forced one, and how far it may be off."""
        if abs(self.growth_rate) > self.growth_rate_error or not math.isfinite(self.lyapunov_by_line):
            return self.growth_rate, self.growth_rate_error
        return self.lyapunov_by_line, errors * self.lyapunov_by_line_error

    @property
    def longer(self) -> float:
        """Duration after which a change has come to its end: its last quarter is judged."""
        return shown_after(self.duration, abs(self.level_change) / (0.5 * self.duration))

    @property
    def own(self) -> float:
        """Growth rate (1/s) of what a linear motion holds beside the forced one."""
        return self.rate(0.0)[0]

    @property
    def grown(self) -> float:
        """Duration after which what grows has come to its limits."""
        limit = self.time_to_limit if math.isfinite(self.time_to_limit) else 0.0
        return shown_after(self.duration + limit, self.own)

    @property
    def waited(self) -> float:
        """Duration after which neighbours have come together."""
        return shown_after(self.duration, abs(self.lyapunov_exponent))

    @property
    def told_apart(self) -> float:
        """Duration after which an exponent is told from 0, as its error falls with the square root of the time."""
        errors = Thresholds.sure_errors * self.lyapunov_error / max(abs(self.lyapunov_exponent), 1e-300)
        times = min(errors, 4.0) ** 2
        return QUARTER * self.duration * max(times, 2.0)  # 2 to 16 times as long; choices

    @property
    def becomes(self) -> str:
        """What becomes of the vibration on the smooth wheel."""
        decided = self.without_waves is not Continuation.UNKNOWN
        return f"it {self.without_waves}" if decided else "it is not known what it comes to"

    @property
    def taken(self) -> float:
        """Power (W) that friction takes."""
        return -self.power_of_friction

    @property
    def decay(self) -> float:
        """Rate (1/s) at which it fades."""
        return -self.own

    @property
    def sticks(self) -> str:
        """How often the motion sticks."""
        return (
            fill("with stick in {stick_cycles:.0%} of the cycles", self) if self.stick_cycles else "without stick"
        )

    @property
    def two_waves(self) -> float:
        """Duration whose settled part holds two periods of the slowest wave."""
        return 2.0 * LONGER * self.slowest_wave_period

    @property
    def lines(self) -> str:
        """Where the energy of vx lies."""
        if not self.band_share <= self.harmonic_share and math.isfinite(self.band_share):
            bands = f"{self.band_share:.0%} of the energy of vx in three narrow bands"
            known = self.waves or math.isfinite(self.frequency_of_modulation)
            apart = self.harmonic_share < Thresholds.harmonic_share and not known
            return bands + ", not multiples of one frequency: a torus, or chaos" * apart
        return fill("{harmonic_share:.0%} of the energy of vx in one line and its harmonics", self)

    @property
    def turns(self) -> str:
        """That the size of cycles turns on a torus, where it does on a smooth wheel."""
        both = "{frequency:.4g} and {frequency_of_modulation:.4g} Hz"
        return fill(f"[; on a torus of two frequencies, {both}, it never repeats]", self)

    @property
    def torus(self) -> float:
        """Frequency (Hz) of a regular motion beside those of the waves; nan where neighbours part, as in chaos.

        A motion with a phase of its own is not locked, so that no whole numbers bind both frequencies.
        """
        whole = self.harmonic_share >= Thresholds.harmonic_share
        regular = whole or self.band_share >= Thresholds.band_share
        chaos = self.lyapunov_exponent > Thresholds.sure_errors * self.lyapunov_error
        return self.frequency if regular and not chaos else math.nan

    @property
    def limit(self) -> str:
        """What it comes to on the smooth wheel."""
        if not math.isfinite(self.amplitude_without_waves):
            return "no limit cycle that was found"
        return fill("an amplitude of {amplitude_without_waves:.4g} m[ in a cycle of {ends_at:.4g} Hz]", self)

    @property
    def ends_at(self) -> float:
        """Frequency (Hz) of the limit cycle on the smooth wheel."""
        return 1.0 / self.period_without_waves

    @property
    def or_longer(self) -> str:
        """How long it takes to grow from rounding to the size of a motion, if that is longer than the run."""
        seconds = math.log(1e9) / self.growth_rate
        return f", or run at least {seconds:.2g} s" if seconds > self.duration else ""

    @property
    def word(self) -> str:
        """Which way the level changes."""
        return "grows" if self.level_change > 0.0 else "falls"
