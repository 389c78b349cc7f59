"""The energy account of a run: what came in, what went out, what is stored, and what does not add up."""

import math
from dataclasses import dataclass, fields
from typing import Any

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.records import Weights, Works

OPEN_ACCOUNT = 0.1
"""Relative closing error from which on a motion is not worth having: the step does not resolve it."""

Mechanical = tuple[float, float, tuple[float, float], float]
"""Kinetic energy and energy of the links (J), the position they belong to (m), and how many steps back that is."""


@dataclass(frozen=True)
class EnergyAccount:
    """Energies (J) over a whole run.

    change of (kinetic + links + contact) = belt - friction - dashpots - load + roughness - scheme + closing error

    `belt`: work F_x U of the moving wheel on the shoe. `friction`: heat of sliding, phi F_y |ẋ - U|. `load`: work
    against the pressing force. `roughness`: work of the passing roughness, (∂V/∂s)(ẋ - U) with s = x - travel:
    the model gives the rough contact no tangential reaction, so this is not balanced by the wheel. `scheme`:
    what the difference scheme itself takes out of the motion, zero for weights of one half. `stored` is the
    larger of kinetic + links + contact at the start and at the end. The closing error of a second-order scheme
    falls with h², down to what the midpoint rule knows of the roughness.
    """

    kinetic: float
    links: float
    contact: float
    belt: float
    friction: float
    dashpots: float
    load: float
    roughness: float
    scheme: float
    stored: float

    @property
    def closing_error(self) -> float:
        """J."""
        passed = self.belt - self.friction - self.dashpots - self.load + self.roughness - self.scheme
        return self.kinetic + self.links + self.contact - passed

    @property
    def relative_closing_error(self) -> float:
        """Closing error over the largest item of the account, the store included; 0 where all are zero."""
        largest = max(map(abs, vars(self).values()))
        return self.closing_error / largest if largest > 0.0 else 0.0


def links_energy(c: Coefficients, x: float, y: float) -> float:
    """Energy of the stretched links, J."""
    return 0.5 * (c.c_xx * x * x + 2.0 * c.c_xy * x * y + c.c_yy * y * y)


def energy_at_level(c: Coefficients, s: Weights, state: Any) -> Mechanical:
    """The energies of a motion whose position and velocity belong to one level."""
    kinetic = 0.5 * c.m * (state.v_x**2 + state.v_y**2)
    return kinetic, links_energy(c, state.x, state.y), (state.x, state.y), 0.0


def account(start: tuple[float, float, float], end: tuple[float, float, float], work: Works) -> EnergyAccount:
    """The account between two states, each as energies (kinetic, links, contact), from the works in between."""
    kinetic, links, contact = (after - before for before, after in zip(start, end, strict=True))
    return EnergyAccount(
        kinetic=kinetic,
        links=links,
        contact=contact,
        belt=float(work.belt),
        friction=float(work.friction),
        dashpots=float(work.dashpots),
        load=float(work.load),
        roughness=float(work.roughness),
        scheme=float(work.scheme),
        stored=max(sum(start), sum(end)),
    )


NOT_KEPT = EnergyAccount(**{item.name: math.nan for item in fields(EnergyAccount)})
"""Account of a run that keeps none: all entries are NaN."""
