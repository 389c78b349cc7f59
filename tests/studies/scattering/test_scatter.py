"""Brakes that are not built to their drawing: distributions, intervals, indices, and the whole study."""

import json
import math
import tomllib
from importlib import import_module, resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

import brakecli
from brakecli.analysis.probability import Probability
from brakecli.analysis.stability.report import stability
from brakecli.api.inputs import load_case, load_study
from brakecli.case.case import resolved_toml
from brakecli.case.system import system_of
from brakecli.case.tables import json_schema
from brakecli.errors import BrakecliError, CaseError, RefusedError, UsageError
from brakecli.results.read import open_result
from brakecli.studies.scattering import draw
from brakecli.studies.scattering.answers import Indices, quantiles
from brakecli.studies.scattering.draw import MOST_SAMPLES, for_indices, sample_values
from brakecli.studies.scattering.study import SCRAMBLINGS, Parameter, Study
from tests.campaign import campaign, counts
from tests.commands import ROOT, left_in
from tests.commands import brakecli as command
from tests.examples import NEVER_STABLE, SQUEAL, make

pytestmark = pytest.mark.usefixtures("compiled")
CASE = ROOT / "cases" / "relaxation.toml"
FRICTION = """\
[[parameter]]
key = "friction.coefficient"
distribution = "uniform"
low = 0.3
high = 0.8
"""
ANGLE = """\
[[parameter]]
key = "link2.angle_deg"
distribution = "normal"
mean = 5.0
deviation = 0.5
"""
PERCENT = """\
[[parameter]]
key = "link2.angle_deg"
distribution = "uniform"
tolerance_percent = 10.0
"""
DAMPING = """\
[[parameter]]
keys = ["link1.damping", "link2.damping"]
distribution = "triangular"
low = 200.0
high = 400.0
"""


def write_study(folder: Path, *tables: str, case: str | None = None) -> Path:
    """A study of a shoe that may flutter, in study.toml."""
    (folder / "shoe.toml").write_text(case or CASE.read_text())
    path = folder / "study.toml"
    path.write_text("\n".join(('case = "shoe.toml"', *sorted(tables, key=lambda each: each.startswith("[[")))))
    return path


def scattering(**tables: Any) -> Parameter:
    """A parameter that may have any value."""
    return Parameter.model_validate({"key": "initial.x", **tables})


def study_of(*parameters: dict[str, Any], **tables: Any) -> Study:
    """A study of keys that may have any value."""
    rows = [{"key": f"initial.{name}", **each} for name, each in zip(("x", "y", "vx"), parameters, strict=False)]
    return Study.model_validate({"case": "-", "parameter": rows, **tables})


NORMAL: dict[str, Any] = {"distribution": "normal", "mean": 0.0, "deviation": 1.0}


@pytest.mark.parametrize(
    ("tables", "mean", "deviation"),
    [
        ({"distribution": "uniform", "low": 1.0, "high": 3.0}, 2.0, 2.0 / math.sqrt(12.0)),
        ({"distribution": "uniform", "mean": 2.0, "deviation": 0.3}, 2.0, 0.3),
        ({"distribution": "triangular", "low": 1.0, "high": 3.0}, 2.0, 1.0 / math.sqrt(6.0)),
        (
            {"distribution": "triangular", "low": 0.0, "high": 3.0, "mode": 0.0},
            1.0,
            3.0 / math.sqrt(18.0),
        ),
        ({"distribution": "triangular", "mean": 2.0, "deviation": 0.3}, 2.0, 0.3),
        ({"distribution": "normal", "mean": 2.0, "deviation": 0.3}, 2.0, 0.3),
        ({"distribution": "normal", "low": 1.1, "high": 2.9}, 2.0, 0.3),
        ({"distribution": "lognormal", "mean": 2.0, "deviation": 0.7}, 2.0, 0.7),
        (  # limits three deviations of the logarithm away
            {"distribution": "lognormal", "low": math.exp(-0.6), "high": math.exp(0.6)},
            math.exp(0.02),
            math.exp(0.02) * math.sqrt(math.expm1(0.04)),
        ),
        (  # cut on both sides
            {"distribution": "normal", "mean": 0.0, "deviation": 1.0, "low": -1.0, "high": 1.0},
            0.0,
            math.sqrt(1.0 - 2.0 * stats.norm.pdf(1.0) / (2.0 * stats.norm.cdf(1.0) - 1.0)),
        ),
    ],
)
def test_a_distribution_has_its_mean_and_deviation(tables: dict[str, Any], mean: float, deviation: float) -> None:
    """By the midpoint rule over its quantile function, in a million cells."""
    values = scattering(**tables).values((np.arange(1e6) + 0.5) / 1e6)
    assert values.mean() == pytest.approx(mean, abs=1e-4)
    assert values.std() == pytest.approx(deviation, rel=2e-3)


