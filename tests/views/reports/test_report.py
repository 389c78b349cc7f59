"""A report is one page that needs nothing else, says what its results hold, and lets nothing hostile in."""

import base64
import json
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from io import BytesIO
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

import brakecli
from brakecli.analysis.stability.advice import KEYS, Left
from brakecli.analysis.stability.report import stability
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import BrakecliError, UsageError
from brakecli.results.read import open_result
from brakecli.results.write import new_result
from brakecli.studies.runs.advise import AdviceReport, advise
from brakecli.studies.runs.run import run
from brakecli.studies.scattering.advised import squealing
from brakecli.studies.sweeps.lock_in import lock_in
from brakecli.studies.sweeps.lock_in import write as write_lock_in
from brakecli.studies.sweeps.tables import Axis
from brakecli.views.plots import style
from brakecli.views.reports import blocks, of_run, of_several, of_sweep, page, sweep_map
from brakecli.views.reports.of_several import best_of
from brakecli.views.reports.page import write_report
from tests.campaign import campaign
from tests.commands import ROOT, TINY
from tests.views.plots.helpers import ANGLE, CRITICAL, SPEED, columns, write
from tests.views.reports.browser import browser

HOSTILE = '</script><script>alert(1)</script><img src=x onerror=alert(2)> & "Ä"'
COLOURS = (style.BLUE, style.ORANGE, style.VERMILION, style.GREEN, style.GREY, style.DARK)
PAGE = re.compile(rb"/Type\s*/Page\b")  # of a PDF
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
        self.html = text
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


def rows(html: str) -> list[tuple[bool, list[str]]]:
    """The cells of each row of all tables, and whether the row is marked."""
    found = re.findall(r"<tr( class=\"differs\")?>(.*?)</tr>", html, re.DOTALL)
    cells = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", inner, re.DOTALL) for _, inner in found]
    texts = [
        ["".join(re.sub("<wbr>", "", cell).split("\n")).replace("\u00a0", " ") for cell in row] for row in cells
    ]
    return [(bool(mark), row) for (mark, _), row in zip(found, texts, strict=True)]


