"""The verdict on a history: what the table decides, with the numbers of what lasts."""

import math
from collections.abc import Sequence
from dataclasses import replace

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.context import Context
from brakecli.analysis.regime.decision import Decision, Excitation, Regime, Thresholds
from brakecli.analysis.regime.forced_linear import Lasting
from brakecli.analysis.regime.lasting import lasting
from brakecli.analysis.regime.measure import Given, Shown, answers
from brakecli.analysis.regime.statistics import statistics
from brakecli.analysis.regime.table import decide
from brakecli.analysis.regime.verdict import Verdict, of_orbit
from brakecli.analysis.spectrum import segment
from brakecli.solver.quantities import ContactState

_DEFAULT = Thresholds()


def classify(
    motions: Sequence[Given], thresholds: Thresholds = _DEFAULT, *, in_full: bool = True
) -> list[Verdict]:
    """The regimes of histories by the table of docs/regimes.md; no number of one depends on the others.

    Where not `in_full`, evidence and numbers that a sweep does not keep are left out; all others are the same.
    """
    return verdicts(look(motions, thresholds), in_full=in_full)


def look(motions: Sequence[Given], thresholds: Thresholds = _DEFAULT) -> list[Shown]:
    """What histories show; where that is not `enough`, `verdicts` has to have another run of the same motion."""
    looked = statistics([motion.history for motion in motions], thresholds.settled_within)
    return [Shown(*pair, thresholds) for pair in zip(motions, looked, strict=True)]


def verdicts(shown: Sequence[Shown], *, in_full: bool = True) -> list[Verdict]:
    """The verdicts on what histories show."""
    records = [answers(motion) for motion in shown]
    decisions = [decide(answer, motion.limits) for answer, motion in zip(records, shown, strict=True)]
    numbers = lasting(shown, records, decisions, in_full=in_full)
    return [_verdict(*row, in_full=in_full) for row in zip(shown, records, decisions, numbers, strict=True)]


def _verdict(shown: Shown, record: Answers, decision: Decision, what: Lasting, *, in_full: bool) -> Verdict:
    """The verdict on one history."""
    stretch = what.stretch
    radius = shown.context.radius
    cycles = what.cycles
    look = shown.statistics
    moves = not record.few_samples and record.moves and look.largest_level > 0.0  # velocities may all be 0
    if decision.excitation is Excitation.SELF_EXCITED and cycles:
        decision = decision._replace(frequency=what.frequency)
        record = record._replace(frequency=what.frequency or math.nan)
    evidence: dict[str, object] = {"row": decision.row}
    if in_full:
        evidence |= record.known() | what.evidence | _further(shown, what, shown.context)
    theory = shown.linear if record.linear else None
    verdict = Verdict(
        amplitude=what.amplitude,
        amplitude_first=look.first if decision.regime is Regime.DAMPED else None,
        amplitude_spread=what.spread,
        amplitude_forced=what.forced,
        amplitude_own=what.own,
        forced_frequency=what.forced_frequency,
        remaining=look.final_level / look.largest_level if moves else 0.0,
        growth_rate=record.own if theory and math.isfinite(record.own) else None,
        ringing_frequency=theory.mode.frequency if theory else None,
        frequency_resolution=1.0 / (segment(stretch.stop - stretch.start) * shown.interval),
        lyapunov_exponent=record.lyapunov_exponent if math.isfinite(record.lyapunov_error) else None,
        lyapunov_error=record.lyapunov_error if math.isfinite(record.lyapunov_error) else None,
        torque_variation=radius * what.variation if what.variation is not None else None,
        settled_from=stretch.start * shown.interval,
        start=stretch.start,
        longer=what.force_rings is not None or (what.longer and not what.settled),
        settled=what.settled and decision.regime is not Regime.UNDECIDED,
        stick_fraction=cycles.stick_fraction if cycles else shown.fraction(ContactState.STICK, stretch),
        contact_loss_fraction=cycles.contact_loss_fraction
        if cycles
        else shown.fraction(ContactState.SEPARATED, stretch),
        mean_friction_force=what.mean_force,
        braking_torque=radius * what.mean_force,
        decision=decision,
        notes={about: note for about, note in what.notes.items() if note},
        evidence=evidence,
        thresholds=shown.limits,
    )
    return replace(verdict, **of_orbit(what.orbit, radius)) if what.orbit else verdict


def _further(shown: Shown, what: Lasting, context: Context) -> dict[str, object]:
    """Evidence on the settled part that no row needs."""
    stretch = what.stretch
    belt = context.belt_speed
    evidence: dict[str, object] = {f"amplitude_{name}": stretch.amplitude(name) for name in ("y", "vx", "vy")}
    if belt != 0.0:
        evidence["largest_vx_over_belt_speed"] = stretch.extremes("vx")[int(belt > 0.0)] / belt
    if context.steady:
        evidence |= shown.track.account(stretch.start * shown.history.interval)
    return evidence | stretch.lines(context.forced, context.quiet)
