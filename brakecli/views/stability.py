"""Views of what `stability`, `advise`, `branch` and `scatter` have found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict

from brakecli.analysis.stability.advice import percent, rounded
from brakecli.results import stability_fields as fields
from brakecli.results.field import labelled
from brakecli.views.render import Renderer, text_of
from brakecli.views.view import SHORT_POINTS, Row, Table, View, details, sentence, sentences

if TYPE_CHECKING:
    from brakecli.analysis.stability.advice import Change, Left
    from brakecli.studies.runs.advise import AdviceReport

_MOVES = "Critical friction for 1 % and for 1 unit of a value; growth rate (1/s) for 1 %"
_STATE = {True: "stable", False: "unstable", None: "-"}
_Rows = Sequence[Mapping[str, object]]  # by the names of `--json`


class _Mode(TypedDict):
    """A mode among the numbers of `--json`."""

    frequency: float
    growth: float
    damping_ratio: float
    shape: float | None
    shape_phase: float | None


class _Crossing(TypedDict):
    """A change of stability among the numbers of `--json`."""

    friction: float
    lost: bool
    instability: str
    frequency: float


def of_stability(numbers: Mapping[str, Any], title: str, show: Renderer, units: str = "") -> View:
    """Steady sliding, its modes and both thresholds of friction; below that what there is along a key.

    `numbers` are those of `--json`; `units` those of the key that is varied.
    """
    phi = numbers["friction_coefficient"]
    modes = numbers["modes"]
    crossings = numbers["crossings"]
    critical = numbers["critical_friction"]
    equilibrium = numbers["equilibrium"]
    answer = [numbers.get("sentence") or _without_loss(numbers), _at_own(modes, numbers["stable"], phi, show)]
    lost = [crossing for crossing in crossings if crossing["friction"] == critical]
    rows = [Row("critical friction", _critical(lost, numbers["critical_error"], show))]
    others = [_crossing(crossing, show) for crossing in crossings if crossing["friction"] != critical]
    rows += [Row("also changes at", text) for text in others]
    if numbers.get("coexists_from") is not None:
        rows.append(Row("can vibrate from", show.text(numbers["coexists_from"])))
    if numbers.get("barrier") is not None:
        rows.append(Row("barrier", show.text(numbers["barrier"], "m")))
    rows += [Row(f"mode at {show.text(mode['frequency'], 'Hz')}", _mode(mode)) for mode in modes]
    if equilibrium is not None:
        position = show.text(equilibrium["y"] + 0.0, "m")
        force = show.text(equilibrium["normal_force"], "N")
        touching = f"{100.0 * equilibrium['contact_fraction']:.3g} % of the pad touches"
        rows.append(Row("steady sliding", f"y = {position}, F_y = {force}, {touching}"))
    undamped = {kind: numbers[f"undamped_{kind}_friction"] for kind in ("flutter", "divergence")}
    losses = [f"{kind} at {show.text(friction)}" for kind, friction in undamped.items() if friction is not None]
    stiffness = show.with_error(numbers["contact_stiffness"], numbers["contact_stiffness_error"], "N/m")
    shapes = [Row(f"shape at {show.text(mode['frequency'], 'Hz')}", _shape(mode)) for mode in modes]
    aside = [
        Row("surface speed U", show.text(numbers["belt_speed"], "m/s")),
        Row("contact stiffness K", stiffness),
        Row("without dashpots", ", ".join(losses) or "neither flutter nor divergence"),
        Row(f"at φ = {phi:g}", _STATE[numbers["stable"]]),
        *shapes,
    ]
    if numbers.get("pushes"):
        aside.append(Row("search for other vibrations", f"{numbers['pushes']} pushes"))
    blocks: list[Row | Table] = [*rows, *_scheme(numbers["discrete"], show), *details(*aside)]
    if numbers.get("output"):
        blocks.append(Row("file", numbers["output"]))
    if numbers.get("vary"):
        along = of_lock_in(numbers, show, units)
        answer += along.answer
        blocks += along.blocks
    return View(title, sentences(answer), blocks)


def of_lock_in(numbers: Mapping[str, Any], show: Renderer, units: str) -> View:
    """Where stability changes along a key, and both modes there; `numbers` are those of `--json`."""
    where = ", ".join(show.text(value, units.removeprefix("1")) for value in numbers["critical_values"] or ())
    changes = f"changes at {where}" if where else "does not change"
    answer = f"along {', '.join(numbers['parameters'])}, stability {changes}"
    return View("", [sentence(answer)], [_along(numbers["vary"], numbers["parameters"])])


def _without_loss(numbers: Mapping[str, object]) -> str:
    """What there is to say where no vibration beside stable sliding was sought."""
    if numbers["no_equilibrium"]:
        return f"there is no steady sliding: {numbers['no_equilibrium']}"
    if (critical := numbers["critical_friction"]) is not None:
        return f"sliding loses stability at {critical:.4g}"
    return "no change of stability by friction is found"


def _at_own(modes: Sequence[_Mode], stable: bool | None, friction: float, show: Renderer) -> str:
    """What the case's own friction coefficient gives."""
    if not modes or stable is None:
        return ""
    first = modes[0]
    growth = f"{'grows' if first['growth'] > 0.0 else 'decays'} at {abs(first['growth']):.4g} 1/s"
    where = f"at the case's {friction:g} sliding is {_STATE[stable]}"
    return f"{where}: its least stable mode ({show.text(first['frequency'], 'Hz')}) {growth}"


