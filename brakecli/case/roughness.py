"""Rough surfaces as users know them: sines, orders of a turn, or a self-affine spectrum."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from brakecli.case import tables
from brakecli.case.records import MOST_MEASURED, Record
from brakecli.case.tables import MOST_SINES, SMALLEST, NonNegative, Positive, Table, Weight, described, quantity
from brakecli.errors import Problem, UsageError

if TYPE_CHECKING:
    from brakecli.solver.roughness import Surface

NEEDLESS = {
    **dict.fromkeys(("amplitudes", "wavelengths", "wavenumbers", "orders"), ("note",)),
    **dict.fromkeys(("profile", "spectrum"), ("note", "phases_deg")),
}
"""Keys of a surface that an override of one replaces, beside those that exclude each other."""
_SINES = ("amplitudes", "wavelengths", "wavenumbers", "orders", "phases_deg")


class Records(dict[str, Record]):
    """Measured profiles by path. Each is read when it is first asked for, and never again: a file may change."""

    def __init__(self, profiles: Mapping[str, Record]) -> None:
        """Begin with those that were read before."""
        super().__init__(profiles)
        self._files = {os.path.realpath(path): record for path, record in profiles.items()}

    def __missing__(self, path: str) -> Record:
        """Read a profile, which other names of its file then have in common."""
        from brakecli.case.profile import read

        file = os.path.realpath(path)
        self[path] = self._files[file] = record = self._files.get(file) or read(Path(file))
        if sum(2 * len(profile.place) for profile in {*self.values()}) > MOST_MEASURED:
            what = f"the measured profiles take more than {MOST_MEASURED / 1e6:g} MB"
            raise UsageError(f"{what}; measure fewer places")
        return record


_profiles = ContextVar[Mapping[str, Record]]("measured profiles")


@contextmanager
def reading(records: Mapping[str, Record]) -> Iterator[None]:
    """Within the block measured profiles are those of `records`."""
    before = _profiles.set(records)
    try:
        yield
    finally:
        _profiles.reset(before)


def record_of(path: str) -> Record:
    """A measured profile; raises UnreadableResultError, UsageError and OSError."""
    try:
        return _profiles.get(Records({}))[path]
    except KeyError:
        raise UsageError("was not read when the sweep began; name it in the case, or in an axis") from None


class Spectrum(Table):
    """A self-affine surface: its power spectral density falls as q^(-1 - 2 hurst) between two wavelengths."""

    rms: NonNegative = quantity("m", "root of the mean square of the heights")
    hurst: Weight = quantity("1", "Hurst exponent: 0 is roughest, 1 smoothest")
    shortest: Positive = quantity("m", "shortest wavelength")
    longest: Positive = quantity("m", "longest wavelength")
    terms: Annotated[int, Field(ge=2, le=MOST_SINES)] = described(
        "number of sines, at equal steps of 1/wavelength", 100
    )
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = described("seed of the random phases", 0)

    def _broken_rules(self) -> Iterator[Problem]:
        too_large = self.rms > 0.5 * tables.LARGEST  # a sine has at most 2^(1/2) of it
        yield from self.broken(
            (self.shortest >= self.longest, "shortest", "is not below longest", "give a range of wavelengths"),
            (too_large, "rms", "is too large for the amplitudes of its sines", "check its unit, m"),
        )

    def sines(self) -> dict[str, list[float]]:
        """The lists of its sines, the longest wave first; the sum of their mean squares is that of the heights."""
        import numpy as np

        count = np.linspace(1.0, self.longest / self.shortest, self.terms)  # of waves in the longest wavelength
        shape = count ** (-0.5 - self.hurst)  # the square is the density, as steps are equal
        amplitudes = self.rms * np.sqrt(2.0 / np.sum(shape**2)) * shape
        phases = np.random.default_rng(self.seed).uniform(0.0, 360.0, self.terms)
        return {
            "amplitudes": np.where(amplitudes < SMALLEST, 0.0, amplitudes).tolist(),
            "wavelengths": np.clip(self.longest / count, self.shortest, self.longest).tolist(),
            "phases_deg": phases.tolist(),
        }


class Profile(Table):
    """A rough surface as a sum of sines, however that is given; empty lists are a smooth surface."""

    alternatives: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("amplitudes", "wavelengths"),
        ("amplitudes", "wavenumbers"),
        ("profile",),
        ("spectrum",),
    )

    amplitudes: tables.Series | None = quantity("m", "amplitude of each sine", None)
    wavelengths: tables.Lengths | None = quantity("m", "wavelength of each sine", None)
    wavenumbers: tables.Lengths | None = quantity("rad/m", "wavenumber of each sine", None)
    phases_deg: tables.Series | None = quantity(
        "deg", "phase of each sine, 0 if left out; in a spectrum in place of random ones", None
    )
    profile: Annotated[str, Field(min_length=1)] | None = described(
        "CSV file with two columns, position or angle and height; seen from the file of the case", None
    )
    profile_error: Weight | None = quantity(
        "1", "part of the RMS that its sines may leave out, 0.01 if left out", None
    )
    spectrum: Spectrum | None = described("a self-affine surface of random phases", None)
    note: tables.Title | None = described("one line for people to read: where the sines come from", None)

    def _fill(self) -> None:
        if self.phases_deg is None and self.amplitudes is not None:
            self.__dict__["phases_deg"] = (0.0,) * len(self.amplitudes)

    def _broken_rules(self) -> Iterator[Problem]:
        yield from super()._broken_rules()
        for key in ("phases_deg", "wavelengths", "wavenumbers"):
            yield from self.different_lengths(key, "amplitudes")
        phases = self.phases_deg
        terms = self.spectrum.terms if self.spectrum else 0
        needless = self.profile is None and self.profile_error is not None
        one_each = "give one value for each term, or leave phases_deg out"
        what = f"has {tables.entries(phases or ())}, but spectrum.terms is {terms}"
        yield from self.broken(
            (self.profile and phases is not None, "phases_deg", "is given together with profile", "leave it out"),
            (needless, "profile_error", "is only for a profile", "leave it out"),
            (terms and phases is not None and len(phases) != terms, "phases_deg", what, one_each),
        )

    @property
    def is_rough(self) -> bool:
        """Whether a sine has an amplitude."""
        return bool(self.spectrum.rms) if self.spectrum else any(self.amplitudes or ())

    def sines(self) -> dict[str, Sequence[float]]:
        """The lists of its sines, by the names of their keys."""
        lists = {key: value for key in _SINES if (value := getattr(self, key, None)) is not None}
        return {**self.spectrum.sines(), **lists} if self.spectrum else lists


class WheelProfile(Profile):
    """The rough surface of the wheel, which has a circumference."""

    alternatives = (*Profile.alternatives[:2], ("amplitudes", "orders"), *Profile.alternatives[2:])

    orders: tables.Wholes | None = quantity("1", "waves per turn of each sine", None)

    def _broken_rules(self) -> Iterator[Problem]:
        yield from super()._broken_rules()
        yield from self.different_lengths("orders", "amplitudes")


@lru_cache(maxsize=16)
def surface_of(profile: Profile, radius: float) -> "Surface":
    """The sines of a profile as the solver has them; `radius` (m) is the wheel's."""
    from brakecli.solver.roughness import surface  # reading a case needs no numerical library

    return surface(**profile.sines(), radius=radius)


class Roughness(Table):
    """The profiles of both surfaces; a surface without one is smooth."""

    shoe: Profile | None = described("profile f1 of the shoe", None)
    wheel: WheelProfile | None = described("profile f2 of the wheel", None)
