"""What the rows of the table ask of the answers, where more than one asks it or it takes more than a line."""

import math

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.decision import Thresholds


def steady(a: Answers, t: Thresholds) -> bool:
    """The level does not change, but for chance."""
    return abs(a.change) <= max(t.sure_errors * a.change_error, 2.0 * t.settled_within)


def together(a: Answers, t: Thresholds) -> bool:
    """Neighbours of the motion come together."""
    return a.powers(a.exponent) < -max(t.comes_together, t.sure_errors * a.powers(a.exponent_error))


def apart(a: Answers, t: Thresholds) -> bool:
    """Nothing shows that neighbours come together, however slowly: the motion may have a phase of its own."""
    return a.exponent >= -t.sure_errors * a.exponent_error


def same(a: Answers, t: Thresholds) -> bool:
    """The motion has the level that it would have on the smooth wheel."""
    return abs(a.level - a.level_without_waves) <= t.same_level * a.level_without_waves


def another(a: Answers, t: Thresholds) -> bool:
    """It has another level than it would come to on the smooth wheel."""
    return math.isfinite(a.level_without_waves) and not same(a, t)


def comes_to_it(a: Answers, t: Thresholds) -> bool:
    """What it will look like is how the limit cycle of the smooth wheel looks, and not yet its own cycles."""
    return not a.waves or not steady(a, t)


def gives(a: Answers, t: Thresholds) -> bool:
    """Friction surely gives energy."""
    return a.power_of_friction > t.sure_errors * a.friction_error


def friction_gives_most(a: Answers, t: Thresholds) -> bool:
    """Friction gives most of the energy."""
    error = math.hypot(a.friction_error, t.most * a.roughness_error)
    return a.power_of_friction - t.most * max(a.power_of_roughness, 0.0) > t.sure_errors * error


def roughness_gives_most(a: Answers, t: Thresholds) -> bool:
    """The waves give most of the energy."""
    error = math.hypot(a.roughness_error, t.most * a.friction_error)
    return a.power_of_roughness - t.most * max(a.power_of_friction, 0.0) > t.sure_errors * error


def regular(a: Answers, t: Thresholds) -> bool:
    """The energy is on one line and its multiples, or in few narrow bands."""
    return a.harmonic_share >= t.harmonic_share or a.band_share >= t.band_share


def takes(a: Answers, t: Thresholds) -> bool:
    """Friction surely takes energy."""
    return a.power_of_friction < -t.sure_errors * a.friction_error


def decays(a: Answers, t: Thresholds) -> bool:
    """Disturbances decay."""
    rate, error = a.rate(t.sure_errors)
    return rate < -error


def grows(a: Answers, t: Thresholds) -> bool:
    """Disturbances grow."""
    rate, error = a.rate(t.sure_errors)
    return rate > error