@pytest.mark.parametrize("sampling", ["sobol", "latin-hypercube", "random"])
def test_samples_repeat_by_their_seed_and_sets_differ(sampling: str) -> None:
    one, again, other = (
        sample_values(study_of(NORMAL, NORMAL, samples=200, sampling=sampling, seed=s)) for s in (1, 1, 2)
    )
    assert (one == again).all()
    assert (one != other).any()
    assert one.shape == (
        (1, 200, 2) if sampling == "random" else (SCRAMBLINGS, 32 if sampling == "sobol" else 25, 2)
    )
    if sampling != "random":
        assert len(np.unique(one[:, :, 0])) == one[:, :, 0].size


def test_correlations_are_those_of_the_matrix() -> None:
    matrix = [[1.0, 0.8, 0.0], [0.8, 1.0, -0.3], [0.0, -0.3, 1.0]]
    values = sample_values(study_of(NORMAL, NORMAL, NORMAL, samples=1 << 14, correlation=matrix)).reshape(-1, 3)
    assert np.corrcoef(values.T) == pytest.approx(np.array(matrix), abs=0.01)  # 1/√16384, and less for Sobol's


def test_indices_of_the_ishigami_function_are_those_of_its_closed_form() -> None:
    """sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1; T. Ishigami and T. Homma, ISUMA 1990: the variances of its parts."""
    a = 7.0
    b = 0.1
    parts = {
        "1": 0.5 * (1.0 + b * math.pi**4 / 5.0) ** 2,
        "2": a**2 / 8.0,
        "13": b**2 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0),
    }
    whole = sum(parts.values())
    limits = {"distribution": "uniform", "low": -math.pi, "high": math.pi}
    study = study_of(limits, limits, limits, samples=4096, seed=3)
    x = for_indices(study)
    answers = np.sin(x[..., 0]) + a * np.sin(x[..., 1]) ** 2 + b * x[..., 2] ** 4 * np.sin(x[..., 0])
    found = Indices.find("growth_rate", study.names, answers, 0)
    first = [parts["1"] / whole, parts["2"] / whole, 0.0]
    total = [(parts["1"] + parts["13"]) / whole, parts["2"] / whole, parts["13"] / whole]
    assert [*found.first_order.values()] == pytest.approx(first, abs=0.02)
    assert [*found.total.values()] == pytest.approx(total, abs=0.02)


def test_parameters_that_errors_do_not_tell_apart_decide_together() -> None:
    total = {"a": 0.46, "b": 0.47, "c": 0.08}
    assert Indices("squeal", {}, total, dict.fromkeys(total, 0.02)).first == ["b", "a"]
    assert Indices("squeal", {}, total, dict.fromkeys(total, 0.004)).first == ["b"]
    assert Indices("squeal").first == []


def test_others_are_named_where_the_joint_part_is_beyond_its_error() -> None:
    """A sum has no joint part; of a product it is all of each index; of x1 (1 + x2) half of the total of x1.

    Of normal x, with deviations 1, the variances of the latter's parts are 1 (x1 alone) and 1 (both together).
    """
    study = study_of(NORMAL, NORMAL, samples=4096, seed=2)
    x = for_indices(study)
    first = study.names[0]

    def said(answers: Any) -> str:
        return Indices.find("squeal", study.names, answers, 0).sentence

    assert said(x[..., 0] + x[..., 1]).endswith("decide most on squeal, by 50% and 50%")
    shares = " (total shares: what several do together counts for each)"
    assert said(x[..., 0] * x[..., 1]).endswith(f", each together with the others{shares}")
    assert said(x[..., 0] * (1.0 + x[..., 1])).startswith(f"{first} decides most on squeal, by 1")
    assert said(x[..., 0] * (1.0 + x[..., 1])).endswith(f"%, together with the others{shares}")
    assert "together" not in said(2.0 * x[..., 0] + x[..., 1])
    parts = {"a": 0.5, "b": 0.49}
    near = Indices("squeal", parts, parts, dict.fromkeys(parts, 0.02), {"a": False, "b": True})
    assert near.sentence == "a and b decide most on squeal, by 50% and 49%, b together with the others" + shares
    assert Indices("squeal").sentence == ""


