"""The tables of a case file and their keys: shoe, wheel, links, load, friction, contact, start, solver, output."""

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import ConfigDict, Field, TypeAdapter, WrapValidator, create_model

from brakecli.case import tables
from brakecli.case.tables import NonNegative, Number, Positive, Schedule, Table, described, one_of, quantity
from brakecli.errors import Problem, found_text
from brakecli.solver.contact import EVALUATORS
from brakecli.solver.method import MOST_EVALUATIONS
from brakecli.solver.schemes import SCHEMES, Scheme

SETTLED: Literal["settled"] = "settled"
"""In place of a duration: the run goes on until its verdict is decided."""
BUDGET = 100_000_000
MOST_BUDGET = 10**15
"""Steps that a case may take in all until its verdict is decided, where it leaves that open, and the most.

A choice: at 7 million given steps in a second, a quarter of a minute. A step on rough pads may take a hundred
times as long, but runs to a tolerance have hardly more steps than samples, whose limit comes first. The most is
beyond any machine."""
_SECONDS = TypeAdapter[float](Positive, config=ConfigDict(strict=True, allow_inf_nan=False))


def _or_settled(value: object, handler: object) -> object:
    """A duration; with the errors of a number, as those of a choice between two kinds would name both."""
    return value if value == SETTLED else _SECONDS.validate_python(value)


Duration = Annotated[Positive | Literal["settled"], WrapValidator(_or_settled)]


class Shoe(Table):
    """The brake shoe, a rigid body."""

    mass: Positive = quantity("kg", "mass m of the shoe")


class Varying(Table):
    """A table with a quantity that is constant, or linear between the times of a schedule."""

    def _broken_rules(self) -> Iterator[Problem]:
        yield from super()._broken_rules()
        _, (times_key, values_key) = self.alternatives
        yield from self.different_lengths(values_key, times_key)
        times: tables.Series = getattr(self, times_key) or ()
        late = [index for index, (before, time) in enumerate(pairwise(times), start=1) if time <= before]
        for index in late[: tables.MOST_WRONG_ENTRIES]:
            yield Problem(
                (times_key, index),
                f"is not later than the time before it{found_text(times[index])}",
                "let the times increase",
            )


class Wheel(Varying):
    """The wheel, turning at a constant speed or at a piecewise linear one."""

    alternatives = (("angular_speed",), ("times", "angular_speeds"))

    radius: Positive = quantity("m", "radius R of the wheel")
    angular_speed: Number | None = quantity("rad/s", "angular speed ω, of any sign", None)
    times: Schedule | None = quantity("s", "times of angular_speeds, increasing", None)
    angular_speeds: Schedule | None = quantity("rad/s", "angular speeds at these times, linear between them", None)


class Link(Table):
    """A spring with a dashpot beside it."""

    stiffness: NonNegative = quantity("N/m", "stiffness c of the spring")
    damping: NonNegative = quantity("N·s/m", "damping b of the dashpot", 0.0)
    angle_deg: tables.Angle = quantity(
        "deg", "inclination: β of link 1 to the vertical, α of link 2 to the friction plane", 0.0
    )


class Load(Varying):
    """The force that presses the shoe on, constant or piecewise linear."""

    alternatives = (("force",), ("times", "forces"))

    force: Number | None = quantity("N", "pressing force Q, of any sign", None)
    times: Schedule | None = quantity("s", "times of forces, increasing", None)
    forces: Schedule | None = quantity("N", "forces at these times, linear between them", None)


class Friction(Table):
    """Dry friction between shoe and wheel."""

    coefficient: NonNegative = quantity("1", "friction coefficient φ")


class Contact(Table):
    """The elastic contact between shoe and wheel."""

    half_length: Positive = quantity("m", "half length a of the contact")
    stiffness: Positive = quantity("N/m²", "stiffness k of the contact per unit of its length")
    evaluator: Annotated[str, *one_of(lambda: EVALUATORS)] = described(
        'how the contact force is computed; "auto" takes the cheapest', "auto"
    )
    nodes: Annotated[int, Field(ge=2, le=10_000_000)] | None = described(
        'quadrature nodes of "cells" and "midpoint", chosen from the shortest wavelength if left out', None
    )


if TYPE_CHECKING:

    class _Begun(Table):
        """What begins where a run ends."""

else:  # `from` is a word of Python's, which no class can name otherwise
    _RESULT = described("result of a run, at whose end this one begins; seen from the file of the case", None)
    _FROM = {"from": (Annotated[str, Field(min_length=1)] | None, _RESULT)}
    _Begun = create_model("Begun", __base__=Table, **_FROM)


