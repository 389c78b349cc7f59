"""The parts of a page about sweeps, comparisons of schemes, stability along a key, branches, and scatter."""

import shlex
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from brakecli.analysis.regime.decision import Regime
from brakecli.case.read import parse_case, parse_table
from brakecli.errors import CaseError, UsageError, escaped
from brakecli.results import fields
from brakecli.results.numbers import stored_numbers
from brakecli.results.read import StoredResult
from brakecli.results.stability_fields import BRANCH, LOCK_IN, PROBABLE, SCATTER
from brakecli.results.toml_lines import Located
from brakecli.studies.sweeps.point_list import GIVEN
from brakecli.studies.sweeps.record import Status
from brakecli.views.plots import style
from brakecli.views.plots.gather import gather, numeric
from brakecli.views.plots.result import draw
from brakecli.views.plots.run import case_of
from brakecli.views.plots.sweep import SweepPicture
from brakecli.views.points import of_comparison, regimes_sentence
from brakecli.views.reports.blocks import (
    PAGE,
    Block,
    Code,
    Numbers,
    Part,
    Picture,
    Section,
    Table,
    Texts,
    blocks_of,
    key_unit,
    numbers_of,
    picture,
    share,
    shown,
)
from brakecli.views.reports.of_run import case_blocks, repeat
from brakecli.views.reports.sweep_map import MOST, maps
from brakecli.views.stability import of_branch, of_lock_in, of_scatter
from brakecli.views.view import sentence

