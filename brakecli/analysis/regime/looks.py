"""How a motion looks that lasts by itself: relaxation or quasi-harmonic, or what has to be known first."""

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.conditions import comes_to_it, regular, steady
from brakecli.analysis.regime.decision import Excitation, Regime, Row, Thresholds

_UNSETTLED = 1.5  # times the fewest cycles, where not all of them are settled; a choice

LOOKS: tuple[Row[Answers, Thresholds], ...] = (
    Row(
        "few cycles",
        lambda a, t: not a.cycles or a.cycles < (1.0 if a.settled else _UNSETTLED) * t.fewest_cycles,
        "but only {a.cycles:.0f} cycles[ in {a.seconds:.3g} s]",
        "run longer",
        longer=True,
    ),
    Row(
        "few steps in a cycle",
        lambda a, t: a.steps_per_cycle < t.samples_per_cycle,
        "but only {a.steps_per_cycle:.1f} steps a cycle",
        "reduce solver.step and output.sample_interval",
    ),
    Row(
        "few samples in a cycle",
        lambda a, t: a.samples_per_cycle < t.samples_per_cycle,
        "but only {a.samples_per_cycle:.1f} samples a cycle",
        "reduce output.sample_interval",
    ),
    Row(
        "shorter than two waves",
        lambda a, t: a.seconds < 2.0 * a.slowest,
        "but the settled part holds less than two periods of the slowest wave, {a.slowest:.3g} s",
        "run at least {a.two_waves:.3g} s",
        longer=True,
    ),
    Row(
        "limit cycle with stick",
        lambda a, t: a.sticks_without_waves >= 1.0 and comes_to_it(a, t),
        "in a limit cycle of {a.ends_at:.4g} Hz with stick",
        "",
        Regime.RELAXATION,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "limit cycle without stick",
        lambda a, t: a.sticks_without_waves == 0.0 and comes_to_it(a, t),
        "in a limit cycle of {a.ends_at:.4g} Hz without stick",
        "",
        Regime.QUASI_HARMONIC,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "on its way",
        lambda a, t: a.waves and not steady(a, t),
        "but its level still {a.word} by e^{a.change:.2g} in the second half, which changes how it looks",
        "run at least {a.longer:.3g} s",
        longer=True,
    ),
    Row(
        "relaxation",
        lambda a, t: a.stick_cycles >= t.stick_cycles,
        "with stick in {a.stick_cycles:.0%} of {a.cycles:.0f} cycles",
        "",
        Regime.RELAXATION,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "quasi-harmonic",
        lambda a, t: a.stick_cycles <= 1.0 - t.stick_cycles and regular(a, t),
        "{a.sticks}: {a.lines}",
        "",
        Regime.QUASI_HARMONIC,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "irregular",
        lambda a, t: True,
        "irregular[: stick in {a.stick_cycles:.0%} of the cycles][, {a.lines}]",
        "run longer, or look at the spectrum",
        longer=True,
    ),
)
