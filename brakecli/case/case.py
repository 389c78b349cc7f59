"""A case: everything that defines one simulation, in SI units, valid by construction.

The tables and keys are those of the case file, version 1. `brakecli.case.read` makes a case of a TOML file.
"""

from collections.abc import Iterator, Mapping
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Any

import tomli_w
from pydantic import Field
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from brakecli.case.tables import (
    MOST_WRONG_ENTRIES,
    Angle,
    Broken,
    Lengths,
    NonNegative,
    Number,
    Positive,
    Schedule,
    Series,
    Table,
    Tolerance,
    Weight,
    from_list,
    from_text,
    quantity,
)


class Evaluator(StrEnum):
    """How the contact force F_y is computed."""

    AUTO = "auto"
    CLOSED_FORM = "closed-form"
    MIDPOINT = "midpoint"
    EXACT = "exact"


class Scheme(StrEnum):
    """How time is stepped."""

    TWO_LAYER = "two-layer"
    THREE_LAYER = "three-layer"
    EVENT_DRIVEN = "event-driven"
    AUTO = "auto"


_THETA: dict[Scheme, tuple[float, ...]] = {
    Scheme.AUTO: (),
    Scheme.TWO_LAYER: (0.5, 0.5),
    Scheme.THREE_LAYER: (0.25, 0.5, 0.25),
    Scheme.EVENT_DRIVEN: (),
}


DEFAULT_TOLERANCE = 1e-3
"""Relative error of the histories where a case gives neither step nor tolerance."""
EVENT_TOLERANCE = 1e-10
"""Tolerance of event-driven where a case gives it a step."""


class Iteration(StrEnum):
    """How the equations of one step are solved; "fixed-point" is the paper's way."""

    NEWTON = "newton"
    FIXED_POINT = "fixed-point"


class Start(StrEnum):
    """How a three-layer scheme gets its second layer; "paper" sets it equal to the first."""

    CONSISTENT = "consistent"
    PAPER = "paper"


class InitialState(StrEnum):
    """The state that the initial values are added to: the origin, or the steady sliding of the case."""

    REST = "rest"
    EQUILIBRIUM = "equilibrium"


def _broken_schedule(times: Series | None, key: str, values: Series | None) -> Iterator[Broken]:
    if times is None or values is None:
        return
    if len(times) != len(values):
        what = f"has {_entries(values)} where times has {len(times)}"
        yield Broken((key,), what, "give one value for each time", values)
    late = [index for index, (before, time) in enumerate(pairwise(times), start=1) if time <= before]
    for index in late[:MOST_WRONG_ENTRIES]:
        what = "is not later than the time before it"
        yield Broken(("times", index), what, "let the times increase", times[index])


def _entries(values: Series) -> str:
    return "1 entry" if len(values) == 1 else f"{len(values)} entries"


class Shoe(Table):
    """The brake shoe, a rigid body."""

    mass: Annotated[Positive, quantity("kg", "mass m of the shoe")]


class Wheel(Table):
    """The wheel, turning at a constant speed or at a piecewise linear one."""

    alternatives = (("angular_speed",), ("times", "angular_speeds"))

    radius: Annotated[Positive, quantity("m", "radius R of the wheel")]
    angular_speed: Annotated[Number | None, quantity("rad/s", "angular speed ω, of any sign")] = None
    times: Annotated[Schedule | None, quantity("s", "times of angular_speeds, increasing")] = None
    angular_speeds: Annotated[
        Schedule | None, quantity("rad/s", "angular speeds at these times, linear between them")
    ] = None

    def _broken_rules(self) -> Iterator[Broken]:
        yield from super()._broken_rules()
        yield from _broken_schedule(self.times, "angular_speeds", self.angular_speeds)


class Link(Table):
    """A spring with a dashpot beside it."""

    stiffness: Annotated[NonNegative, quantity("N/m", "stiffness c of the spring")]
    damping: Annotated[NonNegative, quantity("N·s/m", "damping b of the dashpot")] = 0.0
    angle_deg: Annotated[
        Angle, quantity("deg", "inclination: β of link 1 to the vertical, α of link 2 to the friction plane")
    ] = 0.0


class Load(Table):
    """The force that presses the shoe on, constant or piecewise linear."""

    alternatives = (("force",), ("times", "forces"))

    force: Annotated[Number | None, quantity("N", "pressing force Q, of any sign")] = None
    times: Annotated[Schedule | None, quantity("s", "times of forces, increasing")] = None
    forces: Annotated[Schedule | None, quantity("N", "forces at these times, linear between them")] = None

    def _broken_rules(self) -> Iterator[Broken]:
        yield from super()._broken_rules()
        yield from _broken_schedule(self.times, "forces", self.forces)


class Friction(Table):
    """Dry friction between shoe and wheel."""

    coefficient: Annotated[NonNegative, quantity("1", "friction coefficient φ")]


