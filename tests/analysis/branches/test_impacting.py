"""The piecewise linear oscillator of S. W. Shaw and P. J. Holmes (J. Sound Vib. 90 (1983) 129), solved exactly.

Without friction the shoe moves across the wheel alone. A pad that is short beside its one wave touches as a single
spring: the shoe is a mass between two springs, one of which it leaves. In contact and in flight its motion is
linear. Here it is followed by matrix exponentials, with the wave as a rotating pair, and each change is located to
rounding. No force jumps, so that the derivative of a period is the product of those exponentials.
"""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve

from brakecli.analysis.branches.follow import both_ways
from brakecli.analysis.branches.forced import Forced
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.newton import Settings
from brakecli.analysis.branches.point import Special
from tests.campaign import campaign
from tests.examples import make

pytestmark = pytest.mark.usefixtures("compiled")

MASS = 10.0
LINK = 1e6
CONTACT = 1e7
LOAD = 100.0
HALF = 0.005
RADIUS = 0.5
FAST = math.sqrt((LINK + CONTACT) / MASS)  # rad/s, in contact
DAMPING = 2.0 * 0.03 * FAST * MASS
DEPTH = LOAD / (LINK + CONTACT)
HEIGHT = 1.5 * DEPTH  # of the wave, as many compressions
LOOKS = 400  # places of a period at which the own solution looks for a change
Array = Any


def line() -> Line:
    """The oscillator along the frequency of its wave: one wave a turn, from 0.3 to 2.6 of the fast frequency."""
    link = {"stiffness": LINK, "damping": DAMPING}
    tables = {
        "shoe": {"mass": MASS},
        "wheel": {"radius": RADIUS, "angular_speed": FAST},
        "link1": link,
        "link2": link,
        "load": {"force": LOAD},
        "friction": {"coefficient": 0.0},
        "contact": {"half_length": HALF, "stiffness": CONTACT / (2.0 * HALF)},
        "roughness": {"wheel": {"orders": [1], "amplitudes": [HEIGHT]}},
        "solver": {"tolerance": 1e-6, "duration": 0.1},
        "output": {"sample_interval": 1e-4},
    }
    return Line(make(tables), ["wheel.angular_speed"], 0.3 * FAST, 2.6 * FAST)


class Exact:
    """The own solution at an angular frequency of the wave (rad/s), which begins at a phase."""

    def __init__(self, omega: float, phase: float) -> None:
        mean = HEIGHT * math.sin(HALF / RADIUS) / (HALF / RADIUS)  # of the wave over the pad
        self.omega = omega
        self.phase = phase
        self.gap = np.array([-1.0, 0.0, mean, 0.0, 0.0])
        self.generators = {}
        for touches, k in ((True, CONTACT), (False, 0.0)):
            a = np.zeros((5, 5))  # of y, its velocity, sine and cosine of the wave, 1
            a[0, 1] = 1.0
            a[2, 3] = -omega
            a[3, 2] = omega
            a[1] = np.array([-(LINK + k), -DAMPING, k * mean, 0.0, -LOAD]) / MASS
            self.generators[touches] = a

    def period(self, y: float, v: float) -> tuple[Array, Array]:
        """y and its velocity after a period of the wave, and their derivative by those before."""
        span = 2.0 * math.pi / self.omega
        z = np.array([y, v, math.sin(self.phase), math.cos(self.phase), 1.0])
        total = np.eye(5)
        time = 0.0
        touches = bool(self.gap @ z > 0.0)
        for _ in range(20):
            a = self.generators[touches]
            gone = 0.0
            part = z
            found = None
            while found is None and time + gone < span * (1.0 - 1e-14):
                step = min(span / LOOKS, span - time - gone)
                after = expm(a * step) @ part if step < span / LOOKS else self._look(touches) @ part
                if (self.gap @ after > 0.0) != touches and gone > 0.0:
                    found = gone + brentq(
                        lambda s, a=a, part=part: self.gap @ expm(a * s) @ part, 0.0, step, xtol=1e-17, rtol=1e-15
                    )
                part = after
                gone = gone + step
            passed = expm(a * (gone if found is None else found))
            z = passed @ z
            total = passed @ total
            time = time + (gone if found is None else found)
            if found is None:
                return z[:2], total[:2, :2]
            touches = not touches
        raise ArithmeticError("too many changes in a period")

    @cache  # noqa: B019 - of one test
    def _look(self, touches: bool) -> Array:
        return expm(self.generators[touches] * (2.0 * math.pi / self.omega / LOOKS))

    def closed(self, y: float, v: float) -> tuple[float, float, Array]:
        """The motion that repeats near a state, by Newton's method, and its derivative."""
        for _ in range(15):
            end, matrix = self.period(y, v)
            step = np.linalg.solve(np.eye(2) - matrix, end - np.array([y, v]))
            y = y + step[0]
            v = v + step[1]
            if abs(step[0]) < 1e-12 * DEPTH:
                break
        return y, v, self.period(y, v)[1]


def exact_place(special: Special, omega: float, phase: float) -> float:
    """Where the own solution has the same fold or flip, over the frequency (rad/s) at which the branch has it."""
    _, y, _, v = special.point.facts.state
    if special.kind == "fold":

        def unfit(q: Array) -> list[float]:
            own = Exact(q[2] * omega, phase)
            end, matrix = own.period(q[0] * DEPTH, q[1] * DEPTH * FAST)
            gaps = end[0] / DEPTH - q[0], end[1] / (DEPTH * FAST) - q[1]
            return [*gaps, float(np.linalg.det(np.eye(2) - matrix))]

        return float(fsolve(unfit, [y / DEPTH, v / (DEPTH * FAST), 1.0], xtol=1e-12)[2])
    y, v, _ = Exact(omega, phase).closed(y, v)

    def beyond(ratio: float) -> float:
        return 1.0 + float(np.linalg.eigvals(Exact(ratio * omega, phase).closed(y, v)[2]).real.min())

    return float(brentq(beyond, 0.998, 1.002, xtol=1e-8))


@campaign
def test_folds_and_flips_of_the_piecewise_linear_oscillator_are_where_its_exact_solution_has_them() -> None:
    """Steps are of second order where a landing lies inside one, as the whole pad lands at once.

    With 60 steps to a period of the fastest motion a flip is off by 2.4e-4 of the frequency, so with 240 by about
    1.5e-5. A fold is off by 4e-6. The bounds are some times that.
    """
    along = line()
    problem = Forced.along(along, per_period=240.0)
    first = problem.begin(0.0)
    assert first is not None
    branch = both_ways(problem, first, Settings(longest=0.25))
    assert [end.kind for end in branch.ended] == ["range", "range"]
    found = [special for special in branch.specials if special.kind != "end"]
    assert [special.kind for special in found] == ["fold", "fold", "flip", "flip"]
    phase = float(along.system(0.5).wheel.phase[0])
    for special in found:
        off = exact_place(special, along.value(special.p), phase) - 1.0
        assert abs(off) < (1e-5 if special.kind == "fold" else 1e-4)
