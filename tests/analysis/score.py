"""The score: what `brakecli run` says of random shoes, beside the answers, and what of it is wrong."""

import math
from collections import Counter
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import tomli_w

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.decision import Thresholds
from brakecli.analysis.regime.table import decide
from brakecli.case.read import parse_case
from brakecli.results.read import open_result
from brakecli.solver.quantities import HISTORY
from brakecli.studies.runs.run import run
from tests.analysis.answers import VX, Answer, X, answer, last_eighth, levels, sticks_per_cycle
from tests.analysis.shoes import Array, Shoe, Tables, random_shoes

RESULT = "score.h5"
SUSTAINED = ("relaxation", "quasi-harmonic")
WRONG: dict[str, dict[str, str]] = {  # answer: what may not be said of it, and why
    "dies": {"sustained": "sustained is said of what dies", "forced": "forced is said of a smooth wheel"},
    "carried": {"sustained": "sustained is said of a shoe that is carried along"},
    "gone": {"sustained": "sustained is said of a shoe that has left"},
    "neutral": {
        "none": "died out is said of what neither grows nor decays",
        "sustained": "sustained, of a neutral one",
    },
    "grows": {
        "none": "died out is said of what grows",
        "forced": "forced is said of what grows by itself",
        "sustained": "settled is said of what still grows",
    },
    "swells": {"none": "died out is said of what grows", "forced": "forced is said of what grows by itself"},
    "lasts": {"none": "died out is said of what lasts", "forced": "forced is said of what is self-excited"},
    "forced": {
        "none": "died out is said of what the roughness shakes",
        "sustained": "self-excited, of what is forced",
    },
    "not self-excited": {"sustained": "self-excited is said of what friction does not excite"},
    "no answer": {},
}


def said(numbers: dict[str, Any]) -> str:
    """A verdict in a word."""
    if numbers["regime"] in SUSTAINED:
        return "sustained"
    if numbers["regime"] == "damped":
        return "forced" if numbers["excitation"] == "forced" else "none"
    return "undecided"


