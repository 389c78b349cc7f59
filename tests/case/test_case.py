"""A case holds what the file says, in SI units, with every default filled in."""

import io
import json
import math
import subprocess
import sys
import tomllib
from importlib import import_module, resources
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from brakecli.case.case import Case, changed, given_toml, resolved_toml
from brakecli.case.read import parse_case, read_text, starters
from brakecli.case.tables import json_schema, tables_within
from brakecli.solver.method import MOST_EVALUATIONS
from tests.case.examples import SMALL

jsonschema = import_module("jsonschema")  # imported so because it has no type hints
VALIDATOR = jsonschema.Draft202012Validator(json_schema(Case))

numbers = st.floats(-1e100, 1e100).filter(lambda value: value == 0 or abs(value) >= 1e-100)
positives = st.floats(1e-100, 1e100)
non_negatives = st.just(0.0) | positives
angles = st.floats(-90, 90).filter(lambda value: value == 0 or abs(value) >= 1e-100)
weights = st.floats(1e-100, 1) | st.just(0.0)


def schedules(constant: str, several: str) -> st.SearchStrategy[dict[str, Any]]:
    def give_times(values: list[float]) -> st.SearchStrategy[dict[str, Any]]:
        times = st.lists(numbers, min_size=len(values), max_size=len(values), unique=True).map(sorted)
        return st.fixed_dictionaries({"times": times, several: st.just(values)})

    return st.fixed_dictionaries({constant: numbers}) | st.lists(numbers, min_size=1, max_size=4).flatmap(
        give_times
    )


def profiles(count: int) -> st.SearchStrategy[dict[str, Any]]:
    def each(values: st.SearchStrategy[float]) -> st.SearchStrategy[list[float]]:
        return st.lists(values, min_size=count, max_size=count)

    lengths = st.sampled_from(["wavelengths", "wavenumbers"]).flatmap(
        lambda key: st.fixed_dictionaries({"amplitudes": each(numbers), key: each(positives)})
    )
    phases = st.fixed_dictionaries({}, optional={"phases_deg": each(numbers)})
    return st.builds(lambda first, second: first | second, lengths, phases)


def thetas(scheme: str) -> st.SearchStrategy[dict[str, Any]]:
    two = st.lists(weights, min_size=2, max_size=2)
    three = st.sampled_from([[0.25, 0.5, 0.25], [1.0, 0.0, 0.0], [0.1, 0.2, 0.7]])
    theta = two if scheme == "two-layer" else three
    return st.fixed_dictionaries({"scheme": st.just(scheme)}, optional={"theta": theta})


links = st.fixed_dictionaries(
    {"stiffness": non_negatives}, optional={"damping": non_negatives, "angle_deg": angles}
)
layer_solvers = st.builds(
    lambda first, second: first | second,
    st.sampled_from(["two-layer", "three-layer"]).flatmap(thetas),
    st.fixed_dictionaries(
        {"step": positives, "duration": positives},
        optional={"iteration": st.sampled_from(list(MOST_EVALUATIONS)), "allow_unconverged": st.booleans()},
    ),
)
promising_solvers = st.fixed_dictionaries(
    {"duration": positives},
    optional={
        "scheme": st.sampled_from(["event-driven", "auto", "two-layer", "three-layer"]),
        "tolerance": st.floats(1e-13, 1e-2),
    },
)
solvers = layer_solvers | promising_solvers


def with_what_the_scheme_needs(document: dict[str, Any]) -> dict[str, Any]:
    if "step" not in document["solver"]:
        document["output"] = {"sample_interval": document["solver"]["duration"]}
        document["contact"].pop("evaluator", None)
        document["contact"].pop("nodes", None)
    return document


documents = st.fixed_dictionaries(
    {
        "shoe": st.fixed_dictionaries({"mass": positives}),
        "wheel": st.builds(
            lambda radius, speed: {"radius": radius} | speed,
            positives,
            schedules("angular_speed", "angular_speeds"),
        ),
        "link1": links,
        "link2": links,
        "load": schedules("force", "forces"),
        "friction": st.fixed_dictionaries({"coefficient": non_negatives}),
        "contact": st.fixed_dictionaries(
            {"half_length": positives, "stiffness": positives},
            optional={
                "evaluator": st.sampled_from(["auto", "closed-form", "midpoint", "exact"]),
                "nodes": st.integers(2, 10_000_000),
            },
        ),
        "solver": solvers,
    },
    optional={
        "title": st.text(st.characters(exclude_categories=["Cs", "Cc"])),
        "roughness": st.fixed_dictionaries(
            {},
            optional={side: st.integers(0, 3).flatmap(profiles) for side in ("shoe", "wheel")},
        ),
        "initial": st.fixed_dictionaries(
            {},
            optional={"at": st.sampled_from(["rest", "equilibrium"])}
            | dict.fromkeys(["x", "y", "vx", "vy"], numbers),
        ),
    },
).map(with_what_the_scheme_needs)


