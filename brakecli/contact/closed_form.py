"""The contact in closed form: smooth surfaces, or a pad that a bound proves to touch (or to clear) everywhere."""

import math

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from brakecli.contact.pad import (
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
from brakecli.kernels import (
    EVALUATE,
    FRACTION,
    KIND,
    NORMAL_FORCE,
    STIFFNESS,
    STORE,
    STORE_X,
    TANGENTIAL,
    VALID,
    kernel,
    vector,
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
    mean_force = -k * length * pad[SHOE_MEAN]  # k ∫ (f2 - f1)
    tangential, square, square_x = 0.0, pad[SHOE_SQUARE], 0.0  # ∂F/∂x, ∫ (f2 - f1)² and its derivative by x
    for i in range(n):
        omega = pad[at_omega + i]
        sine, cosine = math.sin(omega * x + angles[i]), math.cos(omega * x + angles[i])
        mean_force += pad[at_full + i] * sine
        tangential += pad[at_full + i] * omega * cosine
        ss, cc = -2.0 * pad[at_pr + i], -2.0 * pad[at_pr + n + i]
        square += cosine * ss + sine * cc
        for j in range(n):
            psi = pad[at_omega + j] * x + angles[j]
            other_s, other_c = pad[at_ss + i * n + j] * math.cos(psi), pad[at_cc + i * n + j] * math.sin(psi)
            square += cosine * other_s + sine * other_c
            ss += 2.0 * other_s
            cc += 2.0 * other_c
        square_x += omega * (cosine * cc - sine * ss)
    contact[NORMAL_FORCE] = mean_force - k * length * y
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
            contact[NORMAL_FORCE] = max(contact[NORMAL_FORCE], 0.0)
            contact[VALID] = 0.0
