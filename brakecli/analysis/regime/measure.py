"""The record of answers to the questions of `table`, from a history and what is known of its case."""

import math
from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import NamedTuple, TypedDict

import numpy as np

from brakecli.analysis.fate import Fate, Kind
from brakecli.analysis.regime.answers import Answers, Continuation
from brakecli.analysis.regime.context import Context
from brakecli.analysis.regime.cycles import Cycles, cycles_of
from brakecli.analysis.regime.decision import Thresholds
from brakecli.analysis.regime.evidence import FEWEST_SAMPLES, LONGEST, Stretch, last_quarter, window_means
from brakecli.analysis.regime.spectra import MULTIPLES
from brakecli.analysis.regime.statistics import Statistics
from brakecli.analysis.regime.torus import turns_per_cycle
from brakecli.analysis.stability.linear import Linear
from brakecli.solver.arrays import Floats
from brakecli.solver.history import History
from brakecli.solver.phases import STICK
from brakecli.solver.quantities import ContactState
from brakecli.solver.tangent import Exponent
from brakecli.solver.track import UNTRACKED, Events, Track


class Powers(TypedDict):
    """Answers about powers (W)."""

    power_of_friction: float
    power_of_roughness: float
    power_stored: float
    power_of_friction_error: float
    power_of_roughness_error: float


class WithoutWaves(TypedDict, total=False):
    """Answers about what a motion comes to on the smooth wheel: none where that is not known."""

    without_waves: Continuation
    amplitude_without_waves: float
    level_without_waves: float
    rate_without_waves: float
    period_without_waves: float
    sticks_without_waves: float


class Given(NamedTuple):
    """A motion that is to be judged, with what is known of it."""

    history: History
    context: Context  # what its case says
    exponent: Exponent | None = None  # of its small disturbances
    track: Track = UNTRACKED  # what the loop has noted
    continued: Callable[[], Fate] = lambda: Fate(Kind.UNKNOWN)  # what it comes to on the smooth wheel
    failure: str = ""  # why the run has failed


