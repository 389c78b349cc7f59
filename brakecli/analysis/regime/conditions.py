"""What the rows of the table ask of the answers, where more than one asks it or it takes more than a line."""

import math

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.decision import Thresholds


def steady(a: Answers, t: Thresholds) -> bool:
    """The level does not change, but for chance."""
    return abs(a.change) <= max(t.sure_errors * a.change_error, 2.0 * t.settled_within)


def _neighbours(a: Answers, t: Thresholds) -> tuple[float, float]:
    """Powers of e by which neighbours change in half of the run, with `sure_errors` of their error.

    A line through the logarithms knows them better where they swing, and worse where they wander: it counts where
    the growth itself lies within its error of it.
    """
    rate = a.exponent
    error = a.exponent_error
    if math.isfinite(error) and a.even_error < error and abs(a.even - rate) <= error:
        rate = a.even
        error = a.even_error
    return a.powers(rate), t.sure_errors * a.powers(error)


def together(a: Answers, t: Thresholds) -> bool:
    """Neighbours of the motion come together."""
    powers, error = _neighbours(a, t)
    return powers < -max(t.comes_together, error)


def apart(a: Answers, t: Thresholds) -> bool:
    """Neighbours do not come together: the motion has a phase of its own.

    That they do so is excluded by more than `comes_together`; the exponent of a quasi-periodic motion is 0.
    """
    powers, error = _neighbours(a, t)
    return powers >= -error and powers - error > -t.comes_together


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
    """Friction surely gives energy, whether dashpots take it or it is stored as the motion grows.

    Where the waves surely take energy from a level that stays, nothing but friction is left to give it.
    """
    alone = steady(a, t) and a.power_of_roughness < -t.sure_errors * a.roughness_error
    return alone or a.power_of_friction > t.sure_errors * a.friction_error


def takes(a: Answers, t: Thresholds) -> bool:
    """Friction surely takes energy: more than is set free as the motion falls."""
    return a.power_of_friction + abs(a.power_left) < -t.sure_errors * a.friction_error


def friction_gives_most(a: Answers, t: Thresholds) -> bool:
    """Friction gives most of the energy, also of what is stored or set free."""
    friction = a.power_of_friction, a.friction_error
    return _gives_most(friction, (a.power_of_roughness, a.roughness_error), a.power_left, t)


def friction_gives_less(a: Answers, t: Thresholds) -> bool:
    """Nothing shows that friction gives most of the energy, and no energy comes from elsewhere.

    Powers balance, or dashpots take more than both give: what falls so is kept up by nothing.
    """
    return (balances(a, t) or a.power_left < 0.0) and not friction_gives_most(a, t)


def roughness_is_idle(a: Answers, t: Thresholds) -> bool:
    """The waves neither give energy nor take it, but for a part that is lost in a settled level."""
    error = t.sure_errors * math.hypot(a.roughness_error, t.settled_within * a.friction_error)
    lost = t.settled_within * (a.power_of_friction - abs(a.power_left))
    return abs(a.power_of_roughness) + error < lost


def roughness_gives_most(a: Answers, t: Thresholds) -> bool:
    """The waves give most of the energy, also of what is stored or set free."""
    roughness = a.power_of_roughness, a.roughness_error
    return _gives_most(roughness, (a.power_of_friction, a.friction_error), a.power_left, t)


def _gives_most(one: tuple[float, float], other: tuple[float, float], left: float, t: Thresholds) -> bool:
    """One gives surely more than `most` times what the other gives and what is left; powers (W) with their errors.

    What surely takes energy gives none, and has no error as a giver.
    """
    power, error = one
    beside, doubt = other
    given = max(beside, 0.0)
    may_give = max(beside + t.sure_errors * doubt, 0.0) - given
    return power - t.most * given > math.hypot(t.sure_errors * error, t.most * may_give) + t.most * abs(left)


def balances(a: Answers, t: Thresholds) -> bool:
    """Dashpots and scheme take what friction and the roughness give, within its error, or the level changes.

    A level that is called settled may change by a part of itself, and what is stored with it.
    """
    error = t.sure_errors * math.hypot(a.friction_error, a.roughness_error)
    drift = t.settled_within * max(abs(a.power_of_friction), abs(a.power_of_roughness))
    return abs(a.power_left) <= max(error, drift) or (not steady(a, t) and math.isfinite(a.power_left))


def regular(a: Answers, t: Thresholds) -> bool:
    """The energy is on one line and its multiples, or in few narrow bands."""
    return a.harmonic_share >= t.harmonic_share or a.band_share >= t.band_share


def decays(a: Answers, t: Thresholds) -> bool:
    """Disturbances decay."""
    rate, error = a.rate(t.sure_errors)
    return rate < -error


def grows(a: Answers, t: Thresholds) -> bool:
    """Disturbances grow."""
    rate, error = a.rate(t.sure_errors)
    return rate > error
