"""A report is one page that needs nothing else, says what its results hold, and lets nothing hostile in."""

import base64
import json
import re
import sys
from html.parser import HTMLParser
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from brakecli.case.read import parse_case
from brakecli.errors import BrakecliError, UsageError
from brakecli.files.read import open_result
from brakecli.files.write import new_result
from brakecli.plots import style
from brakecli.reports import blocks, page, sweep_map
from brakecli.reports.page import write_report
from brakecli.runs.advise import advise
from brakecli.runs.run import run
from brakecli.sweeps.lock_in import lock_in
from brakecli.sweeps.lock_in import write as write_lock_in
from brakecli.sweeps.tables import Axis
from tests.campaign import campaign
from tests.commands import ROOT, TINY
from tests.plots.helpers import ANGLE, CRITICAL, SPEED, columns, write
from tests.reports.browser import browser

HOSTILE = '</script><script>alert(1)</script><img src=x onerror=alert(2)> & "Ä"'
COLOURS = (style.BLUE, style.ORANGE, style.VERMILION, style.GREEN, style.GREY, style.DARK)
BASE = TINY.replace('"Tiny"', json.dumps(HOSTILE))


def quiet(what: str, done: int, total: int) -> None:
    """No progress."""


class Page(HTMLParser):
    """Elements with their attributes, and the text of each script."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.scripts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        (self.scripts if self.found and self.found[-1][0] == "script" else self.texts).append(data)

    def named(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.found if name == tag]

    @property
    def data(self) -> list[dict[str, Any]]:
        """The values of each map."""
        return [json.loads(text) for text in self.scripts if text.startswith("{")]


def reported(*results: Path) -> Page:
    target = results[0].with_suffix(".html")
    write_report(results, target, force=True, progress=quiet)
    return Page(target.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory, compiled: None) -> list[Path]:
    """A run, a map of regimes, and a lock-in diagram, all with a hostile title."""
    folder = tmp_path_factory.mktemp("results")
    loaded = parse_case(BASE, "case")
    run(loaded, folder / "run.h5", force=False)
    write(folder / "map.h5", {"axis": [ANGLE, SPEED]}, **origin())
    axis = Axis(parameter=("friction.coefficient",), start=0.4, stop=0.8, num=5)
    write_lock_in(folder / "modes.h5", loaded, lock_in(loaded, axis, "--vary", quiet), force=False)
    return [folder / f"{name}.h5" for name in ("run", "map", "modes")]


def origin() -> dict[str, Any]:
    """Where results of sweeps come from."""
    return {"title": HOSTILE, "resolved_toml": parse_case(BASE, "case").resolved, "case_toml": BASE}


@pytest.fixture(scope="module")
def found(results: list[Path]) -> Page:
    return reported(*results)


def test_a_page_is_one_file_that_loads_nothing_and_runs_nothing_of_the_results(
    results: list[Path], found: Page
) -> None:
    text = results[0].with_suffix(".html").read_text(encoding="utf-8")
    assert len(text.encode()) < 3_000_000
    places = [
        value
        for _, attributes in found.found
        for name, value in attributes.items()
        if name in ("src", "srcset", "href", "action", "data", "poster")
    ]
    assert len(places) >= 2 * 4
    assert all(str(place).startswith(("data:", "#")) for place in places)
    assert "url(" not in text
    assert "@import" not in text
    assert not any(name.startswith("on") for _, attributes in found.found for name in attributes)
    assert [attributes.get("type") for attributes in found.named("script")] == ["application/json", None]
    assert all(image["alt"] for image in found.named("img"))
    assert len(found.named("article")) == 3
    assert HOSTILE in "".join(found.texts)
    (policy,) = [each["content"] for each in found.named("meta") if "http-equiv" in each]
    assert str(policy).startswith("default-src 'none'; img-src data:")


def test_a_report_of_a_run_answers_first_and_holds_all_that_is_promised(results: list[Path], found: Page) -> None:
    text = " ".join(" ".join(found.texts).split())
    with open_result(results[0]) as stored:
        attributes, evidence = dict(stored.attributes), stored.group_attributes("regime/evidence")
    answer = text[text.index("Will this shoe vibrate") : text.index(" Case ")]
    assert attributes["reasons"][0] in answer
    assert advise(parse_case(BASE, "case"), ("*.angle_deg",), 0.2, quiet).conclusion().split(";")[0] in answer
    heads = ["Case", "Stability of steady sliding", "Regime, and its evidence", "Pictures", "Accuracy", "Warnings"]
    places = [text.index(f" {head} ") for head in (*heads, "How to repeat it", "Versions")]
    assert places == sorted(places)
    assert [name for name in evidence if name.replace("_", " ") not in text] == []
    for version in ("brakecli", "numpy", "scipy", "numba", "h5py", "hdf5"):
        assert f"{version} {attributes[f'{version}_version']}" in text
    assert "brakecli run run.h5 -o again.h5" in text
    assert "critical friction for 1 % more" in text


def test_what_a_scene_does_not_require_is_no_warning(tmp_path: Path, compiled: None) -> None:
    loaded = parse_case((ROOT / "cases" / "damped.toml").read_text(encoding="utf-8"), "case")
    left_out = run(loaded, tmp_path / "r.h5", force=False).left_out
    assert left_out
    text = " ".join(reported(tmp_path / "r.h5").texts)
    accuracy, warnings = text.index("Accuracy"), text.rindex("Warnings")
    assert all(accuracy < text.index(f"Left out: {each}.") < warnings for each in left_out)
    assert "Left out" not in text[warnings:]


def test_a_map_holds_the_values_of_every_point(found: Page) -> None:
    (data,) = found.data
    values = columns((8, 7), critical=False)
    assert [len(data[side]) for side in ("xs", "ys", "x", "y")] == [8, 7, 9, 8]
    assert data["names"] == ["link2.angle_deg (deg)", "wheel.angular_speed (rad/s)"]
    regimes, frequencies, amplitudes = (data["columns"][name] for name in ("regime", "frequency", "amplitude"))
    assert (frequencies["unit"], amplitudes["unit"]) == ("Hz", "µm")
    for i, j in product(range(8), range(7)):
        assert regimes["texts"][regimes["values"][i][j]] == values["regime"][i, j]
        frequency = values["frequency"][i, j]
        assert frequencies["values"][i][j] == (None if np.isnan(frequency) else frequency)
        assert amplitudes["values"][i][j] == 10.0 + 10.0 * (7 * i + j)


def test_a_map_of_too_many_points_is_a_picture_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert sweep_map.MOST == 10_000
    monkeypatch.setattr(sweep_map, "MOST", 15)
    axes = [{**ANGLE, "num": 4}, {"parameter": "wheel.radius", "start": 0.1, "stop": 1.0, "num": 4}]
    alone = reported(write(tmp_path / "r.h5", {"axis": axes}, **origin()))
    assert alone.data == []
    assert len(alone.named("img")) == 1
    assert "Values of single points are left out" in "".join(alone.texts)


def test_what_cannot_be_reported_is_refused_and_nothing_is_left(
    results: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(words: str, result: Path, target: Path, force: bool = False) -> None:
        before = {each: each.read_bytes() for each in tmp_path.iterdir()}
        with pytest.raises(BrakecliError, match=words):
            write_report([result], target, force=force, progress=quiet)
        assert before == {each: each.read_bytes() for each in tmp_path.iterdir()}

    refused(r"ends in \.html", results[0], tmp_path / "r.pdf")
    (tmp_path / "mine.html").write_text("mine")
    refused("--force", results[0], tmp_path / "mine.html")
    refused("the result itself", tmp_path / "mine.html", tmp_path / "mine.html", force=True)
    refused("cannot be read as a result", tmp_path / "absent.h5", tmp_path / "r.html")
    with new_result(tmp_path / "other.h5", force=False) as result:
        result.set_attributes({"kind": "other"})
        result.commit()
    refused("of which there is no report", tmp_path / "other.h5", tmp_path / "r.html")
    monkeypatch.setattr(page, "LARGEST", 1000)
    refused("name fewer results", results[2], tmp_path / "r.html")
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(UsageError, match="pip install matplotlib jinja2"):
        write_report(results, tmp_path / "r.html", force=False, progress=quiet)


def test_a_picture_in_a_page_keeps_colours_that_are_rare() -> None:
    def draw() -> Figure:
        figure = Figure(figsize=(3.0, 3.0))
        axes = figure.subplots()
        for place, colour in enumerate(COLOURS):
            axes.plot([place], [place], "s", ms=3.0, color=colour)
        return figure

    found = blocks.picture("words", draw)
    for data in (found.wide, found.narrow):
        picture = Image.open(BytesIO(base64.b64decode(data.partition(",")[2]))).convert("RGB")
        there = np.asarray(picture).reshape(-1, 3).astype(int)
        for colour in COLOURS:
            wanted = 255.0 * np.array(to_rgb(colour))
            assert np.abs(there - wanted).max(axis=1).min() < 12.0, colour


@campaign
def test_a_browser_shows_the_page_at_any_width_without_a_mouse_and_on_paper(
    results: list[Path], tmp_path: Path
) -> None:
    """In Chromium: no error on the console, every picture there, nothing wider than the window."""
    loaded = parse_case((ROOT / "cases" / "relaxation.toml").read_text(), "case", ["solver.duration=0.5"])
    run(loaded, tmp_path / "relaxation.h5", force=False)
    write(tmp_path / "critical.h5", {"axis": [ANGLE], "critical": CRITICAL}, **origin())
    target = tmp_path / "r.html"
    write_report([*results, *tmp_path.glob("*.h5")], target, force=False, progress=quiet)
    with browser() as window:
        for width in (400, 1600):
            window.open(target, width)
            assert window.complaints() == []
            images = window.run("[...document.images].map(i => [i.complete, i.naturalWidth, i.width])")
            assert len(images) == 2 * 2 + 3
            assert all(complete and natural > 500 and 300 < shown <= width for complete, natural, shown in images)
            assert window.run("document.documentElement.scrollWidth") <= width
            letters = "parseFloat(getComputedStyle(document.querySelector('p')).fontSize)"
            assert window.run(letters) >= 14.0
        for _ in range(500):  # from the top to the first map by the keyboard alone
            window.press("Tab")
            if window.run("document.activeElement.tagName") == "svg":
                break
        values = "document.querySelector('output').textContent"
        assert re.search(r"regime damped .*frequency – ", window.run(values))
        for key in ("ArrowRight", "ArrowUp"):
            window.press(key)
        expected = columns((8, 7), critical=False)
        assert f"regime {expected['regime'][1, 1]}" in window.run(values)
        assert f"amplitude {1e6 * expected['amplitude'][1, 1]:g} µm" in window.run(values)
        box = "document.querySelector('.map > svg').getBoundingClientRect()"
        x, y = window.run(f"(b => [b.left + 0.3 * b.width, b.top + 0.3 * b.height])({box})")
        window.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        assert f"regime {expected['regime'][1, 1]}" not in window.run(values)
        paper = window.call("Page.printToPDF", printBackground=True)["data"]
        assert len(paper) > 100_000
        assert window.complaints() == []
