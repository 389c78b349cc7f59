"""How a system is solved: scheme, step, iteration, and the way of computing the contact."""

from dataclasses import dataclass

from brakecli.solver import schemes

MOST_EVALUATIONS = {"newton": 100, "fixed-point": 500}
"""Evaluations of the contact that a step of each iteration may take before it counts as not converged."""


@dataclass(frozen=True)
class Method:
    """A scheme with everything that is chosen beside it, as it is asked for; a `System` says what comes of it.

    `step` (s): a run shortens it until it divides the sample interval. None: the histories keep `tolerance`.
    `nodes`: 0 leaves their number open. `automatic`: a tolerance may choose scheme and contact. `share`: the part
    that exact steps take of the longest one.
    """

    scheme: str
    theta: tuple[float, ...] = ()
    start: str = "consistent"
    iteration: str = "newton"
    evaluator: str = "auto"
    nodes: int = 0
    step: float | None = None
    tolerance: float = 0.0
    allow_unconverged: bool = False
    automatic: bool = False
    share: float = 1.0

    @property
    def row(self) -> schemes.Scheme:
        """What the scheme states of itself."""
        return schemes.SCHEMES[self.scheme]

    @property
    def own_steps(self) -> bool:
        """Whether the scheme finds its steps itself: no step can then be unstable, or bias anything."""
        return self.row.own_steps
