"""The end of a run in a result file, at which another run begins."""

from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.case.tables import SMALLEST
from brakecli.errors import CaseError, UnreadableResultError, UsageError
from brakecli.files.read import open_result
from brakecli.files.toml_lines import parse
from brakecli.solver.schedules import integral_at
from brakecli.solver.system import System

_STATE = ("x", "y", "vx", "vy")


@dataclass(frozen=True)
class End:
    """The last sample of a run: its case, its time (s), and x, y (m), v_x and v_y (m/s)."""

    case: Case
    time: float
    state: list[float]


def last_of(path: Path) -> End:
    """The end of a run; the one reader of it.

    Raises UnreadableResultError for what is no run, and UsageError for one that has failed.
    """
    with open_result(path, kind="run") as result:
        if result.attributes.get("status") == "failed":
            raise UsageError(f"{path}: has failed, and its last state is of no use; name a run that is done")
        try:
            case = Case.model_validate(parse(result.text("resolved_toml"), "its case"))
        except (CaseError, ValidationError) as error:
            what = f"{path}: holds no case of this version"
            raise UnreadableResultError(f"{what}; run its case again") from error
        if not (samples := result.variables("history")["time"].shape[0]):
            raise UnreadableResultError(f"{path}: has no history; run its case again")
        time, *state = (float(result.read("history", name, samples - 1)[0]) for name in ("time", *_STATE))
    return End(case, time, state)


def end_of(path: Path) -> dict[str, float]:
    """The keys of `initial` at the end of a run: x, y (m), vx, vy (m/s) and wheel_angle (rad).

    Raises what `last_of` raises.
    """
    end = last_of(path)
    return initial_at(end.case, system_of(end.case), end.time, end.state)


def initial_at(case: Case, system: System, time: float, state: list[float]) -> dict[str, float]:
    """The keys of `initial` by which a case goes on from a time (s), where it has this state (m, m/s).

    A number that is smaller than a case takes, as of a motion that dies out, is 0.
    """
    travel = sum(integral_at(system.belt, time, 0.0))
    numbers = [*state, case.initial.wheel_angle + travel / case.wheel.radius]
    names = (*_STATE, "wheel_angle")
    return {name: value if abs(value) >= SMALLEST else 0.0 for name, value in zip(names, numbers, strict=True)}