_PROBABILITY = "probability", "probability_lower", "probability_upper"
_TEXTS = ("regime", "excitation", "critical_status", "sustained_status", "reason")
_ERRORS = ("estimated_error", "critical_error", "critical_bias", "unconverged_steps")
_IDLE = ("settled", "settled_from", "steps", "contact_evaluations", "unconverged_steps", "warning_count")
_COMMANDS = {
    "sweep": "sweep SWEEP.toml",
    "comparison": "compare-schemes CASE.toml",
    "stability": "stability CASE.toml --vary {}",
    "branch": "branch CASE.toml --parameter {}",
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
_PICTURES = {
    "comparison": "The errors of all methods against their times",
    "stability": "Lock-in diagram: frequencies and growth rates of both modes along the key",
    "branch": "Amplitude and frequency of all motions along the key; stable ones full, unstable ones dashed",
    "scatter": "Probabilities with their intervals, what decides on them, and how numbers are distributed",
}
_STANDS_FOR = {"CASE.toml": "the case", "SWEEP.toml": "the sweep", "STUDY.toml": "the study"}
_ADVISE = dict.fromkeys(("sweep", "stability", "branch"), "brakecli advise CASE.toml")
_ADVISE["scatter"] = "brakecli advise CASE.toml --scatter STUDY.toml"


def part_of_sweep(result: StoredResult) -> Part:
    """What the page says of a sweep. Raises UnreadableResultError."""
    variables = result.variables("/")
    names = [name for name in _TEXTS if name in variables]
    names += [name for name in numeric(result) if name not in _IDLE]
    try:
        sweep_picture = gather(result, more=[*names, *(name for name in _ERRORS if name in variables)])
    except UsageError as error:  # more axes than a picture has, or none
        return _plain(result, "sweep", [f"{str(error).removeprefix(f'{result.path}: ')}."], None, list, {})
    sweep = sweep_picture.critical
    question = _QUESTIONS["sweep"] if sweep is None else _QUESTIONS["critical"].format(sweep.parameter)
    drawn = picture(f"Picture of the sweep: {sweep_picture.summary}", partial(draw, result))
    said, numbers = _answer(sweep_picture)
    answer = [*said, *(f"{finding[:1].upper()}{finding[1:]}." for finding in sweep_picture.findings)]
    sections = partial(_points, result, sweep_picture, names)
    return _plain(result, "sweep", answer, drawn, sections, numbers, question)


def _points(result: StoredResult, sweep_picture: SweepPicture, names: list[str]) -> list[Section]:
    """The points of a sweep with all their values, their errors and warnings."""
    points: list[Block] = [*maps(sweep_picture, names)]
    if not points:
        points.append(Texts([f"Values of single points are left out above {MOST} of them; they are in the file."]))
    axes = [
        (axis.key, f"{len(axis.values)} values", f"{axis.text(0)} to {axis.text(-1)}")
        for axis in sweep_picture.axes
    ]
    grid = Table(axes, ("key", "values", "from, to"))
    errors = {name: np.asarray(sweep_picture.variables.get(name, np.nan), float) for name in _ERRORS}
    accuracy = [
        (name.replace("_", " "), shown(float(np.nanmax(np.abs(values))), sweep_picture.units[name]))
        for name, values in errors.items()
        if np.isfinite(values).any()
    ]
    table = Table(accuracy or [("error", "not estimated")], ("number", "largest"))
    failed = np.ravel(np.asarray(result.read("/", "status")) != Status.DONE)
    reasons = np.ravel(result.read("/", "reason"))
    warned = np.ravel(result.read("/", "warning"))
    most = 20  # of each
    lines = [f"Failed: {reason}." for reason in dict.fromkeys(reasons[failed].tolist())][:most]
    lines += [f"{warning}." for warning in dict.fromkeys(warned[warned != ""].tolist())][:most]
    return [
        Section("Points and their values", [grid, *points]),
        Section("Accuracy", [table]),
        Section("Warnings", [Texts(lines or ["There are none."])]),
    ]


def _answer(sweep_picture: SweepPicture) -> tuple[list[str], Numbers]:
    """What the points say, and at which of them the most and the least; and the numbers of that."""
    done = sweep_picture["status"] == Status.DONE
    name = "amplitude"
    words = "largest amplitude"
    end = np.nanargmax
    if sweep_picture.critical is not None:
        name = "critical"
        words = "least critical value"
        end = np.nanargmin
    size = done.size
    values = sweep_picture[name]
    numbers: dict[str, tuple[object, str]] = {"points": (size, "1")}
    if sweep_picture.critical is None:
        lasting = np.isin(sweep_picture["regime"], (Regime.RELAXATION, Regime.QUASI_HARMONIC))
        kinds, counts = np.unique(sweep_picture["regime"][done], return_counts=True)
        regimes = dict(zip(kinds.tolist(), counts.tolist(), strict=True))
        said = [sentence(regimes_sentence(regimes, size))]
        numbers |= {f"{kind} at": (count, "1") for kind, count in regimes.items()}
        values = np.where(lasting, values, np.nan)
    else:
        there = int(np.isfinite(values).sum())
        said = [f"A critical value is found at {there} of {size} points."]
        numbers["with a critical value"] = there, "1"
    said += (f"Attractor {attractor}." for attractor in sweep_picture.attractors)
    if np.isfinite(values).any():
        index = np.unravel_index(end(values), values.shape)
        where = sweep_picture.named(index[1:])
        value = float(f"{values[index]:.4g}")
        said.append(f"The {words} is {shown(value, sweep_picture.units[name])}, at {where}.")
        numbers |= {words: (value, sweep_picture.units[name]), f"{words} at": (where, "")}
    return said, numbers


def part_of_other(result: StoredResult) -> Part:
    """What a page says of a comparison, of stability along a key, of branches or of scatter.

    Raises UnreadableResultError.
    """
    kind = str(result.attributes["kind"])
    declared = {"stability": LOCK_IN, "branch": BRANCH, "scatter": SCATTER}
    apart = ("title", "recommended", "sentence")
    key = _unit_of_key(result)
    single = [
        replace(field, units=key) if field.units == "of the key" else field
        for field in declared.get(kind, fields.COMPARISON)
        if field.name not in apart and field.in_file
    ]
    numbers = stored_numbers(result)
    results = [field for field in single if not field.name.endswith("_error") and "windows" not in field.name]
    compared = numbers_of(results, result.attributes)  # how well a number is known is none to compare by
    drawn = picture(_PICTURES[kind], partial(draw, result))
    views = {
        "stability": lambda: of_lock_in(numbers, PAGE, key),
        "branch": lambda: of_branch(numbers, "", key, PAGE),
        "scatter": lambda: of_scatter(numbers, ""),
        "comparison": lambda: of_comparison(numbers, {}, ""),
    }
    view = views[kind]()
    answer = [*view.answer]
    study = list[Section]()
    if kind == "scatter":
        said, tables_of_study = _study(result)
        answer.append(said)
        study = [Section("Study", tables_of_study)]
        shares = {
            f"probability: {PROBABLE.get(name, name)}": share(value)
            for name, value in numbers["probability"].items()
        }
        compared = {**shares, **compared}
    part = _plain(result, kind, answer, drawn, lambda: [*study, Section("Numbers", blocks_of(view))], compared)
    if kind != "scatter" or "squeal" not in numbers["probability"]:
        return part
    middle, low, high = (float(numbers[name]["squeal"]) for name in _PROBABILITY)
    return replace(part, squeal=(middle, low, high))


def _study(result: StoredResult) -> tuple[str, list[Table]]:
    """Which brakes a study is about and what it calls squeal; what scatters, and how it was asked."""
    from brakecli.studies.scattering.study import Study  # with scipy.stats, for which other pages need not wait

    name = "resolved_study_toml" if "resolved_study_toml" in result.attributes else "study_toml"
    try:
        study = parse_table(Study, result.text(name), "its study")
    except CaseError as error:
        raise style.unreadable(result, f"the study in it is not valid: {error.problems[0]}") from error
    laws = [
        (
            ", ".join(law.paths),
            law.distribution,
            ", ".join(
                f"{name} {shown(value, key_unit(law.paths[0]))}"
                for name in ("mean", "deviation", "mode", "low", "high")
                if (value := getattr(law, name)) is not None
            ),
        )
        for law in study.parameter
    ]
    settings = [
        (
            name,
            shown(getattr(study, name), "Hz" if name == "band" else ""),
            str(Study.model_fields[name].description),
        )
        for name in ("samples", "seed", "sampling", "method", "band", "indices_of", "correlation")
        if getattr(study, name) is not None
    ]
    band = " from {} to {}".format(*(shown(bound, "Hz") for bound in study.band)) if study.band else ""
    scatter = f"{', '.join(study.names)} {'scatters' if len(study.names) == 1 else 'scatter'}"
    said = f"Such brakes are those of the case in which {scatter}; squeal is a vibration of their own{band}."
    return said, [Table(laws, ("what scatters", "distribution", "its numbers")), Table(settings)]


def _unit_of_key(result: StoredResult) -> str:
    """The unit of the key, or of the first of the keys, along which a result was computed."""
    keys = result.attributes.get("parameters", result.attributes.get("parameter", ""))
    return key_unit(str(np.ravel(keys)[0]).partition(",")[0])


def _range(result: StoredResult, kind: str) -> str:
    """The key, or keys, along which a result was computed, with both ends, as an option of its command."""
    key = str(result.attributes.get("parameter", ""))
    ends = list[object]()
    if kind == "branch":
        ends = [result.attributes.get(name, 0.0) for name in ("lower", "upper")]
    if kind == "stability":
        values = style.read_column(result, result.variables("/")["frequencies"].dims[0])
        key = ",".join(map(str, result.attributes.get("parameters", ())))
        ends = [float(values[0]), float(values[-1]), len(values)]
    return escaped(shlex.quote(f"{key}={':'.join(map(repr, ends))}"))


def _plain(
    result: StoredResult,
    kind: str,
    answer: list[str],
    drawn: Picture | None,
    sections: Callable[[], list[Section]],
    numbers: Numbers,
    question: str = "",
) -> Part:
    """A part with what is said of every result."""
    attributes = result.attributes

    def appendix() -> list[Section]:
        source = str(
            attributes.get("sweep_toml") or attributes.get("study_toml") or attributes.get("case_toml", "")
        )
        line = f"brakecli {_COMMANDS[kind].format(_range(result, kind))} -o again.h5"
        again = repeat(result, line, source)
        as_what = "a whole" if "CASE" in line else f"it was given; its case is {case_file or 'the one above'}"
        again.append(Texts([f"{_stands_for(line)}, which is above as {as_what}."]))
        case = Section("Case", case_blocks(case_of(result)))
        return [*sections(), case, Section("How to repeat it", again)]

    case_file = _case_file(result)
    title = str(attributes.get("title", "")) or "Result without a title"
    name = escaped(result.path.name)
    asks = question or _QUESTIONS[kind]
    what = "This names the keys of such a case to change, and to which values:"
    change = list[Block]()
    if kind in _ADVISE:
        advise = _ADVISE[kind].replace("CASE.toml", case_file or "CASE.toml")
        change = [Texts([what]), Code(advise)]
        if unknown := _stands_for(advise):
            change.append(Texts([f"{unknown}: a page with --full has the text to copy."]))
    return Part(name, title, asks, answer, drawn, change, appendix, numbers, result.versions)


def _stands_for(line: str) -> str:
    """What names of files in a command stand for that no file has; empty where there are none."""
    words = line.split()
    return " and ".join(
        f"{name} stands for the file of {what}" for name, what in _STANDS_FOR.items() if name in words
    )


def _case_file(result: StoredResult) -> str:
    """The case file of a sweep or a study, as a command names it; empty where it is not known to hold the case.

    Settings of the command line may have changed the case since.
    """
    attributes = result.attributes
    table = str(attributes.get("resolved_sweep_toml") or attributes.get("resolved_study_toml") or "")
    try:
        name = str(Located(table).data.get("case", GIVEN))
        same = parse_case(result.text("case_toml"), name).resolved == result.text("resolved_toml")
    except CaseError:
        return ""
    return escaped(shlex.quote(name)) if same and name != GIVEN else ""
