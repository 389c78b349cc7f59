"""What a verdict says, and what of the case it goes by; `rules` finds it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple

from brakecli.analysis.regime.evidence import Part

if TYPE_CHECKING:  # a measured signal needs no compiled code
    from brakecli.analysis.regime.linear import Linear
    from brakecli.analysis.regime.ripple import Ripple
    from brakecli.analysis.stability.modes import Mode


class Regime(StrEnum):
    """The paper's three regimes, and `undecided`."""

    DAMPED = "damped"
    RELAXATION = "relaxation"
    QUASI_HARMONIC = "quasi-harmonic"
    UNDECIDED = "undecided"


class Excitation(StrEnum):
    """Where the energy of a sustained motion comes from."""

    SELF_EXCITED = "self-excited"
    FORCED = "forced"
    NONE = "none"


@dataclass(frozen=True)
class Thresholds:
    """The thresholds of docs/regimes.md, which every verdict carries."""

    decayed_to: float = 0.02
    settled_within: float = 0.05
    reach_within: float = 0.02
    trend_errors: float = 3.0
    fewest_cycles: float = 10.0
    samples_per_cycle: float = 8.0
    stick_cycles: float = 0.8
    harmonic_share: float = 0.8
    forced_share: float = 0.8


class Feeds(StrEnum):
    """What gives energy to the vibration on a rough wheel."""

    FRICTION = "friction"
    ROUGHNESS = "roughness"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Context:
    """What is known of the case behind a history."""

    belt_speed: float  # U, m/s
    steady: bool = True  # whether U and Q are constant
    forced: tuple[float, ...] = ()  # Hz, lines of the roughness
    subharmonics: Callable[[], tuple[float, ...]] = tuple  # Hz, further lines that a pad that opens may add
    waves: tuple[tuple[float, float], ...] = ()  # Hz and m: passing frequency, and the swing of x that it forces
    quiet: float = 0.0  # m/s, size of vx that may come from rounding
    scale: float = math.inf  # m/s, of a motion that would open the contact
    frictionless: bool = False
    undamped: bool = False
    held: bool = True  # whether a link holds the shoe along the wheel
    locks: float | None = None  # friction coefficient from which the shoe locks itself, where its own is larger
    touches: Callable[[], bool] = lambda: True  # whether the shoe touches the wheel where it slides steadily
    settles: float = math.inf  # 1/s: the slowest disturbance of a limit cycle without stick decays no faster
    growth: Callable[[], float] = lambda: 0.0  # 1/s, of a small disturbance of steady sliding; below 0 it decays
    modes: Callable[[], list["Mode"]] = list  # of small vibrations
    linear: Callable[[], "Linear | None"] = lambda: None  # the theory of full contact
    steadier: Callable[[], str] = str  # what to do where the steps damp what grows in theory; empty if they do not
    ripple: Callable[[Part, Sequence[float]], "Ripple | None"] = lambda part, lines: None  # of the nodes
    detuned: Callable[[Part, Sequence[float]], float] = lambda part, lines: 0.0  # part of a forced amplitude
    powers: Callable[[Part], dict[str, float]] = lambda part: {}  # W, what becomes of the power of the belt
    radius: float = 1.0  # R, m
    step: float = 0.0  # s; 0 where steps are chosen to keep an error
    feeds: Feeds = Feeds.UNKNOWN  # what a second run has shown
    sticks: float = 0.0  # part of the cycles that stick in a second run without roughness

    @property
    def pattern(self) -> float:
        """Time (s) until the strong waves repeat: a turn or a part of it if they are orders, or the longest."""
        strong = 0.01 * max((swing for _, swing in self.waves), default=0.0)
        passing = [frequency for frequency, swing in self.waves if swing > strong]
        turns = abs(self.belt_speed) / (2.0 * math.pi * self.radius)
        orders = [round(each / turns) for each in passing]
        whole = all(math.isclose(each, order * turns) for each, order in zip(passing, orders, strict=True))
        slowest = turns * math.gcd(*orders) if whole else min(passing)
        return 1.0 / slowest if passing else 0.0


SECOND_RUN = "decide by a second run, at some four times the cost: brakecli classify RESULT.h5 --second-run"


class Decision(NamedTuple):
    """What a rule decides, and why."""

    reason: str
    regime: Regime = Regime.UNDECIDED
    excitation: Excitation = Excitation.NONE
    frequency: float | None = None  # Hz
    stick_fraction: float | None = None
    advice: str = ""  # what to do
    second_run: bool = False  # whether a second run may decide, too

    @property
    def sentence(self) -> str:
        """The reason, and what to do."""
        ways = [self.advice] * bool(self.advice) + [SECOND_RUN] * self.second_run
        return f"{self.reason}; {', or '.join(ways)}" if ways else self.reason


@dataclass(frozen=True)
class Verdict:
    """The regime of a history, its numbers (SI units) over the settled part, and the reasons in plain words."""

    regime: Regime
    excitation: Excitation
    frequency: float | None  # Hz, fundamental of vx when sustained
    amplitude: float  # m, half of peak to peak of x: median over the cycles
    amplitude_spread: float | None  # m, of the amplitudes of the cycles
    amplitude_forced: float | None  # m, on a rough wheel: what the roughness forces
    amplitude_own: float | None  # m, on a rough wheel: what the shoe adds
    growth_rate: float | None  # 1/s, of the slowest mode where the motion is linear
    ringing_frequency: float | None  # Hz, of that mode
    frequency_resolution: float  # Hz, to which a line of the spectrum is known
    torque_variation: float | None  # N m, peak to peak
    settled_from: float  # s; the middle where no settled part was found
    start: int  # the sample there
    settled: bool  # whether a settled part was found
    stick_fraction: float
    contact_loss_fraction: float
    mean_friction_force: float  # N
    braking_torque: float  # N m, its mean torque on the wheel's axis, R F_x
    decision: Decision
    notes: dict[str, str]  # on single numbers, by their names
    evidence: dict[str, Any]
    thresholds: Thresholds

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the regime is as it is, and the notes."""
        return self.decision.sentence, *self.notes.values()
