"""The part of a page about a run: whether the shoe vibrates, why, what to change, and how sure that is."""

import math
import shlex
from collections.abc import Iterable, Iterator
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.stability.advice import KEYS, Change
from brakecli.analysis.stability.follow import followed
from brakecli.analysis.stability.modes import Mode, modes
from brakecli.case.case import Case
from brakecli.case.read import LoadedCase, key_path
from brakecli.case.tables import key_schema
from brakecli.errors import escaped
from brakecli.results import fields
from brakecli.results.field import flat, named, values_of
from brakecli.results.numbers import stored_numbers
from brakecli.results.read import StoredResult
from brakecli.results.stability_fields import ADVICE, STABILITY, THRESHOLDS
from brakecli.solver.integrate import Counted
from brakecli.studies.runs.advise import AdviceReport, advise
from brakecli.studies.scattering.advised import under_tolerance
from brakecli.studies.sweeps.result import unit
from brakecli.views.motion import above_rounding, motion_sentence, reasons_of
from brakecli.views.plots import lock_in, style
from brakecli.views.plots.result import draw
from brakecli.views.plots.run import case_of
from brakecli.views.reports.blocks import (
    PAGE,
    Block,
    Code,
    Part,
    Section,
    Table,
    Texts,
    blocks_of,
    numbers_of,
    percent,
    picture,
    rounded,
    shown,
)
from brakecli.views.stability import of_advice, of_stability
from brakecli.views.view import Table as Columns
from brakecli.views.view import View, sentences

QUESTION = "Will this shoe vibrate, in which way, at which frequency, and what should be changed?"
PICTURE = "The motion in detail, its phase portrait, the whole history, and the spectrum of the velocity"
MOST_CHANGES = 5  # keys on the first page
MOST_WORK = 60.0  # of asking all, as `runs.work` counts it
_IDLE = ("initial.", "solver.", "output.")  # keys that stand below the others
_MAIN = (
    *("regime", "excitation", "frequency", "amplitude", "stick_fraction", "contact_loss_fraction"),
    *("growth_rate", "braking_torque", "torque_variation"),
)
_ACCURACY = (
    *("scheme", "theta", "iteration", "step", "tolerance", "certified", "estimated_error", "certified_until"),
    *("certified_by", "nodes", "steps", "contact_evaluations", "unconverged_steps", "non_unique_steps"),
)


def part_of_run(result: StoredResult, progress: Counted) -> Part:
    """What the page says of a run. Raises UnreadableResultError."""
    attributes = result.attributes
    loaded = case_of(result)
    margin = 0.2  # of the friction, that advice aims at
    advice = under_tolerance(advise(loaded, KEYS, margin, progress, most=MOST_WORK), loaded.case)
    theory = f"By theory, of small vibration and by eigenvalues: {advice.conclusion()}."
    answer = [motion_sentence(stored_numbers(result), PAGE, full=True), theory]
    name = escaped(result.path.name)
    title = loaded.case.title or "Case without a title"
    of_theory = numbers_of(named(ADVICE, "critical_friction", "margin", "squeal_probability"), advice.numbers())
    growth = advice.stability.modes[0].growth if advice.stability.modes else None  # of small motions, by theory
    values = {
        **above_rounding(stored_numbers(result)),
        "growth_rate": growth if attributes.get("growth_rate") is None else attributes["growth_rate"],
    }
    numbers = {**of_theory, **numbers_of(named(fields.VERDICT, *_MAIN), values)}
    drawn = picture(PICTURE, partial(draw, result))
    change = [*_to_change(advice, attributes.get("regime"))]
    sections = partial(_appendix, result, loaded, advice)
    return Part(name, title, QUESTION, answer, drawn, change, sections, numbers, result.versions, advice)


def _appendix(result: StoredResult, loaded: LoadedCase, advice: AdviceReport) -> list[Section]:
    """What the first page leaves out."""
    attributes = result.attributes
    again = f"brakecli run {escaped(shlex.quote(result.path.name))} -o again.h5"
    left_out = sentences(f"Left out: {name}" for name in attributes.get("left_out", ()))
    notes = Texts([*sentences(attributes.get("adjustments", ())), *left_out])
    return [
        Section("Case", case_blocks(loaded)),
        Section("Stability of steady sliding", [*_stability(advice)]),
        Section("Regime, and its evidence", _regime(result)),
        Section("Accuracy", [*_accuracy(result), notes]),
        Section("Warnings", [Texts(sentences(attributes.get("warnings", ())) or ["There are none."])]),
        Section("How to repeat it", repeat(result, again, result.text("case_toml"))),
    ]


def _to_change(advice: AdviceReport, regime: object) -> Iterator[Block]:
    """The changes that help most, and what the advice rests on."""
    helpful = [change for change in advice.advice if change.to is not None]
    lines = []
    if helpful:
        yield _changes(helpful[:MOST_CHANGES], advice.wanted_margin)
    elif advice.advice:
        lines.append(f"No key alone gives a margin of {advice.wanted_margin:.0%}.")
    elif not advice.left_out:
        nothing = advice.stable and regime == Regime.DAMPED
        lines.append(f"{'Nothing has to be changed' if nothing else 'No change is known'}; {advice.conclusion()}.")
    if check := advice.check:
        what = f"A run of the case with {check.parameter} = {check.value:.6g}, {check.duration:.3g} s of motion"
        lines.append(f"{what}: {check.verdict.regime}: {'; '.join(check.verdict.reasons)}.")
    yield Texts([*lines, *sentences(advice.notes())])


