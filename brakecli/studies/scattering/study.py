"""A study's tables: which keys scatter, how, and how samples are drawn."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
import tomli_w
from pydantic import Field, ValidationError
from scipy import stats
from scipy.stats.distributions import rv_frozen

from brakecli.analysis.stability.advice import numbers
from brakecli.case import wording
from brakecli.case.case import Case
from brakecli.case.read import LoadedCase, key_path, parse_over_case, put
from brakecli.case.tables import MISSING, Number, OverCase, Positive, Table, described, from_list, key_schema
from brakecli.errors import CaseError, KeyPath, Problem, found_text
from brakecli.results.toml_lines import innermost
from brakecli.solver.arrays import Floats

SCRAMBLINGS = 8
"""Sequences of a study, each with its own scrambling: what they differ by gives the intervals."""
_NUMBERS = ("low", "high", "mean", "deviation", "tolerance_percent")


class _Law(NamedTuple):
    """A distribution, and the probabilities below both ends of what is kept of it, or above them."""

    distribution: rv_frozen
    first: float
    last: float
    above: bool

    @property
    def probability(self) -> float:
        """That of what is kept."""
        return abs(self.last - self.first)


class Parameter(Table):
    """One quantity that scatters: the key paths that take its value, and its distribution."""

    alternatives = (("key",), ("keys",))

    key: str | None = described("key path of the case", None)
    keys: Annotated[tuple[str, ...], Field(min_length=1), *from_list] | None = described(
        "key paths that take the same value", None
    )
    distribution: Literal["uniform", "normal", "lognormal", "triangular"] = described("its distribution")
    low: Number | None = described("least value; of a normal one without a mean, three deviations below it", None)
    high: Number | None = described("largest value", None)
    mean: Number | None = described("mean", None)
    deviation: Positive | None = described("standard deviation", None)
    tolerance_percent: Positive | None = described(
        "in place of low and high: how many per cent they lie below and above the value of the case", None
    )
    mode: Number | None = described('where "triangular" is likeliest; the middle if left out', None)

    @property
    def paths(self) -> tuple[str, ...]:
        """The key paths that it sets."""
        return self.keys if self.keys is not None else (self.key or "",)

    def _broken_rules(self) -> Iterator[Problem]:
        yield from super()._broken_rules()
        present = [name for name in _NUMBERS if getattr(self, name) is not None]
        for name in ("key", "keys"):
            for text in self.paths if getattr(self, name) is not None else ():
                yield from self._wrong_key(name, text)
        normal = self.distribution == "normal"
        bounded = self.distribution in ("uniform", "triangular")
        for one, other in (("low", "high"), ("mean", "deviation")):
            alone = [name for name in (one, other) if name in present]
            if len(alone) == 1:
                yield self.wrong(alone[0], "is given alone", f"give {one} and {other} together")
        if not present:
            yield Problem(
                ("low",), MISSING, "give low and high, mean and deviation, or tolerance_percent", instead=_NUMBERS
            )
        low = self.low
        high = self.high
        mode = self.mode
        limited = low is not None and high is not None
        rising = low is None or high is None or low < high
        takes_mode = self.distribution == "triangular" and limited
        outside = mode is not None and low is not None and high is not None and not low <= mode <= high
        keep = "keep one of the two"
        others = " and ".join(present[:-1])
        both = self.tolerance_percent is not None and len(present) > 1
        both_limits = bounded and self.mean is not None and low is not None
        only = "is only for a triangular distribution with low and high"
        yield from self.broken(
            (both, "tolerance_percent", f"is given together with {others}", keep),
            (both_limits, "mean", "is given together with low and high", keep),
            (not rising, "high", "is not above low", "give a range"),
            (mode is not None and not takes_mode, "mode", only, "leave it out"),
            (takes_mode and outside, "mode", "is not between low and high", "give a value between them"),
        )
        positive = all(value is None or value > 0.0 for value in (low, self.mean))
        cut = not bounded and limited and None not in (self.mean, self.deviation)
        if cut and rising and (normal or positive) and not self._law.probability > 1e-12:
            yield self.wrong("low", "and high lie where no value falls", "take limits nearer to the mean")
        if self.distribution == "lognormal":
            for name in ("low", "mean"):
                value = getattr(self, name)
                if value is not None and value <= 0.0:
                    yield self.wrong(name, "is not above 0", "a lognormal value is above 0")

    def _wrong_key(self, name: str, text: str) -> Iterator[Problem]:
        """What is wrong with a key path, and with the limits, or the mean, that it is to take."""
        path = key_path(text)
        if not path:
            yield Problem((name,), "is not a key path" + found_text(text), 'write it as in "link2.angle_deg"')
            return
        unknown = False
        try:
            key_schema(Case, path)
        except KeyError:
            unknown = True
        limits = {bound: getattr(self, bound) for bound in ("low", "high", "mean")}
        values = {bound: value for bound, value in limits.items() if value is not None}
        for where, value in list({name: 0.0}.items() if unknown else values.items())[:2]:
            data: dict[str, object] = {}
            put(data, path, value, Case, kept=())
            try:
                Case.model_validate(data)
            except ValidationError as error:
                problems = wording.problems(error, Case)
                wrong = [problem for problem in problems if problem.path == path[: len(problem.path)]]
                for problem in wrong:
                    yield Problem((where,), f"{text} {'is unknown' if unknown else problem.what}", problem.remedy)
                if wrong:
                    return

    def over(self, case: Case) -> "Parameter":
        """The same with its limits, where they are given in per cent of the case's values; raises CaseError."""
        if self.tolerance_percent is None:
            return self
        own = dict.fromkeys(numbers(case).get(key_path(text)) for text in self.paths)
        value, *others = own
        remedy = "give low and high"
        if others:
            what = f"{', '.join(self.paths)} differ in the case: {', '.join(map(str, own))}"
        elif not isinstance(value, float) or not value:
            what = f"{', '.join(self.paths)} {'is 0' if value == 0.0 else 'has no value'} in the case"
        else:
            share = 0.01 * self.tolerance_percent
            low, high = sorted((value * (1.0 - share), value * (1.0 + share)))
            data = {**self.model_dump(exclude_none=True), "low": low, "high": high}
            del data["tolerance_percent"]
            try:
                return Parameter.model_validate(data)
            except ValidationError as error:
                raise CaseError(
                    [
                        replace(problem, path=("tolerance_percent",))
                        for problem in wording.problems(error, Parameter)
                    ]
                ) from None
        raise CaseError([self.wrong("tolerance_percent", f"is part of nothing: {what}", remedy)])

    @cached_property
    def _law(self) -> "_Law":
        low, high, mean, deviation = (getattr(self, name) for name in _NUMBERS[:4])
        uniform, normal = (self.distribution == name for name in ("uniform", "normal"))
        bounded = uniform or self.distribution == "triangular"
        whole = None in (low, high, mean, deviation)
        if bounded:
            if low is None:
                half = deviation * math.sqrt(3.0 if uniform else 6.0)
                low = mean - half
                high = mean + half
            width = high - low
            mode = 0.5 * (low + high) if self.mode is None else self.mode
            law = stats.uniform(low, width) if uniform else stats.triang((mode - low) / width, low, width)
        elif mean is None:
            ends = (low, high) if normal else (math.log(low), math.log(high))
            middle = 0.5 * (ends[0] + ends[1])
            spread = (ends[1] - ends[0]) / 6.0  # three deviations to each limit: 99.7 % lie between
            law = stats.norm(middle, spread) if normal else stats.lognorm(spread, scale=math.exp(middle))
        elif normal:
            law = stats.norm(mean, deviation)
        else:
            spread = math.sqrt(math.log1p((deviation / mean) ** 2))
            law = stats.lognorm(spread, scale=mean * math.exp(-0.5 * spread**2))
        if bounded or whole:
            return _Law(law, 0.0, 1.0, False)
        above = bool(low > law.median())  # probabilities above are exact there; those below are 1 but for rounding
        ends = (law.sf(low), law.sf(high)) if above else (law.cdf(low), law.cdf(high))
        return _Law(law, float(ends[0]), float(ends[1]), above)

    def values(self, parts: Floats) -> Floats:
        """The values below which it lies with these probabilities."""
        law, first, last, above = self._law
        within = first + parts * (last - first)
        return np.asarray(law.isf(within) if above else law.ppf(within), np.float64)

    def beside(self, path: str, own: float) -> str:
        """What is said of a drawing whose own value lies where next to none of the samples do; empty elsewhere."""
        law = self._law.distribution
        rare = 1.35e-3  # what lies beyond three deviations of a normal distribution
        low = float(law.ppf(rare)) if self.low is None else self.low
        high = float(law.isf(rare)) if self.high is None else self.high
        if low <= own <= high:
            return ""
        return f"{path}: the case has {own:.4g}, but the study scatters it between {low:.4g} and {high:.4g}"


