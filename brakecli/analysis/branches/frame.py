"""The frame of motions that waves force: segments, steps, cells and units, the same over a whole range."""

import math
from dataclasses import dataclass

import numpy as np

from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.problem import Array
from brakecli.errors import CaseError
from brakecli.errors import Problem as Wrong
from brakecli.solver.motion.rough import default_cells, default_steps
from brakecli.solver.period import LONGEST, common_period
from brakecli.solver.steady_sliding import sliding, tabulated
from brakecli.solver.system import System

PLACES = 33
"""Places of the range at which periods, frequencies and steady sliding are looked at."""
NO_PERIOD = "the waves of the wheel have no common period"


@dataclass(frozen=True, eq=False)
class Frame:
    """How motions are computed and counted, the same over the whole range."""

    segments: int  # of a common period
    steps: int  # of a segment
    cells: int  # of the pad
    scales: Array  # units of x, y, v_x and v_y
    origins: Array  # (places, 2), x and y of steady sliding at equal distances in p

    def origin(self, p: float) -> Array:
        """The state from which states count: steady sliding, between the places by cubics with equal slopes."""
        xy = self.origins
        last = len(xy) - 1
        if last == 0:
            return np.append(xy[0], [0.0, 0.0])
        k = min(max(int(p * last), 0), last - 1)
        t = p * last - k
        here = xy[k]
        there = xy[k + 1]
        begin = 0.5 * (there - xy[k - 1]) if k > 0 else there - here
        end = 0.5 * (xy[k + 2] - here) if k + 2 <= last else there - here
        chord = there - here
        cubic = here + t * chord + t * (1.0 - t) * ((1.0 - t) * (begin - chord) - t * (end - chord))
        return np.append(cubic, [0.0, 0.0])


def frame_of(line: Line, per_period: float) -> Frame:
    """Segments, steps and cells that are enough over the whole range, and steady sliding along it."""
    systems = line.systems(PLACES)
    periods = [(system, period) for system in systems.values() if (period := common_period(system)) is not None]
    if not periods:
        what = f"{NO_PERIOD} of at most {LONGEST:g} s, so no motion that they force repeats"
        remedy = "choose wavelengths with a short common multiple"
        raise CaseError([Wrong(("roughness", "wheel"), what, remedy, source=line.label)])
    # in ten periods of the slowest mode disturbances stay far above rounding and below the bound of a run
    segments = max(math.ceil(period * system.natural_frequencies[0] / 10.0) for system, period in periods)
    segments = max(segments, 1)
    steps = max(default_steps(system, period / segments, per_period) for system, period in periods)
    # steps are cheap: the more, the smoother are kinks of the force at edges of contact
    steps = max(steps, math.ceil(100 / segments))
    cells = max(default_cells(system) for system, _ in periods)
    middle = periods[len(periods) // 2][0]
    depth = abs(middle.load_at_start) / (middle.coefficients.c_yy + middle.contact_stiffness)
    fast = 2.0 * math.pi * middle.natural_frequencies[1]
    positions = {k: state[:2] for k, system in systems.items() if (state := resting(system)) is not None}
    places = np.array(sorted(positions))
    origins = np.zeros((PLACES, 2))
    for k in range(PLACES if positions else 0):
        origins[k] = positions[int(places[np.argmin(np.abs(places - k))])]
    return Frame(segments, steps, cells, depth * np.array([1.0, 1.0, fast, fast]), origins)


def resting(system: System) -> Array | None:
    """Steady sliding as a state; None where there is none."""
    equilibrium = sliding(system, tabulated(system))
    return np.array([equilibrium.x, equilibrium.y, 0.0, 0.0]) if equilibrium else None
