"""A shoe on smooth pads, at constant speed and load: the numbers that it moves by."""

from typing import NamedTuple

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.system import System


class Shoe(NamedTuple):
    """The numbers that a shoe on smooth pads moves by, at constant speed and load (SI units)."""

    coefficients: Coefficients
    stiffness: float  # of the contact
    belt: float  # speed
    load: float

    @classmethod
    def of(cls, system: System) -> "Shoe":
        """Take the numbers of a system."""
        return cls(system.coefficients, system.contact_stiffness, system.belt_speed, system.load_at_start)

    @property
    def rest(self) -> tuple[float, float] | None:
        """x and y (m) of steady sliding: (6)-(7) without motion, linear in full contact. None where it locks."""
        c = self.coefficients
        k = self.stiffness
        s_xy = c.c_xy + c.grip(self.belt) * k
        s_yy = c.c_yy + k
        determinant = c.c_xx * s_yy - s_xy * c.c_xy
        q_x = self.load * c.sin_beta
        q_y = self.load * c.cos_beta
        if not determinant > 0.0:
            return None
        return (s_xy * q_y - s_yy * q_x) / determinant, (c.c_xy * q_x - c.c_xx * q_y) / determinant