def _mode(mode: _Mode) -> str:
    motion = f"{'grows' if mode['growth'] > 0.0 else 'decays'} at {abs(mode['growth']):.4g} 1/s"
    return f"{motion}, damping ratio {mode['damping_ratio']:.3g}"


def _shape(mode: _Mode) -> str:
    if mode["shape"] is None or mode["shape_phase"] is None:
        return "along y alone"
    return f"y/x {mode['shape']:.3g} at {round(mode['shape_phase'])}°"


def _scheme(discrete: Mapping[str, object] | None, show: Renderer) -> list[Row]:
    """What the scheme of a case makes of it at its step."""
    if discrete is None:
        return []
    limit = discrete["step_limit"]
    friction = discrete["critical_friction"]
    growth = f"{show.text(discrete['growth'], '1/s')}, a factor {discrete['spectral_radius']:.8g} a step"
    bias = "" if discrete["bias"] is None else f", {discrete['bias']:+.2g} from the exact one"
    return details(
        Row("the scheme's growth", growth),
        Row("its critical friction", "none" if friction is None else f"{show.text(friction)}{bias}"),
        Row("its stable steps", "any" if limit is None else f"up to {limit:.4g} s" if limit else "none"),
    )


def _along(entries: Sequence[Mapping[str, Any]], parameters: Sequence[str]) -> Table:
    """Critical friction and both modes along a key."""
    columns = {"value": [f"{entry['value']:.6g}" for entry in entries]}
    columns |= {field.title: [text_of(entry[field.name]) for entry in entries] for field in fields.VARIED}
    looks = ("frequency {}, Hz", 1.0, ".5g"), ("growth {}, 1/s", 1.0, ".4g"), ("damping {}, %", 100.0, ".3g")
    for field, (head, factor, form) in zip(fields.MODES, looks, strict=True):
        for mode in (0, 1):
            values = [entry[field.name][mode] for entry in entries]
            shown = [None if value is None else factor * value for value in values]
            columns[head.format(mode + 1)] = [text_of(value, form=form) for value in shown]
    return Table(columns, f"Along {', '.join(parameters)}", first=None if len(entries) <= SHORT_POINTS else 0)


def _critical(lost: Sequence[_Crossing], error: float | None, show: Renderer) -> str:
    """The least friction coefficient at which stability is lost, with its error, and how it is lost."""
    if not lost:
        return "none"
    if error is None:
        return f"{_crossing(lost[0], show)}, but single windows of the waves have none near it"
    return _crossing(lost[0], show, error)


def _crossing(crossing: _Crossing, show: Renderer, error: float | None = None) -> str:
    change = "lost" if crossing["lost"] else "regained"
    where = f" at {show.text(crossing['frequency'], 'Hz')}" if crossing["frequency"] else ""
    return (
        f"{show.with_error(crossing['friction'], error)}: stability {change} by {crossing['instability']}{where}"
    )


