"""The parts of a page about sweeps, comparisons of schemes, stability along a key, branches, and scatter."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from brakecli.analysis.regime.table import Regime
from brakecli.errors import UsageError, escaped
from brakecli.files import fields
from brakecli.files.read import StoredResult
from brakecli.plots import style
from brakecli.plots.result import draw
from brakecli.plots.run import case_of
from brakecli.plots.sweep import SweepPicture, gather, numeric
from brakecli.reports.blocks import Part, Section, Table, Texts, picture, rows_of, shown
from brakecli.reports.of_run import case_blocks, repeat
from brakecli.reports.sweep_map import MOST, maps
from brakecli.sweeps.point import Status

MOST_FAILURES = 20
_TEXTS = ("regime", "excitation", "critical_status", "sustained_status", "reason")
_ERRORS = ("estimated_error", "critical_error", "critical_bias", "unconverged_steps")
_IDLE = ("settled", "settled_from", "steps", "contact_evaluations", "unconverged_steps", "warning_count")
_COMMANDS = {
    "sweep": "sweep SWEEP.toml",
    "comparison": "compare-schemes CASE.toml",
    "stability": "stability CASE.toml --vary …",
    "branch": "branch CASE.toml --parameter …",
    "scatter": "scatter STUDY.toml",
}
_QUESTIONS = {
    "sweep": "Where does this shoe vibrate, and in which way?",
    "critical": "From which value of {} on does steady sliding lose its stability?",
    "stability": "Which modes meet, where, and how fast does the motion grow?",
    "branch": "From which value on does it squeal by itself, and from which on can it squeal?",
    "scatter": "How likely do such brakes squeal, and which scatter decides on it?",
    "comparison": "Which scheme and which step reach the wanted error at the least cost?",
}


def part_of_sweep(result: StoredResult) -> Part:
    """What the page says of a sweep. Raises UnreadableResultError."""
    known = result.variables("/")
    names = [*(name for name in _TEXTS if name in known), *(name for name in numeric(result) if name not in _IDLE)]
    try:
        found = gather(result, more=[*names, *(name for name in _ERRORS if name in known)])
    except UsageError as error:  # more axes than a picture has, or none
        return _plain(result, "sweep", [f"{str(error).removeprefix(f'{result.path}: ')}."], [])
    sweep = found.critical
    question = _QUESTIONS["sweep"] if sweep is None else _QUESTIONS["critical"].format(sweep.parameter)
    blocks: list[Any] = [*maps(found, names)]
    if not blocks:
        blocks.append(Texts([f"Values of single points are left out above {MOST} of them; they are in the file."]))
    blocks.append(picture(f"Picture of the sweep: {found.summary}", partial(draw, result)))
    answer = [*_answer(found), *(f"{each[:1].upper()}{each[1:]}." for each in found.findings)]
    axes = [(axis.key, f"{len(axis.values)} values", f"{axis.text(0)} to {axis.text(-1)}") for axis in found.axes]
    sections = [Section("Map and pictures", blocks), Section("Grid", [Table(axes, ("key", "values", "from, to"))])]
    errors = {name: np.asarray(found.variables.get(name, np.nan), float) for name in _ERRORS}
    accuracy = [
        (name.replace("_", " "), shown(float(np.nanmax(np.abs(values))), found.units[name]))
        for name, values in errors.items()
        if np.isfinite(values).any()
    ]
    table = Table(accuracy or [("error", "not estimated")], ("number", "largest"))
    sections.append(Section("Accuracy", [table]))
    failed = np.ravel(np.asarray(result.read("/", "status")) != Status.DONE)
    reasons, warned = np.ravel(result.read("/", "reason")), np.ravel(result.read("/", "warning"))
    lines = [f"Failed: {reason}." for reason in dict.fromkeys(reasons[failed].tolist())][:MOST_FAILURES]
    lines += [f"{warning}." for warning in dict.fromkeys(warned[warned != ""].tolist())][:MOST_FAILURES]
    sections.append(Section("Warnings", [Texts(lines or ["There are none."])]))
    return _plain(result, "sweep", answer, sections, question)


def _answer(found: SweepPicture) -> Iterator[str]:
    """What the points say, and at which of them the most and the least."""
    done, name, words, end = found["status"] == Status.DONE, "amplitude", "largest amplitude", np.nanargmax
    if found.critical is not None:
        name, words, end = "critical", "least critical value", np.nanargmin
    size, values = done.size, found[name]
    if found.critical is None:
        lasting = np.isin(found["regime"], (Regime.RELAXATION, Regime.QUASI_HARMONIC))
        kinds, counts = np.unique(found["regime"][done], return_counts=True)
        each = ", ".join(f"{kind} at {count}" for kind, count in zip(kinds, counts, strict=True))
        yield f"It vibrates at {lasting.sum()} of {size} points: {each}."
        values = np.where(lasting, values, np.nan)
    else:
        none = int(size - np.isfinite(values).sum())
        yield f"A critical value is found at {size - none} of {size} points."
    yield from (f"Attractor {each}." for each in found.attractors)
    if np.isfinite(values).any():
        place = np.unravel_index(end(values), values.shape)
        where = ", ".join(axis.named(int(at)) for axis, at in zip(found.axes, place[1:], strict=True))
        value = shown(float(f"{values[place]:.4g}"), found.units[name])
        yield f"The {words} is {value}, at {where}."


def part_of_other(result: StoredResult) -> Part:
    """What a page says of a comparison, of stability along a key, of branches or of scatter.

    Raises UnreadableResultError.
    """
    kind = str(result.attributes["kind"])
    declared = {"stability": fields.LOCK_IN, "branch": fields.BRANCH, "scatter": fields.SCATTER}
    known = declared.get(kind, fields.COMPARISON)
    apart = ("title", "recommended", "sentence")
    rows = rows_of((each for each in known if each.name not in apart and each.in_file), result.attributes)
    drawn = picture("Picture of the result", partial(draw, result))
    answer = ["No entry meets the wanted error."]
    if kind == "stability":
        where = ", ".join(f"{value:.6g}" for value in np.ravel(result.attributes.get("critical_values", ())))
        key = ", ".join(map(str, result.attributes.get("parameters", ())))
        answer = [f"Along {key}, stability {f'changes at {where}' if where else 'does not change'}."]
    if kind in ("branch", "scatter"):
        sentence = str(result.attributes.get("sentence", ""))
        answer = [f"{sentence[:1].upper()}{sentence[1:]}."]
    best = result.attributes.get("recommended")
    if kind == "comparison" and isinstance(best, int):
        method, step, error = (style.read_column(result, name)[best] for name in ("method", "step", "error"))
        steps = f"steps of {shown(float(step), 's')}" if np.isfinite(step) else "its own steps"
        answer = [f"Recommended: {method} with {steps}, whose error is {error:.2g}."]
    return _plain(result, kind, answer, [Section("Picture and numbers", [drawn, Table(rows)])])


def _plain(
    result: StoredResult, kind: str, answer: list[str], sections: list[Section], question: str = ""
) -> Part:
    """A part with what is said of every result."""
    loaded, attributes = case_of(result), result.attributes
    given = str(attributes.get("sweep_toml") or attributes.get("study_toml") or attributes.get("case_toml", ""))
    again = repeat(result, f"brakecli {_COMMANDS[kind]} -o again.h5", given)
    sections += [Section("Case", case_blocks(loaded)), Section("How to repeat it", again)]
    title, name = str(attributes.get("title", "")) or "Result without a title", escaped(result.path.name)
    return Part(name, title, question or _QUESTIONS[kind], answer, sections, result.versions)
