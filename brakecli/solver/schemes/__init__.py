"""Schemes: one file and one row of `SCHEMES` each. The rows are plain data; a file is imported when it is used.

Contract of every scheme module:

- `STATE`: the type of the record that its motion is kept in, with the fields x, y, v_x, v_y and force;
- `LAG`: how many levels the known velocity lies behind the position;
- `MEMORY`: the fields of the state that decide the next ones, `VELOCITIES`: which of them are velocities;
- `weighted_time(weights)`: the time at which a step evaluates the load, the travel of the wheel and the contact,
  in steps after the current level;
- `order(weights, start)`: its order of accuracy on smooth motion;
- `begin(...)`: fills the state from which the loop starts, at level `LAG`;
- `mechanical_energy(...)`: kinetic energy and energy of the links that the scheme keeps, also of states in arrays;
- `hold` and `advance`, kernels, and `sample`: those of `solver.loop`, or its own, with the same arguments, where
  its steps are its own, held to a tolerance, on the grid of samples alone, or exact, on a grid between them;
- in the first case kernels `prepare` and `finish`, of the signatures in `solver.records`: the minimisation that a
  step comes down to, and the new state with the works of the step; where steps are its own and not exact `solve`,
  the kernel of one step, which `advance` calls at the address in `plug.solve`.
"""

from dataclasses import dataclass
from importlib import import_module
from types import ModuleType

HALF, QUARTERS, NUMEROV = (0.5, 0.5), (0.25, 0.5, 0.25), (1 / 12, 10 / 12, 1 / 12)


@dataclass(frozen=True)
class Trial:
    """Weights, start and iteration with which compare-schemes tries a scheme; `contacts`: on other nodes, too."""

    theta: tuple[float, ...] = ()
    start: str = "consistent"
    iteration: str = "newton"
    contacts: bool = False


@dataclass(frozen=True)
class Scheme:
    """What a scheme states of itself.

    `theta`: its weights where a case gives none. `sum_is_one`: whether weights must add up to one. `own_steps`: it
    finds its steps itself and keeps a tolerance, so that no step can be unstable, or bias anything. `exact`: its
    steps make no error but rounding, on smooth surfaces alone. `unstable`: what to do where it multiplies
    disturbances. `colour`: in pictures.
    """

    module: str
    trials: tuple[Trial, ...]
    colour: str
    theta: tuple[float, ...] = ()
    sum_is_one: bool = False
    own_steps: bool = False
    exact: bool = False
    starts: tuple[str, ...] = ("consistent",)
    unstable: str = ""


SCHEMES: dict[str, Scheme] = {
    "two-layer": Scheme(
        "brakecli.solver.schemes.two_layer",
        (
            Trial(HALF, contacts=True),
            Trial((1.0, 0.5)),
            Trial((0.5, 1.0)),
            Trial((1.0, 1.0)),
            Trial(HALF, iteration="fixed-point"),
        ),
        colour="#0072B2",
        theta=HALF,
        unstable="or take weights that add up to 1 or more, such as [0.5, 0.5]",
    ),
    "three-layer": Scheme(
        "brakecli.solver.schemes.three_layer",
        (
            Trial(QUARTERS),
            Trial(NUMEROV),
            Trial(QUARTERS, start="paper"),
            Trial(NUMEROV, start="paper"),
            Trial(QUARTERS, start="paper", iteration="fixed-point"),
        ),
        colour="#D55E00",
        theta=QUARTERS,
        sum_is_one=True,
        starts=("consistent", "paper"),
        unstable="or take theta = [0.25, 0.5, 0.25]",
    ),
    "event-driven": Scheme(
        "brakecli.solver.schemes.event_driven", (Trial(contacts=True),), colour="#222222", own_steps=True
    ),
    "piecewise-exact": Scheme(
        "brakecli.solver.schemes.piecewise_exact", (Trial(),), colour="#6A3D9A", own_steps=True, exact=True
    ),
}


def load(name: str) -> ModuleType:
    """The module of a scheme; its kernels are compiled on the first call of a new version."""
    return import_module(SCHEMES[name].module)
