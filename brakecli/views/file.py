"""Views of files: what a case asks for, what a result holds, and how two results differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from brakecli.errors import value_text
from brakecli.solver.quantities import COEFFICIENTS
from brakecli.views.render import Renderer, text_of
from brakecli.views.view import Row, Table, View, sentence

if TYPE_CHECKING:  # what one command prints need not wait for the modules of the others
    from brakecli.studies.runs.limits import Check
    from brakecli.studies.scattering.study import Study
    from brakecli.studies.sweeps.size import Size

_ASIDE = ("title", "regime/", "adjustments", "reasons", "warnings", "modelled", "left_out")  # long, and in --json
_MAIN = ("regime", "frequency", "amplitude", "excitation", "stick_fraction", "contact_loss_fraction", "critical")
"""Numbers that come first."""


def of_check(check: Check, title: str, show: Renderer) -> View:
    """What a run would take and which limits it meets."""
    system = check.system
    limits = check.limits
    has_step = check.step is not None
    low, high = system.natural_frequencies
    link_low, link_high = check.link_frequencies
    coefficients = zip(COEFFICIENTS.values(), system.coefficients, strict=True)
    rows = [
        *(
            Row(f"{c.symbol}, {c.long_name}", show.text(value, c.units.removeprefix("1")))
            for c, value in coefficients
        ),
        Row("surface speed U", show.text(system.belt_speed, "m/s")),
        Row("contact stiffness 2ak", show.text(system.contact_stiffness, "N/m")),
        Row("natural frequencies", f"{low:.5g} and {high:.5g} Hz in full contact"),
        Row("without contact", f"{link_low:.5g} and {link_high:.5g} Hz"),
        Row("shortest wave passes at", show.text(system.passing_frequency or None, "Hz")),
        Row("step", (f"{check.step:.6g} s, " if has_step else "its own, about ") + f"{check.steps:.15g} steps"),
    ]
    if has_step:
        rows += [
            Row("steps per period", f"{check.steps_per_period:.4g} of the fastest motion"),
            Row("fixed-point contraction", f"{limits.contraction:.3g} (1 or more: it may diverge)"),
            Row("solution of each step", "unique" if limits.unique else "perhaps not unique"),
            Row("scheme", f"multiplies a frictionless disturbance by at most {limits.growth:.8g} a step"),
        ]
    rows += [
        Row("contact", system.evaluator + (f", {system.nodes} nodes" if system.nodes else "")),
        Row("nodes per shortest wave", show.text(check.nodes_per_wave)),
        *_bytes(check),
        *(Row("adjusted", adjustment) for adjustment in check.adjustments),
    ]
    return View(title, blocks=rows)


def of_size(size: Size, title: str) -> View:
    """What a sweep would take."""
    return View(title, blocks=[Row("points", str(size.points)), *_workers(size), *_bytes(size)])


def of_study_size(study: Study, counts: Mapping[str, int], size: Size, title: str) -> View:
    """What a study would take; `counts` are its samples and those of its indices."""
    laws = [f"{' and '.join(law.paths)} ({law.distribution})" for law in study.parameter]
    computed = "growth and frequency of its least stable mode, and its critical friction, by eigenvalues"
    if study.method == "run":
        computed = "a run with its verdict, and its critical friction by eigenvalues"
    more = counts["index_samples"]
    indices = f"on {study.indices_of.replace('_', ' ')}, by {more} samples more" if more else "not asked"
    rows = [
        Row("samples", str(counts["samples"])),
        Row("scatters", ", ".join(laws)),
        Row("of each sample", computed),
        Row("squeal", "at {:g} to {:g} Hz".format(*study.band) if study.band else "at any frequency"),
        Row("what decides", indices),
    ]
    return View(title, blocks=[*rows, *_workers(size), *_bytes(size)])


def _workers(size: Size) -> list[Row]:
    return [Row("workers", str(size.workers or "none, as they would take longer to start"))]


def _bytes(size: Check | Size) -> list[Row]:
    return [
        Row("memory", f"about {size.memory / 1e6:.0f} MB"),
        Row("file", f"about {size.file_size / 1e6:.2g} MB"),
    ]


def of_info(numbers: Mapping[str, Any]) -> View:
    """Contents of a file, a row for each group of variables."""
    groups: dict[str, list[str]] = {}
    for variable in numbers["variables"]:
        lengths = zip(variable["dims"], variable["shape"], strict=True)
        sizes = " x ".join(f"{name} {length}" for name, length in lengths)
        groups.setdefault(f"{variable['group']}: {sizes}", []).append(variable["name"])
    made = ", ".join(f"{name} {version}" for name, version in numbers["versions"].items())
    rows = [
        Row("kind", str(numbers["kind"]) + (f", {numbers['status']}" if numbers["status"] else "")),
        Row("title", numbers["title"] or "-"),
        Row("whole", "yes, every byte is as it was written"),
        Row("size", f"{numbers['bytes'] / 1e6:.3g} MB"),
        Row("made by", made),
        *(Row(where, ", ".join(names)) for where, names in groups.items()),
    ]
    return View(numbers["file"], blocks=rows)


def of_difference(numbers: Mapping[str, Any], files: Mapping[str, str], show: Renderer) -> View:
    """What differs in a sentence; the main keys and numbers, and on demand all, each side by side."""
    blocks: list[Row | Table] = []
    for topic, shown in {"case": 2, "numbers": 3, "versions": 0}.items():  # so many rows in a short answer
        rows = [row for row in numbers[topic] if not row["name"].startswith(_ASIDE)]
        rows.sort(key=lambda row: _MAIN.index(row["name"]) if row["name"] in _MAIN else len(_MAIN))
        if rows:
            blocks.append(_sides(topic, rows, files, show, shown))
        if more := sum(row["name"] != "title" for row in numbers[topic]) - len(rows):
            what = f"{more} more with reasons and evidence differ; --json lists them"
            blocks.append(Row(topic, what, detail=True))
    alike = [variable for variable in numbers["variables"] if variable["compared"] and not variable["different"]]
    variables = [variable for variable in numbers["variables"] if variable not in alike]
    if variables:
        columns = {
            "variable": [_path(variable) for variable in variables],
            "differ": [f"{variable['different']} of {variable['compared']}" for variable in variables],
            "by at most": [text_of(variable["largest"], variable["units"], ".3g") for variable in variables],
            "of the largest": [text_of(variable["relative"], form=".2%") for variable in variables],
            "shapes": [_shapes(variable["shapes"]) for variable in variables],
        }
        if all(variable["shapes"][0] == variable["shapes"][1] for variable in variables):
            del columns["shapes"]
        blocks.append(Table(columns, first=0))
    if alike:
        named = ", ".join(f"{_path(variable)} ({_shapes(variable['shapes'])})" for variable in alike)
        blocks.append(Row("alike", f"the same where both have values, of different lengths: {named}", detail=True))
    if along := {variable["interpolated"]: None for variable in numbers["variables"] if variable["interpolated"]}:
        how = f"compared at equal {' and '.join(along)}; the finer result is interpolated"
        blocks.append(Row("places", how, detail=True))
    if files["output"]:
        blocks.append(Row("written", files["output"]))
    return View("", [sentence(numbers["sentence"])], blocks)


def _sides(
    what: str, rows: Sequence[Mapping[str, object]], files: Mapping[str, str], show: Renderer, first: int
) -> Table:
    """Names, and the values of both files."""
    columns = {what: [str(row["name"]) for row in rows]}
    for side in ("a", "b"):
        columns[files[side]] = [_value(row[side], str(row.get("units") or ""), show) for row in rows]
    return Table(columns, first=first)


def _value(value: object, units: str, show: Renderer) -> str:
    if isinstance(value, float) or value is None:
        return show.text(value, units)
    return value_text(value).strip('"')


def _path(variable: Mapping[str, object]) -> str:
    return f"{variable['group']}/{variable['name']}".replace("//", "")


def _shapes(shapes: Sequence[Sequence[int] | None]) -> str:
    return " and ".join("-" if shape is None else " x ".join(map(str, shape)) for shape in shapes)
