"""The verdict on a history: what the table decides, with the numbers of what lasts."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.closed import Lasting
from brakecli.analysis.regime.context import Context
from brakecli.analysis.regime.decision import Decision, Excitation, Regime, Thresholds
from brakecli.analysis.regime.lasting import lasting
from brakecli.analysis.regime.measure import Given, Shown, answers
from brakecli.analysis.regime.seen import seen
from brakecli.analysis.regime.table import decide
from brakecli.analysis.regime.verdict import Verdict, of_orbit
from brakecli.analysis.spectrum import segment
from brakecli.solver.quantities import ContactState

_DEFAULT = Thresholds()


def classify(given: Sequence[Given], thresholds: Thresholds = _DEFAULT, *, in_full: bool = True) -> list[Verdict]:
    """The regimes of histories by the table of docs/regimes.md; no number of one depends on the others.

    Where not `in_full`, evidence and numbers that a sweep does not keep are left out; all others are the same.
    """
    return verdicts(look(given, thresholds), in_full=in_full)


def look(given: Sequence[Given], thresholds: Thresholds = _DEFAULT) -> list[Shown]:
    """What histories show; where that is not `enough`, `verdicts` has to have another run of the same motion."""
    looked = seen([each.history for each in given], thresholds.settled_within)
    return [Shown(*each, thresholds) for each in zip(given, looked, strict=True)]


def verdicts(shown: Sequence[Shown], *, in_full: bool = True) -> list[Verdict]:
    """The verdicts on what histories show."""
    found = [answers(each) for each in shown]
    decisions = [decide(answer, each.limits) for answer, each in zip(found, shown, strict=True)]
    numbers = lasting(shown, found, decisions, in_full=in_full)
    return [_verdict(*each, in_full=in_full) for each in zip(shown, found, decisions, numbers, strict=True)]


def _verdict(shown: Shown, found: Answers, decision: Decision, what: Lasting, *, in_full: bool) -> Verdict:
    """The verdict on one history."""
    part = what.part
    radius = shown.context.radius
    cycles = what.cycles
    look = shown.seen
    moves = not found.few_samples and found.moves and look.largest_level > 0.0  # velocities may all be 0
    if decision.excitation is Excitation.SELF_EXCITED and cycles:
        decision = decision._replace(frequency=what.frequency)
        found = found._replace(frequency=what.frequency or math.nan)
    evidence: dict[str, Any] = {"row": decision.row}
    if in_full:
        evidence |= found.known() | what.evidence | _further(shown, what, shown.context)
    theory = shown.linear if found.linear else None
    verdict = Verdict(
        amplitude=what.amplitude,
        amplitude_first=look.first if decision.regime is Regime.DAMPED else None,
        amplitude_spread=what.spread,
        amplitude_forced=what.forced,
        amplitude_own=what.own,
        forced_frequency=what.forced_frequency,
        left=look.final_level / look.largest_level if moves else 0.0,
        growth_rate=found.own if theory and math.isfinite(found.own) else None,
        ringing_frequency=theory.mode.frequency if theory else None,
        frequency_resolution=1.0 / (segment(part.stop - part.start) * shown.interval),
        lyapunov_exponent=found.lyapunov_exponent if math.isfinite(found.lyapunov_error) else None,
        lyapunov_error=found.lyapunov_error if math.isfinite(found.lyapunov_error) else None,
        torque_variation=radius * what.variation if what.variation is not None else None,
        settled_from=part.start * shown.interval,
        start=part.start,
        longer=what.force_rings is not None or (what.longer and not what.settled),
        settled=what.settled and decision.regime is not Regime.UNDECIDED,
        stick_fraction=cycles.stick_fraction if cycles else shown.fraction(ContactState.STICK, part),
        contact_loss_fraction=cycles.contact_loss_fraction
        if cycles
        else shown.fraction(ContactState.SEPARATED, part),
        mean_friction_force=what.mean_force,
        braking_torque=radius * what.mean_force,
        decision=decision,
        notes={about: note for about, note in what.notes.items() if note},
        evidence=evidence,
        thresholds=shown.limits,
    )
    return replace(verdict, **of_orbit(what.orbit, radius)) if what.orbit else verdict


def _further(shown: Shown, what: Lasting, context: Context) -> dict[str, Any]:
    """Evidence on the settled part that no row needs."""
    part = what.part
    belt = context.belt_speed
    evidence: dict[str, Any] = {f"amplitude_{name}": part.amplitude(name) for name in ("y", "vx", "vy")}
    if belt != 0.0:
        evidence["largest_vx_over_belt_speed"] = part.extremes("vx")[int(belt > 0.0)] / belt
    if context.steady:
        evidence |= shown.track.account(part.start * shown.history.interval)
    return evidence | part.lines(context.forced, context.quiet)
