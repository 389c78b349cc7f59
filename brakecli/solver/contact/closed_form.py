"""The contact in closed form: smooth surfaces, or a pad that a bound proves to touch (or to clear) everywhere."""

import math

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from brakecli.solver.compile import (
    EVALUATE,
    FRACTION,
    KIND,
    NORMAL_FORCE,
    SCRATCH,
    STIFFNESS,
    STORE,
    STORE_X,
    TANGENTIAL,
    VALID,
    kernel,
    vector,
)
from brakecli.solver.contact.pad import (
    AT_CC,
    AT_FULL,
    AT_PR,
    AT_SS,
    AT_WHEEL,
    HALF,
    SHOE_BOTTOM,
    SHOE_MEAN,
    SHOE_SQUARE,
    SHOE_TOP,
    WHEEL_BOUND,
    WHEEL_TERMS,
    K,
)

CLEAR, PARTLY, FULL = 0, 1, 2


@kernel(int64(float64, vector))
def coverage(y: float, pad: NDArray[np.float64]) -> int:
    """FULL or CLEAR where bounds on the surfaces prove that the pad touches everywhere or nowhere, else PARTLY."""
    if y >= pad[WHEEL_BOUND] + pad[SHOE_BOTTOM]:
        return CLEAR
    if -y >= pad[WHEEL_BOUND] + pad[SHOE_TOP]:
        return FULL
    return PARTLY


@kernel(EVALUATE)
def full_contact(
    x: float, y: float, angles: NDArray[np.float64], pad: NDArray[np.float64], contact: NDArray[np.float64]
) -> None:
    """The pad touches everywhere: F_y = 2ak [-y - mean f1 + Σ g2 sinc(ω2 a) sin(ω2 (x - travel))]."""
    k, length, n = pad[K], 2.0 * pad[HALF], int(pad[WHEEL_TERMS])
    at_omega, at_full = int(pad[AT_WHEEL]) + n, int(pad[AT_FULL])
    at_ss, at_cc, at_pr = int(pad[AT_SS]), int(pad[AT_CC]), int(pad[AT_PR])
    sines, cosines = contact[SCRATCH : SCRATCH + n], contact[SCRATCH + n : SCRATCH + 2 * n]
    mean_force, tangential = -k * length * pad[SHOE_MEAN], 0.0  # k ∫ (f2 - f1) and its derivative by x
    for i in range(n):
        omega = pad[at_omega + i]
        psi = omega * x + angles[i]
        sines[i], cosines[i] = math.sin(psi), math.cos(psi)
        mean_force += pad[at_full + i] * sines[i]
        tangential += pad[at_full + i] * omega * cosines[i]
    square, square_x = pad[SHOE_SQUARE], 0.0  # ∫ (f2 - f1)² and its derivative by x
    for i in range(n):
        ss, cc = -pad[at_pr + i], -pad[at_pr + n + i]
        square += cosines[i] * ss + sines[i] * cc
        for j in range(n):
            ss += pad[at_ss + i * n + j] * cosines[j]
            cc += pad[at_cc + i * n + j] * sines[j]
        square += cosines[i] * ss + sines[i] * cc
        square_x += 2.0 * pad[at_omega + i] * (cosines[i] * cc - sines[i] * ss)
    contact[NORMAL_FORCE] = max(mean_force - k * length * y, 0.0)  # rounding, or a pad that touches in part
    contact[STIFFNESS] = k * length
    contact[TANGENTIAL] = tangential
    contact[FRACTION] = 1.0
    contact[STORE] = 0.5 * k * (square + length * y * y) - y * mean_force
    contact[STORE_X] = 0.5 * k * square_x - y * tangential
    contact[KIND] = 0.0
    contact[VALID] = 1.0


@kernel(EVALUATE)
def clear(
    x: float, y: float, angles: NDArray[np.float64], pad: NDArray[np.float64], contact: NDArray[np.float64]
) -> None:
    """The pad touches nowhere: no force, nothing stored."""
    contact[:KIND] = 0.0
    contact[KIND] = 0.0
    contact[VALID] = 1.0


@kernel(EVALUATE)
def evaluate(
    x: float, y: float, angles: NDArray[np.float64], pad: NDArray[np.float64], contact: NDArray[np.float64]
) -> None:
    """See the package; VALID is 0 where a rough pad may touch in part, which this evaluator cannot know."""
    covered = coverage(y, pad)
    if covered == CLEAR:
        clear(x, y, angles, pad, contact)
    else:
        full_contact(x, y, angles, pad, contact)
        if covered == PARTLY:
            contact[VALID] = 0.0
