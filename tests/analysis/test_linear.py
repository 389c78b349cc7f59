"""The theories of many systems at once."""

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np

from brakecli.analysis.stability.linear import Linear, linear_theory, theories_of
from brakecli.case.system import system_of
from brakecli.solver.schedules import values
from brakecli.solver.system import System
from tests.examples import ROUGH, SQUEAL, make


def shoes() -> list[System]:
    """Smooth and rough ones, with and without friction and dashpots, and some without a theory."""
    two = {"amplitudes": [1e-6, 2e-6], "wavelengths": [0.02, 0.031], "phases_deg": [10.0, 200.0]}
    waves = [{"wheel": {"amplitudes": [1e-6], "wavelengths": [each]}} for each in (0.01, 0.02, 0.05)]
    bare = {"link1__damping": 0.0, "link2__damping": 0.0}
    cases: list[Any] = [make(ROUGH, friction__coefficient=each) for each in np.linspace(0.0, 0.8, 9).tolist()]
    cases += [make(SQUEAL | {"roughness": each}) for each in [*waves, {"wheel": two}, {"shoe": two}]]
    cases += [make(SQUEAL | {"roughness": {"wheel": two}}, **bare), make(SQUEAL, **bare), make(SQUEAL)]
    cases += [make(SQUEAL, wheel__angular_speed=each) for each in (0.0, -3.0)]
    lifted = replace(system_of(make(SQUEAL)), load=system_of(make(SQUEAL)).load.copy())
    values(lifted.load)[:] *= -1.0
    return [*map(system_of, cases), lifted, modes_that_meet()]


def modes_that_meet() -> System:
    """S/m = [[10, -2], [1/2, 8]] has one eigenvalue twice, and a single vector."""
    rough = SQUEAL | {"roughness": {"wheel": {"amplitudes": [1e-3], "wavelengths": [0.5]}}}
    system = system_of(make(rough, wheel__angular_speed=-1.0))
    c = system.coefficients._replace(m=1.0, b_xx=0.0, b_xy=0.0, b_yy=0.0, c_xx=10.0, c_xy=0.5, c_yy=5.5, phi=1.0)
    return replace(system, coefficients=c, half_length=0.5, layer_stiffness=2.5)


def bits(theory: Linear | None) -> list[Any]:
    if theory is None:
        return []
    values = [getattr(theory, field.name) for field in fields(theory)]
    return [value.tobytes() if isinstance(value, np.ndarray) else value for value in values]


def test_no_bit_of_a_theory_depends_on_the_others() -> None:
    systems = shoes()
    alone = [bits(linear_theory(system, system.belt_speed)) for system in systems]
    assert [*map(bits, (theory() for theory in theories_of(systems)))] == alone
    assert sum(each == [] for each in alone) == 2  # a wheel that stands, and a shoe that is pulled off
    for parts in (2, 3, 7):
        some = [
            theory() for first in range(0, len(systems), parts) for theory in theories_of(systems[first:][:parts])
        ]
        assert [*map(bits, some)] == alone


def test_where_two_modes_have_met_nothing_is_said_of_growth() -> None:
    one = SQUEAL | {"roughness": {"wheel": {"amplitudes": [1e-6], "wavelengths": [0.02]}}}
    met, other = (theory() for theory in theories_of([modes_that_meet(), system_of(make(one))]))
    assert met is not None
    assert other is not None
    assert (met.direction, met.known_to) == (0, math.inf)
    assert other.direction != 0
