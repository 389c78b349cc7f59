"""What the rows of the table ask of the answers, where more than one asks it or it takes more than a line."""

import math

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.decision import Thresholds


def steady(motion: Answers, limits: Thresholds) -> bool:
    """The level does not change, but for chance."""
    return abs(motion.level_change) <= max(
        limits.sure_errors * motion.level_change_error, 2.0 * limits.settled_within
    )


def _neighbours(motion: Answers, limits: Thresholds) -> tuple[float, float]:
    """Powers of e by which neighbours change in half of the run, with `sure_errors` of their error.

    A line through the logarithms knows them better where they swing, and worse where they wander: it counts where
    the growth itself lies within its error of it.
    """
    rate = motion.lyapunov_exponent
    error = motion.lyapunov_error
    if (
        math.isfinite(error)
        and motion.lyapunov_by_line_error < error
        and abs(motion.lyapunov_by_line - rate) <= error
    ):
        rate = motion.lyapunov_by_line
        error = motion.lyapunov_by_line_error
    return motion.powers(rate), limits.sure_errors * motion.powers(error)


def together(motion: Answers, limits: Thresholds) -> bool:
    """Neighbours of the motion come together."""
    powers, error = _neighbours(motion, limits)
    return powers < -max(limits.comes_together, error)


def apart(motion: Answers, limits: Thresholds) -> bool:
    """Neighbours do not come together: the motion has a phase of its own.

    That they do so is excluded by more than `comes_together`; the exponent of a quasi-periodic motion is 0.
    """
    powers, error = _neighbours(motion, limits)
    return powers >= -error and powers - error > -limits.comes_together


def same(motion: Answers, limits: Thresholds) -> bool:
    """The motion has the level that it would have on the smooth wheel."""
    return abs(motion.level - motion.level_without_waves) <= limits.same_level * motion.level_without_waves


def another(motion: Answers, limits: Thresholds) -> bool:
    """It has another level than it would come to on the smooth wheel."""
    return math.isfinite(motion.level_without_waves) and not same(motion, limits)


def comes_to_it(motion: Answers, limits: Thresholds) -> bool:
    """What it will look like is how the limit cycle of the smooth wheel looks, and not yet its own cycles."""
    return not motion.waves or not steady(motion, limits)


def gives(motion: Answers, limits: Thresholds) -> bool:
    """Friction surely gives energy, whether dashpots take it or it is stored as the motion grows.

    Where the waves surely take energy from a level that stays, nothing but friction is left to give it.
    """
    alone = (
        steady(motion, limits)
        and motion.power_of_roughness < -limits.sure_errors * motion.power_of_roughness_error
    )
    return alone or motion.power_of_friction > limits.sure_errors * motion.power_of_friction_error


def takes(motion: Answers, limits: Thresholds) -> bool:
    """Friction surely takes energy: more than is set free as the motion falls."""
    return (
        motion.power_of_friction + abs(motion.power_stored) < -limits.sure_errors * motion.power_of_friction_error
    )


def friction_gives_most(motion: Answers, limits: Thresholds) -> bool:
    """Friction gives most of the energy, also of what is stored or set free."""
    friction = motion.power_of_friction, motion.power_of_friction_error
    return _gives_most(
        friction, (motion.power_of_roughness, motion.power_of_roughness_error), motion.power_stored, limits
    )


def friction_gives_less(motion: Answers, limits: Thresholds) -> bool:
    """Nothing shows that friction gives most of the energy, and no energy comes from elsewhere.

    Powers balance, or dashpots take more than both give: what falls so is kept up by nothing.
    """
    return (balances(motion, limits) or motion.power_stored < 0.0) and not friction_gives_most(motion, limits)


def roughness_is_idle(motion: Answers, limits: Thresholds) -> bool:
    """The waves neither give energy nor take it, but for a part that is lost in a settled level."""
    error = limits.sure_errors * math.hypot(
        motion.power_of_roughness_error, limits.settled_within * motion.power_of_friction_error
    )
    lost = limits.settled_within * (motion.power_of_friction - abs(motion.power_stored))
    return abs(motion.power_of_roughness) + error < lost


def roughness_gives_most(motion: Answers, limits: Thresholds) -> bool:
    """The waves give most of the energy, also of what is stored or set free."""
    roughness = motion.power_of_roughness, motion.power_of_roughness_error
    return _gives_most(
        roughness, (motion.power_of_friction, motion.power_of_friction_error), motion.power_stored, limits
    )


def _gives_most(one: tuple[float, float], other: tuple[float, float], stored: float, limits: Thresholds) -> bool:
    """One gives surely more than `most` times what the other gives and what is left; powers (W) with their errors.

    What surely takes energy gives none, and has no error as a giver.
    """
    power, error = one
    beside, doubt = other
    power_beside = max(beside, 0.0)
    may_give = max(beside + limits.sure_errors * doubt, 0.0) - power_beside
    return power - limits.most * power_beside > math.hypot(
        limits.sure_errors * error, limits.most * may_give
    ) + limits.most * abs(stored)


def balances(motion: Answers, limits: Thresholds) -> bool:
    """Dashpots and scheme take what friction and the roughness give, within its error, or the level changes.

    A level that is called settled may change by a part of itself, and what is stored with it.
    """
    error = limits.sure_errors * math.hypot(motion.power_of_friction_error, motion.power_of_roughness_error)
    drift = limits.settled_within * max(abs(motion.power_of_friction), abs(motion.power_of_roughness))
    return abs(motion.power_stored) <= max(error, drift) or (
        not steady(motion, limits) and math.isfinite(motion.power_stored)
    )


def regular(motion: Answers, limits: Thresholds) -> bool:
    """The energy is on one line and its multiples, or in few narrow bands."""
    return motion.harmonic_share >= limits.harmonic_share or motion.band_share >= limits.band_share


def decays(motion: Answers, limits: Thresholds) -> bool:
    """Disturbances decay."""
    rate, error = motion.rate(limits.sure_errors)
    return rate < -error


def grows(motion: Answers, limits: Thresholds) -> bool:
    """Disturbances grow."""
    rate, error = motion.rate(limits.sure_errors)
    return rate > error
