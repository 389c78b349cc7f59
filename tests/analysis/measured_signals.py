"""Synthetic measurements whose regime is known by construction.

`python -m tests.analysis.measured_signals` prints the tables of docs/measured-signals.md.
"""

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.signals.look import Measurand, Signal, SignalVerdict, look

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """A displacement with one cycle a second in the mean, and what it is."""

    name: str
    regime: Regime
    displacement: Array


def stick_slip(per_cycle: int, cycles: int, slip: float, sizes: str = "equal", seed: int = 3) -> Array:
    """Displacement that follows a belt of speed 1, and slips back to 0 along half a cosine of `slip` seconds."""
    random = np.random.default_rng(seed)
    drawn = {
        "equal": np.ones(cycles),
        "lognormal": random.lognormal(0.0, 0.8, cycles),
        "exponential": random.exponential(1.0, cycles) + 0.05,
        "decade": 10.0 ** random.uniform(-0.5, 0.5, cycles),
    }[sizes]
    stick = (1.0 - slip) * drawn / drawn.mean()
    begins = np.concatenate([[0.0], np.cumsum(stick + slip)])
    time = np.arange(per_cycle * cycles) / per_cycle
    event = np.clip(np.searchsorted(begins, time, side="right") - 1, 0, cycles - 1)
    since = time - begins[event]
    fallen = 0.5 - 0.5 * np.cos(np.pi * np.clip((since - stick[event]) / slip, 0.0, 1.0))
    moved: Array = np.where(since < stick[event], since, stick[event] * (1.0 - fallen))
    return moved


def motions(per_cycle: int, cycles: int) -> Iterator[Motion]:
    """Everything that must be told apart."""
    time = np.arange(per_cycle * cycles) / per_cycle
    phase = 2.0 * np.pi * time
    for slip in (0.02, 0.05, 0.1, 0.2, 0.3):
        yield Motion(f"stick-slip {slip}", Regime.RELAXATION, stick_slip(per_cycle, cycles, slip))
    for sizes in ("lognormal", "exponential", "decade"):
        for slip in (0.02, 0.1, 0.3):
            irregular = stick_slip(per_cycle, cycles, slip, sizes)
            yield Motion(f"irregular stick-slip {sizes} {slip}", Regime.RELAXATION, irregular)
    sine = np.sin(phase)
    other = np.sin(1.37 * phase + 1.0)
    yield Motion("harmonic", Regime.QUASI_HARMONIC, sine)
    yield Motion("amplitude modulated", Regime.QUASI_HARMONIC, (1.0 + 0.9 * np.sin(phase / 11.0)) * sine)
    yield Motion("frequency modulated", Regime.QUASI_HARMONIC, np.sin(phase + 1.5 * np.sin(phase / 20.0)))
    yield Motion("two lines", Regime.QUASI_HARMONIC, sine + 0.5 * other)
    yield Motion("two lines in step", Regime.QUASI_HARMONIC, sine + 0.3 * np.sin(2.0 * phase))
    yield Motion("three lines", Regime.QUASI_HARMONIC, sine + 0.5 * other + 0.4 * np.sin(0.71 * phase))
    yield Motion("decaying", Regime.DAMPED, np.exp(-5.0 * time / cycles) * sine)
    yield Motion("growing", Regime.UNDECIDED, np.exp(3.0 * time / cycles) * sine)
    yield Motion("noise", Regime.UNDECIDED, np.random.default_rng(1).normal(0.0, 1.0, len(time)))


def measured(displacement: Array, per_cycle: int, quantity: Measurand, decibels: float, seed: int = 1) -> Array:
    """What a sensor of this quantity gives: a velocity is the mean of each sample; white noise so far below."""
    values = displacement
    if quantity == Measurand.VELOCITY:
        values = per_cycle * np.diff(displacement, prepend=2.0 * displacement[0] - displacement[1])
    if quantity == Measurand.ACCELERATION:
        values = per_cycle**2 * np.diff(displacement, 2, prepend=displacement[0], append=displacement[-1])
    noise = np.random.default_rng(seed).normal(0.0, 1.0, len(values))
    noisy: Array = values + 10.0 ** (-decibels / 20.0) * values.std() * noise
    return noisy