@pytest.mark.parametrize(("sampling", "margin"), [("sobol", 2.0), ("latin-hypercube", 0.5), ("random", 2.0)])
@pytest.mark.parametrize("replications", counts(60, 400))
def test_intervals_cover_the_truth(sampling: str, margin: float, replications: int) -> None:
    """Of a linear margin under normal scatter, whose probability is Φ(-margin/σ).

    A 95 % interval covers at least 92 % of 400; of 60, whose share has a deviation of 2.8 %, at least 85 %. Of
    simple random samples it is as wide as Wald's, 2 · 1.96 √(p q/n), times 1.5 at most; others are narrower.
    """
    probability = float(stats.norm.cdf(-margin))
    weights = np.array([0.6, 0.8])
    covered = 0
    widths = []
    for seed in range(replications):
        study = study_of(NORMAL, NORMAL, samples=1024, sampling=sampling, seed=seed)
        found = Probability.of(sample_values(study) @ weights < -margin)
        covered += found.lower <= probability <= found.upper
        widths.append(found.upper - found.lower)
    assert covered >= (0.92 if replications >= 400 else 0.85) * replications
    wald = 2.0 * 1.96 * math.sqrt(probability * (1.0 - probability) / 1024)
    assert np.mean(widths) <= (1.5 if sampling == "random" else 1.2) * wald


def test_where_no_sample_differs_the_interval_is_wilsons() -> None:
    found = Probability.of(np.zeros((8, 128), np.bool_))
    z = stats.norm.ppf(0.975) ** 2
    assert found == pytest.approx((0.0, 0.0, z / (1024 + z)))


def test_a_study_finds_what_each_of_its_shoes_is_alone(tmp_path: Path) -> None:
    report = brakecli.scatter(write_study(tmp_path, FRICTION, ANGLE, DAMPING, "samples = 64"))
    assert report.sizes["sample"] == 64
    for n in range(0, 64, 7):
        angle, damping = (float(report[name][n]) for name in ("link2_angle_deg", "link1_damping"))
        keys = [f"link2.angle_deg={angle!r}", f"link1.damping={damping!r}", f"link2.damping={damping!r}"]
        own = float(report.friction_coefficient[n])
        alone = stability(system_of(load_case(str(CASE), [*keys, f"friction.coefficient={own!r}"]).case))
        assert alone.critical is not None
        assert float(report.critical_friction[n]) == alone.critical.friction
        assert float(report.growth_rate[n]) == alone.modes[0].growth
    p = dict(zip(report.outcome.to_numpy().tolist(), report.probability.to_numpy().tolist(), strict=True))
    below = (report.critical_friction < report.friction_coefficient).mean()
    assert p["critical_below"] == pytest.approx(float(below))
    assert p["unstable"] == pytest.approx(float((report.growth_rate > 0.0).mean()))
    assert p["stable"] + p["unstable"] == pytest.approx(1.0)


def test_a_band_tells_squeal_from_other_vibration(tmp_path: Path) -> None:
    path = write_study(tmp_path, FRICTION, ANGLE)
    shares = []
    said = []
    for band in ([1.0, 100.0], [100.0, 250.0]):
        report = brakecli.scatter(path, {"band": band, "samples": 64, "indices_of": "squeal"})
        shares.append(float(report.probability.sel(outcome="squeal")))
        said.append(str(report.attrs["sentence"]))
        if band[0] == 1.0:
            assert "nothing decides on squeal here: none of the samples squeals" in str(report.attrs["notes"])
    assert shares[0] == 0.0
    assert shares[1] == float(report.probability.sel(outcome="unstable")) > 0.0
    assert said[0].startswith("0.0% of such brakes squeal between 1 and 100 Hz (95 %: 0.0% to 5.7%)")
    assert said[0].endswith(f"; {shares[1]:.1%} are unstable outside that band")  # 5.7 %: Wilson's z²/(64 + z²)
    assert "outside" not in said[1]


