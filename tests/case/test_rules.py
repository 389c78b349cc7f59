"""Rules between keys: each that is broken is reported at its key, also where other keys are wrong."""

import tomllib

import pytest

from brakecli.case.parts import BUDGET
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.studies.runs.limits import adjustments
from tests.case.examples import CONSTANT, EVENT_DRIVEN, change, lines_of, messages, where

RULES = [
    ("angular_speed = 4.0", "angular_speed = 4.0\ntimes = [0.0]\nangular_speeds = [1.0]", "wheel.times", "times"),
    ("angular_speed = 4.0\n", "", "wheel.angular_speed", "[wheel]"),
    ("angular_speed = 4.0", "times = [0.0]", "wheel.angular_speeds", "[wheel]"),
    ("angular_speed = 4.0", "times = [0.0]\nangular_speeds = [1, 2]", "wheel.angular_speeds", "angular_speeds"),
    ("angular_speed = 4.0", "times = [1, 1]\nangular_speeds = [1, 2]", "wheel.times[1]", "times"),
    ("force = 5000.0", "force = 5000.0\nforces = [1.0]", "load.forces", "forces"),
    ("force = 5000.0", "", "load.force", "[load]"),
    ("wavelengths = [0.02, 0.011]\n", "", "roughness.shoe.wavelengths", "[roughness.shoe]"),
    ("wavelengths = [0.02, 0.011]", "wavelengths = [0.02]", "roughness.shoe.wavelengths", "wavelengths"),
    ("wavelengths = [0.02, 0.011]", "wavelengths = []", "roughness.shoe.wavelengths", "wavelengths"),
    ("1.0\n[link2]", "1.0\nangel_deg = 2\n[link2]", "link1.angel_deg", "angel_deg"),
    ("theta = [0.5, 0.5]", "theta = [0.25, 0.5, 0.25]", "solver.theta", "theta"),
    ('"two-layer"\ntheta = [0.5, 0.5]', '"three-layer"\ntheta = [0.5, 0.5]', "solver.theta", "theta"),
    ('"two-layer"\ntheta = [0.5, 0.5]', '"three-layer"\ntheta = [0.5, 0.5, 0.1]', "solver.theta", "theta"),
    ('start = "consistent"', 'start = "paper"', "solver.start", "start"),
    ("sample_interval = 1e-4", "sample_interval = 0.99e-5", "output.sample_interval", "sample_interval"),
    ("[shoe]\nmass = 10.0\n", "", "shoe", None),
    ("[initial]", "[initial]\nz = 0", "initial.z", "z"),
    ("mass = 10.0\n", "", "shoe.mass", "[shoe]"),
]


@pytest.mark.parametrize(("old", "new", "key", "line"), RULES)
def test_a_broken_rule_is_reported_at_its_key(old: str, new: str, key: str, line: str | None) -> None:
    text = change(CONSTANT, (old, new))
    (found,) = where(text)
    assert found == (lines_of(text, line)[0] if line else "case.toml", key)


def test_the_paper_start_needs_a_shoe_at_rest() -> None:
    three = change(
        CONSTANT,
        ('"two-layer"\ntheta = [0.5, 0.5]', '"three-layer"'),
        ('start = "consistent"', 'start = "paper"'),
    )
    parse_case(three, "case.toml", ['initial.at="equilibrium"', "initial.x=1e-6"])
    moving = change(three, ("vy = 0.0", "vy = 0.1"))
    assert where(moving) == [(lines_of(moving, "start")[0], "solver.start")]


@pytest.mark.parametrize(
    ("old", "new", "line", "what"),
    [
        (
            "tolerance = 1e-10",
            "tolerance = 1e-10\nstep = 1e-5",
            "solver.tolerance",
            "is given together with step (found 1e-10); keep one of the two",
        ),
        ("duration = 1.0", "duration = 1.0\ntheta = [0.5, 0.5]", "solver.theta", "is not used by event-driven"),
        ('"newton"', '"fixed-point"', "solver.iteration", "is not used by event-driven"),
        ('"consistent"', '"paper"', "solver.start", "is only for the three-layer scheme"),
        ("= false", "= true", "solver.allow_unconverged", "is not used by event-driven"),
        ('"auto"', '"midpoint"', "contact.evaluator", "event-driven needs no nodes"),
    ],
)
def test_what_is_not_for_the_event_driven_scheme_is_reported(old: str, new: str, line: str, what: str) -> None:
    first, *_ = messages(change(EVENT_DRIVEN, (old, new)))
    assert f" {line}: " in first
    assert what in first


def test_a_step_chooses_two_layer_and_none_leaves_the_choice() -> None:
    plain = change(CONSTANT, ('scheme = "two-layer"\n', ""), ("theta = [0.5, 0.5]\n", ""))
    assert parse_case(plain, "case.toml").case.solver.scheme == "two-layer"
    free = parse_case(change(plain, ("step = 1e-5\n", "")), "case.toml").case.solver
    assert (free.scheme, free.step, free.tolerance, free.effective_tolerance) == ("auto", None, None, 1e-3)
    kept = parse_case(plain, "case.toml", ["solver.tolerance=1e-5"]).case.solver
    assert (kept.scheme, kept.step, kept.effective_tolerance) == ("auto", None, 1e-5)
    (line,) = messages(change(plain, ("[solver]", '[solver]\nscheme = "auto"')))
    assert 'solver.step: is given, but "auto" chooses the step' in line