_Row = Annotated[tuple[Number, ...], *from_list]


class Study(OverCase):
    """A case whose keys scatter, and what is asked of it."""

    samples: Annotated[int, Field(ge=SCRAMBLINGS)] = described("how many brakes are drawn", 1024)
    seed: Annotated[int, Field(ge=0)] = described("of the random numbers", 0)
    sampling: Literal["sobol", "latin-hypercube", "random"] = described("how samples are drawn", "sobol")
    method: Literal["run", "eigenvalue"] = described(
        "whether samples are run, or only their eigenvalues are asked", "eigenvalue"
    )
    band: Annotated[tuple[Positive, ...], *from_list] | None = described(
        "frequencies (Hz) between which a self-excited vibration is squeal; any if left out", None
    )
    indices_of: Literal["critical_friction", "growth_rate", "squeal", "none"] = described(
        'what the Sobol indices are about; "none" leaves them out', "critical_friction"
    )
    parameter: Annotated[tuple[Parameter, ...], *from_list] = described("what scatters", ())
    correlation: Annotated[tuple[_Row, ...], *from_list] | None = described(
        "correlations of the parameters' normal scores, in their order: a list of rows", None
    )

    def _broken_rules(self) -> Iterator[Problem]:
        if not self.parameter:
            yield Problem(("parameter",), MISSING, "give at least one [[parameter]]")
        if self.band is not None and not (len(self.band) == 2 and self.band[0] < self.band[1]):
            yield self.wrong(
                "band", "is no pair of frequencies that rise", "give the lower one, then the higher one"
            )
        taken: set[tuple[str, ...]] = set()
        for index, parameter in enumerate(self.parameter):
            for text in parameter.paths:
                if key_path(text) in taken:
                    yield Problem(
                        ("parameter", index, "key"),
                        "is set twice" + found_text(text),
                        "let each key path scatter once",
                    )
                taken.add(key_path(text))
        if self.correlation is not None:
            yield from self._wrong_correlation()

    def _wrong_correlation(self) -> Iterator[Problem]:
        rows = self.correlation or ()
        count = len(self.parameter)
        what = ""
        if [*map(len, rows)] != [count] * count:
            what = f"is no matrix with {count} rows of {count} numbers"
        else:
            matrix = np.array(rows)
            if not (np.diag(matrix) == 1.0).all() or not (matrix == matrix.T).all():
                what = "is not symmetric with ones on its diagonal"
            elif not np.linalg.eigvalsh(matrix)[0] > 1e-9:  # what is less may be rounding
                what = "contradicts itself: no quantities correlate so"
        if what:
            yield Problem(
                ("correlation",), what, "give the correlation of each parameter with each, a row for each"
            )

    def columns(self, values: Floats) -> dict[str, list[float]]:
        """Values of the parameters, which stand along the last axis, by the key paths that take them."""
        rows = values.reshape(-1, len(self.parameter))
        return {key: rows[:, n].tolist() for n, parameter in enumerate(self.parameter) for key in parameter.paths}

    @property
    def names(self) -> tuple[str, ...]:
        """The first key path of each parameter."""
        return tuple(parameter.paths[0] for parameter in self.parameter)


