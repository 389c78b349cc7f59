"""The picture of a scatter: critical and own friction over each other, by the samples of the file."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.case.read import parse_case
from brakecli.results.field import Field, integer
from brakecli.results.write import new_result
from tests.commands import TINY
from tests.views.plots.helpers import drawn

SAMPLES = 400
RANDOM = np.random.default_rng(3)
CRITICAL = RANDOM.normal(0.6, 0.05, SAMPLES)
OWN = RANDOM.normal(0.5, 0.03, SAMPLES)


def written(path: Path, scattering: str) -> Path:
    """A scatter over a key."""
    with new_result(path, force=False) as result:
        result.set_attributes({"kind": "scatter", "title": "T", "resolved_toml": parse_case(TINY, "c").resolved})
        result.axis("/", integer("sample", "number"), np.arange(SAMPLES))
        result.column(Field(scattering.replace(".", "_"), "1", scattering), ("sample",), OWN)
        result.column(Field("critical_friction", "1", "critical"), ("sample",), CRITICAL)
        result.column(Field("growth_rate", "1/s", "growth"), ("sample",), CRITICAL)
        result.axis("/", Field("outcome", "", "what", "S"), ["stable", "squeal"])
        for name in ("probability", "probability_lower", "probability_upper"):
            result.column(Field(name, "1", name), ("outcome",), [0.9, 0.1])
        result.commit()
    return path


def texts(axes: Any) -> list[str]:
    """What the legend says."""
    return [text.get_text() for text in axes.get_legend().get_texts()]


def bars(container: Any) -> tuple[list[float], list[float]]:
    """Left ends and heights."""
    return [bar.get_x() for bar in container], [bar.get_height() for bar in container]


def test_critical_and_own_friction_have_the_same_bins(tmp_path: Path) -> None:
    axes = drawn(written(tmp_path / "r.h5", "friction.coefficient")).axes[2]
    critical, own = axes.containers
    assert bars(critical)[0] == bars(own)[0]
    places = [*bars(critical)[0], critical[-1].get_x() + critical[-1].get_width()]
    for container, values in ((critical, CRITICAL), (own, OWN)):
        low, high = np.quantile(values, (0.005, 0.995))
        inside = values[(values >= low) & (values <= high)]
        assert bars(container)[1] == np.histogram(inside, places)[0].tolist()
        assert sum(bars(container)[1]) == len(inside)  # none lies beyond the bins
    assert texts(axes) == [f"critical, median {np.median(CRITICAL):.4g}", f"own, median {np.median(OWN):.4g}"]
    assert axes.get_xlabel() == "friction coefficient"


def test_a_friction_that_does_not_scatter_is_a_line(tmp_path: Path) -> None:
    axes = drawn(written(tmp_path / "r.h5", "link2.damping")).axes[2]
    assert len(axes.containers) == 1
    (own,) = [line for line in axes.get_lines() if line.get_label() == "own, 0.6 of all"]
    assert own.get_xdata() == pytest.approx([0.6, 0.6])  # that of the case
    other = drawn(tmp_path / "r.h5").axes[3]
    assert texts(other) == [f"median {np.median(CRITICAL):.4g} 1/s"]
