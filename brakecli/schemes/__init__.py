"""Difference schemes: one file each, loaded by the name that the case gives.

Contract of a scheme module:

- `WEIGHTS`: how many weights it takes; `LAG`: how many levels the known velocity lies behind the position;
- `MEMORY`: the entries of the state that decide the next ones, `VELOCITIES`: which of them are velocities;
- `weighted_time(weights)`: the time at which a step evaluates the load, the travel of the wheel and the contact,
  in steps after the current level;
- `order(weights, start)`: its order of accuracy on smooth motion;
- `begin(...)`: the state from which the loop starts, at level `LAG`;
- `mechanical_energy(...)`: kinetic energy and energy of the links that the scheme keeps;
- kernels `prepare` and `finish`, of the signatures in `brakecli.kernels`: the minimisation that a step comes
  down to, and the new state with the works of the step.
"""

from importlib import import_module
from types import ModuleType


def load(name: str) -> ModuleType:
    """The scheme module of this name; its kernels are compiled on the first call of a new version."""
    return import_module(f"brakecli.schemes.{name.replace('-', '_')}")
