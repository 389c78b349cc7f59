"""Difference schemes: one file each, loaded by the name that the case gives.

Contract of every scheme module:

- `STATE`: the type of the record that its motion is kept in, with the fields x, y, v_x, v_y and force;
- `WEIGHTS`: how many weights it takes; `LAG`: how many levels the known velocity lies behind the position;
- `MEMORY`: the fields of the state that decide the next ones, `VELOCITIES`: which of them are velocities;
- `weighted_time(weights)`: the time at which a step evaluates the load, the travel of the wheel and the contact,
  in steps after the current level;
- `order(weights, start)`: its order of accuracy on smooth motion;
- `begin(...)`: fills the state from which the loop starts, at level `LAG`;
- `mechanical_energy(...)`: kinetic energy and energy of the links that the scheme keeps;
and of one that steps on the grid of the case, in the common loop `brakecli.solver.loop`:

- kernels `prepare` and `finish`, of the signatures in `solver.records`: the minimisation that a step comes
  down to, and the new state with the works of the step;

or of one whose steps are its own, held to a tolerance, on the grid of samples alone:

- kernels `advance` and `sample`, which do what those of `brakecli.solver.loop` do, with the same arguments.
"""

from importlib import import_module
from types import ModuleType
from typing import Any

from brakecli.solver.compile import address
from brakecli.solver.records import Plug


def load(name: str) -> ModuleType:
    """The scheme module of this name; its kernels are compiled on the first call of a new version."""
    return import_module(f"brakecli.solver.schemes.{name.replace('-', '_')}")


def has_own_steps(scheme: Any) -> bool:
    """Whether a scheme chooses its steps itself: no step of the case can then be unstable, or bias anything."""
    return hasattr(scheme, "advance")


def loop(scheme: Any) -> Any:
    """The module whose `advance` and `sample` step this scheme."""
    return scheme if has_own_steps(scheme) else import_module("brakecli.solver.loop")


def plug(scheme: Any, solve: Any) -> Plug:
    """What the common loop calls for a scheme and an iteration."""
    if has_own_steps(scheme):
        return Plug(0, 0, 0)
    return Plug(address(scheme.prepare), address(scheme.finish), address(solve))
