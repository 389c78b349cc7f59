"""A case: everything that defines one simulation, in SI units, valid by construction.

The tables and keys are those of the case file, version 1. `brakecli.case.read` makes a case of a TOML file.
"""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import tomli_w
from pydantic import ConfigDict, Field, TypeAdapter, WrapValidator, create_model

from brakecli.case import tables
from brakecli.case.roughness import NEEDLESS, Roughness, record_of, surface_of
from brakecli.case.tables import NonNegative, Number, Positive, Schedule, Table, described, one_of, quantity
from brakecli.errors import BrakecliError, Problem, found
from brakecli.solver.contact import EVALUATORS
from brakecli.solver.method import MOST
from brakecli.solver.schemes import SCHEMES, Scheme

if TYPE_CHECKING:
    from brakecli.solver.records import Coefficients

DEFAULT_TOLERANCE = 1e-3  # relative error of the histories where a case gives neither step nor tolerance
SETTLED: Literal["settled"] = "settled"
"""In place of a duration: the run goes on until its verdict is decided."""
SAMPLES_PER_CYCLE, SAMPLES_PER_WAVE = 50.0, 10.0
"""Samples in a period of the fastest motion, and of the shortest wave that passes, where a case leaves it open."""
_SECONDS = TypeAdapter[float](Positive, config=ConfigDict(strict=True, allow_inf_nan=False))