def of_advice(report: AdviceReport, show: Renderer) -> View:
    """Whether it squeals, from which friction on, what helps, and what moves the critical friction."""
    stability = report.stability
    check = report.check
    margin = report.margin
    blocks: list[Row | Table] = []
    wanted = f"{100.0 * report.wanted_margin:.3g} % is wanted"
    critical = "none" if stability.critical is None else show.text(stability.critical.friction)
    far = "" if margin is None else f", {100.0 * margin:+.2g} % from the case's {stability.friction:g}; {wanted}"
    blocks.append(Row("critical friction", critical + far, detail=True))
    if under := report.squeal:
        interval = f"{100.0 * under.squeal_lower:.3g} to {100.0 * under.squeal_upper:.3g} %"
        share = f"{100.0 * under.squeal_probability:.3g} % (95 %: {interval})"
        blocks.append(Row(f"squeal under a scatter {report.scatter}", share, detail=True))
    if report.thresholds.coexists_from is not None:
        blocks += details(Row("can vibrate from", show.text(report.thresholds.coexists_from)))
    if report.thresholds.barrier is not None:
        blocks += details(Row("barrier", show.text(report.thresholds.barrier, "m")))
    notes = report.notes()
    blocks += [Row("note", note) for note in notes]
    if check:
        ran = f"{check.parameter} = {check.value:.6g}, {check.duration:.3g} s of motion"
        blocks += details(Row("checked by a run", f"{ran}: {check.verdict.regime}"))
        blocks += details(Row("why", "; ".join(check.verdict.reasons)))
    if changes := _ordered([change for change in report.advice if change.to is not None], report.mildest):
        apart = report.mildest not in (None, changes[0].parameter)
        first = max(3 - len(notes), 1 + apart)  # a short answer has twelve lines; a note takes one
        blocks.append(Table(_advice(changes, report.squeal), report.ranking, first=first))
    if vain := [change for change in report.advice if change.to is None]:
        blocks.append(Table(_without_help(vain), "No help within bounds", first=0))
    if moves := _moves(report):
        blocks.append(Table(moves, _MOVES, first=0))
    return View(report.title, [sentence(report.conclusion)], blocks)


def _ordered(changes: list[Change], mildest: str | None) -> list[Change]:
    """The changes with the one that leaves least squeal second, if it is not first."""
    remaining = [change for change in changes[1:] if change.parameter != mildest]
    return changes[:1] + [change for change in changes[1:] if change.parameter == mildest] + remaining


def _without_help(changes: Sequence[Change]) -> dict[str, list[str]]:
    return {
        "no help": [change.parameter for change in changes],
        "from": [text_of(change.start) for change in changes],
        "none in": [f"{change.lowest:.4g} to {change.highest:.4g}" for change in changes],
    }


def _advice(changes: Sequence[Change], drawn: Left | None) -> dict[str, list[str]]:
    columns = {
        "what helps": [change.parameter for change in changes],
        "from": [text_of(change.start, form=".4g") for change in changes],
        "to": [change.rounded for change in changes],
        "critical φ": [text_of(change.critical_friction, form=".4g") for change in changes],
        "safe until": [_until(change) for change in changes],
        "a run is": [change.check or "-" for change in changes],
    }
    if drawn is None:
        return columns
    squeals = [squeal.squeal for squeal in changes]
    beside = any(squeal.unstable_elsewhere for squeal in squeals if squeal)
    columns["squeals"] = ["-" if squeal is None else percent(squeal.squeal_probability) for squeal in squeals]
    if beside:
        columns["unstable else"] = [
            "-" if squeal is None else percent(squeal.unstable_elsewhere or 0.0) for squeal in squeals
        ]
    last = columns["unstable else" if beside else "squeals"]
    last[:] = [f"{text}{_moved(squeal, drawn)}" for text, squeal in zip(last, squeals, strict=True)]
    return columns


def _moved(squeal: Left | None, drawn: Left) -> str:
    """The frequency of what is left of squeal, where it differs from that of the drawing by more than 5 %."""
    if squeal is None or not squeal.squeal_frequency or not drawn.squeal_frequency:
        return ""
    # less is not heard as another tone; a choice
    far = abs(squeal.squeal_frequency / drawn.squeal_frequency - 1.0) > 0.05
    return f", {squeal.squeal_frequency:.4g} Hz" if far else ""


def _moves(report: AdviceReport) -> dict[str, list[str]]:
    """What moves the critical friction, and the growth; empty where nothing does."""
    moving = [key for key in report.sensitivities if key.elasticity or key.derivative or key.growth_change]
    if not moving:
        return {}
    return {
        "what moves it": [key.parameter for key in moving],
        "value": [text_of(key.value) if isinstance(key.value, float) else "list" for key in moving],
        "% for 1 %": [text_of(key.elasticity, form=".3g") for key in moving],
        "for a unit": [text_of(key.derivative, form=".3g") for key in moving],
        "growth for 1 %": [text_of(key.growth_change, form=".3g") for key in moving],
    }


def _until(change: Change) -> str:
    """Where safe values end, rounded towards them."""
    return "-" if change.until is None or change.to is None else rounded(change.until, change.until < change.to)


