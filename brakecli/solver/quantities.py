"""The vocabulary: each quantity's symbol, words, unit and equation, once; the contact states; the failures.

Signs: x grows along the wheel's motion, y away from the wheel; F_x and F_y act on the shoe; F_y >= 0 presses it
off the wheel; the wheel's surface moves with U (either sign).
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Self


@dataclass(frozen=True)
class Quantity:
    """A quantity of the model: the paper's symbol, words, SI unit and where the paper defines it."""

    symbol: str
    long_name: str
    units: str
    equation: str


TIME = Quantity("t", "time", "s", "")
HISTORY = {
    "x": Quantity("x", "tangential displacement of the shoe, along the wheel's motion", "m", "(6)"),
    "y": Quantity("y", "normal displacement of the shoe, away from the wheel", "m", "(7)"),
    "vx": Quantity("ẋ", "tangential velocity of the shoe", "m/s", "(6)"),
    "vy": Quantity("ẏ", "normal velocity of the shoe", "m/s", "(7)"),
    "friction_force": Quantity("F_x", "friction force on the shoe", "N", "(3)-(5)"),
    "normal_force": Quantity("F_y", "normal contact force on the shoe", "N", "(2)"),
    "contact_fraction": Quantity("", "part of the pad that touches", "1", "(2)"),
    "state": Quantity("", "state of the contact", "1", "(3)-(5)"),
}
"""The variables of a time history, in the order of its columns."""

COEFFICIENTS = {
    "m": Quantity("m", "mass of the shoe", "kg", "(6)"),
    "b_xx": Quantity("bxx", "tangential damping of the links", "N s/m", "(6)"),
    "b_xy": Quantity("bxy", "damping that couples the directions", "N s/m", "(6)-(7)"),
    "b_yy": Quantity("byy", "normal damping of the links", "N s/m", "(7)"),
    "c_xx": Quantity("cxx", "tangential stiffness of the links", "N/m", "(6)"),
    "c_xy": Quantity("cxy", "stiffness that couples the directions", "N/m", "(6)-(7)"),
    "c_yy": Quantity("cyy", "normal stiffness of the links", "N/m", "(7)"),
    "sin_beta": Quantity("sin β", "tangential part of the load", "1", "(6)"),
    "cos_beta": Quantity("cos β", "normal part of the load", "1", "(7)"),
    "phi": Quantity("φ", "coefficient of friction", "1", "(3)"),
}


class ContactState(IntEnum):
    """How the shoe moves on the wheel at a sample."""

    BACKWARD_SLIP = -1
    STICK = 0
    FORWARD_SLIP = 1
    SEPARATED = 2


BOUND = 1e15
"""Position (m) and velocity (m/s) beyond which a motion is not one of a brake, `Failure.DIVERGED`."""


class Failure(IntEnum):
    """Why a run is not worth having; each has a sentence with its remedy."""

    sentence: str  # what happened and what to do

    def __new__(cls, number: int, sentence: str = "") -> Self:
        """The number that a loop returns, with its sentence."""
        failure = int.__new__(cls, number)
        failure._value_ = number
        failure.sentence = sentence
        return failure

    NONE = 0, "the run reached its end"
    UNCONVERGED = (
        1,
        'the iteration of a step did not converge; reduce solver.step, take solver.iteration = "newton", '
        "or set solver.allow_unconverged = true to continue and count these steps",
    )
    DIVERGED = 2, "the motion grew beyond all bounds; check the case, or reduce solver.step where it has one"
    NOT_CLOSED = (
        3,
        "the pad may no longer touch everywhere, so the closed form does not hold; "
        'take contact.evaluator = "auto"',
    )
    UNBALANCED = (
        4,
        "the energy account does not close, so the step does not resolve the motion and the history is not "
        "reliable; reduce solver.step",
    )
    STALLED = (
        5,
        "the steps shrink to nothing: stick, slip, lift-off and touch-down alternate without progress, or "
        "the tolerance is below the accuracy of the forces; increase solver.tolerance, or take "
        'solver.scheme = "two-layer" with a solver.step',
    )
    COARSE = 6, "the error that is carried along is more than the tolerance allows; reduce solver.tolerance"
