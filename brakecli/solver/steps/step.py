"""A step of a difference scheme: what it minimises, and what its solution makes of the motion."""

from brakecli.solver.kernels import kernel
from brakecli.solver.plant import Plant
from brakecli.solver.records import Contact, Problem, State, Works
from brakecli.solver.schemes import SCHEMES
from brakecli.solver.steps import three_layer, two_layer

_TWO_LAYER = list(SCHEMES).index("two-layer")


@kernel
def prepare(p: Plant, state: State, problem: Problem) -> None:
    """The minimisation that a step from a state comes down to."""
    if p.grid.scheme == _TWO_LAYER:
        two_layer.prepare(p.c, p.s, state, problem)
    else:
        three_layer.prepare(p.c, p.s, state, problem)


@kernel
def finish(p: Plant, state: State, problem: Problem, contact: Contact, work: Works) -> None:
    """The new state, and the works of the step."""
    if p.grid.scheme == _TWO_LAYER:
        two_layer.finish(p.c, p.s, state, problem, contact, work)
    else:
        three_layer.finish(p.c, p.s, state, problem, contact, work)