def _changes(changes: Iterable[Change], margin: float) -> Table:
    rows = [
        (
            change.parameter,
            shown(change.start, unit(change.parameter)),
            "no help" if change.to is None else _target(change),
            shown(change.critical_friction and float(f"{change.critical_friction:.4g}")),
        )
        for change in changes
    ]
    return Table(rows, ("what to change", "from", f"to, for a margin of {margin:.0%}", "critical friction then"))


def _target(change: Change) -> str:
    """The value that a change leads to, with what that is in per cent of the present one."""
    value = float(change.rounded)
    relative = f" ({percent(value / change.start - 1.0)})" if change.start else ""
    return shown(value, unit(change.parameter)) + relative


def case_blocks(loaded: LoadedCase) -> list[Block]:
    """Every key of a case with its value and unit, and the text to copy."""
    keys = {key: value for key, value in flat(loaded.case.model_dump(mode="json")) if value not in (None, [])}
    del keys["title"]
    rows = [(key, shown(value, unit(key)), _meaning(key)) for key, value in keys.items()]
    idle = [row for row in rows if row[0].startswith(_IDLE)]
    head = ("key", "value", "meaning")
    shoe = Table([row for row in rows if row not in idle], head)
    return [shoe, Table(idle, head, "Start, solver and output"), Code(loaded.resolved, "The whole case as a file")]


def repeat(result: StoredResult, again: str, source: str) -> list[Block]:
    """The commands that give the result, and this page, again; and the file that it was computed from."""
    report = f"brakecli report {escaped(shlex.quote(result.path.name))} --full -o report.html"
    exactly = "The same version on the same machine gives the same numbers, to the last bit."
    return [Code(f"{again}\n{report}"), Texts([exactly]), Code(source, "The file as it was given")]


def _stability(advice: AdviceReport) -> Iterator[Block]:
    report = advice.stability
    numbers = values_of(STABILITY, report) | values_of(THRESHOLDS, advice.thresholds)
    view = of_stability(numbers, "", PAGE)
    yield Texts(view.answer)
    yield from blocks_of(view)
    if report.equilibrium is not None and report.belt_speed:
        yield picture(
            "Lock-in diagram: frequencies and growth rates of both modes over the friction coefficient",
            partial(_diagram, advice),
        )
    tables = [block for block in of_advice(advice, PAGE).blocks if isinstance(block, Columns)]
    yield from blocks_of(View("", blocks=tables))


def _diagram(advice: AdviceReport) -> Figure:
    """Modes over friction, to half more than the case's or the critical one; to four times the case's at most."""
    report = advice.stability
    c = advice.system.coefficients
    highest = 1.5 * max(report.friction, advice.critical_friction or 0.0) or 1.0
    highest = min(highest, 4.0 * report.friction or highest)
    phi = np.linspace(0.0, highest, 121)

    def at(friction: float) -> tuple[Mode, ...]:
        k = report.stiffness_at(friction)
        grip = math.copysign(friction, report.belt_speed)
        return tuple(modes(c._replace(phi=friction), k, grip)) if k > 0.0 else ()

    pairs = followed(map(at, phi.tolist()))
    none = [(np.nan, np.nan)] * 2
    curves = np.array([[(mode.frequency, mode.growth) for mode in pair] if pair else none for pair in pairs])
    ends = np.array([crossing.friction for crossing in report.crossings if crossing.friction <= highest])
    figure = lock_in.diagram("", "friction coefficient φ", "", phi, (curves[..., 0], curves[..., 1]), ends)
    for axes in figure.axes:
        axes.axvline(report.friction, color=style.GREEN, lw=1.3, ls=style.DASHES, label="this case")
    figure.axes[0].legend(loc="best")
    return figure


def _regime(result: StoredResult) -> list[Block]:
    attributes = result.attributes
    rows = PAGE.rows((field for field in fields.VERDICT if field.kind != fields.OBJECT), attributes)
    evidence = result.group_attributes("regime/evidence")
    proof = [
        (name.replace("_", " "), shown(value, fields.evidence_unit(name)))
        for name, value in sorted(evidence.items())
    ]
    reasons = Texts(sentences(reasons_of(attributes, PAGE)))
    intervals = stored_numbers(result).get("vibrations") or []
    vibrations = [
        [shown(rounded(interval[field.name], 4), field.units) for field in fields.VIBRATION]
        for interval in intervals
    ]
    beats = [Table(vibrations, [field.meaning for field in fields.VIBRATION])]
    shown_on_demand = Table(proof, ("evidence", "value"), "All numbers by which the table decided")
    return [reasons, *beats * bool(intervals), Table(rows), shown_on_demand]


def _accuracy(result: StoredResult) -> list[Block]:
    error = abs(float(result.group_attributes("energy").get("relative_closing_error", math.nan)))
    closing = "energy account", f"{error:.1e}", "what it does not account for, over its largest item"
    return [Table([*PAGE.rows(named(fields.RUN, *_ACCURACY), result.attributes), closing])]


def _meaning(key: str) -> str:
    return str(key_schema(Case, key_path(key)).get("description", ""))
