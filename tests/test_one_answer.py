"""The same question has the same answer, whoever is asked: the critical friction of smooth shoes."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import brakecli
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.sliding import Sliding
from brakecli.analysis.stability.report import stability
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.studies.scattering.eigen import answer_of
from brakecli.studies.sweeps.critical import search
from brakecli.studies.sweeps.tables import Critical
from tests.analysis.shoes import random_shoes
from tests.campaign import counts
from tests.commands import brakecli as command
from tests.examples import make

DIGITS = 5e-7
"""Part of a critical value that seven digits do not show: more than any command prints."""


@pytest.mark.filterwarnings("ignore::UserWarning")  # random shoes may have numbers that no brake has
@pytest.mark.parametrize("number", counts(2, 12))
def test_all_commands_have_the_same_critical_friction(number: int, tmp_path: Path) -> None:
    """`stability`, `advise`, `branch`, a sweep without axes, and a sample of `scatter` that is the case itself."""
    for place, tables in enumerate(islice(random_shoes("smooth", 50), number)):
        file = tmp_path / f"{place}.toml"
        file.write_text(tomli_w.dumps(tables))
        value = float(brakecli.stability(file, pushes=0).critical_friction)
        if not np.isfinite(value):  # the wheel stands
            continue
        ends = (0.0, 2.0 * value)
        searched = {"parameter": "friction.coefficient", "lower": ends[0], "upper": ends[1]}
        answers = {
            "advise": brakecli.advise(file).critical_friction,
            "branch": brakecli.branch(file, parameter={"friction.coefficient": ends}, pushes=0).attrs["critical"],
            "sweep": np.ravel(brakecli.sweep(file, critical=searched, jobs=1).critical)[0],
            "scatter": answer_of(system_of(parse_case(file.read_text(), file.name).case), None)[2],
        }
        for name, answer in answers.items():
            assert answer == pytest.approx(value, rel=DIGITS), (place, name)


def test_a_rough_shoe_has_the_same_critical_friction_and_bar_in_a_sweep() -> None:
    """By the mean stiffness of an open pad, with what the mean leaves open; a search adds half its bracket."""
    for place, tables in enumerate(islice(random_shoes("open", 11), 9, 16)):
        case = make(tables)
        told = stability(system_of(case))
        if told.critical is None or told.critical_error is None:
            continue
        value = told.critical.friction
        critical = Critical(
            parameter="friction.coefficient",
            lower=0.0,
            upper=2.0 * value,
            method="eigenvalue",
            tolerance=1e-6 * value,
        )
        found = search(critical, Line(case, [critical.parameter], critical.lower, critical.upper))
        assert found.value == pytest.approx(value, rel=DIGITS), place
        assert found.error == pytest.approx(told.critical_error, rel=0.1, abs=1e-8 * value), place


def test_self_locking_of_a_rough_shoe_is_a_change_for_all() -> None:
    """In full contact: steady sliding ends where the determinant of the stiffness is zero."""
    case = make(
        {
            "shoe": {"mass": 0.3085080421393824},
            "wheel": {"radius": 0.5, "angular_speed": -0.05171182578244892},
            "link1": {"stiffness": 8918939.360033464, "damping": 0.0, "angle_deg": -24.45639401494012},
            "link2": {"stiffness": 21055621.77829502, "damping": 0.0, "angle_deg": 27.019052380302064},
            "load": {"force": 1291.8458564252483},
            "friction": {"coefficient": 0.5},
            "contact": {"half_length": 4.778111480935504e-05, "stiffness": 216869263618.05194},
            "roughness": {
                "wheel": {
                    "amplitudes": [3.5414050263521763e-06],
                    "wavelengths": [0.00039809115598824765],
                    "phases_deg": [284.42770897740246],
                }
            },
            "solver": {"duration": 0.1},
            "output": {"sample_interval": 1e-4},
        }
    )
    told = stability(system_of(case)).critical
    assert told is not None
    assert told.instability == "divergence"
    sliding = Sliding(Line(case, ["friction.coefficient"], 0.0, 3.0))
    (change,) = sliding.changes(sliding.along())
    assert (change.kind, change.lost) == ("divergence", True)
    assert 3.0 * change.p == pytest.approx(told.friction, rel=DIGITS)


ON_THE_EQUILIBRIUM = """
shoe.mass = 1.7
wheel = { radius = 0.2, angular_speed = 1.4 }
link1 = { stiffness = 2.3e6, damping = 29.0, angle_deg = 3.8 }
link2 = { stiffness = 6.7e6, damping = 33.0, angle_deg = 5.1 }
load.force = 1500.0
friction.coefficient = 0.4
contact = { half_length = 0.03, stiffness = 5.0e7 }
solver = { tolerance = 1e-5, duration = "settled" }
initial.at = "equilibrium"
"""


@pytest.mark.filterwarnings("ignore::UserWarning")  # what grows out of rounding has no certified error
def test_a_start_on_unstable_sliding_itself_is_judged_alike_by_runs_and_sweeps(tmp_path: Path) -> None:
    """Only rounding moves such a shoe, or nothing does: neither ends in a division by zero."""
    file = tmp_path / "on.toml"
    file.write_text(ON_THE_EQUILIBRIUM)
    values = [0.71, 0.5900000000000001]
    found = brakecli.sweep(file, axes={"friction.coefficient": values}, jobs=1)
    for value, regime in zip(values, found.regime.values.tolist(), strict=True):
        run = brakecli.run(file, {"friction.coefficient": value}, progress=False)
        assert regime == run.attrs["regime"]
    assert found.regime.values.tolist()[0] == "undecided"


def test_a_search_tells_of_vibration_beside_stable_sliding_as_stability_does(tmp_path: Path) -> None:
    file = tmp_path / "on.toml"
    file.write_text(ON_THE_EQUILIBRIUM)
    (tmp_path / "s.toml").write_text(
        'case = "on.toml"\n[critical]\nparameter = "friction.coefficient"\nlower = 0\nupper = 1\n'
        '[[axis]]\nparameter = "link2.angle_deg"\nvalues = [5.0, 6.0]\n'
    )
    least = min(float(brakecli.stability(file, {"link2.angle_deg": angle}).coexists_from) for angle in (5.0, 6.0))
    said = command("sweep", "s.toml", "-j", "1", cwd=tmp_path).out
    assert f"can exist at 2 of 2 points, the least value is {least:.4g}" in " ".join(said.split())
