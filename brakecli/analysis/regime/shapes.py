"""How a motion looks that lasts by itself: relaxation or quasi-harmonic, or what has to be known first."""

import math

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.conditions import comes_to_it, regular, steady
from brakecli.analysis.regime.decision import Excitation, Regime, Row, Thresholds

SHAPES: tuple[Row[Answers, Thresholds], ...] = (
    Row(
        "few cycles",
        lambda motion, limits: (
            # 1.5: where not all of them are settled; a choice
            not motion.cycles or motion.cycles < (1.0 if motion.settled else 1.5) * limits.fewest_cycles
        ),
        "but only {cycles:.0f} cycles[ in {settled_duration:.3g} s]",
        "run longer",
        longer=True,
    ),
    Row(
        "few steps in a cycle",
        lambda motion, limits: motion.steps_per_cycle < limits.samples_per_cycle,
        "but only {steps_per_cycle:.1f} steps a cycle",
        "reduce solver.step and output.sample_interval",
    ),
    Row(
        "few samples in a cycle",
        lambda motion, limits: motion.samples_per_cycle < limits.samples_per_cycle,
        "but only {samples_per_cycle:.1f} samples a cycle",
        "reduce output.sample_interval",
    ),
    Row(
        "shorter than two waves",
        lambda motion, limits: motion.settled_duration < 2.0 * motion.slowest_wave_period,
        "but the settled part holds less than two periods of the slowest wave, {slowest_wave_period:.3g} s",
        "run at least {two_waves:.3g} s",
        longer=True,
    ),
    Row(
        "limit cycle with stick",
        lambda motion, limits: motion.sticks_without_waves >= 1.0 and comes_to_it(motion, limits),
        "in a limit cycle of {ends_at:.4g} Hz with stick",
        "",
        Regime.RELAXATION,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "limit cycle without stick",
        lambda motion, limits: motion.sticks_without_waves == 0.0 and comes_to_it(motion, limits),
        "in a limit cycle of {ends_at:.4g} Hz without stick",
        "",
        Regime.QUASI_HARMONIC,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "on its way",
        lambda motion, limits: motion.waves and not steady(motion, limits),
        "but its level still {word} by e^{level_change:.2g} in the second half, which changes how it looks",
        "run at least {longer:.3g} s",
        longer=True,
    ),
    Row(
        "relaxation",
        lambda motion, limits: motion.stick_cycles >= limits.stick_cycles,
        "with stick in {stick_cycles:.0%} of {cycles:.0f} cycles{turns}",
        "",
        Regime.RELAXATION,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "quasi-harmonic",
        lambda motion, limits: motion.stick_cycles <= 1.0 - limits.stick_cycles and regular(motion, limits),
        "{sticks}: {lines}{turns}",
        "",
        Regime.QUASI_HARMONIC,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "torus",
        lambda motion, limits: math.isfinite(motion.frequency_of_modulation),
        "{sticks}, neither in most nor in few{turns}",
    ),
    Row(
        "some cycles stick",
        regular,
        "{sticks}, neither in most nor in few: {lines}",
        "run longer, or look at the spectrum",
        longer=True,
    ),
    Row(
        "irregular",
        lambda motion, limits: True,
        "irregular[: stick in {stick_cycles:.0%} of the cycles][, {lines}]",
        "run longer, or look at the spectrum",
        longer=True,
    ),
)