@given(documents)
def test_resolved_toml_reads_back_as_the_same_case_to_the_last_bit(document: dict[str, Any]) -> None:
    case = Case.model_validate(document)
    again = parse_case(resolved_toml(case), "resolved")
    assert repr(again.case) == repr(case)  # repr tells 0.0 from -0.0
    assert again.case == case
    assert again.resolved == again.text


@given(documents)
def test_the_json_schema_accepts_every_valid_case(document: dict[str, Any]) -> None:
    Case.model_validate(document)
    VALIDATOR.validate(document)


def test_keys_left_out_get_their_defaults() -> None:
    case = parse_case(SMALL, "small").case
    assert case.title == ""
    assert case.link1.damping == case.link1.angle_deg == 0.0
    assert case.contact.evaluator == "auto"
    assert case.contact.nodes is None
    assert case.roughness.shoe is case.roughness.wheel is None
    assert case.initial.at == "rest"
    assert (case.initial.x, case.initial.y, case.initial.vx, case.initial.vy) == (0.0, 0.0, 0.0, 0.0)
    assert case.solver.scheme == "two-layer"
    assert case.solver.theta == (0.5, 0.5)
    assert case.solver.iteration == "newton"
    assert case.solver.start == "consistent"
    assert case.solver.allow_unconverged is False
    assert case.output.sample_interval == case.solver.step == 1e-5


def test_weights_left_out_are_those_of_the_scheme() -> None:
    case = parse_case(SMALL, "small", ['solver.scheme="three-layer"']).case
    assert case.solver.theta == (0.25, 0.5, 0.25)


def test_phases_left_out_are_zero() -> None:
    wheel = "roughness.wheel = { amplitudes = [1e-6, 2e-6], wavelengths = [0.02, 0.01] }"
    profile = parse_case(SMALL + wheel, "small").case.roughness.wheel
    assert profile is not None
    assert profile.phases_deg == (0.0, 0.0)


def test_integers_become_floats() -> None:
    case = parse_case(SMALL, "small").case
    assert type(case.shoe.mass) is float
    assert type(case.wheel.angular_speed) is float


def test_resolved_toml_holds_every_default_and_no_absent_key() -> None:
    resolved = tomllib.loads(parse_case(SMALL, "small").resolved)
    assert resolved["solver"] == {
        "scheme": "two-layer",
        "theta": [0.5, 0.5],
        "iteration": "newton",
        "start": "consistent",
        "step": 1e-5,
        "duration": 1.0,
        "allow_unconverged": False,
    }
    assert resolved["output"] == {"sample_interval": 1e-5, "events": False}
    assert resolved["wheel"] == {"radius": 0.5, "angular_speed": -4.0}


def test_a_case_cannot_be_changed() -> None:
    case = parse_case(SMALL, "small").case
    with pytest.raises(ValidationError, match="frozen"):
        case.shoe.mass = 1.0  # type: ignore[misc]
    assert hash(case) == hash(parse_case(SMALL, "small").case)


def test_a_case_built_in_python_obeys_the_same_rules() -> None:
    case = parse_case(SMALL, "small").case
    parts = {name: getattr(case, name) for name in Case.model_fields}
    assert Case(**parts) == case
    slow_output = {"sample_interval": 1e-9}
    with pytest.raises(ValidationError, match="sample_interval"):
        Case(**parts | {"output": slow_output})


def test_every_key_has_a_description_and_every_float_a_unit() -> None:
    schema = json_schema(Case)
    seen = 0
    for path, table in tables_within(Case).items():
        properties = schema["$defs"][table.__name__]["properties"] if path else schema["properties"]
        for key, node in properties.items():
            kind = node.get("items", node).get("type")
            assert "description" in node or "$ref" in node, (path, key)
            kind = node["anyOf"][0]["type"] if "anyOf" in node else kind  # or a word
            assert ("unit" in node) == (kind == "number"), (path, key)
            seen += 1
    assert seen > 50


def test_the_shipped_schema_is_the_one_the_models_give() -> None:
    shipped = resources.files("brakecli.case").joinpath("case.schema.json").read_text(encoding="utf-8")
    assert json.loads(shipped) == json_schema(Case)


