"""From which value of a parameter on vibration lasts from the case's own start."""

import math
from functools import cache
from typing import NamedTuple

from brakecli.analysis.branches.answers import Answers
from brakecli.analysis.branches.problem import Array
from brakecli.analysis.fate import Fate, Kind, fate
from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.stability.linear import linear_theory
from brakecli.analysis.stability.margin import between_known
from brakecli.analysis.stability.modes import is_undamped
from brakecli.case.case import Case, changed
from brakecli.case.system import system_of
from brakecli.solver.period import common_period
from brakecli.solver.steady_sliding import sliding
from brakecli.solver.system import System
from brakecli.studies.runs.limits import within_range
from brakecli.studies.sweeps.simulate import verdict_of
from brakecli.studies.sweeps.windows import Outcome, Search
from brakecli.studies.sweeps.windows_of_branch import calm

LASTS = Fate(Kind.VIBRATION)
FADES = Fate(Kind.STEADY_SLIDING)
UNKNOWN = Fate(Kind.UNKNOWN)


class Lasting(NamedTuple):
    """The least value, how the search for it has ended, and the vibration that was seen to last lowest down.

    `state`: x, y, v_x and v_y of that, at t = 0 of the waves, and `at` the value; None where no run showed one.
    """

    value: float | None
    outcome: Outcome
    state: Array | None = None
    at: float | None = None


def sustained(answers: Answers, tolerance: float, loss: Search) -> Lasting:
    """Look for the least value at which vibration lasts from the case's own start, as far as it lasts above it.

    From where stability is lost, as in `loss`, the search strides down, ever faster, and then narrows down by
    halves. Where sliding is known to be unstable, vibration lasts without a run. `answers` know the stable motions
    that a rough wheel forces and that are no vibrations.
    """
    line = answers.line
    low = line.low
    high = line.high

    @cache
    def end(value: float) -> Fate:
        return LASTS if loss.unstable_at(value) else _end(answers, value)

    def ended(value: float | None, outcome: Outcome) -> Lasting:
        shown = [at for at in tried if end(at).state is not None]
        return Lasting(value, outcome, end(min(shown)).state, min(shown)) if shown else Lasting(value, outcome)

    def lasts(value: float) -> bool | None:
        tried.add(value)
        return end(value).lasts

    tried = set[float]()
    just_below = math.nan
    if loss.outcome is Outcome.FOUND:
        # the bracket of a loss of stability may be far narrower than is asked here, and runs there take long
        just_below = low = max(low, loss.lower - 0.5 * tolerance)
        high = min(high, loss.upper)
        stride = tolerance
        while lasts(low) is not False and low > line.low:
            low, high = max(line.low, low - stride), low if lasts(low) else high
            stride *= 2.0
    if lasts(low) is None or lasts(high) is None:
        return ended(None, Outcome.UNDECIDED)
    if lasts(low):
        return ended(None, Outcome.SUSTAINED if lasts(high) else Outcome.IN_PART)
    if not lasts(high):
        return ended(None, Outcome.DAMPED)
    if low == just_below:  # vibration begins where stability is lost
        return ended(loss.value, Outcome.FOUND)
    # Right beside the value sought a vibration dies out, or settles, too slowly to be decided.
    [begun] = between_known(lasts, [low, high], tolerance)
    decided = begun.error <= tolerance
    return ended(begun.value, Outcome.FOUND) if decided else ended(None, Outcome.UNDECIDED)


def _end(answers: Answers, value: float) -> Fate:
    """What the case's own start comes to: by the flow of the equations, whatever scheme the case has.

    Runs of the case decide where no motion repeats, no dashpot damps, no link holds the shoe or the wheel rests,
    and where speed or load change.
    """
    case = answers.line.case_at(answers.line.place(value))
    with within_range():
        system = system_of(case)
    waves = bool(system.wheel.g.size)
    slides = system.belt_speed != 0.0 and system.natural_frequencies[0] > 0.0  # and links hold it
    repeats = system.steady and (not waves or common_period(system) is not None)
    if is_undamped(system.coefficients) or not (slides and repeats):
        return _by_runs(case, system)
    if (equilibrium := sliding(system)) is None:
        return UNKNOWN
    forced = calm(answers, value) if waves else None
    return fate(system, system.initial.beside((equilibrium.x, equilibrium.y)), forced=forced)


def _by_runs(case: Case, system: System) -> Fate:
    """Whether vibration lasts by the verdicts on runs of one to eight durations, each twice as long as the last.

    It does where the amplitude changes by a hundredth at most from one to the next.

    It is asked where sliding is not known to be unstable. So in full contact what neither sticks nor lifts off
    does not grow, as it is linear, and counts as fading; without dashpots it stays as it is.
    """
    theory = linear_theory(system, system.belt_speed)
    linear = theory is not None and not theory.opens
    # of the run before
    regime = Regime.UNDECIDED
    amplitude = math.inf
    for times in (1.0, 2.0, 4.0, 8.0):
        verdict = verdict_of(changed(case, solver={"duration": times * system.duration}))
        if verdict is None or verdict.contact_loss_fraction == 1.0 or verdict.stick_fraction == 1.0:
            break
        free = verdict.contact_loss_fraction == verdict.stick_fraction == 0.0
        if verdict.regime is Regime.DAMPED or (free and linear):
            return FADES
        alike = verdict.regime is regime is not Regime.UNDECIDED
        if alike and abs(amplitude - verdict.amplitude) <= 0.01 * verdict.amplitude:
            return LASTS
        regime = verdict.regime
        amplitude = verdict.amplitude
    return UNKNOWN
