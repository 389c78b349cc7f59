"""A study from its tables to its answers: draw samples, ask each of them, and write what they say."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.probability import Probability
from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.analysis.stability.report import LARGEST_FRICTION
from brakecli.case.read import key_path
from brakecli.case.system import system_of
from brakecli.errors import CaseError, Problem
from brakecli.results import stability_fields as fields
from brakecli.results.field import Field, values_of
from brakecli.results.write import ResultFile, new_result
from brakecli.solver.arrays import Floats
from brakecli.solver.integrate import Counted
from brakecli.studies.runs.limits import FILE_BYTES
from brakecli.studies.runs.plausible import implausible
from brakecli.studies.runs.run import origin
from brakecli.studies.scattering.answers import Indices, quantiles
from brakecli.studies.scattering.draw import for_indices, has_indices, sample_values
from brakecli.studies.scattering.eigen import ask, asking
from brakecli.studies.scattering.study import SCRAMBLINGS, LoadedStudy, Study
from brakecli.studies.sweeps.driver import choose_engine, crew, sweep
from brakecli.studies.sweeps.journal import Journal
from brakecli.studies.sweeps.plan import LoadedSweep, Plan, sweep_of
from brakecli.studies.sweeps.point_list import GIVEN, Listed
from brakecli.studies.sweeps.result import SweepReport, unit
from brakecli.studies.sweeps.size import WORKER_BYTES, WORKER_WORK, Size, size_of
from brakecli.studies.sweeps.workers.task import Compute, Engine

ELSEWHERE = {True: "are unstable outside that band", False: "are unstable without vibration"}
"""What is said of samples that are unstable, but do not squeal: where there is a band, and where there is none."""


class Distribution(NamedTuple):
    """Quantiles of a number of the samples."""

    name: str
    units: str
    quantiles: list[float]  # of `answers.SHARES`


@dataclass(frozen=True)
class ScatterReport:
    """Everything that a study has found; `fields.SCATTER` says where each number is."""

    output: Path
    loaded: LoadedStudy
    samples: int
    failed: int
    first_failure: str
    probabilities: dict[str, Probability]
    distributions: list[Distribution]
    indices: Indices
    columns: dict[str, NDArray[Any]]  # of the samples, by name
    values: Floats  # of the parameters: sets, samples, parameters
    notes: list[str]

    @property
    def quantiles(self) -> dict[str, list[float]]:
        """Quantiles of each number, by its name."""
        return {distribution.name: distribution.quantiles for distribution in self.distributions}

    @property
    def probability(self) -> dict[str, float]:
        """Each probability."""
        return {name: probability.value for name, probability in self.probabilities.items()}

    @property
    def probability_lower(self) -> dict[str, float]:
        """The lower end of its 95 % interval."""
        return {name: probability.lower for name, probability in self.probabilities.items()}

    @property
    def probability_upper(self) -> dict[str, float]:
        """The upper end of its 95 % interval."""
        return {name: probability.upper for name, probability in self.probabilities.items()}

    @property
    def sentence(self) -> str:
        """The answer in a sentence."""
        squeal, low, high = self.probabilities["squeal"]
        if self.failed == self.samples:
            return f"no sample has an answer: {self.first_failure}"
        answer = f"{squeal:.1%} of such brakes squeal{self._where} (95 %: {low:.1%} to {high:.1%})"
        if beside := float(np.mean(elsewhere(self.loaded.study, self.columns))):
            answer += f"; {beside:.1%} {self._elsewhere}"
        if self.failed:
            answer += f"; {self.failed / self.samples:.1%} have no answer, and may squeal or not"
        return "; ".join(filter(None, (answer, self.indices.sentence)))

    @property
    def _where(self) -> str:
        """The band in words; empty without one."""
        band = self.loaded.study.band
        return "" if band is None else f" between {band[0]:g} and {band[1]:g} Hz"

    @property
    def _elsewhere(self) -> str:
        """What is said of brakes that are unstable, but do not squeal as the study counts it."""
        if self.loaded.study.method == "run":
            return "vibrate by themselves outside that band"
        return ELSEWHERE[self.loaded.study.band is not None]

    def numbers(self) -> dict[str, Any]:
        """Names and values as `--json` gives them."""
        return values_of(fields.SCATTER, self)


@dataclass(frozen=True)
class Drawing:
    """What is to be computed: the samples, and those of the indices."""

    values: Floats  # sets, samples, parameters
    others: Floats | None  # the same of the indices
    sweep: LoadedSweep  # of the samples, and behind them of the indices, if those are asked for the same
    by_eigenvalues: LoadedSweep | None  # of the indices, if those are asked for eigenvalues beside runs

    @property
    def samples(self) -> int:
        """How many samples there are."""
        return math.prod(self.values.shape[:2])

    @property
    def index_samples(self) -> int:
        """How many more there are of the indices."""
        return 0 if self.others is None else math.prod(self.others.shape[:2])


def draw(loaded: LoadedStudy) -> Drawing:
    """Draw the samples of a study; raises CaseError where its keys do not fit its case."""
    study = loaded.study
    values = sample_values(study)
    others = for_indices(study) if has_indices(study) else None
    beside = others is not None and study.method == "run" and study.indices_of != "squeal"
    together = [values] if others is None or beside else [values, others]
    friction = {"parameter": "friction.coefficient", "lower": 0.0, "upper": LARGEST_FRICTION}
    tables: dict[str, object] = {"critical": {**friction, "method": "eigenvalue"}} if study.method == "run" else {}
    apart = _sweep(loaded, [others]) if others is not None and beside else None
    return Drawing(values, others, _sweep(loaded, together, tables), apart)


def _sweep(loaded: LoadedStudy, sets: list[Floats], tables: dict[str, object] | None = None) -> LoadedSweep:
    """The samples as the points of a sweep."""
    columns = loaded.study.columns(np.concatenate([values.reshape(-1, values.shape[-1]) for values in sets]))
    listed = Listed.of([*columns], columns.values())
    try:
        return sweep_of({"case": GIVEN, "points": GIVEN, **(tables or {})}, loaded.base, listed)
    except CaseError as error:
        raise CaseError([_of_sample(problem, loaded) for problem in error.problems]) from error


def _of_sample(problem: Problem, loaded: LoadedStudy) -> Problem:
    """What is wrong with a sample, at the line of the parameter that sets it."""
    paths = [[*map(key_path, parameter.paths)] for parameter in loaded.unresolved.parameter]
    if (number := next((n for n, keys in enumerate(paths) if problem.path in keys), None)) is None:
        return replace(problem, source=loaded.name)
    if (law := loaded.study.parameter[number].distribution) in ("uniform", "triangular"):
        remedy = f"{problem.remedy}: a {law} distribution reaches √{3 if law == 'uniform' else 6} deviations far"
    else:
        remedy = "cut its distribution off: give low and high beside mean and deviation"
    what = f"{problem.key} {problem.what} at {problem.source.replace('point', 'sample')}"
    return loaded.at(number, Problem((), what, remedy))


def scatter(
    loaded: LoadedStudy,
    output: Path,
    engine_of: Callable[..., Engine],
    *,
    force: bool,
    tell: Counted = lambda what, done, total: None,
) -> ScatterReport:
    """Ask all samples of a study, and write its result file.

    `engine_of(plan, compute=...)` gives what computes. Samples that are run are kept in a journal as points of a
    sweep are, and the same call goes on with them. Raises CaseError, RefusedError, UsageError or CannotWriteError
    before anything is computed.
    """
    drawing = draw(loaded)
    study = loaded.study
    plan = drawing.sweep.plan

    def by_eigenvalues(sweep: LoadedSweep) -> dict[str, NDArray[Any]]:
        with engine_of(sweep.plan, compute=asking(sweep.plan, study.band)) as engine:
            answers = ask(engine, sweep.plan.points, tell)
        return {name: answers[name] for name in answers.dtype.names or ()}

    if study.method == "eigenvalue":
        with new_result(output, force=force) as result:
            report = _report(loaded, output, drawing, by_eigenvalues(drawing.sweep), None)
            _write(result, report)
            result.commit()
        return report
    beside = by_eigenvalues(drawing.by_eigenvalues) if drawing.by_eigenvalues else None
    reports = list[ScatterReport]()

    def write(result: ResultFile, swept: SweepReport, journal: Journal) -> None:
        columns = {name: journal.column(name) for name in (*_OF_RUNS, "critical")}
        columns["critical_friction"] = columns.pop("critical")
        reports.append(_report(loaded, output, drawing, columns, beside))
        _write(result, reports[0])

    def progress(done: int, failed: int) -> None:
        tell("samples", done, plan.points)

    with engine_of(plan) as engine:
        sweep(drawing.sweep, output, engine, force=force, progress=progress, write=write)
    return reports[0]


def engine_for(
    plan: Plan,
    jobs: int | None = None,
    scheduler: object = None,
    scheduler_file: str | None = None,
    *,
    in_caller: bool = False,
    compute: Compute | None = None,
) -> Engine:
    """The engine for the samples of a plan: this process where workers would take as long to start."""
    few = compute is not None and _few(plan)
    if few and jobs is None and scheduler is None and scheduler_file is None:
        jobs = 1
        in_caller = True
    return choose_engine(plan, jobs, scheduler, scheduler_file, in_caller=in_caller, compute=compute)


def _few(plan: Plan) -> bool:
    """Whether the eigenvalues of all samples take less time than workers take to start."""
    of_sample = 4e-4 if system_of(plan.case({})).smooth else 0.1  # about
    return plan.points * of_sample < WORKER_WORK


def size_of_study(loaded: LoadedStudy, drawing: Drawing) -> Size:
    """What a study will take; none of its samples is computed."""
    plan = drawing.sweep.plan
    if loaded.study.method == "run":
        return size_of(plan, crew(plan), spare=True)
    samples = drawing.samples
    keys = sum(len(parameter.paths) for parameter in loaded.study.parameter)
    workers = 0 if _few(plan) else crew(plan)
    return Size(
        points=plan.points,
        workers=workers,
        memory=WORKER_BYTES * (workers + 1) + 450.0 * samples + 50.0 * plan.points * keys,
        file_size=FILE_BYTES + 8.0 * samples * (len(loaded.study.parameter) + 6),  # columns beside the parameters
        implausible=tuple(implausible(system_of(loaded.base.case))),
    )


def _report(
    loaded: LoadedStudy,
    output: Path,
    drawing: Drawing,
    columns: dict[str, NDArray[Any]],
    beside: dict[str, NDArray[Any]] | None,
) -> ScatterReport:
    """What the answers say; those of the indices stand behind the others, or `beside`."""
    study = loaded.study
    sets, many, _ = drawing.values.shape
    count = sets * many
    hits = {name: flags.reshape(sets, many) for name, flags in _outcomes(study, drawing, columns, count).items()}
    failed = hits["failed"].ravel()
    apart = "no indices: with correlations, the share of one parameter is not its own"
    index = Indices(study.indices_of, note=apart * (study.correlation is not None and study.indices_of != "none"))
    if drawing.others is not None:
        indexed = {name: column[count:] for name, column in columns.items()} if beside is None else beside
        of = squeals(study, indexed).astype(float) if study.indices_of == "squeal" else indexed[study.indices_of]
        answers = of.reshape(drawing.others.shape[:2])
        index = Indices.find(study.indices_of, study.names, answers, study.seed)
    sampled = {name: column[:count] for name, column in columns.items()}
    squealing = hits["squeal"].ravel()
    others = f"{count} samples in place of {study.samples}: as many as {SCRAMBLINGS} sequences need"
    distributions = [
        Distribution(name, units, quantiles(np.where(squealing | (name not in _OF_SQUEAL), sampled[name], np.nan)))
        for name, units in _TOLD
        if name in sampled
    ]
    return ScatterReport(
        output=output,
        loaded=loaded,
        samples=count,
        failed=int(failed.sum()),
        first_failure=sampled["reason"][failed][0].decode() if failed.any() else "",
        probabilities={
            name: Probability.within(flags, hits["failed"] & ~flags)
            for name, flags in hits.items()
            if name != "failed" or flags.any()
        },
        distributions=[distribution for distribution in distributions if distribution.quantiles],
        indices=index,
        columns={**sampled, "squeal": squealing.astype(np.int64)},
        values=drawing.values,
        notes=[*loaded.beside(loaded.base.case), *filter(None, [index.note, others * (count != study.samples)])],
    )


def _outcomes(
    study: Study, drawing: Drawing, columns: dict[str, NDArray[Any]], count: int
) -> dict[str, NDArray[np.bool_]]:
    """Which of the samples come to what."""
    sampled = {name: column[:count] for name, column in columns.items()}
    if study.method == "run":
        failed = sampled["status"] != b"done"
        outcomes = {regime.value: (sampled["regime"] == regime.value.encode()) & ~failed for regime in Regime}
    else:
        growth = sampled["growth_rate"]
        failed = np.isnan(growth)
        outcomes = {"stable": growth <= 0.0, "unstable": growth > 0.0}
    path = ("friction", "coefficient")
    own = np.array([drawing.sweep.plan.settings(n).get(path, np.nan) for n in range(count)])
    own = np.where(np.isnan(own), drawing.sweep.plan.case({}).friction.coefficient, own)
    with np.errstate(invalid="ignore"):
        below = sampled["critical_friction"] < own
    return outcomes | {"squeal": squeals(study, sampled), "critical_below": below, "failed": failed}


def squeals(study: Study, columns: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Which samples vibrate by themselves with a frequency in the band, or have an unstable mode there."""
    low, high = study.band or (0.0, math.inf)
    frequency = columns["frequency"]
    with np.errstate(invalid="ignore"):
        within = (frequency > 0.0) & (frequency >= low) & (frequency <= high)
        if study.method == "run":
            return np.asarray(within & (columns["excitation"] == Excitation.SELF_EXCITED.value.encode()))
        return np.asarray(within & (columns["growth_rate"] > 0.0))


