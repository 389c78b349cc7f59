"""How fast the size of cycles turns on a torus, where cycles of all phases show that it lies on a closed curve."""

import math

import numpy as np

from brakecli.analysis.spectrum import FEWEST_CYCLES, Array, interpolated


def turns_per_cycle(sizes: Array, within: float) -> float:
    """Turns of the size in a cycle, at most a half; nan where the sizes of cycles fill no closed curve.

    On a torus the size of a cycle depends on its phase alone, which grows by as much in every cycle, and no phase
    is left out. In the order of phase, sizes then differ little from their neighbours. The mean square of the
    differences is twice the variance of what lies beside a curve: that may be `within`, squared, of the variance
    of all, and no more than that part of a turn may be left out. Of chaos all lies beside it, and a locked motion
    leaves out most phases.
    """
    count = len(sizes)
    if count < 8 * FEWEST_CYCLES:  # lines lie from `FEWEST_CYCLES` up to half a turn, with their width beside them
        return math.nan
    away = sizes - sizes.mean()
    variance = float(away @ away) / count
    line = _line(away) if variance > (1e-9 * sizes.mean()) ** 2 else math.nan  # less is rounding
    number = np.arange(count, dtype=np.float64)
    if not _left_out(line * number % 1.0) <= within:
        return math.nan
    for rate in [(line + turn) / parts for parts in range(1, 4) for turn in range(parts)]:
        order = np.argsort(rate * number % 1.0)
        steps = np.diff(away[order], append=away[order[0]])
        if float(steps @ steps) / count <= 2.0 * variance * within**2:
            return float(min(rate, 1.0 - rate))
    return math.nan


def _left_out(phases: Array) -> float:
    """The largest part of a turn in which no phase (in turns) lies."""
    ordered = np.sort(phases)
    return float(np.diff(ordered, append=ordered[:1] + 1.0).max(initial=0.0))


def _line(values: Array) -> float:
    """Frequency (1 per value) of the strongest line, by how far its phase moves from one half to the other.

    Weights that vanish with all their derivatives at the ends of a half leave less of other lines than any power
    of its length.
    """
    count = len(values)
    half = count // 2
    power = np.abs(np.fft.rfft(values * np.hanning(count))) ** 2
    top = FEWEST_CYCLES + int(np.argmax(power[FEWEST_CYCLES:]))
    line = interpolated(np.arange(len(power), dtype=np.float64) / count, power, top)
    place = (np.arange(half) + 0.5) / half
    weights = np.exp(-1.0 / (place * (1.0 - place)))
    for _ in range(2):  # the second time nothing is left of the first error
        turned = values[: 2 * half] * np.exp(-2j * math.pi * line * np.arange(2 * half))
        first, second = turned.reshape(2, half) @ weights
        line += float(np.angle(second * first.conj())) / (2.0 * math.pi * half)
    return line
