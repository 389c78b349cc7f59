"""A starter for a brake of one's own: a similar shoe with its mass, frequency, load and speed, and its friction.

Shoes are similar where all that has no unit agrees. In units of the mass m, of 1/ω with the angular frequency ω of
the mode that vibrates, and of the load Q, an amplitude is Q/(m ω²), a stiffness m ω² and a damping m ω. Equations
(1)-(7) of similar shoes then differ by U m ω/Q alone. Waves as long as U/ω pass as often in a period, and the pad
is as many of them long. Nothing but U depends on the radius, and nothing on the length of a smooth pad: both stay.
Critical friction has no unit and does not depend on the brake's own, which may be another one: the frequency is
that of the mode at this friction.
"""

import math
import re
from collections.abc import Sequence
from decimal import Decimal
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.modes import eigensystem
from brakecli.analysis.stability.report import critical_friction
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import UsageError
from brakecli.solver.steady_sliding import sliding
from brakecli.solver.system import System

STICKS_BELOW = 0.396
"""U m ω/Q below which the shoe of the starter `case` sticks in every cycle at its friction, by bisection of runs.

Above, it leaves the wheel and never sticks.
"""


class Scales(NamedTuple):
    """Factors of mass, time, length and wavelength, or the powers in which a number goes with them."""

    mass: float = 0.0
    time: float = 0.0
    length: float = 0.0
    wavelength: float = 0.0
    pad: float = 0.0


_POWERS = {
    "mass": Scales(mass=1.0),
    "angular_speed": Scales(time=-1.0, wavelength=1.0),  # U/R, where a wavelength is U times a time
    "stiffness": Scales(mass=1.0, time=-2.0),
    "damping": Scales(mass=1.0, time=-1.0),
    "force": Scales(mass=1.0, time=-2.0, length=1.0),
    "forces": Scales(mass=1.0, time=-2.0, length=1.0),
    "half_length": Scales(pad=1.0),
    "contact.stiffness": Scales(mass=1.0, time=-2.0, pad=-1.0),
    "amplitudes": Scales(length=1.0),
    "rms": Scales(length=1.0),
    "wavelengths": Scales(wavelength=1.0),
    "shortest": Scales(wavelength=1.0),
    "longest": Scales(wavelength=1.0),
    "wavenumbers": Scales(wavelength=-1.0),
    "x": Scales(length=1.0),
    "y": Scales(length=1.0),
    "vx": Scales(time=-1.0, length=1.0),
    "vy": Scales(time=-1.0, length=1.0),
    "duration": Scales(time=1.0),
    "step": Scales(time=1.0),
    "sample_interval": Scales(time=1.0),
}
_IN_COMMENTS = {"m/s": Scales(time=-1.0, wavelength=1.0), "Hz": Scales(time=-1.0)}
_HEADER = re.compile(r"(?:# )?\[([\w.]+)\]")
_KEY = re.compile(r"((?:# )?)(\w+)( = )([^#\n]*?)( *)(#.*)?")
_NUMBER = re.compile(r"[-+]?\b\d+(?:\.\d*)?(?:e[-+]?\d+)?")
_FRICTION = re.compile(r"^(coefficient = )([^#\n]*)", re.MULTILINE)
_SCHEDULES = re.compile(r"^(?:angular_speeds|forces) =", re.MULTILINE)


class Brake(NamedTuple):
    """What is known of a brake, in SI units; None where the starter's holds."""

    mass: float | None = None
    frequency: float | None = None  # Hz, of the mode that vibrates
    load: float | None = None
    speed: float | None = None  # of the wheel's surface
    friction: float | None = None


class _Whole(NamedTuple):
    """The same, all of it."""

    mass: float
    frequency: float
    load: float
    speed: float


