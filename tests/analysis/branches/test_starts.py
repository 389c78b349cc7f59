"""Where a branch begins: at the cycle that a motion comes to."""

import math

import pytest

from brakecli.analysis.branches.cycles import Cycles
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.starts import settle
from brakecli.analysis.fate import fate_on_smooth_pads
from tests.analysis.branches.smooth_shoes import FRICTION, cycle_of
from tests.analysis.test_fate import CRITICAL, HYSTERETIC, of_smooth
from tests.examples import make

pytestmark = pytest.mark.usefixtures("compiled")


@pytest.mark.parametrize("friction", [0.18, 0.4])
def test_a_branch_begins_at_the_cycle_that_a_motion_comes_to(friction: float) -> None:
    line = Line(make(HYSTERETIC), [FRICTION], 0.0, 2.0 * CRITICAL)
    p = line.place(friction)
    point = settle(Cycles(line), p, of_smooth(friction)[1], math.nan)
    assert point is not None
    assert point.stable
    orbit = fate_on_smooth_pads(*of_smooth(friction)).orbit
    assert orbit is not None
    assert cycle_of(point).period == pytest.approx(orbit.period, rel=1e-9)


def test_a_motion_that_dies_out_begins_no_branch() -> None:
    line = Line(make(HYSTERETIC), [FRICTION], 0.0, 2.0 * CRITICAL)
    assert settle(Cycles(line), line.place(0.1), of_smooth(0.1)[1], math.nan) is None