@campaign
def test_runs_and_eigenvalues_agree_on_a_shoe_that_flutters(tmp_path: Path) -> None:
    """Its vibration grows by e in 0.1 s where friction is 2 % above the critical one, and dies as fast below."""
    path = write_study(tmp_path, FRICTION, "samples = 16", "seed = 5", 'indices_of = "none"')
    shares = []
    for method in ("eigenvalue", "run"):
        report = brakecli.scatter(path, {"method": method, "solver.duration": 4.0}, jobs=1)
        shares.append(report.probability.sel(outcome=["squeal", "critical_below"]).to_numpy().tolist())
    assert shares[0] == shares[1]
    regimes = {*report.regime.to_numpy().tolist()}
    assert regimes <= {"damped", "relaxation", "quasi-harmonic", "undecided"}


def test_what_is_said_is_what_the_file_holds(tmp_path: Path) -> None:
    write_study(tmp_path, FRICTION, ANGLE, "samples = 64")
    told = json.loads(command("scatter", "study.toml", "--json", cwd=tmp_path).out)
    with open_result(tmp_path / "study.h5", kind="scatter") as result:
        outcomes = [*result.read("/", "outcome")]
        for name in ("probability", "probability_lower", "probability_upper"):
            assert told[name] == dict(zip(outcomes, result.read("/", name).tolist(), strict=True))
        keys = [*result.read("/", "parameter")]
        assert keys == ["friction.coefficient", "link2.angle_deg"]
        for name in ("first_order", "total", "total_error"):
            assert told[name] == dict(zip(keys, result.read("/", name).tolist(), strict=True))
        assert result.attributes["sentence"] == told["sentence"]
    shown = command("scatter", "study.toml", "--force", "--details", cwd=tmp_path).out
    assert "critical friction below the brake's own" in shown
    assert "What decides on critical friction" in shown


def test_check_says_what_a_study_takes_and_computes_nothing(tmp_path: Path) -> None:
    """Samples as those of the study itself; its file within a factor of three, as its head is the most of it."""
    write_study(tmp_path, FRICTION, DAMPING, "samples = 60", "band = [100.0, 300.0]")
    shown, told = (command("check", "study.toml", *more, cwd=tmp_path) for more in ((), ("--json",)))
    assert left_in(tmp_path) == {"shoe.toml", "study.toml"}
    numbers = told.json
    for words in (
        "friction.coefficient (uniform), link1.damping and link2.damping (triangular)",
        "growth and frequency of its least stable mode, and its critical friction, by eigenvalues",
        "at 100 to 300 Hz",
        "on critical friction, by 128 samples more",  # sets A, B, and one for each parameter, of 32 samples
        "none, as they would take longer to start",
    ):
        assert words in " ".join(shown.out.split())
    assert numbers["valid"] is True
    assert numbers["keys"] == ["friction.coefficient", "link1.damping", "link2.damping"]
    assert (numbers["samples"], numbers["index_samples"], numbers["points"]) == (64, 128, 192)
    report = brakecli.scatter(tmp_path / "study.toml", output=tmp_path / "study.h5")
    assert report.attrs["samples"] == numbers["samples"]
    assert numbers["file_size"] / 3.0 < (tmp_path / "study.h5").stat().st_size < 3.0 * numbers["file_size"]
    run = ["--set", 'method="run"', "--set", 'indices_of="none"', "--set", "friction.coefficient=0.9"]
    other = command("check", "study.toml", *run, "--json", cwd=tmp_path)
    assert (other.json["method"], other.json["index_samples"], other.json["points"]) == ("run", 0, 64)
    assert "the case has 0.9, but the study scatters it between 0.3 and 0.8" in other.told(0)
    assert "not asked" in command("check", "study.toml", *run, cwd=tmp_path).out
    write_study(tmp_path, FRICTION.replace("0.8", "0.2"))
    command("check", "study.toml", cwd=tmp_path).told(2, "study.toml:6: parameter[0].high: is not above low")


