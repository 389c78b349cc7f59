"""The promises of many cases at once, by runs that know their own error, side by side in lanes."""

import math
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace

import numpy as np

from brakecli.errors import BrakecliError
from brakecli.solver.alike import at_once
from brakecli.solver.ensemble import fits, run_together
from brakecli.solver.integrate import Motion
from brakecli.solver.lanes.records import LANES
from brakecli.solver.schemes import NUMEROV
from brakecli.solver.system import System
from brakecli.studies.runs.certificate import Certified, displacement
from brakecli.studies.runs.first import FIRST_PER_WAVE, first_nodes
from brakecli.studies.runs.own_error import exact_is_cheaper, promised
from brakecli.studies.runs.tolerance import begins_with_steps

TOGETHER = 64
"""Cases that are certified side by side."""
SAFETY = 3.0
"""What is promised, over the error that a run in a lane knows; docs/accuracy.md compares that with true ones."""
ORDER = 3
ORDER_OF_NODES = 2
"""Least order with which errors by steps fall, and those by nodes, of the midpoint rule."""


def _runs(system: System) -> Generator[System, Motion, Certified]:
    """What is run in lanes for a promise."""
    fastest = 2.0 * math.pi * system.natural_frequencies[1]
    waves = FIRST_PER_WAVE * system.passing_frequency
    # by which angle (rad) the fastest motion turns in a first step
    turn = 0.12 * (system.method.tolerance / 1e-3) ** (1.0 / ORDER)
    nodes = 2 * first_nodes(system, ORDER_OF_NODES)
    start_error = displacement(system)

    def rung(per_sample: float, more: float) -> System:
        step = system.interval / _few(per_sample)
        more_nodes = int(nodes * _few(more))
        run = system.by(scheme="three-layer", theta=NUMEROV, step=step, nodes=more_nodes, evaluator="midpoint")
        return replace(run, start_error=start_error)

    def finer(run: System, steps: float, by_nodes: float) -> System | None:
        shorter = steps ** (1.0 / ORDER)
        more = by_nodes ** (1.0 / ORDER_OF_NODES)
        candidate = rung(shorter * run.per_sample, more * run.nodes / nodes)
        dear = max(shorter, more) > 16.0  # a run of its own is cheaper then
        return None if dear or exact_is_cheaper(candidate, system) else candidate

    return promised(system, rung(system.interval * max(fastest / turn, waves), 1.0), finer, SAFETY)


def _few(least: float) -> float:
    """The least of 1, 2, 3, 4, 6, 8, 12 and so on that is not below: few numbers, so that runs share loops."""
    power = 2.0 ** math.ceil(math.log2(max(least, 1.0)))
    return 0.75 * power if power > 2.0 and least <= 0.75 * power else power


def loops(systems: Sequence[System]) -> int:
    """How many loops of lanes begin the runs of systems; 0 where all have to be certified alone."""
    alike = Counter(fits(next(_runs(system))) for system in systems if begins_with_steps(system))
    return sum(math.ceil(number / LANES) for key, number in alike.items() if key is not None)


def certify_together(
    systems: Sequence[System], suffices: Callable[[Motion], bool] = lambda motion: True
) -> list[Certified | None]:
    """What `certify` finds for each system, with runs that are made and refined side by side.

    None where that is not certain, cannot be computed in a lane, or where a motion in a lane does not suffice:
    such a system has to be certified alone.
    """
    certified: list[Certified | None] = [None] * len(systems)
    runs = {i: _runs(system) for i, system in enumerate(systems) if begins_with_steps(system)}
    rungs = dict[int, System]()

    def go_on(i: int, motion: Motion | None) -> None:
        """To the next run. Numbers that no brake has end the runs of a case, and concern none of the others."""
        try:
            rungs[i] = next(runs[i]) if motion is None else runs[i].send(motion)
        except StopIteration as end:
            certified[i] = end.value if end.value.certificate.certified else None
        except (BrakecliError, ArithmeticError, np.linalg.LinAlgError):
            pass

    for i in runs:
        go_on(i, None)

    def side_by_side(at: list[int]) -> list[Motion | None]:
        return run_together([ready[i] for i in at])

    while rungs:
        places = [*rungs]
        ready = [*rungs.values()]
        rungs = {}
        with np.errstate(all="ignore"):  # of a lane, which is left then
            motions = at_once([*map(fits, ready)], side_by_side)
        for i, motion in zip(places, motions, strict=True):
            if motion is not None and suffices(motion):
                go_on(i, motion)
    return certified
