"""The promises of many cases at once: their ladders of runs are climbed side by side, in lanes."""

import math
from collections import Counter, defaultdict
from collections.abc import Generator, Hashable, Sequence
from dataclasses import replace

import numpy as np

from brakecli.errors import BrakecliError
from brakecli.runs.certificate import Certified
from brakecli.runs.ladder import InLanes, ladder
from brakecli.runs.own_error import exact_is_cheaper
from brakecli.runs.tolerance import begins_with_steps
from brakecli.solver.ensemble import fits, run_together
from brakecli.solver.lanes import LANES
from brakecli.solver.motion import Motion
from brakecli.solver.schemes import NUMEROV
from brakecli.solver.system import System

TOGETHER = 32
"""Cases that are certified side by side."""


def _ladder(system: System) -> Generator[System, Motion, Certified]:
    def is_left(run: Motion) -> bool:
        """Whether a run that knows its error is cheaper: always where the pad does not open."""
        closed = set(run.work.evaluators) == {"closed-form"}
        return closed or exact_is_cheaper(run.system, system)

    method = replace(system.method, scheme="three-layer", theta=NUMEROV)
    return ladder(replace(system, method=method), is_left, InLanes)


def loops(systems: Sequence[System]) -> int:
    """How many loops of lanes begin the ladders of systems; 0 where all have to be certified alone."""
    alike = Counter(fits(next(_ladder(system))) for system in systems if begins_with_steps(system))
    return sum(math.ceil(number / LANES) for key, number in alike.items() if key is not None)


def certify_together(systems: Sequence[System]) -> list[Certified | None]:
    """What `certify` finds for each system, with ladders that are climbed side by side.

    None where that is not certain, or cannot be computed in a lane: such a system has to be certified alone.
    """
    found: list[Certified | None] = [None] * len(systems)
    ladders = {i: _ladder(system) for i, system in enumerate(systems) if begins_with_steps(system)}
    rungs = dict[int, System]()

    def climb(i: int, motion: Motion | None) -> None:
        """To the next rung. Numbers that no brake has end a ladder, and concern none of the others."""
        try:
            rungs[i] = next(ladders[i]) if motion is None else ladders[i].send(motion)
        except StopIteration as end:
            found[i] = end.value if end.value.certificate.certified else None
        except (BrakecliError, ArithmeticError, np.linalg.LinAlgError):
            pass

    for i in ladders:
        climb(i, None)
    while rungs:
        alike, ready = defaultdict[Hashable, list[int]](list), rungs
        for i, rung in ready.items():
            if (key := fits(rung)) is not None:
                alike[key].append(i)
        rungs = {}
        for members in alike.values():
            with np.errstate(all="ignore"):  # of a lane, which is left then
                motions = run_together([ready[i] for i in members])
            for i, motion in zip(members, motions, strict=True):
                if motion is not None:
                    climb(i, motion)
    return found