def _or_settled(value: Any, handler: Any) -> Any:
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
            what = f"is not later than the time before it{found(times[index])}"
            yield Problem((times_key, index), what, "let the times increase")


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
        'quadrature nodes of "midpoint", chosen from the shortest wavelength if left out', None
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
    iteration: Annotated[str, *one_of(lambda: MOST)] = described(
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
    allow_unconverged: bool = described("whether a run goes on after a step that did not converge", False)

    def _fill(self) -> None:
        if "scheme" not in self.model_fields_set and self.step is not None:
            self.__dict__["scheme"] = "two-layer"
        if "theta" not in self.model_fields_set:
            self.__dict__["theta"] = self.row.theta

    @property
    def row(self) -> Scheme:
        """What the scheme states of itself; one that is still to be chosen is event-driven until then."""
        return SCHEMES["event-driven" if self.scheme == "auto" else self.scheme]

    @property
    def effective_tolerance(self) -> float | None:
        """Largest relative error that the histories may have; None where the step is given."""
        return None if self.step is not None else self.tolerance or DEFAULT_TOLERANCE

    def _broken_rules(self) -> Iterator[Problem]:
        yield from super()._broken_rules()
        if self.step is not None and self.scheme == "auto":
            what = 'is given, but "auto" chooses the step'
            yield self.wrong("step", what, "leave scheme out, or give tolerance instead of step")
        row, count = self.row, len(self.row.theta)
        if row.own_steps:
            for key, neutral in (("theta", ()), ("iteration", "newton"), ("allow_unconverged", False)):
                if getattr(self, key) != neutral:
                    yield self.wrong(key, f"is not used by {self.scheme}", f"leave {key} out")
        elif len(self.theta) != count:
            what = f"has {tables.entries(self.theta)}, but {self.scheme} needs {count} weights"
            yield self.wrong("theta", what, f"give {count} weights, or leave theta out")
        elif row.sum_is_one and abs(sum(self.theta) - 1) > 1e-9:
            yield self.wrong("theta", f"adds up to {sum(self.theta):.12g}", "let the weights add up to 1")
        if self.start not in row.starts:
            names = [name for name, each in SCHEMES.items() if self.start in each.starts]
            what = f"is only for the {' and '.join(names)} scheme"
            remedy = " or ".join(f'"{name}"' for name in names)
            yield self.wrong("start", what, f"leave start out, or set scheme to {remedy}")


class Output(Table):
    """What of the run is kept."""

    sample_interval: Positive = quantity(
        "s", "time between two samples; the time step if left out, or by modes and waves", default_factory=float
    )
    events: bool = described("whether the result holds the events of the motion", False)


class Case(Table):
    """Everything that defines one simulation.

    In a finished case nothing is left to be chosen: `solver.theta`, `output.sample_interval` and the phases
    of the roughness hold their values also where the file left them out.
    """

    needless: ClassVar = {
        ("initial", "from"): tuple(("initial", key) for key in Initial.model_fields if key != "from"),
        ("solver", "tolerance"): (("solver", "theta"), ("solver", "iteration"), ("contact", "evaluator")),
        **{
            ("roughness", side, key): tuple(("roughness", side, other) for other in needless)
            for side in ("shoe", "wheel")
            for key, needless in NEEDLESS.items()
        },
    }

    title: tables.Title = ""
    shoe: Shoe
    wheel: Wheel
    link1: Link = described("the link that is inclined by β to the vertical")
    link2: Link = described("the link that is inclined by α to the friction plane")
    load: Load
    friction: Friction
    contact: Contact
    roughness: Roughness = Field(default_factory=Roughness)
    initial: Initial = Field(default_factory=Initial)
    solver: Solver
    output: Output = Field(default_factory=Output)

    def _fill(self) -> None:
        if "sample_interval" not in self.output.model_fields_set and self.solver.step is not None:
            given = self.output.model_dump(exclude_unset=True)
            self.__dict__["output"] = Output(**given, sample_interval=self.solver.step)

    def _put_sines(self) -> Iterator[Problem]:
        """Put sines beside measured profiles; yield a problem for each that cannot be used.

        A surface with a profile counts as given by it alone, so that other settings may lead to other sines.
        """
        for side, given in self.roughness:
            if given is None or given.profile is None or given.amplitudes is not None:
                continue
            from brakecli.case.profile import sines_of

            pad = self.contact.half_length if side == "shoe" else None
            error = 0.01 if given.profile_error is None else given.profile_error
            try:
                path, record = Path(given.profile), record_of(given.profile)
                sines = dict(type(given)(**sines_of(path.name, record, error, self.wheel.radius, pad)))
                written = {"profile": str(path.absolute()), "profile_error": given.profile_error}
                surface = given.model_construct(given.model_fields_set, **sines | written)
                self.__dict__["roughness"] = self.roughness.model_copy(update={side: surface})
            except (OSError, ValueError) as failure:  # ValueError: a NUL in the path
                what = f"cannot be read: {(getattr(failure, 'strerror', None) or str(failure)).lower()}"
                yield self.wrong(f"roughness.{side}.profile", what, "name a CSV file")
            except BrakecliError as failure:
                what, _, remedy = str(failure).rpartition("; ")
                yield self.wrong(f"roughness.{side}.profile", what, remedy)

    def _put_start(self) -> Iterator[Problem]:
        """Put the state at the end of a run in the place of its file; yield a problem if it cannot be used."""
        if (path := getattr(self.initial, "from")) is None:
            return
        from brakecli.case.restart import end_of

        try:
            self.__dict__["initial"] = Initial(at="rest", **end_of(Path(path)))
        except BrakecliError as failure:
            what, _, remedy = str(failure).removeprefix(f"{path}: ").rpartition("; ")
            yield self.wrong("initial.from", what, remedy)

    def _broken_rules(self) -> Iterator[Problem]:
        yield from self._put_sines()
        yield from self._put_start()
        step = self.solver.step
        if step is not None and self.output.sample_interval < step * (1 - 1e-9):
            what = f"is below the time step of {step!r} s"
            yield self.wrong("output.sample_interval", what, "make it at least one time step")
        exact = self.solver.row.own_steps or step is None
        evaluator = self.contact.evaluator
        if exact and evaluator != "auto" and EVALUATORS[evaluator].needs_nodes:
            name = self.solver.scheme if self.solver.row.exact else "event-driven"
            what = f"has no effect: {name} needs no nodes, and with a tolerance the program chooses them"
            yield self.wrong("contact.evaluator", what, "leave evaluator out")
        rough = [name for name, profile in self.roughness if profile and profile.is_rough]
        if self.solver.row.exact and rough:
            what = f"is for smooth surfaces, but roughness.{rough[0]} is given"
            yield self.wrong("solver.scheme", what, 'set scheme to "event-driven", or leave the roughness out')
        if self.output.events and not self.solver.row.own_steps:
            what = f"is for schemes that locate events, and {self.solver.scheme} does not"
            yield self.wrong("output.events", what, 'set scheme to "event-driven", or leave events out')
        if self.solver.start == "paper" and (self.initial.vx or self.initial.vy):
            what = "sets the second layer equal to the first, but the initial velocity is not zero"
            remedy = 'set start to "consistent", or initial.vx and initial.vy to 0'
            yield self.wrong("solver.start", what, remedy)
        values = {"wheel.angular_speeds": self.wheel.angular_speeds, "load.forces": self.load.forces}
        changing = [key for key, each in values.items() if len({*(each or ())}) > 1]
        if self.solver.duration == SETTLED and changing:
            what = f"is never reached, as {changing[0]} change with time"
            yield self.wrong("solver.duration", what, "give a number above 0, in s")
        if step is None and "sample_interval" not in self.output.model_fields_set:
            # as one that is not given: it follows the case, also where that is changed
            given, found = self.output.model_fields_set, {"sample_interval": self._interval()}
            self.__dict__["output"] = Output.model_construct(given, **self.output.model_dump() | found)

    def _interval(self) -> float:
        """Between samples (s), to two digits, by the fastest motion and the shortest wave that passes."""
        from brakecli.solver.links import natural_frequencies

        wheel, (_, fastest) = self.wheel, natural_frequencies(self.coefficients, self.contact_stiffness)
        turns = [0.0] if self.roughness.wheel is None else surface_of(self.roughness.wheel, wheel.radius).turns
        speed = wheel.radius * max(map(abs, wheel.angular_speeds or (wheel.angular_speed or 0.0,)))
        rate = max(SAMPLES_PER_CYCLE * fastest, SAMPLES_PER_WAVE * speed * float(max(turns, default=0.0)))
        return float(f"{min(max(1.0 / rate, tables.SMALLEST), tables.LARGEST):.1e}")

    @property
    def coefficients(self) -> "Coefficients":
        """What the links and the shoe make of the equations of motion."""
        from brakecli.solver.links import coefficients

        return coefficients(
            mass=self.shoe.mass,
            c_1=self.link1.stiffness,
            b_1=self.link1.damping,
            beta_deg=self.link1.angle_deg,
            c_2=self.link2.stiffness,
            b_2=self.link2.damping,
            alpha_deg=self.link2.angle_deg,
            phi=self.friction.coefficient,
        )

    @property
    def contact_stiffness(self) -> float:
        """2ak, N/m: the contact that touches everywhere."""
        return 2.0 * self.contact.half_length * self.contact.stiffness


def changed(case: Case, **tables: Mapping[str, object]) -> Case:
    """The case with some keys of some tables changed, valid again; raises pydantic's ValidationError."""
    new = {name: {**dict(getattr(case, name)), **keys} for name, keys in tables.items()}
    return Case.model_validate({**dict(case), **new})


def resolved_toml(case: Case) -> str:
    """The case as TOML with every default filled in, and all surfaces as sines.

    Reading it gives an equal case, to the last bit.
    """
    return _as_toml(case, case.model_dump(mode="json", exclude_none=True), ("profile", "spectrum"))


def given_toml(case: Case, *, profiles: bool = True) -> str:
    """The keys that were given, as TOML; without `profiles` their sines."""
    given = case.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    return _as_toml(case, given, () if profiles else ("profile",))


def _as_toml(case: Case, data: dict[str, Any], as_sines: tuple[str, ...]) -> str:
    """Keys of a case as TOML, with sines in place of surfaces that are given by one of these keys."""
    for side, surface in case.roughness:
        if surface is not None and any(getattr(surface, key) is not None for key in as_sines):
            sines = type(surface)(**surface.sines(), note=surface.note)
            data["roughness"][side] = sines.model_dump(mode="json", exclude_none=True)
    return tomli_w.dumps(data)