def wrong(tables: Tables, numbers: dict[str, Any], rows: Array, true: Answer) -> str | None:
    """Why a verdict contradicts the answer, or None."""
    word = said(numbers)
    why = WRONG[true.name].get(word)
    if true.name == "neutral" and word == "forced" and own_share(tables, rows) > 0.5:
        return "forced is said of a vibration most of which is the shoe's own, which does not die"
    if why and true.name == "forced" and word == "none" and shaking(tables, rows) < 1e-3:
        return None
    if why is None and word == "sustained" and true.name in ("lasts", "swells"):
        sticks = sticks_per_cycle(rows[-(len(rows) // 4) :]), true.sticks
        if numbers["regime"] == "relaxation" and sticks == (0.0, 0.0):
            return "relaxation is said of what never sticks"
        if numbers["regime"] == "quasi-harmonic" and min(each or 0.0 for each in sticks) >= 0.9:
            return "quasi-harmonic is said of what sticks in every cycle"
    return why


def shaking(tables: Tables, rows: Array) -> float:
    """Half of peak to peak of the x that lasts, over the static compression and displacement."""
    size = float(np.abs(Shoe.of(tables).rest).max())
    return 0.5 * float(np.ptp(last_eighth(rows)[:, X])) / size


def own_share(tables: Tables, rows: Array) -> float:
    """Part of vx in the second half that the frequencies of the waves and the sums of two of them do not hold."""
    belt = Shoe.of(tables).belt
    part = rows[len(rows) // 2 :]
    passing = [abs(belt) / length for length in tables["roughness"]["wheel"]["wavelengths"]]
    lines = {*passing, *(abs(f + s * g) for f in passing for g in passing for s in (-1.0, 1.0))}
    time = 2.0 * math.pi * tables["output"]["sample_interval"] * np.arange(len(part))
    basis = np.stack([one(f * time) for f in sorted(lines) for one in (np.cos, np.sin)], axis=1)
    left = part[:, VX] - basis @ np.linalg.lstsq(basis, part[:, VX], rcond=None)[0]
    return float(left.std() / part[:, VX].std())


def verdict(tables: Tables, folder: Path) -> tuple[Tables, dict[str, Any], Array] | None:
    """The case, what `brakecli run` says of it, and its samples; None where the run fails at three steps."""
    path = folder / RESULT
    for finer in (1, 3, 3):
        tables = {**tables, "solver": {**tables["solver"], "step": tables["solver"]["step"] / finer}}
        numbers = run(parse_case(tomli_w.dumps(tables), "score"), path, force=True).numbers()
        if not numbers["failure"]:
            with open_result(path) as result:
                columns = [result.read("history", name) for name in HISTORY]
            return tables, numbers, np.stack(columns, axis=1).astype(float)
    return None


MOVED = {
    (name, value): Thresholds(**{name: value})
    for name, values in {
        "settled_within": (0.025, 0.1),
        "sure_errors": (1.5, 6.0),
        "comes_together": (0.5, 2.0),
        "same_level": (0.15, 0.6),
        "most": (1.0, 4.0),
        "fewest_cycles": (5.0, 20.0),
        "samples_per_cycle": (4.0, 16.0),
        "band_share": (0.95, 0.8),
    }.items()
    for value in values
}
"""Each threshold half and twice as large; of a share that is near 1 what it lacks. The others define words."""


def moved(numbers: dict[str, Any], limits: Thresholds) -> dict[str, Any]:
    """What is said with other thresholds, by the record of answers."""
    found = decide(Answers.of(numbers["evidence"]), limits)
    return {**numbers, "regime": str(found.regime), "excitation": str(found.excitation)}


BESIDE = ("neutral", "grows", "swells", "carried", "gone")  # answers of which nothing else may be said


@dataclass
class Score:
    """What was said of how many shoes with which answers, what was wrong or undecided, how many runs failed."""

    said: Counter[tuple[str, str]]
    mistakes: list[tuple[Tables, dict[str, Any], Answer, str]]
    undecided: list[tuple[Tables, str, Answer]]  # with the reason, where more can be said
    open: int = 0  # undecided where the answer is not known either
    moved: list[tuple[Thresholds, Tables, str]] = field(default_factory=list)  # wrong with other thresholds
    fewer: Counter[tuple[str, float]] = field(default_factory=Counter)  # decided no more, by threshold and value
    failed: int = 0

    @property
    def judged(self) -> int:
        """All of them but failed runs."""
        return sum(self.said.values())


@cache
def score(stratum: str, count: int, seed: int) -> Score:
    """Judge so many random shoes."""
    found = Score(Counter(), [], [])
    with TemporaryDirectory() as folder:
        for drawn in islice(random_shoes(stratum, seed), count):
            told = verdict(drawn, Path(folder))
            if told is None:
                found.failed += 1
                continue
            tables, numbers, rows = told
            true = answer(tables, rows)
            if true.name == "lasts" and levels(rows)[-1] > 1.03 * levels(rows)[-2]:
                true = replace(true, name="swells")
            found.said[true.name, said(numbers)] += 1
            neutral = Shoe.of(tables).rate == 0.0 and not Shoe.of(tables).b.any()
            if said(numbers) == "undecided" and not neutral and true.name not in BESIDE:
                if true.name == "no answer":
                    found.open += 1
                else:
                    found.undecided.append((tables, numbers["reasons"][0], true))
            for named, limits in MOVED.items():
                other = moved(numbers, limits)
                found.fewer[named] += said(other) == "undecided" != said(numbers)
                if why := wrong(tables, other, rows, true):
                    found.moved.append((limits, tables, why))
            if why := wrong(tables, numbers, rows, true):
                found.mistakes.append((tables, numbers, true, why))
    return found
