"""Case files for tests of what a case may say, and what is reported of a wrong one."""

import pytest

from brakecli.case.read import parse_case
from brakecli.errors import CaseError, Problem

SMALL = """
shoe.mass = 10
wheel = { radius = 0.5, angular_speed = -4 }
link1.stiffness = 1e7
link2.stiffness = 0
load.force = -5000
friction.coefficient = 0
contact = { half_length = 0.05, stiffness = 2e7 }
solver = { step = 1e-5, duration = 1 }
"""
CONSTANT = """\
title = "constant wheel and load"
[shoe]
mass = 10.0
[wheel]
radius = 0.5
angular_speed = 4.0
[link1]
stiffness = 1e7
damping = 300.0
angle_deg = 1.0
[link2]
stiffness = 1.2e7
damping = 300.0
angle_deg = 5.0
[load]
force = 5000.0
[friction]
coefficient = 0.45
[contact]
half_length = 0.05
stiffness = 2e7
evaluator = "auto"
nodes = 256
[roughness.shoe]
amplitudes = [1e-6, 7e-7]
wavelengths = [0.02, 0.011]
phases_deg = [0.0, 90.0]
[roughness.wheel]
amplitudes = [1e-6, 8e-7]
wavenumbers = [300.0, 500.0]
phases_deg = [0.0, 90.0]
[initial]
at = "rest"
x = 0.0
y = 0.0
vx = 0.0
vy = 0.0
wheel_angle = 0.0
[solver]
scheme = "two-layer"
theta = [0.5, 0.5]
iteration = "newton"
start = "consistent"
step = 1e-5
duration = 1.0
allow_unconverged = false
[output]
sample_interval = 1e-4
"""
VARYING = (
    CONSTANT.replace("angular_speed = 4.0", "times = [0.0, 1.0]\nangular_speeds = [4.0, 0.0]")
    .replace("force = 5000.0", "times = [0.0, 1.0]\nforces = [0.0, 5000.0]")
    .replace("wavelengths = [0.02, 0.011]", "wavenumbers = [300.0, 500.0]")
    .replace("[1e-6, 8e-7]\nwavenumbers = [300.0, 500.0]", "[1e-6, 8e-7]\nwavelengths = [0.02, 0.011]")
)
EVENT_DRIVEN = (
    CONSTANT.replace('"two-layer"', '"event-driven"')
    .replace("theta = [0.5, 0.5]\n", "")
    .replace("step = 1e-5", "tolerance = 1e-10")
    .replace("sample_interval = 1e-4", "sample_interval = 1e-4\nevents = true")
)


def change(text: str, *pairs: tuple[str, str]) -> str:
    for old, new in pairs:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


SINES = "amplitudes = [1e-6, 8e-7]\nwavenumbers = [300.0, 500.0]\nphases_deg = [0.0, 90.0]\n"
ORDERS = change(
    CONSTANT, (SINES, SINES.replace("wavenumbers = [300.0, 500.0]", "orders = [1, 2]") + 'note = "n"\n')
)
SPECTRUM = "\nrms = 1e-6\nhurst = 0.8\nshortest = 1e-3\nlongest = 0.1\nterms = 50\nseed = 1\n"
SPECTRA = change(
    change(CONSTANT, ("[roughness.wheel]\n" + SINES, "[roughness.wheel.spectrum]" + SPECTRUM)),
    ("[roughness.shoe]\n", '[roughness.shoe]\nnote = "n"\n'),
)
SPECTRA_OF_SHOES = change(
    CONSTANT,
    (
        CONSTANT[CONSTANT.index("[roughness.shoe]") : CONSTANT.index("[roughness.wheel]")],
        "[roughness.shoe.spectrum]" + SPECTRUM,
    ),
)


def problems(text: str, *overrides: str) -> tuple[Problem, ...]:
    with pytest.raises(CaseError) as caught:
        parse_case(text, "case.toml", overrides)
    for problem in caught.value.problems:
        assert problem.what
        assert problem.remedy
        assert str(problem).isprintable()
    assert len(set(caught.value.problems)) == len(caught.value.problems)
    return caught.value.problems


def messages(text: str, *overrides: str) -> list[str]:
    return [str(problem) for problem in problems(text, *overrides)]


def where(text: str, *overrides: str) -> list[tuple[str, str]]:
    return [(problem.where, problem.key) for problem in problems(text, *overrides)]


def put(key: str, value: str) -> tuple[str, int]:
    """A case with a value written into one of its fields, and the line of that field."""
    table, _, name = key.rpartition(".")
    for text in (CONSTANT, VARYING, EVENT_DRIVEN, ORDERS, SPECTRA, SPECTRA_OF_SHOES):
        lines = text.splitlines()
        first = lines.index(f"[{table}]") if f"[{table}]" in lines else -1
        for index in range(first + 1, len(lines) if first >= 0 or not table else 0):
            if lines[index].startswith("["):
                break
            if lines[index].startswith(f"{name} = "):
                lines[index] = f"{name} = {value}"
                return "\n".join(lines), index + 1
    raise AssertionError(f"no such field: {key}")


def lines_of(text: str, *starts: str) -> list[str]:
    lines = text.splitlines()
    return [
        f"case.toml:{next(i for i, line in enumerate(lines, 1) if line.startswith(start))}" for start in starts
    ]
