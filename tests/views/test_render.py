"""Fields read alike in the terminal, in Python and on pages; only the form of numbers differs."""

from typing import Any

import pytest

from brakecli.results import fields
from brakecli.results.field import Field, integer, ratio
from brakecli.results.stability_fields import SCATTER
from brakecli.views.motion import above_rounding
from brakecli.views.render import TERMINAL, text_of
from brakecli.views.reports.blocks import PAGE

FLAG = integer("settled", "whether it has settled (0, 1)")
SHARE = ratio("stick", "part of the time in stick")
LENGTH = Field("amplitude", "m", "amplitude of x")


@pytest.mark.parametrize(
    ("field", "value", "terminal", "page"),
    [
        (FLAG, 1, "yes", "yes"),
        (FLAG, 0, "no", "no"),
        (FLAG, None, "-", "–"),
        (SHARE, 0.25, "25 % of the time", "25 % of the time"),
        (SHARE, None, "-", "–"),
        (LENGTH, 2.5e-6, "2.5 µm", "2.5\u00a0µm"),
        (LENGTH, None, "-", "–"),
        (LENGTH, [1e-6, 2e-3], "1 µm, 2 mm", "1\u00a0µm, 2\u00a0mm"),
        (LENGTH, [], "-", "–"),
        (Field("regime", "", "what it is"), "damped", "damped", "damped"),
        (Field("counts", "", "how many"), {"stick": 2}, "stick 2", "stick 2"),
        (integer("steps", "steps"), 12345, "12345", "12\u202f345"),
        (Field("value", "of the key", "a value"), 0.5, "0.5", "0.5"),
    ],
)
def test_a_field_is_read_on_both_faces(field: Field, value: Any, terminal: str, page: str) -> None:
    assert (TERMINAL.field(field, value), PAGE.field(field, value)) == (terminal, page)


def test_a_page_writes_the_beginning_of_a_long_list() -> None:
    assert PAGE.text([1.0] * 9).endswith("1 … (9 values)")
    assert TERMINAL.text([1.0] * 9) == ", ".join("1" * 9)


def test_rows_leave_out_what_does_not_exist_and_name_no_codes() -> None:
    assert TERMINAL.rows([FLAG, SHARE], {"settled": 1}) == [("settled", "yes", "whether it has settled")]


def test_every_declared_part_of_the_time_and_flag_is_read_as_such() -> None:
    known = [each for table in (fields.VERDICT, fields.RUN, fields.POINT, SCATTER) for each in table]
    for each in known:
        if "(0, 1)" in each.meaning:
            assert TERMINAL.field(each, 1) == "yes", each.name
        if each.name in ("stick_fraction", "contact_loss_fraction"):
            assert TERMINAL.field(each, 0.5) == "50 % of the time", each.name


def test_numbers_of_the_terminal_have_the_form_that_is_asked_for() -> None:
    assert text_of(1.0 / 3.0, "Hz", ".3g") == "0.333 Hz"
    assert text_of(None, "Hz", ".3g") == "-"
    assert text_of(2.0, "(m/s)2 Hz-1") == "2 (m/s)^2/Hz"


def test_what_is_rounding_of_steady_sliding_is_shown_as_0() -> None:
    """A spring of c under the force F: the energy F²/2c and the displacement F/c."""
    force = 900.0
    stiffness = 1.6e8
    lever = 0.5
    numbers = {
        "mean_friction_force": force,
        "braking_torque": lever * force,
        "energy": {"links": 0.5 * force**2 / stiffness},
        "amplitude": 2.0**-52 * force / stiffness,
        "torque_variation": 2.0**-51 * lever * force,
    }
    found = above_rounding(numbers)
    assert (found["amplitude"], found["torque_variation"]) == (0.0, 0.0)
    larger = {**numbers, "amplitude": 1e-12 * force / stiffness, "torque_variation": 1e-12 * lever * force}
    assert above_rounding(larger) == larger