class Shown:
    """What a history shows."""

    def __init__(self, motion: Given, statistics: Statistics, limits: Thresholds) -> None:
        """Take a motion, and what all its samples show."""
        self.history, self.context, *_ = self.motion = motion
        self.statistics = statistics
        self.limits = limits
        self.track = motion.track
        self.samples = self.history.samples
        self.interval = self.history.interval
        self.duration = self.samples * self.interval
        self.half, self.quarter = self.samples // 2, last_quarter(self.samples)
        self.judged_from = statistics.settled_from or self.half

    def stretch(self, start: int) -> Stretch:
        """The samples from one on."""
        return Stretch(self.history, start, self.samples)

    @cached_property
    def judged(self) -> Stretch:
        """The settled part, or the second half."""
        return self.stretch(self.judged_from)

    def stays(self, state: ContactState, start: int) -> bool:
        """Whether the contact is in a state from a sample on."""
        return self.statistics.state == state and self.statistics.state_from <= start

    def fraction(self, state: ContactState, stretch: Stretch) -> float:
        """Part of the samples in a state of the contact, which mostly does not change any more."""
        if self.statistics.state_from <= stretch.start:
            return float(self.statistics.state == state)
        return stretch.fraction(state)

    @cached_property
    def linear(self) -> Linear | None:
        """The theory, where the motion has long been linear at last."""
        theory = self.context.linear()
        slow = self.slowest(0.0)
        if theory is None:
            return None
        start = max(min(self.quarter, self.samples - int(slow / self.interval)), 0)
        slides = self.statistics.full_from <= start and (theory.slip is None or self.stays(theory.slip, start))
        return theory if slides or theory.stays(self.end[1]) else None

    @property
    def brief(self) -> bool:
        """Whether it fails, changes or is too short, so that little is asked of it."""
        return self.samples < FEWEST_SAMPLES or not self.context.steady or bool(self.motion.failure)

    @property
    def enough(self) -> bool:
        """Whether all is known that is asked of it: more than a linear motion needs works and events."""
        return self.track is not UNTRACKED or self.brief or self.linear is not None

    @property
    def end(self) -> tuple[float, np.ndarray]:
        """Time and state of the last sample."""
        last = self.samples - 1
        state = [float(self.history.read(name, last, self.samples)[0]) for name in ("x", "y", "vx", "vy")]
        return last * self.interval, np.array(state)

    @cached_property
    def fate(self) -> Fate:
        """What the motion comes to on the smooth wheel."""
        return self.motion.continued()

    @cached_property
    def cycles(self) -> Cycles | None:
        """The cycles of the part that is judged; on a smooth wheel those of the limit cycle that it comes to."""
        own = not (self.context.forced or self.context.frictionless)
        known = self.fate.orbit.period if own and self.fate.orbit else math.nan
        return cycles_of(self.judged, self.events, self.context.step, known)

    @cached_property
    def events(self) -> Events:
        """The events of the part that is judged, as far as the loop keeps them and spectra are taken."""
        return self.track.events(max(self.judged_from, self.samples - LONGEST) * self.interval)

    def slowest(self, amplitude: float) -> float:
        """Period (s) of the slowest wave that counts beside an amplitude of x (m) and beside the others; or 0."""
        return 1.0 / min(counts) if (counts := self._counting(amplitude)) else 0.0

    def beat(self, amplitude: float = 0.0) -> float:
        """Period (s) of the slowest wave, or of the slowest beat of one that counts with a multiple of another."""
        return _beat(self._counting(amplitude))

    def _counting(self, amplitude: float) -> tuple[float, ...]:
        """Frequencies (Hz) of the waves that count beside an amplitude of x (m) and beside the others."""
        least = max([amplitude, *(swing for _, swing in self.context.waves)])
        return tuple([f for f, swing in self.context.waves if swing >= self.limits.settled_within * least])

    @cached_property
    def _before(self) -> Floats:
        """Level of vx and amplitude of x in the third quarter, over those in the last one."""
        before = Stretch(self.history, self.half, 3 * self.samples // 4)
        sizes = np.array([before.deviation("vx"), before.amplitude("x")])
        return sizes / np.maximum([self.statistics.level, self.statistics.amplitude], 1e-300)

    def changes(self) -> float:
        """By which part vx or x, whichever does more so, swings otherwise in the last quarter than before."""
        return float(np.abs(self._before - 1.0).max())

    def drift(self) -> float:
        """Rate (1/s) at which vx or x, whichever does more so, changes from the third quarter to the last."""
        return float(np.abs(np.log(np.maximum(self._before, 1e-300))).max()) / (0.25 * self.duration)

    def powers(self) -> Powers:
        """Powers (W) that friction and the roughness give, with their errors, by the loop's account.

        What dashpots and scheme leave of both is nothing where the motion has settled.
        """
        begin = self.judged_from * self.interval
        energies = window_means(self.track.given(begin, self.judged.mean("friction_force")))
        powers = energies[:, :3] / energies[:, 3:]
        friction, roughness, stored = powers.mean(axis=0).tolist()
        friction_error, roughness_error, _ = (powers.std(axis=0) / 2.0).tolist()
        closing = abs(self.track.powers(begin, self.duration).closing)
        return {
            "power_of_friction": friction,
            "power_of_roughness": roughness,
            "power_stored": stored,
            "power_of_friction_error": max(friction_error, closing),
            "power_of_roughness_error": max(roughness_error, closing),
        }


@lru_cache(maxsize=4)  # the points of a sweep ask for the same ones
def _beat(counts: tuple[float, ...]) -> float:
    """Period (s) of the slowest of some waves (Hz), or of the slowest beat of one with a multiple of another."""
    slow = 1.0 / min(counts) if counts else 0.0
    beats = [abs(f - n * g) for f in counts for g in counts for n in range(1, MULTIPLES + 1)]
    return max([slow, *(1.0 / beat for beat in beats if beat * slow > 1e-3)])  # less is rounding


def answers(shown: Shown) -> Answers:
    """The record of answers; what the motion comes to is asked only where a row may need it."""
    context = shown.context
    statistics = shown.statistics
    exponent = shown.motion.exponent
    stands = context.belt_speed == 0.0
    record = Answers(
        failure=shown.motion.failure,
        duration=shown.duration,
        samples=shown.samples,
        few_samples=shown.samples < FEWEST_SAMPLES,
        constant_speed_and_load=context.steady,
        wheel_stands=stands,
        waves=bool(context.forced),
        frictionless=context.frictionless,
        undamped=context.undamped,
        locking_friction=math.nan if context.locks is None else context.locks,
        held_by_link=context.held_by_link,
        never_touched=shown.stays(ContactState.SEPARATED, 0),
        contact_lost=shown.stays(ContactState.SEPARATED, shown.half),
        contact_left=shown.stays(ContactState.SEPARATED, shown.quarter),
        carried_along=shown.stays(ContactState.STICK, shown.quarter if stands else shown.half),
    )
    if exponent is not None:
        record = record._replace(
            lyapunov_exponent=exponent.rate,
            lyapunov_by_line=exponent.even,
            lyapunov_by_line_error=exponent.even_error,
        )
    if shown.brief:
        return record
    record = record._replace(
        moves=statistics.largest_level > context.quiet,
        slowest_wave_period=shown.slowest(statistics.swing),
        level_change=statistics.change,
        level_change_error=statistics.change_error,
        amplitude=statistics.amplitude,
        level=statistics.level,
        settled=statistics.settled_from > 0,
        settled_duration=(shown.samples - shown.judged_from) * shown.interval,
    )
    if exponent is not None:
        drift = 0.0 if record.settled else shown.drift()
        passing = 0.0 if _lasts(shown, record) else max(exponent.rate, 0.0)  # what grows on the way only
        record = record._replace(lyapunov_error=math.hypot(exponent.error, drift, passing))
    theory = shown.linear
    if theory is None:
        return _with_more(record, shown)
    record = record._replace(linear=True, ringing_frequency=theory.mode.frequency)
    if math.isfinite(theory.known_to):  # otherwise only neighbours tell
        record = record._replace(growth_rate=theory.mode.growth, growth_rate_error=theory.known_to)
    if theory.direction > 0:
        limit = theory.seconds_to_limit(*shown.end)
        record = record._replace(time_to_limit=limit, steadier=context.steadier())
    return record


def of_fate(fate: Fate) -> WithoutWaves:
    """The answers about what a motion comes to on the smooth wheel."""
    if fate.lasts is None:
        return {}
    if (orbit := fate.orbit) is None:
        return {"without_waves": Continuation.LASTS if fate.lasts else Continuation.DIES}
    return {
        "without_waves": Continuation.LASTS,
        "amplitude_without_waves": orbit.amplitude,
        "level_without_waves": orbit.level,
        "rate_without_waves": math.nan if fate.rate is None else fate.rate,
        "period_without_waves": orbit.period,
        "sticks_without_waves": float(orbit.word.count(STICK)) if orbit.word else math.nan,
    }


def _lasts(shown: Shown, record: Answers) -> bool:
    """Whether disturbances will grow as they do: they fade from a linear motion, or the level surely stays."""
    theory = shown.linear
    fades = theory is not None and theory.direction < 0
    return fades or abs(record.level_change) <= shown.limits.sure_errors * record.level_change_error


def _with_more(record: Answers, shown: Shown) -> Answers:
    """The record with what has to be known of a motion that is not linear."""
    context = shown.context
    record = record._replace(growth_rate=context.growth())
    if not context.frictionless:
        record = record._replace(**of_fate(shown.fate))
    if record.waves:
        record = record._replace(**shown.powers(), touches_in_sliding=context.touches())
    if cycles := shown.cycles:
        record = record._replace(
            cycles=cycles.evidence["cycles"],
            samples_per_cycle=cycles.evidence["samples_per_cycle"],
            stick_cycles=cycles.evidence["stick_cycles"],
            harmonic_share=cycles.evidence["harmonic_share"],
            frequency=cycles.frequency,
        )
        if cycles.evidence["frequency_spread"] <= shown.limits.settled_within * cycles.frequency:
            record = record._replace(band_share=shown.judged.narrow())
        if not record.waves and record.without_waves is Continuation.LASTS and shown.fate.orbit is None:
            late = cycles.sizes[len(cycles.sizes) // 2 :]  # the level may settle before what modulates it
            turns = turns_per_cycle(late, shown.limits.settled_within)
            record = record._replace(frequency_of_modulation=turns * cycles.frequency)
        if context.step:
            record = record._replace(steps_per_cycle=1.0 / (cycles.frequency * context.step))
    return record
