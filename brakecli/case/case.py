"""A case: everything that defines one simulation, in SI units, valid by construction.

The tables and keys are those of the case file, version 1. `brakecli.case.read` makes a case of a TOML file.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import tomli_w
from pydantic import Field

from brakecli.case import tables
from brakecli.case.parts import SETTLED, Contact, Friction, Initial, Link, Load, Output, Shoe, Solver, Wheel
from brakecli.case.roughness import NEEDLESS, Roughness, record_of, surface_of
from brakecli.case.tables import ROUNDED, Table, described
from brakecli.errors import BrakecliError, Problem
from brakecli.solver.contact import EVALUATORS

if TYPE_CHECKING:
    from brakecli.solver.coefficients import Coefficients


class Case(Table):
    """Everything that defines one simulation.

    In a finished case nothing is left to be chosen: `solver.theta`, `output.sample_interval` and the phases
    of the roughness hold their values also where the file left them out.
    """

    needless: ClassVar = {
        ("initial", "from"): tuple(("initial", key) for key in Initial.model_fields if key != "from"),
        ("solver", "duration"): (("solver", "budget"),),
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
            keys = self.output.model_dump(exclude_unset=True)
            self.__dict__["output"] = Output(**keys, sample_interval=self.solver.step)

    def _put_sines(self) -> Iterator[Problem]:
        """Put sines beside measured profiles; yield a problem for each that cannot be used.

        A surface with a profile counts as given by it alone, so that other settings may lead to other sines. They
        leave out a hundredth of its RMS where the case leaves that open.
        """
        for side, surface in self.roughness:
            if surface is None or surface.profile is None or surface.amplitudes is not None:
                continue
            from brakecli.case.profile import sines_of

            pad = self.contact.half_length if side == "shoe" else None
            error = 0.01 if surface.profile_error is None else surface.profile_error
            try:
                path = Path(surface.profile)
                record = record_of(surface.profile)
                sines = dict(type(surface)(**sines_of(path.name, record, error, self.wheel.radius, pad)))
                written = {"profile": str(path.absolute()), "profile_error": surface.profile_error}
                of_sines = surface.model_construct(surface.model_fields_set, **sines | written)
                self.__dict__["roughness"] = self.roughness.model_copy(update={side: of_sines})
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
        from brakecli.case.restart import initial_at, last_of

        try:
            end = last_of(Path(path), type(self).model_validate)
            state = initial_at(end.case.wheel, end.case.initial.wheel_angle, end.time, end.state)
            self.__dict__["initial"] = Initial(at="rest", **state)
        except BrakecliError as failure:
            what, _, remedy = str(failure).removeprefix(f"{path}: ").rpartition("; ")
            yield self.wrong("initial.from", what, remedy)

    def _broken_rules(self) -> Iterator[Problem]:
        yield from self._put_sines()
        yield from self._put_start()
        solver = self.solver
        step = self.solver.step
        evaluator = self.contact.evaluator
        own_steps = solver.row.own_steps
        exact = solver.row.exact
        start = self.initial
        rough = [name for name, profile in self.roughness if profile and profile.is_rough]
        values = {"wheel.angular_speeds": self.wheel.angular_speeds, "load.forces": self.load.forces}
        changing = [key for key, series in values.items() if len({*(series or ())}) > 1]
        yield from self.broken(
            (
                step is not None and self.output.sample_interval < step * (1 - ROUNDED),
                "output.sample_interval",
                f"is below the time step of {step!r} s",
                "make it at least one time step",
            ),
            (
                (own_steps or step is None) and evaluator != "auto" and EVALUATORS[evaluator].needs_nodes,
                "contact.evaluator",
                f"has no effect: {solver.scheme if exact else 'event-driven'} needs no nodes, and with a "
                "tolerance the program chooses them",
                "leave evaluator out",
            ),
            (
                exact and rough,
                "solver.scheme",
                f"is for smooth surfaces, but roughness.{' and '.join(rough[:1])} is given",
                'set scheme to "event-driven", or leave the roughness out',
            ),
            (
                self.output.events and not own_steps,
                "output.events",
                f"is for schemes that locate events, and {solver.scheme} does not",
                'set scheme to "event-driven", or leave events out',
            ),
            (
                solver.start == "paper" and (start.vx or start.vy),
                "solver.start",
                "sets the second layer equal to the first, but the initial velocity is not zero",
                'set start to "consistent", or initial.vx and initial.vy to 0',
            ),
            (
                solver.duration == SETTLED and changing,
                "solver.duration",
                f"is never reached, as {' and '.join(changing[:1])} change with time",
                "give a number above 0, in s",
            ),
        )
        if step is None and "sample_interval" not in self.output.model_fields_set:
            # as one that is not given: it follows the case, also where that is changed
            set_keys = self.output.model_fields_set
            interval = {"sample_interval": self._interval()}
            self.__dict__["output"] = Output.model_construct(set_keys, **self.output.model_dump() | interval)

    def _interval(self) -> float:
        """Between samples (s), to two digits: 50 in a period of the fastest motion, and 10 in a passing wave."""
        from brakecli.solver.links import natural_frequencies

        wheel = self.wheel
        _, fastest = natural_frequencies(self.coefficients, self.contact_stiffness)
        turns = [0.0] if self.roughness.wheel is None else surface_of(self.roughness.wheel, wheel.radius).turns
        speed = wheel.radius * max(map(abs, wheel.angular_speeds or (wheel.angular_speed or 0.0,)))
        rate = max(50.0 * fastest, 10.0 * speed * float(max(turns, default=0.0)))
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
    keys = case.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    return _as_toml(case, keys, () if profiles else ("profile",))


def _as_toml(case: Case, data: dict[str, Any], as_sines: tuple[str, ...]) -> str:
    """Keys of a case as TOML, with sines in place of surfaces that are given by one of these keys."""
    for side, surface in case.roughness:
        if surface is not None and any(getattr(surface, key) is not None for key in as_sines):
            sines = type(surface)(**surface.sines(), note=surface.note)
            data["roughness"][side] = sines.model_dump(mode="json", exclude_none=True)
    return tomli_w.dumps(data)