def elsewhere(study: Study, columns: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Which samples are unstable (of runs: vibrate by themselves) without squeal as the study counts it."""
    if study.method == "run":
        anyhow = squeals(study.model_copy(update={"band": None}), columns)
    else:
        with np.errstate(invalid="ignore"):
            anyhow = np.asarray(columns["growth_rate"] > 0.0)
    return anyhow & ~squeals(study, columns)


def _write(result: ResultFile, report: ScatterReport) -> None:
    """Everything that the file holds."""
    loaded = report.loaded
    study = report.loaded.study
    texts = {"study_toml": loaded.text, "resolved_study_toml": loaded.resolved}
    result.set_attributes({**origin("scatter", loaded.title, loaded.base), **texts})
    result.set_fields(fields.SCATTER, report.numbers())
    result.axis("/", fields.SAMPLE, np.arange(report.samples))
    sets, many, _ = report.values.shape
    result.variable("/", fields.SET, ("sample",), np.repeat(np.arange(sets), many))
    for number, scattering in enumerate(study.parameter):
        name = scattering.paths[0].replace(".", "_")
        keys = [*scattering.paths]
        data = report.values[..., number].ravel()
        result.variable("/", Field(name, unit(keys[0]), ", ".join(keys)), ("sample",), data, parameters=keys)
    for field in fields.SCATTERED:
        if field.name in report.columns:
            values = report.columns[field.name]
            result.column(field, ("sample",), np.char.decode(values) if values.dtype.kind == "S" else values)
    result.axis("/", fields.OUTCOME, np.array([*report.probabilities]))
    for name, field in zip(("value", "lower", "upper"), fields.PROBABILITY, strict=True):
        column = [getattr(probability, name) for probability in report.probabilities.values()]
        result.column(field, ("outcome",), column)
    if report.indices.total:
        result.axis("/", fields.SCATTERING, np.array([*report.indices.total]))
        parts = report.indices.first_order, report.indices.total, report.indices.error
        for field, shares in zip(fields.INDEX, parts, strict=True):
            result.column(field, ("parameter",), [*shares.values()])


_OF_RUNS = ("status", "regime", "excitation", "frequency", "amplitude", "reason")
_OF_SQUEAL = ("frequency", "amplitude")  # which only a vibration has
_TOLD = (("critical_friction", ""), ("growth_rate", "1/s"), ("frequency", "Hz"), ("amplitude", "m"))