class Contact(Table):
    """The elastic contact between shoe and wheel."""

    half_length: Annotated[Positive, quantity("m", "half length a of the contact")]
    stiffness: Annotated[Positive, quantity("N/m²", "stiffness k of the contact per unit of its length")]
    evaluator: Annotated[
        Evaluator, from_text, Field(description='how the contact force is computed; "auto" takes the cheapest')
    ] = Evaluator.AUTO
    nodes: Annotated[
        int | None,
        Field(
            ge=2,
            le=10_000_000,
            description='quadrature nodes of "midpoint", chosen from the shortest wavelength if left out',
        ),
    ] = None


class Profile(Table):
    """A rough surface as a sum of sines; empty lists are a smooth surface."""

    alternatives = (("wavelengths",), ("wavenumbers",))

    amplitudes: Annotated[Series, quantity("m", "amplitude of each sine")]
    wavelengths: Annotated[Lengths | None, quantity("m", "wavelength of each sine")] = None
    wavenumbers: Annotated[Lengths | None, quantity("rad/m", "wavenumber of each sine")] = None
    phases_deg: Annotated[Series, quantity("deg", "phase of each sine, 0 if left out")] = Field(
        default_factory=tuple
    )

    def _fill(self) -> None:
        if "phases_deg" not in self.model_fields_set:
            self.__dict__["phases_deg"] = (0.0,) * len(self.amplitudes)

    def _broken_rules(self) -> Iterator[Broken]:
        yield from super()._broken_rules()
        for key in ("phases_deg", "wavelengths", "wavenumbers"):
            values = getattr(self, key)
            if values is not None and len(values) != len(self.amplitudes):
                what = f"has {_entries(values)} where amplitudes has {len(self.amplitudes)}"
                yield Broken((key,), what, "give one value for each amplitude", values)


class Roughness(Table):
    """The profiles of both surfaces; a surface without one is smooth."""

    shoe: Annotated[Profile | None, Field(description="profile f1 of the shoe")] = None
    wheel: Annotated[Profile | None, Field(description="profile f2 of the wheel")] = None


class Initial(Table):
    """The state at t = 0."""

    at: Annotated[InitialState, from_text, Field(description="the state that x, y, vx and vy are added to")] = (
        InitialState.REST
    )
    x: Annotated[Number, quantity("m", "tangential displacement")] = 0.0
    y: Annotated[Number, quantity("m", "normal displacement")] = 0.0
    vx: Annotated[Number, quantity("m/s", "tangential velocity")] = 0.0
    vy: Annotated[Number, quantity("m/s", "normal velocity")] = 0.0


class Solver(Table):
    """How the equations of motion are solved, and for how long."""

    alternatives = (("step",), ("tolerance",))
    one_is_needed = False

    scheme: Annotated[
        Scheme,
        from_text,
        Field(description='the time-stepping scheme; without a step "auto", which chooses one, else "two-layer"'),
    ] = Scheme.AUTO
    theta: Annotated[
        tuple[Weight, ...],
        *from_list,
        quantity(
            "1",
            "weights of the layers: two for two-layer, 0.5 and 0.5 if left out; "
            "three that add up to 1 for three-layer, 0.25, 0.5 and 0.25 if left out; none for event-driven",
        ),
    ] = Field(default_factory=tuple)
    iteration: Annotated[Iteration, from_text, Field(description="how the equations of a step are solved")] = (
        Iteration.NEWTON
    )
    start: Annotated[Start, from_text, Field(description="how the second layer of three-layer is found")] = (
        Start.CONSISTENT
    )
    step: Annotated[Positive | None, quantity("s", "time step h; or tolerance instead")] = None
    tolerance: Annotated[
        Tolerance | None,
        quantity("1", "relative error that the histories are kept to, 0.001 if there is no step either"),
    ] = None
    duration: Annotated[Positive, quantity("s", "time to simulate")]
    allow_unconverged: Annotated[
        bool, Field(description="whether a run goes on after a step that did not converge")
    ] = False

    def _fill(self) -> None:
        if "scheme" not in self.model_fields_set and self.step is not None:
            self.__dict__["scheme"] = Scheme.TWO_LAYER
        if "theta" not in self.model_fields_set:
            self.__dict__["theta"] = _THETA[self.scheme]

    @property
    def promise(self) -> float | None:
        """The relative error that the histories must keep; None where the step is given."""
        return None if self.step is not None else self.tolerance or DEFAULT_TOLERANCE

    def _broken_rules(self) -> Iterator[Broken]:
        yield from super()._broken_rules()
        if self.step is not None and self.scheme == Scheme.AUTO:
            what = 'is given, but "auto" chooses the step'
            yield Broken(("step",), what, "leave scheme out, or give tolerance instead of step", self.step)
        own_steps = self.scheme in (Scheme.EVENT_DRIVEN, Scheme.AUTO)
        yield from self._not_of_own_steps() if own_steps else self._not_of_layers()
        if self.start == Start.PAPER and self.scheme != Scheme.THREE_LAYER:
            what = "is for the three-layer scheme alone"
            yield Broken(("start",), what, 'leave start out, or set scheme to "three-layer"', self.start)

    def _not_of_layers(self) -> Iterator[Broken]:
        count = len(_THETA[self.scheme])
        if len(self.theta) != count:
            what = f"has {_entries(self.theta)} where {self.scheme} has {count} weights"
            yield Broken(("theta",), what, f"give {count} weights, or leave theta out", self.theta)
        elif count == 3 and abs(sum(self.theta) - 1) > 1e-9:
            yield Broken(
                ("theta",), f"adds up to {sum(self.theta):.12g}", "let the weights add up to 1", self.theta
            )

    def _not_of_own_steps(self) -> Iterator[Broken]:
        if self.theta:
            what = f"is not for {self.scheme}, which has no weights"
            yield Broken(("theta",), what, "leave theta out", self.theta)
        if self.iteration == Iteration.FIXED_POINT:
            what = f"is not for {self.scheme}"
            yield Broken(("iteration",), what, "leave iteration out", self.iteration)
        if self.allow_unconverged:
            what = f"is not for {self.scheme}"
            yield Broken(("allow_unconverged",), what, "leave allow_unconverged out", self.allow_unconverged)


