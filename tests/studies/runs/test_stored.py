"""`classify` decides from the record of answers that a run has stored."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from brakecli.analysis.regime.answers import RENAMED, Answers
from brakecli.analysis.regime.decision import Thresholds
from brakecli.case.read import parse_case
from brakecli.studies.runs import stored
from brakecli.studies.runs.run import run
from tests.examples import ROUGH


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("stored") / "rough.h5"
    overrides = ["solver.duration=0.5", "solver.step=2e-5"]
    run(parse_case(tomli_w.dumps(ROUGH), "rough", overrides), found, force=False)
    return found


def with_evidence(monkeypatch: pytest.MonkeyPatch, of: Callable[[Mapping[str, Any]], dict[str, Any]]) -> None:
    """Files have another record of evidence."""
    whole = stored.stored_run

    @contextmanager
    def older(path: Path) -> Iterator[stored.Stored]:
        with whole(path) as found:
            yield found._replace(evidence=of(found.evidence))

    monkeypatch.setattr(stored, "stored_run", older)


def test_other_thresholds_decide_anew_and_the_numbers_stay(path: Path) -> None:
    numbers = stored.classify_result(path, Thresholds())
    strict = stored.classify_result(path, Thresholds(comes_together=1e9, settled_within=0.0, sure_errors=0.0))
    assert (numbers["regime"], numbers["excitation"]) == ("damped", "forced")
    assert strict["evidence"]["row"] != numbers["evidence"]["row"]
    assert strict["amplitude"] == numbers["amplitude"]
    assert strict["thresholds"]["comes_together"] == 1e9


def test_answers_under_their_earlier_names_decide_as_well(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now = stored.classify_result(path, Thresholds())
    earlier = {name: before for before, name in RENAMED.items()}
    with_evidence(monkeypatch, lambda known: {earlier.get(name, name): value for name, value in known.items()})
    assert stored.classify_result(path, Thresholds()) == now
    assert {*RENAMED.values()} <= {*Answers._fields}
    assert not {*RENAMED} & {*Answers._fields}


def test_an_older_file_is_run_again_where_that_is_little_work(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now = stored.classify_result(path, Thresholds())
    with_evidence(monkeypatch, lambda _: {"envelope_final": 1.0})  # as an older version does
    again = stored.classify_result(path, Thresholds())
    for name in ("regime", "excitation", "reasons", "settled", "frequency"):
        assert again[name] == now[name]
    assert again["evidence"].keys() == now["evidence"].keys()
    for name in ("amplitude", "forced_frequency", "mean_friction_force", "braking_torque"):
        assert again[name] == pytest.approx(now[name], rel=1e-12)
    strict = stored.classify_result(path, Thresholds(comes_together=1e9, settled_within=0.0, sure_errors=0.0))
    assert strict["evidence"]["row"] != now["evidence"]["row"]
    assert strict["thresholds"]["comes_together"] == 1e9
    monkeypatch.setattr(stored, "MOST_WORK", 0.0)
    late = stored.classify_result(path, Thresholds())
    assert (late["regime"], late["settled"]) == ("undecided", 0)
    assert late["reasons"][0].endswith(f"brakecli run {path.name} -o NEW.h5")
    assert late["amplitude"] == now["amplitude"]