def reported(*results: Path, full: bool = True) -> Page:
    target = results[0].with_suffix(".html")
    write_report(results, target, full=full, force=True, progress=quiet)
    return Page(target.read_text(encoding="utf-8"))


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages whose pictures are drawn, but not painted, for tests that look at something else."""

    def picture(words: str, draw: Callable[[], Figure]) -> blocks.Picture:
        if words.startswith(of_several.PICTURE):  # it is not known beforehand whether there is one
            draw()
        return blocks.Picture(words, "data:,wide", "data:,narrow")

    for module in (of_run, of_several, of_sweep):
        monkeypatch.setattr(module, "picture", picture)


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
        attributes = dict(stored.attributes)
        evidence = stored.group_attributes("regime/evidence")
    answer = text[text.index("Will this shoe vibrate") : text.index(" What to change ")]
    assert attributes["reasons"][0] in answer
    assert advise(parse_case(BASE, "case"), ("*.angle_deg",), 0.2, quiet).conclusion().split(";")[0] in answer
    heads = ["What to change", "Appendix", "Case", "Stability of steady sliding", "Regime, and its evidence"]
    places = [text.index(f" {head} ") for head in (*heads, "Accuracy", "Warnings", "How to repeat it", "Versions")]
    assert places == sorted(places)
    assert [name for name in evidence if name.replace("_", " ") not in text] == []
    for version in ("brakecli", "numpy", "scipy", "numba", "h5py", "hdf5"):
        assert f"{version} {attributes[f'{version}_version']}" in text
    assert "brakecli run run.h5 -o again.h5" in text
    assert "Critical friction for 1 % and for 1 unit of a value" in text


def test_the_first_page_has_question_answer_one_picture_and_what_to_change(
    results: list[Path], found: Page
) -> None:
    first, appendix = found.html.split('<div class="appendix">')[:2]
    places = [first.index(part) for part in ('class="answer"', "Will this shoe", "<figure>", "What to change")]
    assert places == sorted(places)
    assert first.count("<figure>") == 1
    with open_result(results[0]) as stored:
        report = advise(parse_case(stored.text("resolved_toml"), "case"), KEYS, 0.2, quiet)
    helpful = [each for each in report.advice if each.to is not None]
    assert len(helpful) > of_run.MOST_CHANGES
    names = [each.parameter for each in helpful[: of_run.MOST_CHANGES]]
    assert [cells[0] for _, cells in rows(first)] == ["what to change", *names]
    change = helpful[0]
    _, cells = rows(first)[1]
    part = f"{100.0 * (float(change.rounded) / change.start - 1.0):+.3g} %".replace("-", "−")
    assert cells[2].endswith(f"({part})")
    assert {each.parameter for each in report.advice} <= {cells[0] for _, cells in rows(appendix)}


def test_headings_are_in_order_and_each_picture_is_there_once_for_those_who_do_not_see_it(found: Page) -> None:
    levels = [int(tag[1]) for tag, _ in found.found if tag in ("h1", "h2", "h3")]
    assert levels[0] == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    looks = [image["class"] for image in found.named("img")]  # of which a browser shows one
    assert looks == ["of-wide", "narrow"] * (len(looks) // 2)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            "friction.coefficient=0.3",
            "Nothing has to be changed; as drawn it does not squeal by itself; sliding loses",
        ),
        ("wheel.angular_speed=0.0", "No change is known; the wheel stands"),
    ],
)
def test_without_advice_the_first_page_says_so(
    change: str, words: str, tmp_path: Path, compiled: None, plain: None
) -> None:
    run(parse_case(TINY, "case", [change, "solver.duration=0.5"]), tmp_path / "r.h5", force=False)
    assert words in " ".join(reported(tmp_path / "r.h5").texts)


def test_advice_that_would_take_long_is_left_to_the_command(
    results: list[Path], plain: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(of_run, "MOST_WORK", -1.0)
    assert (
        "What to change is left out, as it takes long here: `brakecli advise` asks it" in reported(results[0]).html
    )


def test_without_more_being_asked_for_a_page_has_the_answer_alone(
    results: list[Path], found: Page, plain: None
) -> None:
    short = reported(results[0], full=False)
    assert 'class="appendix"' in found.html
    assert 'class="appendix"' not in short.html
    assert [tag for tag, _ in short.found if tag == "h3"] == []
    assert short.html.count("<figure>") == 1
    assert "brakecli report --full" in " ".join(short.texts)
    first = "Will this shoe vibrate, in which way, at which frequency, and what should be changed?"
    assert first in " ".join(short.texts)


def test_three_results_stand_side_by_side_with_their_changes_against_the_first(
    tmp_path: Path, compiled: None, plain: None
) -> None:
    for name, friction in zip("abc", (0.6, 0.3, 0.75), strict=True):
        run(parse_case(TINY, "case", [f"friction.coefficient={friction}"]), tmp_path / f"{name}.h5", force=False)
    short = reported(*(tmp_path / f"{name}.h5" for name in "abc"), full=False)
    assert len(short.named("article")) == 1
    heads = re.findall(r"<h2>(.: .*)</h2>", short.html)
    numbers = (("A", "a", 0.6), ("B", "b", 0.3), ("C", "c", 0.75))
    assert heads == [f"{letter}: {name}.h5, friction.coefficient = {number:g}" for letter, name, number in numbers]
    assert short.html.count('<section class="answer">') == 3
    assert short.html.count("<figure>") == 1  # of all together
    assert "<p>B is best against squeal: critical friction over own friction is " in short.html
    told = {cells[0]: (marked, cells[1:]) for marked, cells in rows(short.html)}
    assert told[""] == (False, ["A", "B", "C", "B against A", "C against A"])
    assert told["friction.coefficient"] == (True, ["0.6", "0.3", "0.75", "−50 %", "+25 %"])  # 0.75 / 0.6 - 1
    for squeal, friction in zip(told["squeal under a scatter"][1], (0.6, 0.3, 0.75), strict=False):
        hits = squealing(parse_case(TINY, "case", [f"friction.coefficient={friction}"]).case)
        assert hits is not None
        assert squeal.endswith(" %")
        assert float(squeal.rstrip(" %")) == pytest.approx(100.0 * hits.mean(), rel=1e-3)
    assert all(len({*cells[:3]}) > 1 for name, (_, cells) in told.items() if name)  # what is the same is no news
    long = reported(*(tmp_path / f"{name}.h5" for name in "abc"))
    assert len(long.named("article")) == 4
    assert (False, ["lost contact", "0 %", "0 %", "0 %", "same", "same"]) in rows(long.html)


def test_the_better_design_is_named_by_its_margin_and_by_its_squeal_under_a_scatter() -> None:
    """Critical frictions from the closed form of `stability`; shares, and their intervals, are made up."""

    def design(squeal: Left | None, *changes: str) -> AdviceReport:
        loaded = parse_case(TINY, "case", changes)
        return replace(advise(loaded, KEYS, 0.2, quiet, most=-1.0), squeal=squeal, scatter="of ±10 %")

    critical = stability(system_of(parse_case(TINY, "case").case)).critical
    assert critical is not None
    low, high = (f"{critical.friction / own:.4g}" for own in (0.6, 0.5))
    often = Left(0.3, 0.28, 0.32)
    near = Left(0.31, 0.29, 0.33)
    seldom = Left(0.1, 0.08, 0.12)
    less = "friction.coefficient=0.5"
    margins = f"critical friction over own friction is {low} for A and {high} for B"
    assert best_of({"A": design(often), "B": design(seldom, less)}) == (
        f"B is better against squeal: {margins}; under a scatter of ±10 % 30 % of A and 10 % of B squeal."
    )
    assert best_of({"A": design(often), "B": design(near, less)}).startswith("B is better against squeal: ")
    assert best_of({"A": design(often), "B": design(near)}).startswith(
        "A and B do not differ in what decides on squeal: "
    )
    assert best_of({"A": design(seldom), "B": design(often, less)}).startswith(
        f"The larger margin is that of B, but fewer squeal of A: {margins}; "
    )
    without = design(None, "friction.coefficient=0.0")
    said = best_of({"A": design(often), "B": without})
    assert said.endswith(f"critical friction over own friction is {low} for A; no friction makes B squeal.")
    three = {"A": design(often), "B": design(seldom, less), "C": design(seldom, less)}
    assert best_of(three).startswith("B and C are best against squeal: ")
    assert best_of({"A": design(often), "B": design(None, "wheel.angular_speed=0.0")}) == ""


def test_of_two_studies_the_better_one_is_named_where_their_intervals_do_not_meet() -> None:
    often = (0.138, 0.133, 0.142)
    near = (0.145, 0.14, 0.15)
    seldom = (0.011, 0.008, 0.013)
    assert of_several.seldom_of({"A": often, "B": seldom}) == (
        "B is better against squeal: 13.8 % (13.3 to 14.2 %) of A and 1.1 % (0.8 to 1.3 %) of B squeal."
    )
    assert of_several.seldom_of({"A": often, "B": near}) == ""
    assert of_several.seldom_of({"A": often, "B": near, "C": seldom}).startswith("C is best against squeal: ")


@pytest.mark.parametrize(
    ("before", "after", "unit", "said"),
    [
        (-4.1, -11.5, "%", "−7.4\u00a0points"),  # a margin that is less than before
        (19.79, 30.08, "%", "+10.3\u00a0points"),
        (-50.0, 20.0, "1/s", "+70\u00a01/s"),
        (-45.0, -50.0, "deg", "−5\u00a0deg"),
        (200.0, 300.0, "Hz", "+50\u00a0%"),
        (0.0, 0.0, "%", "same"),
        ("damped", "relaxation", "", "differs"),
    ],
)
def test_a_change_is_a_part_of_what_was_or_a_difference(before: Any, after: Any, unit: str, said: str) -> None:
    assert of_several._change(before, after, unit) == said


@campaign
def test_a_pdf_has_one_page_and_the_same_bytes_again(results: list[Path], tmp_path: Path) -> None:
    pytest.importorskip("weasyprint")
    for name in ("a", "b"):
        write_report([results[0]], tmp_path / f"{name}.pdf", force=False, progress=quiet)
    data = (tmp_path / "a.pdf").read_bytes()
    assert data == (tmp_path / "b.pdf").read_bytes()
    assert data.startswith(b"%PDF")


@campaign
def test_every_kind_of_result_fits_on_one_page_of_a4(results: list[Path], tmp_path: Path, compiled: None) -> None:
    """So do two and three of them, whatever differs."""
    weasyprint = pytest.importorskip("weasyprint")
    case = tmp_path / "c.toml"
    case.write_text(TINY)
    study = '[[parameter]]\nkey = "link2.angle_deg"\ndistribution = "uniform"\nlow = 4.0\nhigh = 6.0\n'
    (tmp_path / "s.toml").write_text(f'case = "c.toml"\nsamples = 64\n{study}')
    brakecli.scatter(tmp_path / "s.toml", output=tmp_path / "scatter.h5")
    brakecli.branch(case, parameter={"friction.coefficient": (0.5, 0.8)}, output=tmp_path / "branch.h5")
    kinds = [*results, tmp_path / "scatter.h5", tmp_path / "branch.h5"]
    other = tmp_path / "other.h5"
    changes = ["friction.coefficient=0.3", "shoe.mass=12.0", "link1.stiffness=2e7", "link1.damping=100.0"]
    run(parse_case(TINY, "case", [*changes, "load.force=4e3", "wheel.radius=0.4"]), other, force=False)
    several = [[each] * count for each in kinds for count in (1, 2, 3)] + [[results[0], other, results[0]]]
    for each in several:
        page = write_report(each, tmp_path / "r.pdf", force=True, progress=quiet)
        assert len(weasyprint.HTML(string=page).render().pages) == 1, each


def test_without_what_makes_a_pdf_the_remedy_is_said(
    results: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(words: str) -> None:
        with pytest.raises(UsageError, match=words):
            write_report([results[2]], tmp_path / "r.pdf", force=False, progress=quiet)
        assert not (tmp_path / "r.pdf").exists()

    class Broken:
        """Finds the library, which finds none of the system."""

        def find_spec(self, name: str, *_: Any) -> None:
            if name == "weasyprint":
                raise OSError("cannot load library 'libpango-1.0-0': no such file\nAdditionally, ...")

    monkeypatch.setitem(sys.modules, "weasyprint", None)
    refused("weasyprint cannot be imported .*; install it with: python -m pip install weasyprint")
    monkeypatch.delitem(sys.modules, "weasyprint")
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    refused(r"finds no library of the system that it needs \(cannot load library 'libpango-1.0-0': no such file\)")


@pytest.mark.parametrize("given", [False, pytest.param(True, marks=campaign)])
@campaign
def test_what_the_program_has_chosen_is_no_change_of_the_user(given: bool, tmp_path: Path, plain: None) -> None:
    """The interval of samples is a change where files give it; else it is named apart if its digits differ."""
    text = BASE if given else BASE.replace("output.sample_interval = 1e-4", "")
    for name, interval in (("a", 1e-4), ("b", 2e-4), ("c", 1e-4 + 1e-16)):
        case = parse_case(BASE, "case", [f"output.sample_interval={interval!r}"])
        about: dict[str, Any] = {"title": "T", "resolved_toml": case.resolved, "case_toml": text}
        write(tmp_path / f"{name}.h5", {"axis": [ANGLE], "critical": CRITICAL}, **about)
    changed, close = (reported(tmp_path / "a.h5", tmp_path / f"{name}.h5").html for name in "bc")
    row = True, ["output.sample_interval", "100 µs", "200 µs", "+100 %"]
    assert (row in rows(changed)) == given
    told = "different, too: output.sample_interval (100\u00a0µs, 200\u00a0µs)."
    assert (told in changed) != given
    assert ("The cases are the same." in changed) != given
    assert "different, too" not in close
    heading = "T: output.sample_interval 100\u00a0µs → 200\u00a0µs" if given else "T: a.h5 – b.h5"
    assert f"<h1>{heading}</h1>" in changed


def test_scatter_has_its_study_and_its_probabilities_as_tables(
    tmp_path: Path, compiled: None, plain: None
) -> None:
    (tmp_path / "c.toml").write_text(TINY)
    study = '[[parameter]]\nkey = "link2.angle_deg"\ndistribution = "uniform"\nlow = 4.0\nhigh = 6.0\n'
    study = f"band = [100.0, 2000.0]\n{study}"
    (tmp_path / "s.toml").write_text(f'case = "c.toml"\nmethod = "eigenvalue"\nsamples = 64\n{study}')
    found = brakecli.scatter(tmp_path / "s.toml", {"seed": 7}, output=tmp_path / "r.h5")
    page = reported(tmp_path / "r.h5")
    for row in (
        ["link2.angle_deg", "uniform", "low 4 deg, high 6 deg"],
        ["seed", "7", "of the random numbers"],  # that of the shell, not that of the file
        ["sampling", "sobol", "how samples are drawn"],
        ["samples", "64", "how many brakes are drawn"],
    ):
        assert (False, row) in rows(page.html)
    assert [cells[1] for _, cells in rows(page.html) if cells[0] == "band"] == ["100 Hz, 2000 Hz"]
    text = (
        "Such brakes are those of the case in which link2.angle_deg scatters; squeal is a vibration of their own"
    )
    assert f"{text} from 100\u00a0Hz to 2000\u00a0Hz." in page.html
    assert "solver.theta" not in page.html[: page.html.index("The whole case as a file")]
    squeal = [cells for _, cells in rows(page.html) if cells[0] == "squeal"]
    of = {"outcome": "squeal"}
    names = "probability", "probability_lower", "probability_upper"
    share, low, high = (f"{float(found[name].sel(of)):.2%}" for name in names)
    assert squeal == [["squeal", share, f"{low} to {high}"]]
    assert "<pre>brakecli advise c.toml --scatter STUDY.toml</pre>" in page.html
    assert (
        "<p>STUDY.toml stands for the file of the study: a page with --full has the text to copy.</p>" in page.html
    )
    given = "<p>STUDY.toml stands for the file of the study, which is above as it was given; its case is "
    assert f"{given}c.toml.</p>" in page.html
    other = brakecli.load(tmp_path / "s.toml", {"shoe.mass": 9.0})  # which no file has
    brakecli.scatter(other, output=tmp_path / "o.h5")
    page = reported(tmp_path / "o.h5")
    assert "<pre>brakecli advise CASE.toml --scatter STUDY.toml</pre>" in page.html
    unknown = "CASE.toml stands for the file of the case and STUDY.toml stands for the file of the study"
    assert f"<p>{unknown}: a page with --full has the text to copy.</p>" in page.html
    assert f"{given}the one above.</p>" in page.html


def test_what_a_scene_does_not_require_is_no_warning(tmp_path: Path, compiled: None, plain: None) -> None:
    loaded = parse_case((ROOT / "cases" / "damped.toml").read_text(encoding="utf-8"), "case")
    left_out = run(loaded, tmp_path / "r.h5", force=False).left_out
    assert left_out
    text = " ".join(reported(tmp_path / "r.h5").texts)
    accuracy = text.index("Accuracy")
    warnings = text.rindex("Warnings")
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


@campaign
def test_a_map_of_too_many_points_is_a_picture_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert sweep_map.MOST == 10_000
    monkeypatch.setattr(sweep_map, "MOST", 15)
    axes = [{**ANGLE, "num": 4}, {"parameter": "wheel.radius", "start": 0.1, "stop": 1.0, "num": 4}]
    alone = reported(write(tmp_path / "r.h5", {"axis": axes}, **origin()))
    assert alone.data == []
    assert len(alone.named("img")) == 2  # for wide and for narrow screens
    assert "Values of single points are left out" in "".join(alone.texts)


def test_what_cannot_be_reported_is_refused_and_nothing_is_left(
    results: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(words: str, result: Path, target: Path, force: bool = False) -> None:
        before = {each: each.read_bytes() for each in tmp_path.iterdir()}
        with pytest.raises(BrakecliError, match=words):
            write_report([result], target, force=force, progress=quiet)
        assert before == {each: each.read_bytes() for each in tmp_path.iterdir()}

    refused(r"ends in \.html, \.htm or \.pdf", results[0], tmp_path / "r.txt")
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
    write_report([*results, *tmp_path.glob("*.h5")], target, full=True, force=False, progress=quiet)
    with browser() as window:
        for width in (400, 1600):
            window.open(target, width)
            assert window.complaints() == []
            shown = "[...document.images].filter(i => i.offsetParent)"
            images = window.run(f"{shown}.map(i => [i.complete, i.naturalWidth, i.width])")
            assert len(images) == 2 * 2 + 3
            wanted = "narrow" if width == 400 else "of-wide"
            assert set(window.run(f"{shown}.map(i => i.className)")) == {wanted}
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
        assert window.complaints() == []
        for name in ("relaxation", "run"):
            result = tmp_path / "relaxation.h5" if name == "relaxation" else results[0]
            write_report([result], target, force=True, progress=quiet)
            window.open(target, 1600)
            assert len(PAGE.findall(window.paper())) == 1
            write_report([result], target, full=True, force=True, progress=quiet)
            window.open(target, 1600)
            assert 2 <= len(PAGE.findall(window.paper())) <= 6
            assert window.run("document.querySelectorAll('details[open]:has(table)').length") == 2
            assert window.run("document.querySelectorAll('details[open]:has(pre)').length") == 0