class Output(Table):
    """What of the run is kept."""

    sample_interval: Annotated[Positive, quantity("s", "time between two samples, the time step if left out")] = (
        Field(default_factory=float)
    )


class Case(Table):
    """Everything that defines one simulation.

    In a finished case nothing is left to be chosen: `solver.theta`, `output.sample_interval` and the phases
    of the roughness hold their values also where the file left them out.
    """

    title: Annotated[
        str, Field(pattern=r"^[^\x00-\x1f\x7f-\x9f]*$", description="one line for people to read")
    ] = ""
    shoe: Shoe
    wheel: Wheel
    link1: Annotated[Link, Field(description="the link that is inclined by β to the vertical")]
    link2: Annotated[Link, Field(description="the link that is inclined by α to the friction plane")]
    load: Load
    friction: Friction
    contact: Contact
    roughness: Roughness = Field(default_factory=Roughness)
    initial: Initial = Field(default_factory=Initial)
    solver: Solver
    output: Output = Field(default_factory=Output)

    def _fill(self) -> None:
        if "sample_interval" not in self.output.model_fields_set and self.solver.step is not None:
            self.__dict__["output"] = Output(sample_interval=self.solver.step)

    def _broken_rules(self) -> Iterator[Broken]:
        interval, step = self.output.sample_interval, self.solver.step
        if step is None and "sample_interval" not in self.output.model_fields_set:
            what = "is missing, and there is no time step to take its place"
            yield Broken(("output", "sample_interval"), what, "give a number above 0, in s")
        if step is not None and interval < step * (1 - 1e-9):
            what = f"is below the time step of {step!r} s"
            yield Broken(("output", "sample_interval"), what, "make it at least one time step", interval)
        exact = self.solver.scheme == Scheme.EVENT_DRIVEN or step is None
        if exact and self.contact.evaluator == Evaluator.MIDPOINT:
            what = "is given, but event-driven is exact, and a tolerance is kept by nodes of its own"
            yield Broken(("contact", "evaluator"), what, "leave evaluator out", self.contact.evaluator)
        if self.solver.start == Start.PAPER and (self.initial.vx or self.initial.vy):
            what = "takes the second layer for equal to the first, but the initial velocity is not zero"
            remedy = 'set start to "consistent", or initial.vx and initial.vy to 0'
            yield Broken(("solver", "start"), what, remedy, self.solver.start)


class _TomlSchema(GenerateJsonSchema):
    """TOML has no null: a key without a value is left out."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        described = super().default_schema(schema)
        if described.get("default", 0) is None:
            del described["default"]
        return described


def json_schema(table: type[Table] = Case) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a case file, or of one kind of table.

    It accepts everything that is valid; most rules between keys are beyond it.
    """
    return {"$schema": _TomlSchema.schema_dialect, **table.model_json_schema(schema_generator=_TomlSchema)}


def changed(case: Case, **tables: Mapping[str, object]) -> Case:
    """The case with some keys of some tables changed, valid again; raises pydantic's ValidationError."""
    parts = {name: getattr(case, name) for name in Case.model_fields}
    for name, keys in tables.items():
        parts[name] = {**{key: getattr(parts[name], key) for key in type(parts[name]).model_fields}, **keys}
    return Case.model_validate(parts)


def resolved_toml(case: Case) -> str:
    """The case as TOML with every default filled in; reading it gives an equal case, to the last bit."""
    return tomli_w.dumps(case.model_dump(mode="json", exclude_none=True))
