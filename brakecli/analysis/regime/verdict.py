"""What a verdict says, of a run, of a point of a sweep, and in Python."""

from dataclasses import dataclass, field
from typing import Any, TypedDict

from brakecli.analysis.regime.decision import Decision, Excitation, Regime, Thresholds
from brakecli.solver.motion.flow import Orbit


@dataclass(frozen=True)
class Verdict:
    """The regime of a motion, its numbers (SI units) over the settled part, and the reasons in plain words."""

    decision: Decision
    amplitude: float  # m, half of peak to peak of x: median over the cycles, or what is left at the end
    stick_fraction: float
    contact_loss_fraction: float
    mean_friction_force: float  # N
    braking_torque: float  # N m, its mean torque on the wheel's axis, R F_x
    settled_from: float  # s; the middle where no settled part was found
    settled: bool  # whether the numbers are those of any longer run
    evidence: dict[str, Any]
    start: int = 0  # the sample from which on the numbers are taken
    amplitude_first: float | None = None  # m, of a damped motion: in the first tenth of the run
    amplitude_spread: float | None = None  # m, of the amplitudes of the cycles
    amplitude_forced: float | None = None  # m, on a rough wheel: what the roughness forces
    amplitude_own: float | None = None  # m, on a rough wheel: what the shoe adds
    forced_frequency: float | None = None  # Hz, of the wave that moves x most
    longer: bool = False  # whether a longer run may say more of the numbers of what lasts
    remaining: float = 0.0  # of the level of vx at its highest, in the last quarter
    growth_rate: float | None = None  # 1/s, of the slowest mode where the motion is linear
    ringing_frequency: float | None = None  # Hz, of that mode
    frequency_resolution: float | None = None  # Hz, to which a line of the spectrum is known
    torque_variation: float | None = None  # N m, peak to peak
    lyapunov_exponent: float | None = None  # 1/s, at which disturbances of a motion that lasts grow
    lyapunov_error: float | None = None  # 1/s
    notes: dict[str, str] = field(default_factory=dict)  # on single numbers, by their names
    thresholds: Thresholds = field(default_factory=Thresholds)

    @property
    def regime(self) -> Regime:
        """How the motion looks, or `damped`."""
        return self.decision.regime

    @property
    def excitation(self) -> Excitation:
        """Where its energy comes from."""
        return self.decision.excitation

    @property
    def frequency(self) -> float | None:
        """Fundamental frequency of vx of a motion that lasts, Hz."""
        return self.decision.frequency

    @property
    def unfinished(self) -> bool:
        """Whether a longer run may say more of the regime, or of numbers that last."""
        if self.regime is Regime.UNDECIDED:
            return self.decision.longer
        if self.excitation is Excitation.NONE:
            return not self.settled and self.remaining > 0.01  # less is nothing any more
        return self.longer

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the regime is as it is, and the notes."""
        return self.decision.sentence, *self.notes.values()


class OfOrbit(TypedDict):
    """The numbers of a verdict on a motion that has come to an orbit."""

    amplitude: float
    stick_fraction: float
    contact_loss_fraction: float
    mean_friction_force: float
    braking_torque: float


def of_orbit(orbit: Orbit, radius: float) -> OfOrbit:
    """The numbers of a verdict on a motion that has come to an orbit; radius in m."""
    return {
        "amplitude": orbit.amplitude,
        "stick_fraction": orbit.stick_fraction,
        "contact_loss_fraction": orbit.contact_loss_fraction,
        "mean_friction_force": orbit.mean_force,
        "braking_torque": radius * orbit.mean_force,
    }
