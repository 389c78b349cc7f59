"""The verdict on a history: what the table decides, with the numbers of what lasts."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from brakecli.analysis.regime.context import Context
from brakecli.analysis.regime.lasting import Lasting, lasting
from brakecli.analysis.regime.measure import Continued, Shown, answers
from brakecli.analysis.regime.table import Excitation, Regime, Thresholds, decide
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.spectrum import segment
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState
from brakecli.solver.tangent import Exponent
from brakecli.solver.track import UNTRACKED, Track

_DEFAULT = Thresholds()


def classify(
    history: History,
    context: Context,
    thresholds: Thresholds = _DEFAULT,
    *,
    exponent: Exponent | None = None,
    track: Track = UNTRACKED,
    continued: Callable[[], Continued] = Continued,
    failure: str | None = None,
    in_full: bool = True,
) -> Verdict:
    """The regime of a run's history by the table of docs/regimes.md.

    `exponent` of its small disturbances, what the loop noted in its `track`, and what it comes to where it is
    `continued` on the smooth wheel, are asked of the case. Where not `in_full`, evidence and numbers that a sweep
    does not keep are left out; all others are the same.
    """
    shown = Shown(history, context, thresholds, track)
    found = answers(shown, exponent, continued, failure or "")
    decision = decide(found, thresholds)
    what = lasting(shown, found, decision, in_full=in_full)
    part, radius, cycles = what.part, context.radius, what.cycles
    if decision.excitation is Excitation.SELF_EXCITED and cycles:
        decision = decision._replace(frequency=what.frequency)
        found = replace(found, frequency=what.frequency or math.nan)
    evidence: dict[str, Any] = {"row": decision.row}
    if in_full:
        evidence |= found.known() | what.evidence | _further(shown, what, context)
    friction = part.mean("friction_force")
    theory = shown.linear if found.linear else None
    return Verdict(
        amplitude=what.amplitude,
        amplitude_first=shown.tenths[0].amplitude("x") if decision.regime is Regime.DAMPED else None,
        amplitude_spread=what.spread,
        amplitude_forced=what.forced,
        amplitude_own=what.own,
        forced_frequency=what.forced_frequency,
        left=shown.envelope.final / shown.envelope.largest if shown.envelope and found.moves else 0.0,
        growth_rate=found.own if theory and math.isfinite(found.own) else None,
        ringing_frequency=theory.mode.frequency if theory else None,
        frequency_resolution=1.0 / (segment(part.stop - part.start) * history.interval),
        torque_variation=radius * what.variation if what.variation is not None else None,
        settled_from=part.start * history.interval,
        start=part.start,
        longer=what.force_rings is not None or (what.longer and not what.settled),
        settled=what.settled and decision.regime is not Regime.UNDECIDED,
        stick_fraction=cycles.stick_fraction if cycles else part.fraction(ContactState.STICK),
        contact_loss_fraction=cycles.contact_loss_fraction if cycles else part.fraction(ContactState.SEPARATED),
        mean_friction_force=friction,
        braking_torque=radius * friction,
        decision=decision,
        notes={about: note for about, note in what.notes.items() if note},
        evidence=evidence,
        thresholds=thresholds,
    )


def _further(shown: Shown, what: Lasting, context: Context) -> dict[str, Any]:
    """Evidence on the settled part that no row needs."""
    part, belt = what.part, context.belt_speed
    evidence: dict[str, Any] = {f"amplitude_{name}": part.amplitude(name) for name in ("y", "vx", "vy")}
    if belt != 0.0:
        evidence["largest_vx_over_belt_speed"] = part.extremes("vx")[int(belt > 0.0)] / belt
    if context.steady:
        evidence |= shown.track.account(part.start * shown.history.interval)
    return evidence | part.lines(context.forced, context.quiet)
