"""One run that keeps a tolerance, beside the reference: what it promises and estimates, and what is true."""

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.statistics.cases import Drawn, draw
from benchmarks.statistics.reference import SHARE, reference
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.studies.runs.together import certify_together
from brakecli.studies.runs.tolerance import certify

BETTER = 10.0  # the reference is at least so much better than the promise


@dataclass(frozen=True)
class Judged:
    """What a run says and what is true; errors are those of x, y, vx and vy over their largest values."""

    drawn: Drawn
    certified: bool
    estimate: float
    until: float  # s, up to which the promise is kept where it is not certified
    method: str
    error: float  # up to where the reference is good
    own: float  # error of the reference there
    compared: float  # part of the motion that was compared
    early: float  # error up to `until`, or where the reference ends
    early_own: float
    events: tuple[int, ...]  # sticks, turns, lifts

    @property
    def broken(self) -> bool:
        """Whether a certified run is wrong by more than its tolerance, for certain."""
        return self.certified and not self.error - self.own <= self.drawn.tolerance

    @property
    def low(self) -> bool:
        """Whether the estimate is below the error, for certain."""
        return not self.error - self.own <= self.estimate

    @property
    def broken_early(self) -> bool:
        """Whether a run without a certificate is wrong by more than its tolerance while it says that it is not."""
        return not self.certified and not self.early - self.early_own <= self.drawn.tolerance

    @property
    def ratio(self) -> float:
        """The estimate over the error; an error that the reference cannot see counts as that of the reference."""
        return self.estimate / max(self.error, self.own, 1e-300)

    @property
    def faulty(self) -> bool:
        """Whether anything that the run says is wrong."""
        return self.broken or self.low or self.broken_early

    def __str__(self) -> str:
        """The run in one line."""
        said = "certified" if self.certified else f"kept up to {self.until:.3g} s"
        true = f"error {self.error:.2e} ± {self.own:.0e} ({self.compared:.0%}), {self.early:.2e} while kept"
        place = f"{self.drawn.kind} {self.drawn.seed}, {self.drawn.tolerance:.2e}"
        return f"{place}: {said}, estimate {self.estimate:.2e}; {true}; {self.method}"


def judge(drawn: Drawn, share: float = SHARE, *, lanes: bool = False) -> Judged | None:
    """Run and judge a case by a reference whose steps are so much better; None where it has no reference.

    In `lanes` as the point of a map is run; None where it leaves its lane.
    """
    system = system_of(Case.model_validate(drawn.tables))
    found = certify_together([system])[0] if lanes else None
    if lanes and found is None:
        return None
    exact = reference(drawn.tables, share * drawn.tolerance)
    if exact is None:
        return None
    run = found or certify(system)
    said = run.certificate
    rows = np.asarray(run.motion.rows[:, :4])
    good = exact.good(drawn.tolerance / BETTER)
    kept = min(good, 1 + math.floor(said.certified_until / exact.interval + 1e-6))
    return Judged(
        drawn=drawn,
        certified=said.certified,
        estimate=said.estimated_error,
        until=said.certified_until,
        method=said.method,
        error=exact.error_of(rows, good),
        own=exact.own_error(good),
        compared=(good - 1) / (len(exact.rows) - 1),
        early=exact.error_of(rows, kept),
        early_own=exact.own_error(kept),
        events=(exact.sticks, exact.turns, exact.lifts),
    )


def judged(work: tuple[str, int, int], *, lanes: bool = False) -> Judged | None:
    """Draw and judge the case of a kind, a seed and a number: the task of a worker."""
    return judge(draw(*work), lanes=lanes)
