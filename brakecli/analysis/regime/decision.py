"""What a table decides: a regime, an excitation and the reason, by the first of its rows that holds."""

import math
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from string import Formatter
from typing import Generic, NamedTuple, TypeVar


class Regime(StrEnum):
    """The paper's three regimes, and `undecided`."""

    DAMPED = "damped"
    RELAXATION = "relaxation"
    QUASI_HARMONIC = "quasi-harmonic"
    UNDECIDED = "undecided"


class Excitation(StrEnum):
    """Where the energy of a sustained motion comes from."""

    SELF_EXCITED = "self-excited"
    FORCED = "forced"
    NONE = "none"


@dataclass(frozen=True)
class Thresholds:
    """The only numbers that decide a verdict: see docs/regimes.md, and `make statistics` for what each moves."""

    settled_within: float = 0.05  # part of its level by which a settled motion may change
    sure_errors: float = 3.0  # standard errors beyond which a change is no chance
    comes_together: float = 1.0  # powers of e by which neighbours that come together do so in half of the run
    same_level: float = 0.3  # part by which two motions of the same level may differ
    most: float = 2.0  # times the power of the other, of what gives most of the energy
    fewest_cycles: float = 10.0  # in the settled part
    samples_per_cycle: float = 8.0
    stick_cycles: float = 0.8  # part of the cycles that stick in relaxation; in 1 less it, others may
    harmonic_share: float = 0.8  # part of the energy on one line and its multiples
    band_share: float = 0.9  # part of it in three narrow bands, which chaos may have, too


class Decision(NamedTuple):
    """What a row decides, and why."""

    reason: str
    regime: Regime = Regime.UNDECIDED
    excitation: Excitation = Excitation.NONE
    frequency: float | None = None  # Hz
    stick_fraction: float | None = None
    advice: str = ""  # what to do
    row: str = ""  # its name
    longer: bool = False  # whether a longer run may decide

    @property
    def sentence(self) -> str:
        """The reason, and what to do."""
        return f"{self.reason}; {self.advice}" if self.advice else self.reason


A = TypeVar("A")  # the answers
T = TypeVar("T")  # and the thresholds of a table


class Row(NamedTuple, Generic[A, T]):
    """A row: its name, its condition, what it says, and what to do. `{…}` are attributes of the answers.

    A row whose sentence needs a number that is not known does not hold, so that of the last one needs none. What
    stands in [brackets] is said only where its numbers are known; so is what to do.

    `longer` says whether a longer run may decide where the row does not.
    """

    name: str
    holds: Callable[[A, T], object]
    sentence: str
    remedy: str = ""
    regime: Regime = Regime.UNDECIDED
    excitation: Excitation = Excitation.NONE
    longer: bool | Callable[[A], object] = False

    def decision(self, answers: A) -> Decision:
        """What it says of these answers; raises UnknownNumberError where they lack a number that it needs."""
        reason = fill(self.sentence, answers)
        advice = _fill_or_nothing(self.remedy, answers)
        longer = bool(self.longer(answers) if callable(self.longer) else self.longer)
        return Decision(reason, self.regime, self.excitation, advice=advice, row=self.name, longer=longer)


def first(rows: tuple[Row[A, T], ...], answers: A, thresholds: T) -> Decision:
    """What the first row of a table says whose condition holds, and whose numbers are known."""
    for row in rows:
        if row.holds(answers, thresholds):
            with suppress(UnknownNumberError):
                return row.decision(answers)
    raise AssertionError(f"no row holds; the last one, {rows[-1].name!r}, has to hold always")


_OPTIONAL = re.compile(r"\[(.*?)\]")


class UnknownNumberError(Exception):
    """A sentence needs a number that is not known."""


class _Writer(Formatter):
    """Writes what is known, by the names of answers."""

    def __init__(self, answers: object) -> None:
        self.answers = answers

    def get_value(self, key: int | str, args: object, kwargs: object) -> object:
        """The answer of a name."""
        return getattr(self.answers, str(key))

    def format_field(self, value: object, format_spec: str) -> str:
        """A value in a sentence; raises UnknownNumberError for a number that is not finite."""
        if isinstance(value, float) and not math.isfinite(value):
            raise UnknownNumberError
        return str(super().format_field(value, format_spec))


def fill(text: str, answers: object) -> str:
    """A text with the numbers of answers; raises UnknownNumberError where one is not known.

    What stands in [brackets] is left out then.
    """
    pieces = re.split(_OPTIONAL, text)
    pieces[1::2] = [_fill_or_nothing(piece, answers) for piece in pieces[1::2]]
    pieces[::2] = [_Writer(answers).format(piece) for piece in pieces[::2]]
    return "".join(pieces)


def _fill_or_nothing(text: str, answers: object) -> str:
    """A text with the numbers of answers, or none where one is not known."""
    try:
        return fill(text, answers)
    except UnknownNumberError:
        return ""