@campaign
def test_a_study_is_drawn_reported_and_written_as_a_starter(tmp_path: Path) -> None:
    assert "run it with: brakecli scatter scatter.toml" in command("new", "scatter", cwd=tmp_path).out
    few = ("--set", "samples=64")
    command("scatter", "scatter.toml", *few, "-q", cwd=tmp_path)
    assert "scatter.png: written" in command("plot", "scatter.h5", cwd=tmp_path).out
    command("report", "scatter.h5", "--full", "-o", "scatter.html", cwd=tmp_path)
    page = (tmp_path / "scatter.html").read_text()
    for text in ("How likely do such brakes squeal", "brakecli scatter STUDY.toml", "[[parameter]]"):
        assert text in page
    command("scatter", "scatter.toml", *few, "--set", 'indices_of="none"', "-q", "--force", cwd=tmp_path)
    command("plot", "scatter.h5", "--force", cwd=tmp_path)
    assert "No difference" in command("diff", "scatter.h5", "scatter.h5", cwd=tmp_path).out
    assert command("export", "scatter.h5", "-o", "s.csv", cwd=tmp_path).out
    assert (tmp_path / "s.csv").read_text().startswith("sample,")


@campaign
def test_advice_under_scatter_is_that_of_a_study_of_the_changed_drawing(tmp_path: Path) -> None:
    """Of the key that scatters, its mean is moved; of another, the case has the new value."""
    write_study(tmp_path, FRICTION, ANGLE, "samples = 64", "band = [1.0, 100.0]")
    keys = "link2.angle_deg,link1.stiffness"
    line = ["advise", "shoe.toml", "--scatter", "study.toml", "--keys", keys, "--json"]
    outside = json.loads(command(*line, cwd=tmp_path).out)
    path = write_study(tmp_path, FRICTION, ANGLE, "samples = 64")
    said = command("advise", "shoe.toml", "--scatter", "study.toml", "--keys", keys, "--json", cwd=tmp_path).out
    told = json.loads(said)
    own = brakecli.scatter(path).probability.sel(outcome="squeal")
    assert told["squeal_probability"] == float(own) > 0.0
    assert outside["squeal_probability"] == 0.0  # as `scatter` says
    assert outside["unstable_elsewhere"] == float(own)
    assert "squeal between 1 and 100 Hz, and " in outside["conclusion"]
    assert "% are unstable outside that band" in outside["conclusion"]
    # what moves squeal out of the band does not help: the order is that without a band
    assert [each["parameter"] for each in outside["advice"]] == [each["parameter"] for each in told["advice"]]
    left = [each["squeal_probability"] for each in told["advice"]]
    assert [each["unstable_elsewhere"] for each in outside["advice"]] == left
    assert left == [2.0 / 64.0, 0.0]  # two samples are not surely more than none: the smaller change is first
    assert [each["parameter"] for each in told["advice"]] == ["link2.angle_deg", "link1.stiffness"]
    assert max(left) < float(own)
    assert told["check"]["parameter"] == told["advice"][0]["parameter"]
    for each in told["advice"]:
        settings = {each["parameter"]: float(f"{each['to']:.4g}")}
        if each["parameter"] == "link2.angle_deg":
            moved = ANGLE.replace("mean = 5.0", f"mean = {settings.pop('link2.angle_deg')!r}")
            path = write_study(tmp_path, FRICTION, moved, "samples = 64")
        changed = brakecli.scatter(path, settings)
        assert each["squeal_probability"] == float(changed.probability.sel(outcome="squeal"))
        path = write_study(tmp_path, FRICTION, ANGLE, "samples = 64")
    shown = command("advise", "shoe.toml", "--scatter", "study.toml", cwd=tmp_path).out
    assert "under a scatter as of the study" in " ".join(shown.split())
    assert "Least instability first, then" in " ".join(shown.split())


@campaign
def test_a_study_and_its_result_are_loaded_in_python(tmp_path: Path) -> None:
    path = write_study(tmp_path, FRICTION, "samples = 16")
    study = brakecli.load(path, {"link2.angle_deg": 6.0})
    report = brakecli.scatter(study, output=tmp_path / "r.h5")
    assert report.identical(brakecli.scatter(path, {"link2.angle_deg": 6.0}))
    stored = brakecli.load(tmp_path / "r.h5")
    assert stored.to_dataset().identical(report)
    assert str(report.attrs["sentence"])[:20] in stored.brakecli.table()
    one, other = (
        brakecli.advise(tmp_path / "shoe.toml", keys="shoe.mass", scatter=each) for each in (study, path)
    )
    assert one.advice == other.advice
    assert one.squeal == other.squeal
    with pytest.raises(UsageError, match="come too late for a study that was loaded"):
        brakecli.scatter(study, {"samples": 32})
    command("plot", "study.toml", cwd=tmp_path).told(2, "brakecli scatter study.toml")


