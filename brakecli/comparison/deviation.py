"""How far one history is from another, in time and in what has settled."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.quantities import HISTORY

MOTION = ("x", "y", "vx", "vy")


@dataclass(frozen=True)
class Errors:
    """Relative errors against a reference, all of them parts of the largest value of the quantity.

    `largest` of each quantity over the samples; `mean`: the same in the mean over time (L1), as one sample on
    the other side of a jump of the friction force makes its largest error 2. `error`: the largest of x, y, vx
    and vy. `amplitude` and `phase` (rad): of the strongest line of vx over the last quarter of the time, None
    where there is none.
    """

    error: float
    largest: dict[str, float]
    mean: dict[str, float]
    amplitude: float | None
    phase: float | None


def errors(rows: NDArray[np.float64], reference: NDArray[np.float64]) -> Errors:
    """Compare rows of `quantities.HISTORY`, sampled at the same times."""
    columns = {name: pair for name, *pair in zip(HISTORY, rows.T, reference.T, strict=True)}
    largest, mean = {}, {}
    for name in (*MOTION, "friction_force", "normal_force"):
        values, exact = columns[name]
        apart, scale = np.abs(values - exact), float(np.abs(exact).max()) or 1.0
        largest[name], mean[name] = float(apart.max()) / scale, float(apart.mean()) / scale
    return Errors(max(largest[name] for name in MOTION), largest, mean, *_line(*columns["vx"]))


def _line(values: NDArray[np.float64], reference: NDArray[np.float64]) -> tuple[float | None, float | None]:
    """Relative error of the amplitude, and error of the phase, of the reference's strongest line."""
    count = len(reference) // 4
    if count < 64:
        return None, None
    window = np.hanning(count + 2)[1:-1]
    late = reference[-count:] - reference[-count:].mean()
    size = np.abs(np.fft.rfft(window * late))
    top = int(np.argmax(size))
    if top < 3 or size[top] <= 1e-9 * count * float(np.abs(reference).max()):
        return None, None
    turning = np.exp(-2j * math.pi * top / count * np.arange(count)) * window
    exact, found = complex(turning @ late), complex(turning @ (values[-count:] - values[-count:].mean()))
    return abs(found) / abs(exact) - 1.0, float(np.angle(found / exact))
