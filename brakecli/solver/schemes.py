"""Schemes: one file and one row of `SCHEMES` each. The rows are plain data; a file is imported when it is used.

1. A scheme names the record of its motion, `STATE`, which the plant has as `KEPT`, with x, y, v_x, v_y and force.
2. It says how many levels its velocity lies behind its position (`LAG`), which fields of the state decide the next
   ones (`MEMORY`), and which of these are velocities (`VELOCITIES`).
3. It begins at a position with a velocity and an acceleration, at the level `LAG` (`begin`).
4. It states the order of its error on smooth motion (`order`).
5. It says when a step takes load, travel and contact (`weighted_time`).
6. It places kinetic energy and that of the links where it keeps them, also for arrays (`mechanical_energy`).

One whose steps are those of `solver.steps.loop`, all of one length, keeps the contract `SteppingModule`:

7. Its kernel `prepare` makes of a state the minimisation that a step comes down to.
8. Its kernel `finish` makes the new state, with the previous position in `x_old` and `y_old`, and adds up the
   works of the step; `work.scheme` gets the energy that the step itself takes out, so that the account closes.
9. Both have a branch in `steps.step`.

One that finds its steps itself keeps the contract `OwnStepsModule`:

10. Its entry `advance` fills rows with the samples before a level, and may be called again from anywhere without
    changing a bit; it notes works and events (`track`), growth and errors (`tangent`) where these are on.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol, cast, runtime_checkable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from brakecli.solver.arrays import Floats
    from brakecli.solver.coefficients import Coefficients
    from brakecli.solver.energy import Mechanical
    from brakecli.solver.plant import Plant
    from brakecli.solver.records import Contact, Pair, Problem, Record, State, Weights, Works

HALF: tuple[float, ...] = 0.5, 0.5
QUARTERS: tuple[float, ...] = 0.25, 0.5, 0.25
NUMEROV: tuple[float, ...] = 1 / 12, 10 / 12, 1 / 12


@runtime_checkable
class SchemeModule(Protocol):
    """What every scheme has."""

    STATE: "type[Record]"
    """Type of the record that its motion is kept in, with the fields x, y, v_x, v_y and force."""
    KEPT: str
    """The field of the plant that is this record."""
    LAG: int
    """How many levels the known velocity lies behind the position."""
    MEMORY: tuple[str, ...]
    """The fields of the state that decide the next ones."""
    VELOCITIES: tuple[str, ...]
    """The fields of `MEMORY` that are velocities."""

    def __hash__(self) -> int:
        """Modules are told apart, as by caches."""

    def weighted_time(self, s: "Weights", /) -> float:
        """Time at which a step evaluates load, travel and contact, in steps after the current level."""

    def order(self, s: "Weights", start: str, /) -> int:
        """Order of accuracy on smooth motion."""

    def begin(self, s: "Weights", state: Any, position: "Pair", velocity: "Pair", acceleration: "Pair", /) -> None:
        """Fill the state from which the loop starts, at level `LAG`."""

    def mechanical_energy(self, c: "Coefficients", s: "Weights", state: Any, /) -> "Mechanical":
        """Kinetic energy and energy of the links that the scheme keeps, also of states in arrays."""


@runtime_checkable
class SteppingModule(SchemeModule, Protocol):
    """What a scheme has besides whose steps are of one length: two kernels, with branches in `steps.step`."""

    STATE: "type[State]"

    def prepare(self, c: "Coefficients", s: "Weights", state: "State", problem: "Problem", /) -> None:
        """The minimisation that a step comes down to."""

    def finish(
        self,
        c: "Coefficients",
        s: "Weights",
        state: "State",
        problem: "Problem",
        contact: "Contact",
        work: "Works",
        /,
    ) -> None:
        """The new state, and the works of the step."""


@runtime_checkable
class OwnStepsModule(SchemeModule, Protocol):
    """What a scheme has besides that finds its steps itself. Its samples lie on the grid alone."""

    def advance(
        self,
        plants: "Sequence[Plant]",
        tables: "Floats",
        scratch: "Floats",
        rows: "Floats",
        events: "Floats",
        stop: int,
        /,
    ) -> int:
        """Step to the level `stop`, fill rows with the samples before each step; a `Failure`: an entry."""


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
    disturbances.
    """

    module: str
    trials: tuple[Trial, ...]
    theta: tuple[float, ...] = ()
    sum_is_one: bool = False
    own_steps: bool = False
    exact: bool = False
    starts: tuple[str, ...] = ("consistent",)
    unstable: str = ""


SCHEMES: dict[str, Scheme] = {
    "two-layer": Scheme(
        "brakecli.solver.steps.two_layer",
        (
            Trial(HALF, contacts=True),
            Trial((1.0, 0.5)),
            Trial((0.5, 1.0)),
            Trial((1.0, 1.0)),
            Trial(HALF, iteration="fixed-point"),
        ),
        theta=HALF,
        unstable="or take weights that add up to 1 or more, such as [0.5, 0.5]",
    ),
    "three-layer": Scheme(
        "brakecli.solver.steps.three_layer",
        (
            Trial(QUARTERS),
            Trial(NUMEROV),
            Trial(QUARTERS, start="paper"),
            Trial(NUMEROV, start="paper"),
            Trial(QUARTERS, start="paper", iteration="fixed-point"),
        ),
        theta=QUARTERS,
        sum_is_one=True,
        starts=("consistent", "paper"),
        unstable="or take theta = [0.25, 0.5, 0.25]",
    ),
    "event-driven": Scheme("brakecli.solver.steps.event_driven", (Trial(contacts=True),), own_steps=True),
    "piecewise-exact": Scheme("brakecli.solver.steps.piecewise_exact", (Trial(),), own_steps=True, exact=True),
}


def module_of(name: str) -> SchemeModule:
    """The module of a scheme: its equations, for which no kernel is loaded."""
    return cast(SchemeModule, import_module(SCHEMES[name].module))
