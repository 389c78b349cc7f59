"""The pad: constants and tables of the contact in one flat buffer of doubles.

One buffer because every array that a compiled function pointer receives costs time on each of its calls. The
first entries are the constants below; those named AT_... hold where a block begins.
"""

import math

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.compile import SCRATCH
from brakecli.solver.roughness import Surface, height

(K, HALF, SHOE_TERMS, WHEEL_TERMS, NODES, SHOE_TOP, SHOE_BOTTOM, WHEEL_BOUND, SHOE_MEAN, SHOE_SQUARE) = range(10)
(CELL, AT_SHOE, AT_WHEEL, AT_FULL, AT_SS, AT_CC, AT_PR, AT_NODES, AT_SIN, AT_COS) = range(10, 20)
HEADER = 20

NODES_PER_WAVE = 16
"""Nodes per shortest wavelength that `nodes` is chosen for; measured in tests/solver/test_contact.py."""


def default_nodes(half_length: float, shoe: Surface, wheel: Surface) -> int:
    """Quadrature nodes for the shortest wavelength of both surfaces, at least 64, a multiple of 64."""
    waves = 2.0 * half_length * max([*shoe.turns, *wheel.turns], default=0.0)
    return 64 * max(1, math.ceil(NODES_PER_WAVE * waves / 64 - 1e-9))


def build_pad(k: float, half_length: float, shoe: Surface, wheel: Surface, nodes: int) -> NDArray[np.float64]:
    """The buffer for stiffness k (N/m²), half length (m) and surfaces; `nodes` = 0 without quadrature tables."""
    top, bottom = _shoe_bounds(half_length, shoe)
    sinc = np.sinc(wheel.omega * half_length / np.pi)
    ss, cc, pr, shoe_mean, shoe_square = _products(half_length, shoe, wheel)
    f1, sines, cosines = _node_tables(half_length, shoe, wheel, nodes)
    blocks = {
        AT_SHOE: np.concatenate([shoe.g, shoe.omega, shoe.phase]),
        AT_WHEEL: np.concatenate([wheel.g, wheel.omega]),
        AT_FULL: 2.0 * half_length * k * wheel.g * sinc,
        AT_SS: ss,
        AT_CC: cc,
        AT_PR: pr,
        AT_NODES: f1,
        AT_SIN: sines,
        AT_COS: cosines,
    }
    header = np.zeros(HEADER)
    header[[K, HALF, SHOE_TERMS, WHEEL_TERMS, NODES]] = k, half_length, shoe.g.size, wheel.g.size, nodes
    header[[SHOE_TOP, SHOE_BOTTOM, WHEEL_BOUND]] = top, bottom, np.abs(wheel.g).sum()
    header[[SHOE_MEAN, SHOE_SQUARE]] = shoe_mean, shoe_square
    header[CELL] = 2.0 * half_length / max(8.0, 8.0 * half_length * max([*shoe.turns, *wheel.turns], default=0.0))
    place = HEADER
    for index, block in blocks.items():
        header[index] = place
        place += block.size
    return np.concatenate([header, *(block.ravel() for block in blocks.values())])


def build_contact(pad: NDArray[np.float64]) -> NDArray[np.float64]:
    """The vector that an evaluator fills for this pad, its scratch included."""
    return np.zeros(SCRATCH + int(max(pad[NODES] + 2, 6 * (pad[SHOE_TERMS] + pad[WHEEL_TERMS]))))


def _shoe_bounds(a: float, shoe: Surface) -> tuple[float, float]:
    """Upper bounds (m) of f1 and of -f1 on the pad: a fine grid and what curvature can add between its points."""
    if shoe.g.size == 0:
        return 0.0, 0.0
    xi = np.linspace(-a, a, min(1 + 64 * max(1, math.ceil(2.0 * a * max(shoe.turns))), 10**6))
    f = height(shoe, xi)
    between = float(np.abs(shoe.g) @ shoe.omega**2) * (xi[1] - xi[0]) ** 2 / 8.0
    crest = float(np.abs(shoe.g).sum())
    return min(float(f.max()) + between, crest), min(float(-f.min()) + between, crest)


def _node_tables(
    a: float, shoe: Surface, wheel: Surface, nodes: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Cell means of f1, and of g sin(omega xi), g cos(omega xi) for the wheel, with one cell beyond each end.

    The mean of a sine over a cell is its value in the middle times sinc(omega spacing/2). With means instead of
    values the midpoint sum of a fully touching pad is its integral, so `auto` may change over without a jump.
    """
    if nodes == 0:
        return np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0))
    spacing = 2.0 * a / nodes
    xi = -a + spacing * (np.arange(nodes + 2) - 0.5)

    def mean(f: Surface) -> NDArray[np.float64]:
        return (f.g * np.sinc(f.omega * spacing / (2.0 * np.pi)))[:, None]

    waves = np.outer(wheel.omega, xi)
    f1 = np.sum(mean(shoe) * np.sin(np.outer(shoe.omega, xi) + shoe.phase[:, None]), axis=0)
    return f1, mean(wheel) * np.sin(waves), mean(wheel) * np.cos(waves)


def _products(
    a: float, shoe: Surface, wheel: Surface
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float, float]:
    """Integrals over the pad of products of harmonics (m³), for the store of a fully touching pad.

    With S = g sin(omega xi), C = g cos(omega xi) of the wheel: ∫ S S, ∫ C C, (∫ S f1, ∫ C f1), ∫ f1 (per pad
    length), ∫ f1². ∫ S C and ∫ S are zero by symmetry.
    """

    def pair(f: Surface, h: Surface) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        minus = np.sinc(np.subtract.outer(f.omega, h.omega) * a / np.pi)
        plus = np.sinc(np.add.outer(f.omega, h.omega) * a / np.pi)
        g = a * np.outer(f.g, h.g)
        return g * (minus - plus), g * (minus + plus)  # ∫ sin sin, ∫ cos cos

    sin_1, cos_1 = np.sin(shoe.phase), np.cos(shoe.phase)
    ss, cc = pair(wheel, wheel)
    s_f1, c_f1 = pair(wheel, shoe)
    ss_1, cc_1 = pair(shoe, shoe)
    mean = float(np.sum(shoe.g * sin_1 * np.sinc(shoe.omega * a / np.pi)))
    square = float(cos_1 @ ss_1 @ cos_1 + sin_1 @ cc_1 @ sin_1)
    return ss, cc, np.concatenate([s_f1 @ cos_1, c_f1 @ sin_1]), mean, square