class Initial(_Begun):
    """The state at t = 0.

    That at the end of a run, `from`, is read as the case is, and stands in the other keys from then on.
    """

    at: Literal["rest", "equilibrium"] = described(
        "the state that x, y, vx and vy are added to: the origin, or the steady sliding of the case", "rest"
    )
    x: Number = quantity("m", "tangential displacement", 0.0)
    y: Number = quantity("m", "normal displacement", 0.0)
    vx: Number = quantity("m/s", "tangential velocity", 0.0)
    vy: Number = quantity("m/s", "normal velocity", 0.0)
    wheel_angle: Number = quantity("rad", "angle by which the rough wheel has turned before", 0.0)

    def _broken_rules(self) -> Iterator[Problem]:
        if getattr(self, "from") is not None:
            for key in sorted(self.model_fields_set - {"from"}):
                yield self.wrong(key, "is given together with from", "keep one of the two")


class Solver(Table):
    """How the equations of motion are solved, and for how long."""

    alternatives = (("step",), ("tolerance",))
    one_is_needed = False

    scheme: Annotated[str, *one_of(lambda: (*SCHEMES, "auto"))] = described(
        'the time-stepping scheme; "two-layer" with a step, otherwise "auto", which chooses one', "auto"
    )
    theta: tables.Weights = quantity(
        "1",
        "weights of the layers: two for two-layer, 0.5 and 0.5 if left out; "
        "three that add up to 1 for three-layer, 0.25, 0.5 and 0.25 if left out; none for others",
        default_factory=tuple,
    )
    iteration: Annotated[str, *one_of(lambda: MOST_EVALUATIONS)] = described(
        'how the equations of a step are solved; "fixed-point" is the paper\'s way', "newton"
    )
    start: Annotated[str, *one_of(lambda: [start for row in SCHEMES.values() for start in row.starts])] = (
        described('how the second layer of three-layer is found; "paper" sets it equal to the first', "consistent")
    )
    step: Positive | None = quantity("s", "time step h; or tolerance instead", None)
    tolerance: tables.Tolerance | None = quantity(
        "1", "largest relative error of the histories, 0.001 if there is no step either", None
    )
    duration: Duration = quantity("s", 'time to simulate, or "settled": until the verdict is decided')
    budget: Annotated[int, Field(ge=1, le=MOST_BUDGET)] | None = described(
        f'steps that duration = "settled" may take in all, {BUDGET} if left out', None
    )
    allow_unconverged: bool = described("whether a run goes on after a step that did not converge", False)

    def _fill(self) -> None:
        if "scheme" not in self.model_fields_set and self.step is not None:
            self.__dict__["scheme"] = "two-layer"
        if "theta" not in self.model_fields_set:
            self.__dict__["theta"] = self.row.theta
        if self.budget is None and getattr(self, "duration", None) == SETTLED:  # it may be missing
            self.__dict__["budget"] = BUDGET

    @property
    def row(self) -> Scheme:
        """What the scheme states of itself; one that is still to be chosen is event-driven until then."""
        return SCHEMES["event-driven" if self.scheme == "auto" else self.scheme]

    @property
    def effective_tolerance(self) -> float | None:
        """Largest relative error that the histories may have; None where the step is given."""
        return None if self.step is not None else self.tolerance or 1e-3

    def _broken_rules(self) -> Iterator[Problem]:
        yield from super()._broken_rules()
        if self.step is not None and self.scheme == "auto":
            what = 'is given, but "auto" chooses the step'
            yield self.wrong("step", what, "leave scheme out, or give tolerance instead of step")
        if self.budget is not None and getattr(self, "duration", SETTLED) != SETTLED:
            what = f'is for duration = "{SETTLED}", but duration is a number'
            yield self.wrong("budget", what, f'leave budget out, or set duration to "{SETTLED}"')
        row = self.row
        count = len(self.row.theta)
        if row.own_steps:
            for key, neutral in (("theta", ()), ("iteration", "newton"), ("allow_unconverged", False)):
                if getattr(self, key) != neutral:
                    yield self.wrong(key, f"is not used by {self.scheme}", f"leave {key} out")
        elif len(self.theta) != count:
            what = f"has {tables.entries(self.theta)}, but {self.scheme} needs {count} weights"
            yield self.wrong("theta", what, f"give {count} weights, or leave theta out")
        elif row.sum_is_one and abs(sum(self.theta) - 1) > tables.ROUNDED:
            yield self.wrong("theta", f"adds up to {sum(self.theta):.12g}", "let the weights add up to 1")
        if self.start not in row.starts:
            names = [name for name, scheme in SCHEMES.items() if self.start in scheme.starts]
            what = f"is only for the {' and '.join(names)} scheme"
            remedy = " or ".join(f'"{name}"' for name in names)
            yield self.wrong("start", what, f"leave start out, or set scheme to {remedy}")


class Output(Table):
    """What of the run is kept."""

    sample_interval: Positive = quantity(
        "s", "time between two samples; the time step if left out, or by modes and waves", default_factory=float
    )
    events: bool = described("whether the result holds the events of the motion", False)