class Similar(NamedTuple):
    """A case for a brake, and U m ω/Q of its shoe and of that of the starter."""

    text: str
    number: float
    before: float
    sticks: bool | None = None  # in every cycle, or never; None where only a run tells
    friction: float | None = None  # of the brake, where it is not that of the starter
    critical: float | None = None  # critical friction of both, which is known where that is given
    stable: bool | None = None  # sliding of the brake, likewise
    not_given: tuple[str, ...] = ()  # numbers with their units that are those of the starter, scaled

    @property
    def sentence(self) -> str:
        """What is assumed, and what follows."""
        ratios = "angles, and the ratios of all stiffnesses and dampings are those of the starter"
        same = f"{ratios}, and so is the critical friction"
        if self.friction is None:
            same = f"friction, {same}"
        elif self.critical:
            times = self.friction / self.critical
            side = "above" if times > 1.0 else "below"
            far = f"is {times:.3g} times" if times > 2.0 else f"lies {100.0 * abs(times - 1.0):.2g} % {side}"
            own = f"the brake's own {self.friction:g} {far} that"
            same = f"{same}, {self.critical:.3g}; {own}: sliding is {'stable' if self.stable else 'unstable'}"
        if self.not_given:  # U m ω/Q needs all four
            names, sizes = zip(*(text.split(": ") for text in self.not_given), strict=True)
            many = "were not given: {} are those" if len(names) > 1 else "was not given: {} is that"
            said = many.format(_listed(sizes))
            missing = f"{_listed(names)} {said} of the starter, scaled, so that how it vibrates is not said"
            return f"{missing}; {same}"
        number = f"U m ω/Q is {self.number:.3g} (there {self.before:.3g})"
        regime = "quasi-harmonic: it leaves the wheel and does not stick"
        if self.sticks:
            regime = "relaxation: it sticks in every cycle"
        follows = f", so that it vibrates, {regime}" if self.sticks is not None else "; a run tells what follows"
        return f"{same}; {number}{follows}"