def test_a_budget_is_for_a_run_that_settles_and_stands_in_its_resolved_case() -> None:
    open_ = change(CONSTANT, ("duration = 1.0", 'duration = "settled"'))
    resolved = parse_case(open_, "case.toml").resolved
    assert (
        tomllib.loads(resolved)["solver"]["budget"] == parse_case(resolved, "again").case.solver.budget == BUDGET
    )
    few = parse_case(open_, "case.toml", ["solver.budget=1000"])
    assert tomllib.loads(few.resolved)["solver"]["budget"] == 1000
    assert parse_case(few.resolved, "again", ["solver.duration=2.0"]).case.solver.budget is None
    both = ['solver.duration="settled"', "solver.budget=7"]
    for order in (both, both[::-1]):
        assert parse_case(CONSTANT, "case.toml", order).case.solver.budget == 7
    (line,) = messages(change(CONSTANT, ("duration = 1.0", "duration = 1.0\nbudget = 1000")))
    assert 'solver.budget: is for duration = "settled", but duration is a number (found 1000)' in line
    assert line.endswith('leave budget out, or set duration to "settled"')
    for wrong in ("0", "-1", "1.5", "true", '"many"'):
        (line,) = messages(change(open_, ('"settled"', f'"settled"\nbudget = {wrong}')))
        assert " solver.budget: " in line
    assert "budget" not in tomllib.loads(parse_case(CONSTANT, "case.toml").resolved)["solver"]


def test_nodes_are_chosen_by_the_tolerance() -> None:
    case = parse_case(CONSTANT, "case.toml", ["solver={duration=1.0, tolerance=1e-4}"]).case
    assert "contact.nodes: not used, the tolerance chooses nodes itself" in adjustments(system_of(case))


def test_the_piecewise_exact_scheme_is_for_smooth_surfaces() -> None:
    exact = change(CONSTANT, ('"two-layer"\ntheta = [0.5, 0.5]', '"piecewise-exact"'))
    (line,) = messages(exact)
    assert 'solver.scheme: is for smooth surfaces, but roughness.shoe is given (found "piecewise-exact")' in line
    zero = [f"roughness.{surface}.amplitudes=[0, 0]" for surface in ("shoe", "wheel")]
    for overrides in (["roughness={}"], zero):
        system = system_of(parse_case(exact, "case.toml", overrides).case)
        assert system.method.scheme == "piecewise-exact"
        assert "solver.step: not used, piecewise-exact finds its steps itself, which are exact" in adjustments(
            system
        )


def test_event_driven_takes_the_step_of_a_case_for_its_samples_alone() -> None:
    case = parse_case(CONSTANT, "case.toml", ['solver.scheme="event-driven"', "solver.theta=[]"]).case
    (adjustment,) = adjustments(system_of(case))
    assert "solver.step: not used, event-driven finds its steps itself, to a tolerance of 1e-10" in adjustment


def test_an_override_makes_a_case_event_driven() -> None:
    solver = parse_case(
        CONSTANT, "case.toml", ['solver.scheme="event-driven"', "solver.tolerance=1e-10", "solver.theta=[]"]
    ).case.solver
    assert (solver.step, solver.theta, solver.tolerance) == (None, (), 1e-10)


def test_an_interval_of_one_step_to_rounding_is_allowed() -> None:
    parse_case(change(CONSTANT, ("sample_interval = 1e-4", "sample_interval = 0.9999999999e-5")), "case.toml")


def test_empty_lists_are_a_smooth_surface() -> None:
    smooth = "amplitudes = []\nwavelengths = []\nphases_deg = []"
    text = change(
        CONSTANT, ("amplitudes = [1e-6, 7e-7]\nwavelengths = [0.02, 0.011]\nphases_deg = [0.0, 90.0]", smooth)
    )
    shoe = parse_case(
        text.replace("phases_deg = [0.0, 90.0]\n[roughness", "[roughness"), "case.toml"
    ).case.roughness.shoe
    assert shoe is not None
    assert shoe.amplitudes == shoe.wavelengths == shoe.phases_deg == ()


def test_one_entry_is_a_constant_schedule() -> None:
    text = change(CONSTANT, ("force = 5000.0", "times = [0.0]\nforces = [5000.0]"))
    assert parse_case(text, "case.toml").case.load.forces == (5000.0,)


def test_rules_are_checked_where_other_keys_and_tables_are_wrong() -> None:
    text = change(
        CONSTANT,
        ("radius = 0.5", "radius = -0.5"),
        ("angular_speed = 4.0", "times = [1, 0]\nangular_speeds = [1]"),
        ("force = 5000.0", ""),
        ("theta = [0.5, 0.5]", "theta = [0.5]"),
        ('iteration = "newton"', 'iteration = "none"'),
        ("sample_interval = 1e-4", 'sample_interval = "small"'),
    )
    keys = [key for _, key in where(text)]
    assert keys == [
        "wheel.radius",
        "wheel.times[1]",
        "wheel.angular_speeds",
        "load.force",
        "solver.theta",
        "solver.iteration",
        "output.sample_interval",
    ]


def test_rules_between_tables_are_checked_where_a_third_table_is_wrong() -> None:
    text = change(CONSTANT, ("mass = 10.0", "mass = nan"), ("sample_interval = 1e-4", "sample_interval = 1e-9"))
    assert [key for _, key in where(text)] == ["shoe.mass", "output.sample_interval"]