def test_with_correlations_there_are_no_indices(tmp_path: Path) -> None:
    path = write_study(tmp_path, "samples = 16", "correlation = [[1.0, 0.5], [0.5, 1.0]]", FRICTION, ANGLE)
    report = brakecli.scatter(path)
    assert "parameter" not in report.sizes
    assert "with correlations" in str(report.attrs["notes"])


def test_a_shoe_that_locks_itself_is_unstable_and_past_its_critical_friction(tmp_path: Path) -> None:
    """There it does not slide steadily; its critical friction is that of the same shoe with less friction."""
    wedge = {"link2.angle_deg": -40.0, "link1.angle_deg": 20.0}
    path = write_study(tmp_path, FRICTION.replace("0.8", "6.0"), "samples = 64", 'indices_of = "none"')
    report = brakecli.scatter(path, wedge)
    assert report.attrs["failed"] == 0
    keys = [f"{key}={value}" for key, value in wedge.items()]
    alone = stability(system_of(load_case(str(CASE), [*keys, "friction.coefficient=0.3"]).case)).critical
    assert alone is not None
    assert report.critical_friction.to_numpy() == pytest.approx(alone.friction)
    beyond = (report.friction_coefficient > alone.friction).to_numpy()
    assert 0 < beyond.sum() < 64
    assert ((report.growth_rate > 0.0).to_numpy() == beyond).all()
    assert f"; {beyond.mean():.1%} are unstable without vibration" in str(report.attrs["sentence"])
    assert float(report.probability.sel(outcome="critical_below")) == beyond.mean()


def test_a_shoe_that_is_never_stable_has_a_critical_friction_of_zero(tmp_path: Path) -> None:
    case = resolved_toml(make(SQUEAL, **NEVER_STABLE))
    report = brakecli.scatter(write_study(tmp_path, FRICTION, "samples = 64", 'indices_of = "none"', case=case))
    assert report.critical_friction.to_numpy().tolist() == [0.0] * 64
    assert float(report.probability.sel(outcome="critical_below")) == 1.0


def test_what_is_not_known_may_squeal_or_not(tmp_path: Path) -> None:
    load = '[[parameter]]\nkey = "load.force"\ndistribution = "uniform"\nlow = -100.0\nhigh = 300.0\n'
    path = write_study(tmp_path, load, FRICTION, "samples = 64", 'indices_of = "none"')
    with pytest.warns(UserWarning, match="of 64 samples have no answer"):
        squeal = (report := brakecli.scatter(path)).sel(outcome="squeal")
    known = float(squeal.probability)
    assert float(squeal.probability_lower) < known
    assert float(squeal.probability_upper) > known + 0.25
    assert "have no answer, and may squeal or not" in report.attrs["sentence"]
    with pytest.warns(UserWarning, match="the wheel stands"):
        report = brakecli.scatter(path, {"wheel.angular_speed": 0.0})
    assert str(report.attrs["sentence"]).startswith("no sample has an answer: ")


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_tail_is_exact(side: float) -> None:
    """Beyond seven deviations a normal value lies there by 1/7 in the mean, but for terms of 1/7³."""
    limits = sorted((7.0 * side, 9.0 * side))
    tail = scattering(distribution="normal", mean=0.0, deviation=1.0, low=limits[0], high=limits[1])
    values = tail.values((np.arange(1e4) + 0.5) / 1e4)
    assert len(np.unique(values)) == 10_000
    assert abs(values.mean()) == pytest.approx(7.0 + 1.0 / 7.0 - 2.0 / 343.0, abs=1e-3)