def test_the_schema_is_valid_and_accepts_the_starter_case() -> None:
    jsonschema.Draft202012Validator.check_schema(json_schema(Case))
    VALIDATOR.validate(tomllib.loads(starters()["case"]))


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("shoe", "mass", 0),
        ("shoe", "mass", "10"),
        ("shoe", "weight", 10),
        ("link1", "angle_deg", 91),
        ("contact", "evaluator", "quick"),
        ("contact", "nodes", 1),
        ("solver", "allow_unconverged", 1),
        ("solver", "theta", [0.5, 1.5]),
    ],
)
def test_the_schema_refuses_wrong_values(table: str, key: str, value: object) -> None:
    document = tomllib.loads(starters()["case"])
    document[table][key] = value
    assert not VALIDATOR.is_valid(document)


def test_the_schema_refuses_two_alternatives_at_once() -> None:
    document = tomllib.loads(starters()["case"])
    document["load"] |= {"times": [0.0], "forces": [1.0]}
    assert not VALIDATOR.is_valid(document)


def test_the_starter_mentions_every_key() -> None:
    text = starters()["case"]
    seen = 0
    for path, table in tables_within(Case).items():
        for key in table.model_fields:
            if (*path, key) not in tables_within(Case):
                assert f"\n{key} = " in text or f"\n# {key} = " in text, (path, key)
                seen += 1
    assert seen > 30


def test_each_alternative_of_the_starter_is_valid() -> None:
    lines = starters()["case"].splitlines()
    roughness = [
        line[2:]
        for line in lines
        if line.startswith(("# [roughness.shoe]", "# [roughness.wheel]", "# ampl", "# wave", "# phases"))
    ]
    case = parse_case(starters()["case"] + "\n" + "\n".join(roughness), "rough").case
    assert case.roughness.shoe is not None
    assert case.roughness.wheel is not None
    keys = ("times", "angular_speeds", "forces", "nodes", "step", "theta", "iteration", "start")
    commented = [line[2:] for line in lines if line.startswith(tuple(f"# {key} = " for key in keys))]
    tables_of = ["wheel", "wheel", "load", "load", "contact", *["solver"] * 5]
    overrides = [f"{table}.{line}" for table, line in zip(tables_of, commented, strict=True)]
    overrides += ['solver.scheme="three-layer"', "solver.duration=1.0"]  # what changes does not settle
    solver = parse_case(starters()["case"], "all", overrides).case.solver
    assert solver.theta == (0.25, 0.5, 0.25)


UNCOUPLED = ["link1.angle_deg=0.0", "link2.angle_deg=0.0", "solver={duration=1.0}", "roughness={}"]
WAVES = "roughness.wheel={amplitudes=[1e-6, 0.0, 1e-6], wavelengths=[0.5, 1e-6, 2e-4]}"


@pytest.mark.parametrize(
    ("changes", "rate"),
    [
        ([], 50.0 / (2.0 * math.pi) * math.sqrt((1e7 + 2.0 * 0.05 * 2e7) / 10.0)),  # y on link 1 and the contact
        (["shoe.mass=0.1"], 50.0 / (2.0 * math.pi) * math.sqrt((1e7 + 2.0 * 0.05 * 2e7) / 0.1)),
        (["wheel.angular_speed=-40.0", WAVES], 10.0 * 40.0 * 0.5 / 2e-4),
        (["wheel={radius=0.5, times=[0.0, 1.0], angular_speeds=[0.0, 40.0]}", WAVES], 10.0 * 40.0 * 0.5 / 2e-4),
    ],
)
def test_samples_are_taken_by_modes_and_waves_where_a_case_leaves_that_open(
    changes: list[str], rate: float
) -> None:
    """Two digits are half a unit of the second one off at most: a twentieth."""
    case = parse_case(SMALL, "open", [*UNCOUPLED, *changes]).case
    assert case.output.sample_interval == pytest.approx(1.0 / rate, rel=0.05)
    assert float(f"{case.output.sample_interval:.1e}") == case.output.sample_interval
    assert parse_case(resolved_toml(case), "again").case == case
    assert "sample_interval" not in given_toml(case)
    light = changed(case, shoe={"mass": 1e-6 * case.shoe.mass})
    assert light.output.sample_interval < case.output.sample_interval


def test_the_text_is_kept_as_it_was_with_its_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "wüst, with spaces.toml"
    text = SMALL.replace("\n", "\r\n") + "# ω"
    path.write_bytes(text.encode())
    loaded = parse_case(*read_text(str(path)))
    assert loaded.text == text
    assert loaded.case == parse_case(SMALL, "small").case


def test_a_case_is_read_from_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(SMALL.encode())))
    assert parse_case(*read_text("-")).case == parse_case(SMALL, "small").case


def test_reading_a_case_imports_no_numerical_library() -> None:
    code = "import sys, brakecli.case.read; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = done.stdout.split()
    assert "brakecli.case.case" in loaded
    assert not {"numpy", "scipy", "numba", "h5py"} & set(loaded)
