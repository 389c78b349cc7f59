"""A case along a line: what changes along it, and its numbers without reading the case anew."""

import numpy as np
import pytest

from brakecli.analysis.branches.line import Line
from brakecli.analysis.shoe import Shoe
from brakecli.errors import CaseError
from brakecli.solver.steady_sliding import steady_sliding
from tests.examples import SQUEAL, make

KEYS = {
    "friction.coefficient": (0.0, 2.0),
    "wheel.angular_speed": (-3.0, 5.0),
    "load.force": (100.0, 9000.0),
    "link1.angle_deg": (-40.0, 40.0),
    "link2.angle_deg": (0.0, 80.0),
    "link2.stiffness": (1e6, 1e9),
    "link1.damping": (0.0, 1e4),
    "contact.stiffness": (1e5, 1e10),
    "contact.half_length": (0.01, 0.3),
    "shoe.mass": (0.5, 300.0),
}


@pytest.mark.parametrize("key", KEYS)
def test_interpolated_numbers_are_those_of_the_case_to_rounding(key: str) -> None:
    """1e-13 of the largest, by the bound that the table is held to."""
    line = Line(make(SQUEAL), [key], *KEYS[key])
    assert line._table is not None
    largest = np.abs(line._table).max(axis=0)
    for p in [*np.random.default_rng(3).uniform(0.0, 1.0, 40), 0.0, 1.0]:
        shoe = line.shoe(float(p))
        exact = Shoe.of(line.system(float(p)))
        off = np.array([*shoe.coefficients, *shoe[1:]]) - np.array([*exact.coefficients, *exact[1:]])
        assert np.all(np.abs(off) <= 2e-13 * largest)


def test_the_ends_are_exact_and_ties_take_the_same_value() -> None:
    line = Line(make(SQUEAL), ["link1.damping", "link2.damping"], 100.0, 700.1)
    assert (line.value(0.0), line.value(1.0)) == (100.0, 700.1)
    case = line.case_at(1.0)
    assert (case.link1.damping, case.link2.damping) == (700.1, 700.1)
    assert line.own == 300.0
    assert Line(make(SQUEAL, link1__damping=1.0), ["link1.damping", "link2.damping"], 0.0, 700.0).own is None
    assert Line(make(SQUEAL), ["friction.coefficient"], 0.0, 0.5).own is None  # it lies outside


def test_steady_sliding_of_the_numbers_is_that_of_the_system() -> None:
    line = Line(make(SQUEAL), ["friction.coefficient"], 0.0, 2.0)
    for p in (0.0, 0.3, 0.9):
        rest = line.shoe(p).rest
        exact = steady_sliding(line.system(p))
        assert rest == pytest.approx((exact.x, exact.y), rel=1e-12)


def test_a_locked_shoe_has_no_steady_sliding() -> None:
    """From φ = (cxx (cyy + K) - cxy²) / (cxy K) on, where the determinant of its stiffness vanishes."""
    line = Line(make(SQUEAL, wheel__angular_speed=-1.0), ["friction.coefficient"], 0.0, 100.0)
    c = line.shoe(0.0).coefficients
    k = line.shoe(0.0).stiffness
    locks = (c.c_xx * (c.c_yy + k) - c.c_xy**2) / abs(c.c_xy * k)
    assert locks < 100.0
    side = 1.0 if c.c_xy > 0.0 else -1.0
    turning = Line(make(SQUEAL, wheel__angular_speed=side), ["friction.coefficient"], 0.0, 100.0)
    assert turning.shoe(turning.place(0.999 * locks)).rest is not None
    assert turning.shoe(turning.place(1.001 * locks)).rest is None


def test_where_the_range_is_not_valid_throughout_the_case_is_read_each_time() -> None:
    line = Line(make(SQUEAL), ["link1.damping"], -100.0, 500.0)
    assert line._table is None
    assert line.shoe(0.5) == Shoe.of(line.system(0.5))
    with pytest.raises(CaseError):
        line.shoe(0.0)