def test_where_no_friction_is_critical_the_indices_say_so(tmp_path: Path) -> None:
    report = brakecli.scatter(
        write_study(tmp_path, FRICTION, "samples = 16"), {"link1.angle_deg": 0.0, "link2.angle_deg": 0.0}
    )
    assert "have no critical friction; ask for squeal" in str(report.attrs["notes"])


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ((FRICTION, FRICTION), "study.toml:9: parameter[1].key: is set twice"),
        ((FRICTION.replace("high = 0.8", ""),), "low: is given alone"),
        (
            (FRICTION.replace("low = 0.3\nhigh = 0.8", ""),),
            "give low and high, mean and deviation, or tolerance_percent",
        ),
        ((FRICTION.replace("0.8", "0.2"),), "high: is not above low"),
        ((FRICTION + "mean = 0.5\ndeviation = 0.1",), "mean: is given together with low and high"),
        ((FRICTION + "mode = 0.5",), "mode: is only for a triangular distribution"),
        ((DAMPING + "mode = 0.5",), "mode: is not between low and high"),
        ((ANGLE.replace('"normal"', '"lognormal"').replace("5.0", "-5.0"),), "mean: is not above 0"),
        ((ANGLE.replace("0.5", "0"),), "deviation: is out of range"),
        (
            (FRICTION.replace("friction", "frction"),),
            "study.toml:3: parameter[0].key: frction.coefficient is unknown; did you mean [friction]?",
        ),
        (
            (FRICTION.replace(".coefficient", ""),),
            "study.toml:5: parameter[0].low: friction is a table, not a number (found 0.3); did you",
        ),
        (
            (FRICTION.replace("0.3", "-0.3"),),
            "study.toml:5: parameter[0].low: friction.coefficient is out of range (found -0.3); give",
        ),
        (
            (ANGLE.replace("5.0", "89.5").replace("normal", "uniform"),),
            "study.toml:2: parameter[0]: link2.angle_deg is out of range (found 90.",
        ),
        (
            (ANGLE.replace("5.0", "89.5").replace("normal", "uniform"),),
            "give a number from -90 to 90, in deg: a uniform distribution reaches √3 deviations far",
        ),
        ((ANGLE.replace("5.0", "89.0"),), "cut its distribution off: give low and high beside mean and deviation"),
        (
            (PERCENT + "mean = 1.0\ndeviation = 0.1",),
            "tolerance_percent: is given together with mean and deviation",
        ),
        (
            (PERCENT.replace("link2.angle", "link1.angle"),),
            "study.toml:5: parameter[0].tolerance_percent: is part of",
        ),
        (
            (PERCENT.replace("10.0", "2000.0"),),
            "study.toml:5: parameter[0].tolerance_percent: link2.angle_deg is out",
        ),
        (
            (
                DAMPING.replace("link1.damping", "shoe.mass").replace(
                    "low = 200.0\nhigh = 400.0", "tolerance_percent = 1.0"
                ),
            ),
            "shoe.mass, link2.damping differ in the case: 10.0, 300.0",
        ),
        ((ANGLE + "low = 9.2\nhigh = 12.0",), "low: and high lie where no value falls"),
        (("band = [100.0]", FRICTION), "band: is no pair"),
        (("band = [1.0, 2.0, 3.0]", FRICTION), "band: is no pair"),
        (("band = [nan, 100.0]", FRICTION), "band[0]: "),
        (('band = ["a", 100.0]', FRICTION), "band[0]: "),
        (("samples = 4", FRICTION), "samples: is out of range"),
        (("band = [2.0, 1.0]", FRICTION), "band: is no pair of frequencies that rise"),
        (("correlation = [[1.0, 0.5]]", FRICTION, ANGLE), "is no matrix with 2 rows of 2 numbers"),
        (("correlation = [[1.0, 0.5], [0.4, 1.0]]", FRICTION, ANGLE), "is not symmetric"),
        (("correlation = [[1.0, 1.1], [1.1, 1.0]]", FRICTION, ANGLE), "contradicts itself"),
        (("method = 1", FRICTION), "method: "),
        ((), "parameter: is missing"),
    ],
)
def test_a_wrong_study_is_refused_with_its_line(tmp_path: Path, tables: tuple[str, ...], said: str) -> None:
    with pytest.raises(CaseError) as refused:
        brakecli.scatter(write_study(tmp_path, *tables))
    assert said in str(refused.value)


