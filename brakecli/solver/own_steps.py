"""What schemes have in common that find their steps themselves."""

from brakecli.solver.block import Block
from brakecli.solver.energy import energy_at_level
from brakecli.solver.records import Pair, Weights

LAG = 0
MEMORY: tuple[str, ...] = ("x", "y", "v_x", "v_y")
VELOCITIES: tuple[str, ...] = ("v_x", "v_y")
mechanical_energy = energy_at_level


def weighted_time(s: Weights) -> float:
    """Steps of other schemes place their forces; these have none."""
    return 0.0


def begin(s: Weights, state: Block, position: Pair, velocity: Pair, acceleration: Pair) -> None:
    """The initial state; its phase is found with the first step."""
    state.x, state.y = position
    state.v_x, state.v_y = velocity
