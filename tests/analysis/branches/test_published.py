"""Branches against results that others have published."""

import math

import pytest

from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.sliding import Sliding
from tests.analysis.branches.smooth_shoes import FRICTION, changed
from tests.analysis.shoes import Shoe
from tests.examples import MODE_COUPLING, SQUEAL, make

pytestmark = pytest.mark.usefixtures("compiled")

# N. Hoffmann, M. Fischer, R. Allgaier, G.-P. Ostermeyer, A minimal model for studying properties of the
# mode-coupling type instability in friction induced oscillations, Mech. Res. Comm. 29 (2002) 197-205.
#
# c_xx = c_yy + 2ak = 2 and c_xy = -1 without dashpots: (2 - w)² = -(-1)(-1 + 4/3 φ) for w = ω², so that both
# frequencies meet at √2 where 4/3 φ = 1.


def test_the_minimal_model_of_mode_coupling_grows_as_its_closed_form_beyond_it() -> None:
    """At φ = 1 w = 2 ± i √(1/3), and the growth rate is the imaginary part of its root."""
    slide = Sliding(Line(make(MODE_COUPLING), [FRICTION], 0.0, 2.0)).at(0.5)
    root = complex(2.0, math.sqrt(1.0 / 3.0)) ** 0.5
    assert slide.eigenvalues is not None
    fastest = max(slide.eigenvalues, key=lambda value: value.real)
    assert fastest.real == pytest.approx(root.imag, rel=1e-13)
    assert abs(fastest.imag) == pytest.approx(root.real, rel=1e-13)
    assert not slide.stable


def test_a_shoe_that_locks_diverges_at_its_closed_form() -> None:
    """The stiffness of sliding is singular where φ = (c_xx (c_yy + K) - c_xy²) / (K c_xy)."""
    tables = changed(SQUEAL, "link2.angle_deg", -25.0)
    shoe = Shoe.of(tables)
    (xx, xy), (_, yy) = shoe.c.tolist()
    locks = (xx * (yy + shoe.k) - xy**2) / (shoe.k * xy)
    for part in (0.5, 0.4, 1.0 / 3.0):
        sliding = Sliding(Line(make(tables), [FRICTION], 0.0, locks / part))
        (change,) = sliding.changes(sliding.along())
        assert (change.kind, change.frequency, change.lost) == ("divergence", 0.0, True)
        assert change.p == pytest.approx(part, abs=1e-12)
