"""What a verdict says."""

from dataclasses import dataclass
from typing import Any

from brakecli.analysis.regime.table import Decision, Excitation, Regime, Thresholds


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