@dataclass(frozen=True)
class LoadedStudy:
    """A study with the text that it was read from, and its case."""

    unresolved: Study
    text: str
    base: LoadedCase
    name: str  # of its file
    lines: Mapping[KeyPath, int]  # of its keys

    @cached_property
    def study(self) -> Study:
        """The study with its limits; raises CaseError."""
        laws = list[Parameter]()
        wrong = list[Problem]()
        for number, parameter in enumerate(self.unresolved.parameter):
            try:
                laws.append(parameter.over(self.base.case))
            except CaseError as error:
                wrong += (self.at(number, problem) for problem in error.problems)
        if wrong:
            raise CaseError(wrong)
        return self.unresolved.model_copy(update={"parameter": tuple(laws)})

    def at(self, number: int, problem: Problem) -> Problem:
        """The problem of a parameter, with its line."""
        path = ("parameter", number, *problem.path)
        return replace(problem, path=path, source=self.name, line=innermost(self.lines, path, 0))

    def beside(self, case: Case) -> list[str]:
        """Sentences on values of a drawing that lie beside all samples."""
        own = numbers(case)
        laws = ((law, path, own.get(key_path(path))) for law in self.study.parameter for path in law.paths)
        said = (law.beside(path, value) for law, path, value in laws if isinstance(value, float))
        return [sentence for sentence in said if sentence]

    @property
    def resolved(self) -> str:
        """The study as TOML, with overrides and defaults filled in."""
        return tomli_w.dumps(self.study.model_dump(mode="json", exclude_none=True))

    @property
    def title(self) -> str:
        """The title of the study, otherwise that of its case."""
        return self.study.title or self.base.case.title


def parse_study(text: str, name: str, folder: Path, overrides: Sequence[str] = ()) -> LoadedStudy:
    """Make a study of its text; the path of its case begins at `folder`. Raises `CaseError`.

    Overrides of its own keys belong to the study, all others to its case.
    """
    study, base, lines = parse_over_case(Study, text, name, folder, overrides, {*Study.model_fields} - {"title"})
    loaded = LoadedStudy(study, text, base, name, lines)
    assert loaded.study  # its limits are known
    return loaded