def test_all_that_is_wrong_with_a_study_is_told_at_once_and_each_of_it_once(tmp_path: Path) -> None:
    wrong = FRICTION.replace("friction", "frction").replace("low = 0.3\n", "") + ANGLE.replace("angle", "angel")
    with pytest.raises(CaseError) as refused:
        brakecli.scatter(write_study(tmp_path, wrong, PERCENT))
    assert [each.path for each in refused.value.problems] == [
        ("parameter", 0, "key"),
        ("parameter", 0, "high"),
        ("parameter", 1, "key"),
    ]


@campaign
def test_per_cent_are_those_of_the_drawing(tmp_path: Path) -> None:
    """The case has 5 degrees, and 300 N·s/m in both links; advice is about the drawing that it is given."""
    both = DAMPING.replace("low = 200.0\nhigh = 400.0", "tolerance_percent = 20.0")
    path = write_study(tmp_path, PERCENT, both, 'indices_of = "none"', "samples = 512")
    study = load_study(str(path), ["link2.angle_deg=-6.0"]).study
    ends = [end for each in study.parameter for end in (each.low, each.high)]
    assert ends == pytest.approx([-6.6, -5.4, 240.0, 360.0])
    report = brakecli.scatter(path)
    for name, low, high in (("link2_angle_deg", 4.5, 5.5), ("link1_damping", 240.0, 360.0)):
        values = report[name].to_numpy()
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < values.max() <= high
    assert "tolerance_percent" in str(report.attrs["study_toml"])
    assert "tolerance_percent" not in str(report.attrs["resolved_study_toml"])
    asked = ["--set", "link2.angle_deg=7.0", "--scatter", "study.toml", "--keys", "shoe.mass"]
    assert "scatters it between" not in command("advise", "shoe.toml", *asked, cwd=tmp_path).told(0)


def test_other_files_are_told_from_studies(tmp_path: Path) -> None:
    path = write_study(tmp_path, FRICTION)
    command("scatter", "shoe.toml", cwd=tmp_path).told(
        2,
        "is a case; simulate it with: brakecli run shoe.toml, or write a study of it with: brakecli new scatter",
    )
    command("advise", "shoe.toml", "--scatter", "shoe.toml", cwd=tmp_path).told(2, "with: brakecli new scatter")
    command("run", "study.toml", cwd=tmp_path).told(2, "study.toml: ")
    with pytest.raises(BrakecliError):
        brakecli.sweep(path, jobs=1)
    (tmp_path / "shoe.toml").unlink()
    with pytest.raises(CaseError, match=r"study\.toml:1: case: "):
        load_study(str(path), None)


def test_quantiles_are_of_what_is_known() -> None:
    assert quantiles(np.array([np.nan, 1.0, 3.0, np.nan])) == pytest.approx([1.1, 1.5, 2.0, 2.5, 2.9])
    assert quantiles(np.array([np.nan])) == []


def test_the_schema_of_studies_accepts_the_starter_and_no_unknown_key() -> None:
    validator = import_module("jsonschema").Draft202012Validator(json_schema(Study))
    text = resources.files("brakecli.case.starters").joinpath("scatter.toml").read_text(encoding="utf-8")
    validator.validate(tomllib.loads(text))
    assert not validator.is_valid(tomllib.loads(text.replace("samples", "sample")))


def test_more_samples_than_memory_holds_are_refused_before_any_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def drawn_(*_: Any, seed: Any) -> None:
        raise AssertionError("a sample was drawn")

    monkeypatch.setattr(stats.qmc, "Sobol", drawn_)
    path = write_study(tmp_path, FRICTION, ANGLE)
    for samples in (MOST_SAMPLES + 1, 10_000_000, 10**300):
        with pytest.raises(RefusedError, match=r"samples: are too many \(found .*\); 1000000 are the most"):
            brakecli.scatter(path, {"samples": samples})
    monkeypatch.setattr(draw, "MOST_VALUES", 4000)
    with pytest.raises(RefusedError, match=r"samples: are too many \(found 2000\) for 2 keys; take fewer samples"):
        brakecli.scatter(path, {"samples": 2000})
    with pytest.raises(AssertionError, match="a sample was drawn"):
        brakecli.scatter(path, {"samples": 200})
    (tmp_path / "study.toml").write_text(path.read_text().replace("case =", "samples = 10000000\ncase ="))
    command("scatter", "study.toml", cwd=tmp_path).told(3, "samples: are too many (found 10000000)")
    assert left_in(tmp_path) == {"shoe.toml", "study.toml"}
