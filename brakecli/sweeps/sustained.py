"""Whether a vibration beside steady sliding lasts or dies out, by the verdict on a run of it."""

import math

from brakecli.analysis.regime.verdict import Regime, Verdict
from brakecli.analysis.stability.modes import growth as eigenvalue_growth
from brakecli.analysis.stability.modes import is_undamped, slowest_of_cycles
from brakecli.sweeps.early import Known
from brakecli.sweeps.growth import Sliding

STEADY = 0.01  # relative change of the amplitude in a run twice as long that shows that a vibration lasts


def lasting(answer: bool, before: Verdict | Known | None, verdict: Verdict | Known, linear: bool) -> bool:
    """Whether the answer of a run beside stable sliding is that of a longer one, too.

    It is once the shoe has come to rest or moves by `linear` equations, where its orbit is known, and where the
    vibration is the same as in a run half as long.
    """
    if isinstance(verdict, Known):
        return True
    if answer:
        free = verdict.stick_fraction + verdict.contact_loss_fraction == 0.0
        return verdict.regime is Regime.DAMPED or (linear and free)
    if before is None or before.regime is not verdict.regime:
        return False
    return abs(before.amplitude - verdict.amplitude) <= STEADY * verdict.amplitude


def fades_linearly(steady: Sliding) -> bool:
    """Whether a motion that neither sticks nor lifts off follows linear equations, by which it does not grow."""
    c, k = steady.system.coefficients, steady.stiffness
    return not (steady.opens or steady.forced) and eigenvalue_growth(c, k, steady.grip) <= 0.0


def settling(steady: Sliding | None) -> float:
    """The rate (1/s) at which vibration beside stable sliding dies out or settles, at most; else infinite."""
    if steady is None or is_undamped(c := steady.system.coefficients):
        return math.inf
    own = eigenvalue_growth(c, steady.stiffness, steady.grip)
    return min(-own, slowest_of_cycles(c)) if own < 0.0 else math.inf


def verdict_fades(
    verdict: Verdict | Known | None, duration: float, unstable: bool | None, linear: bool, rate: float
) -> bool | None:
    """Whether the vibration of a run dies out; None where the run does not answer that.

    `unstable`: what is known of steady sliding. Where it is unstable no vibration can die out. A `linear` motion
    that neither sticks nor lifts off is on its way by the same equations: it lasts if sliding is unstable. One
    that does fades if it loses a factor e in its `duration` (s); as long as it loses less, nobody knows. One that
    keeps its amplitude, or grows, lasts if it had the time to change at its `rate` (1/s).
    """
    if verdict is None or verdict.contact_loss_fraction == 1.0 or verdict.stick_fraction == 1.0:
        return None
    linear &= verdict.stick_fraction + verdict.contact_loss_fraction == 0.0
    if unstable or (unstable is False and linear):
        return not unstable
    if verdict.regime is not Regime.UNDECIDED:
        return verdict.regime is Regime.DAMPED
    slope, error = (verdict.evidence.get(f"envelope_slope{what}", 0.0) for what in ("", "_error"))
    slope = slope if abs(slope) > 3.0 * error else 0.0
    if isinstance(verdict, Verdict) and verdict.decision.second_run:  # the roughness may keep it up as well
        return True if slope < 0.0 and linear else None
    if slope < 0.0:
        return True if linear or slope * duration < -1.0 else None
    kept = not linear or slope > 0.0
    return False if kept and rate * (duration - verdict.settled_from) >= 1.0 else None