def disturbed(values: Array, per_cycle: int, kind: str, seed: int = 9) -> Array:
    """The values with one disturbance of a real measurement."""
    random, values, size = np.random.default_rng(seed), values.copy(), float(values.std())
    time = np.linspace(0.0, 1.0, len(values))
    places = random.choice(len(values) - per_cycle, 8, replace=False)
    match kind:
        case "spikes":
            values[places] += 30.0 * size * random.choice([-1.0, 1.0], 8)
        case "drift":
            values += size * (8.0 * time + 4.0 * np.sin(5.0 * time))
        case "offset":
            values += 100.0 * size
        case "sign reversed":
            values = -values
        case "short gaps":
            for place in places:
                values[place : place + max(1, per_cycle // 10)] = np.nan
        case "long gap":
            values[int(0.2 * len(values)) : int(0.27 * len(values))] = np.nan
        case "jump":
            values[len(values) // 3 :] += 5.0 * size
    return values


def verdict(values: Array, per_cycle: int, quantity: Measurand) -> SignalVerdict:
    """The verdict, without any knowledge of the belt."""
    return look(Signal(values, 1.0 / per_cycle), quantity=quantity).verdict


def outcome(found: Regime, true: Regime) -> str:
    """How a verdict compares with the truth."""
    if found == true:
        return "right"
    return "undecided" if found == Regime.UNDECIDED else "wrong"


def tally(per_cycle: int, cycles: int, decibels: float, kind: str = "") -> Counter[str]:
    """Outcomes over all motions, as displacement and as velocity."""
    outcomes: Counter[str] = Counter()
    for motion in motions(per_cycle, cycles):
        for quantity in (Measurand.DISPLACEMENT, Measurand.VELOCITY):
            values = disturbed(measured(motion.displacement, per_cycle, quantity, decibels), per_cycle, kind)
            outcomes[outcome(verdict(values, per_cycle, quantity).regime, motion.regime)] += 1
    return outcomes


def _row(label: str, outcomes: Counter[str]) -> str:
    return f"| {label} | {outcomes['right']} | {outcomes['undecided']} | {outcomes['wrong']} |"


def clipped(stick: float, samples: int = 20000, per_cycle: float = 99.7) -> Array:
    """A velocity that is a sine but for the top, which is cut off at 1 for this part of the time."""
    phase = 2.0 * np.pi * np.arange(samples) / per_cycle
    velocity: Array = np.minimum(np.cos(phase) / np.cos(np.pi * stick), 1.0)
    return velocity


def _short_stick(stick: float, decibels: float, belt_speed: float | None) -> str:
    velocity = clipped(stick)
    noise = 10.0 ** (-decibels / 20.0) * velocity.std() * np.random.default_rng(1).normal(0.0, 1.0, len(velocity))
    signal = Signal(velocity + noise, 1e-3)
    return str(look(signal, quantity=Measurand.VELOCITY, belt_speed=belt_speed).verdict.regime)


def main() -> None:
    """Print the tables."""
    lines = ["| samples per cycle, cycles, signal to noise | right | undecided | wrong |", "|---|---|---|---|"]
    rows = [(per_cycle, 100, decibels) for per_cycle in (10, 20, 50, 200, 1000) for decibels in (40, 20, 10)]
    rows += [(50, 100, decibels) for decibels in (5, 3, 0, -3)] + [(50, cycles, 20) for cycles in (50, 30, 20, 12)]
    lines += [_row(f"{row[0]}, {row[1]}, {row[2]} dB", tally(*row)) for row in rows]
    lines += [
        "",
        "| disturbance (50 samples per cycle, 20 dB): 100 cycles | right | undecided | wrong |",
        "|---|---|---|---|",
    ]
    kinds = ("spikes", "drift", "offset", "sign reversed", "short gaps", "long gap", "jump")
    lines += [_row(kind, tally(50, 100, 20, kind)) for kind in kinds]
    lines += ["| **30 cycles** | | | |", *(_row(kind, tally(50, 30, 20, kind)) for kind in kinds)]
    lines += [
        "",
        "| stick at the top of a sine | without noise | 40 dB | 30 dB | 20 dB |",
        "|---|---|---|---|---|",
    ]
    for stick in (0.03, 0.05, 0.08, 0.1, 0.2, 0.3):
        cells = [
            " / ".join(_short_stick(stick, noise, belt) for belt in (1.0, None)) for noise in (200, 40, 30, 20)
        ]
        lines.append(f"| {stick:.0%} | {' | '.join(cells)} |")
    print("\n".join(lines))  # noqa: T201


if __name__ == "__main__":
    main()
