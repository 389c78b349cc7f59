"""Poincaré sections: one dot for a motion that repeats, and what a run does not have is said."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from matplotlib.text import Text

from brakecli.case.read import parse_case
from brakecli.errors import UsageError
from brakecli.results.numbers import stored_numbers
from brakecli.results.read import open_result
from brakecli.studies.runs.run import run
from brakecli.views.plots import section as sections
from brakecli.views.plots.result import draw
from brakecli.views.plots.style import applied
from tests.campaign import campaign
from tests.examples import ROUGH, SQUEAL
from tests.views.plots.helpers import points

pytestmark = pytest.mark.usefixtures("compiled")
FREQUENCY = 2.0 / 0.03  # Hz
FORCED: dict[
    str, Any
] = {  # full contact: a linear motion of one wave, 2/0.03 Hz, which is all that is left in the end
    **ROUGH,
    "load": {"force": 20000.0},
    "link1": {"stiffness": 2e7, "damping": 5e4},
    "link2": {"stiffness": 1e7, "damping": 5e4, "angle_deg": 30.0},
    "roughness": {"wheel": {"amplitudes": [2e-6], "wavelengths": [0.03]}},
    "solver": {"step": 1e-5, "duration": 0.5},
}
STICKS = {
    **SQUEAL,
    "solver": {"tolerance": 1e-6, "duration": 1.0},
    "output": {"sample_interval": 1e-4, "events": True},
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("runs")
    found = {name: folder / f"{name}.h5" for name in ("forced", "sticks")}
    for case, path in zip((FORCED, STICKS), found.values(), strict=True):
        run(parse_case(tomli_w.dumps(case), "case.toml"), path, force=False)
    return found


def section(path: Path, kind: str) -> list[Any]:
    with open_result(path) as result, applied():
        return list(draw(result, section=kind).axes)


@pytest.mark.parametrize(("name", "kind", "count"), [("forced", "wave", FREQUENCY), ("sticks", "slip", 174.1)])
def test_a_motion_that_repeats_is_one_dot_on_its_curve(
    name: str, kind: str, count: float, runs: dict[str, Path]
) -> None:
    with open_result(runs[name]) as result:
        seconds = result.read("history", "time")[-1] - result.attributes["settled_from"]
    for axes in section(runs[name], kind):
        dots = points(axes, "section")
        curve = points(axes, "motion")
        assert len(dots) == pytest.approx(count * seconds, abs=1.5)
        assert (np.ptp(dots[-10:], axis=0) < 2e-3 * np.ptp(curve, axis=0)).all()
        sizes = np.ptp(curve, axis=0)
        assert np.abs((curve - dots[-1]) / sizes).max(axis=1).min() < 0.05  # from sample to sample


@pytest.mark.parametrize("spread", [0.3, 1e-3])
def test_dots_that_spread_fill_the_axes_and_others_stand_on_the_whole_motion(
    spread: float, runs: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ring of dots whose size is a part of the motion's."""
    at_waves = sections._at_waves
    with open_result(runs["forced"]) as result:
        sizes = {name: np.ptp(result.read("history", name)[-1000:]) for name in ("x", "y", "vx", "vy")}

    def ring(*about: Any) -> Any:
        found, words = at_waves(*about)
        turns = np.linspace(0.0, 2.0 * np.pi, len(found["x"]))
        places = {"x": np.cos(turns), "y": np.cos(turns), "vx": np.sin(turns), "vy": np.sin(turns)}
        return {name: found[name].mean() + 0.5 * spread * sizes[name] * places[name] for name in sizes}, words

    monkeypatch.setattr(sections, "_at_waves", ring)
    for axes in section(runs["forced"], "wave"):
        limits = np.array([axes.get_xlim(), axes.get_ylim()])
        filling = points(axes, "section" if spread > 0.01 else "motion")
        shares = np.ptp(filling, axis=0) / np.ptp(limits, axis=1)
        assert (shares > 0.85).all()  # the margins of Matplotlib leave 1/1.1, those of a section 1/1.08
        assert (shares < 1.0).all()
        assert ((limits[:, 0] < filling.min(axis=0)) & (filling.max(axis=0) < limits[:, 1])).all()


TORUS = "with a phase of its own (a torus: 173 Hz and the frequencies of the waves are incommensurate)"


@pytest.mark.parametrize(
    ("regime", "words"), [("relaxation", "in every cycle"), ("quasi-harmonic", "without stick")]
)
def test_the_verdict_stands_above_the_section(
    regime: str, words: str, runs: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    told = {"regime": regime, "excitation": "self-excited", "reasons": (f"the vibration lasts, {TORUS}",)}
    with open_result(runs["forced"]) as result, applied():
        read = stored_numbers(result)
        assert read["reasons"]
        monkeypatch.setattr("brakecli.views.plots.section.stored_numbers", lambda _: {**read, **told})
        shown = " ".join(text.get_text() for text in draw(result, section="wave").findobj(Text))
    assert words in shown
    assert TORUS.replace(" ", "") in shown.replace(" ", "")


@campaign
def test_what_a_run_does_not_have_is_said(runs: dict[str, Path], tmp_path: Path) -> None:
    def said(path: Path, kind: str, variable: str = "") -> str:
        with open_result(path) as result, applied(), pytest.raises(UsageError) as caught:
            draw(result, variable=variable, section=kind)
        return str(caught.value)

    assert "no wave of a rough wheel passes at a constant speed; give an event" in said(runs["sticks"], "wave")
    assert "holds no events; run its case again with --set output.events=true" in said(runs["forced"], "slip")
    assert "give one of slip, stick" in said(runs["sticks"], "turn")
    assert "give one of wave, stick, slip, turn, lift-off, touch" in said(runs["sticks"], "chaos")
    assert "is a picture of its own" in said(runs["forced"], "wave", "x")
    coarse = {**FORCED, "output": {"sample_interval": 5e-3}}
    run(parse_case(tomli_w.dumps(coarse), "case.toml"), tmp_path / "a.h5", force=False)
    assert "do not resolve the wave of 66.67 Hz; run with output.sample_interval=0.0019" in said(
        tmp_path / "a.h5", "wave"
    )
    brief = {**FORCED, "solver": {"step": 1e-5, "duration": 0.011}}
    run(parse_case(tomli_w.dumps(brief), "case.toml"), tmp_path / "b.h5", force=False)
    assert "less than a period" in said(tmp_path / "b.h5", "wave")
