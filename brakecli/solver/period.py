"""The time after which all waves of the wheel repeat: the period of a motion that they force."""

import math
from fractions import Fraction

from brakecli.solver.system import System

LONGEST = 10.0  # s, of a period that is worth computing


def common_period(system: System) -> float | None:
    """The time (s) after which all waves of the wheel repeat; None where there is none, or none short enough."""
    turns = system.wheel.turns
    belt = abs(system.belt_speed)
    if belt == 0.0 or not turns.size:
        return None
    ratios = [Fraction(turn / turns[0]).limit_denominator(10**6) for turn in turns.tolist()]
    if any(abs(float(ratio) * turns[0] - turn) > 1e-15 * turn for ratio, turn in zip(ratios, turns, strict=True)):
        return None
    common = math.gcd(*(ratio.numerator for ratio in ratios)) / math.lcm(*(ratio.denominator for ratio in ratios))
    period = 1.0 / (turns[0] * common * belt) if common > 0.0 else math.inf
    return float(period) if period <= LONGEST else None
