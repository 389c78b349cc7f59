"""The end of a run in a result file, at which another run begins."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import ValidationError

from brakecli.case.parts import Wheel
from brakecli.case.schedules import belt_of
from brakecli.case.tables import SMALLEST
from brakecli.errors import CaseError, UnreadableResultError, UsageError
from brakecli.results.read import open_result
from brakecli.results.toml_lines import parse
from brakecli.solver.schedules import integral_at

_STATE = ("x", "y", "vx", "vy")
_Case = TypeVar("_Case")


@dataclass(frozen=True)
class End(Generic[_Case]):
    """The last sample of a run: its case, its time (s), and x, y (m), v_x and v_y (m/s)."""

    case: _Case
    time: float
    state: list[float]


def last_of(path: Path, case_of: Callable[[object], _Case]) -> End[_Case]:
    """The end of a run; the one reader of it. `case_of` makes a case of its resolved table.

    Raises UnreadableResultError for what is no run, and UsageError for one that has failed.
    """
    with open_result(path, kind="run") as result:
        if result.attributes.get("status") == "failed":
            raise UsageError(f"{path}: has failed, and its last state is of no use; name a run that is done")
        try:
            case = case_of(parse(result.text("resolved_toml"), "its case"))
        except (CaseError, ValidationError) as error:
            what = f"{path}: holds no case of this version"
            raise UnreadableResultError(f"{what}; run its case again") from error
        if not (samples := result.variables("history")["time"].shape[0]):
            raise UnreadableResultError(f"{path}: has no history; run its case again")
        time, *state = (float(result.read("history", name, samples - 1)[0]) for name in ("time", *_STATE))
    return End(case, time, state)


def initial_at(wheel: Wheel, wheel_angle: float, time: float, state: list[float]) -> dict[str, float]:
    """The keys of `initial` by which a case goes on from a time (s), where it has this state (m, m/s).

    They are x, y (m), vx, vy (m/s) and wheel_angle (rad); `wheel_angle` is the one at time 0. A number that is
    smaller than a case takes, as of a motion that dies out, is 0.
    """
    travel = sum(integral_at(belt_of(wheel), time, 0.0))
    numbers = [*state, wheel_angle + travel / wheel.radius]
    names = (*_STATE, "wheel_angle")
    return {name: value if abs(value) >= SMALLEST else 0.0 for name, value in zip(names, numbers, strict=True)}