def of_branch(numbers: Mapping[str, Any], title: str, units: str, show: Renderer) -> View:
    """The answer in a sentence, then each branch with its special points; `numbers` are those of `--json`."""
    units = units.removeprefix("1")
    ends = f"{numbers['lower']:g} to {numbers['upper']:g} {units}".strip()
    rows = [
        Row("along", f"{numbers['parameter']} from {ends}", detail=True),
        Row("critical", show.with_error(numbers["critical"], numbers["critical_error"], units)),
    ]
    if numbers["coexists_from"] is not None:
        rows.append(Row("can vibrate from", show.text(numbers["coexists_from"], units)))
    if numbers["barrier"] is not None:
        rows.append(Row("barrier", show.text(numbers["barrier"], "m")))
    if numbers["pushes"]:
        rows.append(Row("search for other vibrations", f"{numbers['pushes']} pushes", detail=True))
    if numbers.get("output"):
        rows.append(Row("file", str(numbers["output"])))
    tables = []
    for number, branch in enumerate(numbers["branches"] or ()):
        points = _off_flutter(branch["points"], branch["special"])
        stable = sum(bool(point["stable"]) for point in points)
        there = " beside the one at flutter" * (len(points) < len(branch["points"]))
        head = f"branch {number}: {branch['kind']}, {len(points)} motions{there}, {stable} of them stable"
        spans = zip(branch.get("unstable_lower") or (), branch.get("unstable_upper") or (), strict=True)
        parts = ", ".join(f"from {low:.4g} to {high:.4g}" for low, high in spans)
        head += f"; unstable {parts}" if parts else ""
        note = f" ({branch['note']})" if branch["note"] else ""
        tables.append(Table(_special_points(branch["special"]), head + note))
    return View(title, sentences([str(numbers["sentence"] or "")]), [*rows, *tables])


def _off_flutter(motions: _Rows, marks: _Rows) -> list[Mapping[str, object]]:
    """The motions of a branch without an end at flutter: sliding is neutral there, and so are its vibrations."""
    inner = [*motions]
    sizes = [mark["amplitude"] for mark in marks if mark["kind"] == "flutter" and mark["amplitude"]]
    for end in (0, -1):
        if inner and inner[end]["amplitude"] in sizes:
            inner.pop(end)
    return inner


def _special_points(marks: _Rows) -> dict[str, list[str]]:
    return {
        "special point": [str(mark["kind"]) for mark in marks],
        "value": [f"{mark['value']:.8g}" for mark in marks],
        "error": [f"{mark['error']:.1g}" if mark["error"] else "-" for mark in marks],
        "amplitude, m": [text_of(mark["amplitude"] or None, form=".4g") for mark in marks],
        "frequency, Hz": [text_of(mark["frequency"] or None, form=".5g") for mark in marks],
        "why": [str(mark["reason"] or "-") for mark in marks],
    }


def of_scatter(numbers: Mapping[str, Any], title: str) -> View:
    """The answer in a sentence, then distributions, and on demand probabilities and indices."""
    from brakecli.studies.scattering.answers import SHARES

    failed = f", {numbers['failed']} without an answer" if numbers["failed"] else ""
    blocks: list[Row | Table] = [Row("samples", f"{numbers['samples']}{failed}")]
    blocks += [Row("note", note) for note in numbers["notes"] or ()]
    if numbers.get("output"):
        blocks.append(Row("file", str(numbers["output"])))
    if numbers["quantiles"]:
        units = {field.name: field.units for field in fields.SCATTERED}
        heads = [labelled(name.replace("_", " "), units.get(name, "")) for name in numbers["quantiles"]]
        columns = {"quantiles": heads}
        for index, share in enumerate(SHARES):
            columns[f"{share:.0%}"] = [f"{values[index]:.4g}" for values in numbers["quantiles"].values()]
        blocks.append(Table(columns))
    lower = numbers["probability_lower"]
    upper = numbers["probability_upper"]
    probabilities = {
        "a sample is": [fields.PROBABLE.get(name, name) for name in numbers["probability"]],
        "probability": [f"{probability:.2%}" for probability in numbers["probability"].values()],
        "95 % interval": [f"{lower[name]:.2%} to {upper[name]:.2%}" for name in numbers["probability"]],
    }
    blocks.append(Table(probabilities, first=0))
    if total := numbers["total"]:
        names = sorted(total, key=lambda name: -total[name])
        indices = {
            "parameter": names,
            "alone": [f"{numbers['first_order'][name]:.3f}" for name in names],
            "with all others": [f"{total[name]:.3f}" for name in names],
            "±": [f"{numbers['total_error'][name]:.2g}" for name in names],
        }
        blocks.append(Table(indices, f"What decides on {numbers['indices_of'].replace('_', ' ')}", first=0))
    return View(title, [sentence(numbers["sentence"])], blocks)