def _listed(words: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def similar(starter: str, text: str, brake: Brake) -> Similar:
    """The text of a starter for a brake; raises UsageError for one with schedules, and for numbers not above 0."""
    for name, value in brake._asdict().items():
        if value is not None and not 0.0 < value < math.inf:
            raise UsageError(f"--{name}: has to be above 0 (found {value:g}); give it in SI units")
    if _SCHEDULES.search(text):
        raise UsageError(
            f"{starter} has speeds at given times; give a starter whose wheel turns evenly, such as case"
        )
    system = system_of(parse_case(text, starter).case)
    before = _number(_whole_of(system))
    if brake.friction is not None:
        text = _FRICTION.sub(partial(_with_friction, brake.friction), text)
        system = system_of(parse_case(text, starter).case)
    own = _whole_of(system)
    mass = (brake.mass or own.mass) / own.mass
    time = own.frequency / (brake.frequency or own.frequency)
    load = (brake.load or own.load) / own.load
    length = load * time**2 / mass
    speed = brake.speed / own.speed if brake.speed else length / time
    factors = Scales(mass, time, length, speed * time, 1.0 if system.smooth else speed * time)
    wanted = _Whole(own.mass * mass, own.frequency / time, own.load * load, own.speed * speed)
    number = _number(wanted)
    units = {"mass": "kg", "frequency": "Hz", "load": "N", "speed": "m/s"}
    sizes = wanted._asdict()
    missing = tuple(
        f"{name}: {sizes[name]:.3g} {unit}" if name != "load" else f"{name}: {sizes[name]:g} {unit}"
        for name, unit in units.items()
        if getattr(brake, name) is None
    )
    case = Similar(
        _scaled(text, factors, _head(wanted, starter, brake.friction)), number, before, not_given=missing
    )
    if brake.friction is None:
        whole = starter == "case" and not missing
        return case._replace(sticks=number < STICKS_BELOW if whole else None)
    critical = critical_friction(system, _stiffness(system))
    return case._replace(friction=brake.friction, critical=critical, stable=_values(system).real.max() <= 0.0)


def _number(brake: _Whole) -> float:
    return 2.0 * math.pi * brake.frequency * brake.speed * brake.mass / brake.load


def _whole_of(system: System) -> _Whole:
    """What a system has; the mode that vibrates grows fastest, or decays slowest, beside steady sliding."""
    values = _values(system)
    frequency = abs(float(values[values.real.argmax()].imag)) / (2.0 * math.pi)
    return _Whole(system.coefficients.m, frequency, system.load_at_start, abs(system.belt_speed))


def _values(system: System) -> NDArray[np.complex128]:
    """The eigenvalues of steady sliding, 1/s."""
    c = system.coefficients
    return eigensystem(c, _stiffness(system), c.grip(system.belt_speed))[0]


def _stiffness(system: System) -> float:
    """Stiffness of the contact (N/m) in steady sliding, or of full contact where there is none."""
    steady = sliding(system)
    return steady.stiffness if steady else system.contact_stiffness


def _with_friction(friction: float, match: re.Match[str]) -> str:
    """The line of the friction coefficient with another one; its comment stays in its column if it can."""
    return f"{match[1]}{friction!r}".ljust(len(match[0]) - 1) + " "


def _head(brake: _Whole, starter: str, friction: float | None) -> str:
    """The first lines of the case, and its title."""
    with_friction = "" if friction is None else f", with friction {friction:g}"
    of_brake = f"A brake of {brake.mass:g} kg at {brake.frequency:.4g} Hz, under {brake.load:g} N"
    return f"{of_brake}, at {brake.speed:.4g} m/s{with_friction}: similar to the starter {starter}"


def _scaled(text: str, factors: Scales, title: str) -> str:
    """A case with all its numbers that have a unit scaled, also those in comments that are keys, speeds or Hz."""
    table = ""
    lines = []
    for line in text[text.index("title = ") :].splitlines():  # what stands above is true of the starter
        if header := _HEADER.match(line):
            table = header[1]
            lines.append(_comment(line, factors))
        elif line.startswith("title = "):
            lines.append(f'title = "{title}"')
        elif table and (key := _KEY.fullmatch(line)):
            lines.append(_key(table, key, factors))
        else:
            lines.append(line)
    units = (
        "# All numbers are in SI units, angles in degrees. What comments say of the motion is true of the starter."
    )
    return "\n".join([f"# {title}.", "#", units, "", *lines, ""])


def _key(table: str, match: re.Match[str], factors: Scales) -> str:
    """A line with a key, whose comment stays in its column if it can."""
    mark, name, equals, value, space, comment = match.groups("")
    powers = _POWERS.get(f"{table}.{name}", _POWERS.get(name))
    new = value if powers is None else _NUMBER.sub(partial(_times, factors, powers), value)
    before = f"{mark}{name}{equals}"
    width = len(before) + len(value) + len(space)
    shown = f"{before}{new}".ljust(width) if comment else f"{before}{new}"
    return shown + ("" if not comment or shown.endswith(" ") else " ") + _comment(comment, factors)


def _comment(text: str, factors: Scales) -> str:
    """A comment whose speeds and frequencies are scaled, in as many digits as those have."""
    for unit, powers in _IN_COMMENTS.items():
        number = re.compile(rf"[\d.]+(?=(?: and [\d.]+)? {unit}\b)")
        text = number.sub(partial(_roughly, factors, powers), text)
    return text


def _roughly(factors: Scales, powers: Scales, number: re.Match[str]) -> str:
    return f"{_product(factors, powers, number[0]):.3g}"


def _times(factors: Scales, powers: Scales, number: re.Match[str]) -> str:
    """A number, scaled, as TOML writes it: in six digits; of waves the factor, so that their ratios stay."""
    if powers == _POWERS["wavelengths"]:
        return repr(float(Decimal(number[0]) * Decimal(f"{_product(factors, powers, '1'):.6g}")))
    return repr(float(f"{_product(factors, powers, number[0]):.6g}"))


def _product(factors: Scales, powers: Scales, number: str) -> float:
    """A number times its factor."""
    scale: float = math.prod(factor**power for factor, power in zip(factors, powers, strict=True))
    return float(number) * scale
