"""What samples say: distributions and Sobol indices."""

from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from brakecli.analysis.probability import LEVEL
from brakecli.solver.arrays import Floats

SHARES: tuple[float, ...] = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Shares of the samples below the quantiles that are reported."""


@dataclass(frozen=True)
class Indices:
    """By which part the scatter of each parameter makes an answer vary: alone, and with all others."""

    of: str
    first_order: dict[str, float] = field(default_factory=dict)
    total: dict[str, float] = field(default_factory=dict)
    error: dict[str, float] = field(
        default_factory=dict
    )  # half of the 95 % interval of the total index, by resampling
    together: dict[str, bool] = field(
        default_factory=dict
    )  # whether it also decides together with others: total less first-order index beyond the error of that
    note: str = ""  # why there are none

    @property
    def first(self) -> list[str]:
        """The parameters that decide most, the largest first: with it those whose 95 % intervals reach its own."""
        order = sorted(self.total, key=lambda name: -self.total[name])
        return [
            name
            for name in order
            if self.total[name] + self.error[name] >= self.total[order[0]] - self.error[order[0]]
        ]

    @property
    def sentence(self) -> str:
        """Which parameters decide most, by how much, and whether together; empty where none is known."""
        if not (first := self.first):
            return ""
        decide = "decides" if len(first) == 1 else "decide"
        shares = listed([f"{self.total[name]:.0%}" for name in first])
        ranking = f"{listed(first)} {decide} most on {self.of.replace('_', ' ')}, by {shares}"
        joint = [name for name in first if self.together.get(name)]
        if not joint:
            return ranking
        who = "" if len(first) == 1 else "each " if joint == first else f"{listed(joint)} "
        return f"{ranking}, {who}together with the others (total shares: what several do together counts for each)"

    @classmethod
    def find(cls, of: str, names: tuple[str, ...], answers: Floats, seed: int) -> "Indices":
        """From the answers of the samples of `draw.for_indices`: sets, samples."""
        missing = int(np.isnan(answers).sum())
        if missing:
            none = "have no critical friction" if of == "critical_friction" else "have no answer"
            other = "squeal" if of == "critical_friction" else "limits for the parameters"
            return cls(of, note=f"{missing} of {answers.size} samples {none}; ask for {other}")
        if np.ptp(answers) == 0.0:
            same = f"{of.replace('_', ' ')} is the same in all samples"
            if of == "squeal":
                same = "all samples squeal" if answers.flat[0] else "none of the samples squeals"
            return cls(of, note=f"nothing decides on {of.replace('_', ' ')} here: {same}")
        if len(names) == 1:
            return cls(of, {names[0]: 1.0}, {names[0]: 1.0}, {names[0]: 0.0})
        first, total = _indices(answers)
        rng = np.random.default_rng([seed, len(names)])
        many = answers.shape[1]
        # what chance makes of them, by samples of the samples
        again = np.array([_indices(answers[:, rng.integers(many, size=many)]) for _ in range(200)])
        half = stats.norm.ppf(0.5 + 0.5 * LEVEL)
        errors = half * np.std(again[:, 1], axis=0)
        together = total - first > half * np.std(again[:, 1] - again[:, 0], axis=0)
        named = [dict(zip(names, row.tolist(), strict=True)) for row in (first, total, errors)]
        return cls(of, named[0], named[1], named[2], dict(zip(names, together.tolist(), strict=True)))


def _indices(answers: Floats) -> tuple[Floats, Floats]:
    a = answers[0][None]
    b = answers[1][None]
    mixed = answers[2:, None]
    indices = stats.sobol_indices(func={"f_A": a, "f_B": b, "f_AB": mixed}, n=answers.shape[1])
    return np.ravel(indices.first_order), np.ravel(indices.total_order)


def listed(words: list[str]) -> str:
    """Words as a sentence lists them: a, b and c."""
    *before, last = words
    return f"{', '.join(before)} and {last}" if before else last


def quantiles(values: Floats) -> list[float]:
    """The values below which the known ones lie with the probabilities of `SHARES`; empty where none is known."""
    finite = values[np.isfinite(values)]
    return np.quantile(finite, SHARES).tolist() if len(finite) else []
