"""The verdict on a history: what the rules decide, with the numbers of the settled part."""

from dataclasses import replace

from brakecli.analysis.regime.forced import QUARTER
from brakecli.analysis.regime.rules import Rules
from brakecli.analysis.regime.spectra import segment
from brakecli.analysis.regime.verdict import Context, Excitation, Regime, Thresholds, Verdict
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState

_DEFAULT = Thresholds()
_VAGUE = "the amplitude may be off by as much as itself: run longer, or take a smaller solver.step"


def classify(
    history: History, context: Context, thresholds: Thresholds = _DEFAULT, *, in_full: bool = True
) -> Verdict:
    """The regime of a run's history, by the rules of docs/regimes.md; the first that applies decides.

    Where not `in_full`, evidence and numbers that a sweep does not keep are left out; all others are the same.
    """
    rules = Rules(history, context, thresholds)
    decision = rules.decide()
    part, radius = rules.settled_part, context.radius
    cycles = rules.cycles if decision.excitation is Excitation.SELF_EXCITED else None
    undecided = decision.regime is Regime.UNDECIDED
    if in_full:
        _add_evidence(rules, context)
    lasting = decision.excitation is Excitation.FORCED and not rules.rings
    lines = (*context.forced, *context.subharmonics()) if lasting else ()
    split = rules.parts or (None if rules.rings or not in_full else rules.split(lines or context.forced))
    forced, own = split if split and not (cycles and split[0] > split[1]) else (None, None)
    amplitude, spread = rules.amplitude(decision)
    ripple = context.ripple(part, lines) if context.steady and not cycles else None
    if spread is not None and lines and not rules.theory:
        spread += amplitude * context.detuned(part, lines) + (ripple.size if ripple else 0.0)
    if ripple := ripple if ripple and ripple.counts else None:
        rules.evidence |= {f"ripple_{name}": getattr(ripple, name) for name in ("x", "vx", "force")}
    vague = spread is not None and 0.0 < amplitude <= spread  # then not even its order is known
    if lasting and not rules.parts:
        rules.settle_force()
    low, high = replace(part, start=max(part.start, rules.force_from)).extremes("friction_force")
    variation = cycles.force_variation if cycles else None if rules.force_rings is not None else high - low
    doubt = _torque_doubt(rules, context, variation, lasting=not cycles and not undecided)
    notes = {
        "settled": (rules.drifts if cycles else None) or (_VAGUE if vague and rules.lasts else None),
        "ripple": ripple.sentence if ripple else None,
        "torque_variation": doubt,
    }
    friction = part.mean("friction_force")
    return Verdict(
        regime=decision.regime,
        excitation=decision.excitation,
        frequency=decision.frequency,
        amplitude=amplitude,
        amplitude_spread=None if vague else spread,
        amplitude_forced=forced,
        amplitude_own=own,
        growth_rate=rules.theory.mode.growth if rules.theory else None,
        ringing_frequency=rules.theory.mode.frequency if rules.theory else None,
        frequency_resolution=1.0 / (segment(part.stop - part.start) * history.interval),
        torque_variation=radius * variation if variation is not None else None,
        settled_from=part.start * history.interval,
        start=part.start,
        settled=rules.lasts and not (undecided or ripple or vague),
        stick_fraction=cycles.stick_fraction if cycles else part.fraction(ContactState.STICK),
        contact_loss_fraction=cycles.contact_loss_fraction if cycles else part.fraction(ContactState.SEPARATED),
        mean_friction_force=friction,
        braking_torque=radius * friction,
        decision=decision,
        notes={about: note for about, note in notes.items() if note},
        evidence=rules.evidence,
        thresholds=thresholds,
    )


def _add_evidence(rules: Rules, context: Context) -> None:
    """Evidence on the settled part that no rule needs."""
    part, belt = rules.settled_part, context.belt_speed
    rules.evidence |= {f"amplitude_{name}": part.amplitude(name) for name in ("y", "vx", "vy")}
    if belt != 0.0:
        rules.evidence["largest_vx_over_belt_speed"] = part.extremes("vx")[int(belt > 0.0)] / belt
    rules.evidence |= part.lines(context.forced, context.quiet) | (context.powers(part) if context.steady else {})


def _torque_doubt(rules: Rules, context: Context, variation: float | None, *, lasting: bool) -> str | None:
    """Why the variation of the torque is missing, or may be too small."""
    part, interval = rules.settled_part, rules.history.interval
    if (rings := rules.force_rings) is not None:
        longer = QUARTER * (rules.duration + rings)
        return f"the friction force still rings, and torque_variation is missing: run at least {longer:.3g} s"
    if variation is None:
        finer = f"give an output.sample_interval of {0.25 * interval:.2g} s"
        return f"samples miss impacts of the friction force, and torque_variation is missing: {finer}"
    short = (part.stop - max(part.start, rules.force_from)) * interval < 0.999 * context.pattern
    if short and context.steady and lasting:
        return f"torque_variation needs {context.pattern:.3g} s, until the waves repeat: run longer"
    return None
