"""The attractors of a sweep over initial states: which of its points come to the same motion.

Points are told apart by what attracts them: steady sliding, what the waves force, or a vibration by itself. The
latter two are told apart by amplitude, frequency, and the parts of the cycle in stick and without contact as well.
Along each of these numbers points are split wherever neighbours differ by more than one motion may. Points without
such a gap between them have one attractor, whatever their order.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.studies.sweeps.journal import Journal
from brakecli.studies.sweeps.record import Status

if TYPE_CHECKING:
    from brakecli.analysis.probability import Probability

SAME_AMPLITUDE = 0.05  # part by which amplitudes of the same motion may differ: a settled one is known to that
_NUMBERS = ("amplitude", "frequency", "stick_fraction", "contact_loss_fraction")


@dataclass(frozen=True)
class Attractor:
    """A motion to which points come; its numbers are medians, in SI units."""

    attractor: int  # its number
    regime: str
    excitation: str
    points: int  # that come to it
    share: "Probability"  # of all points
    amplitude: float
    frequency: float | None
    stick_fraction: float
    contact_loss_fraction: float


@dataclass(frozen=True)
class Attractors:
    """What the points of a sweep come to."""

    numbers: NDArray[np.int64]  # of the attractor that each point comes to, 0 where it is not known
    attractors: list[Attractor]
    sentences: list[str]

    @classmethod
    def of(cls, journal: Journal) -> "Attractors":
        """Tell the attractors of a sweep apart by the numbers of its points.

        They are counted by rising amplitude: first steady sliding, then what is forced, then vibrations. A point
        that is undecided comes to none; neither does one whose numbers are not yet those of a longer run.
        """
        from brakecli.analysis.probability import Probability  # only such sweeps wait for SciPy's statistics

        regime, excitation, status = (journal.column(name) for name in ("regime", "excitation", "status"))
        dies = (regime == Regime.DAMPED.encode()) & (excitation == Excitation.NONE.encode())
        decided = (status == Status.DONE.encode()) & (regime != Regime.UNDECIDED.encode())
        decided &= dies | (journal.column("settled") == 1)
        kinds = np.where(dies, 0, np.where(excitation == Excitation.FORCED.encode(), 1, 2))[decided]
        values = np.where(kinds, [journal.column(name)[decided] for name in _NUMBERS], 0.0)
        numbers = np.zeros(regime.shape, np.int64)
        apart = _comparable(values)
        numbers[decided] = labels = 1 + _grouped(kinds, apart)
        attractors = list[Attractor]()
        sentences = list[str]()
        for number in range(1, int(labels.max(initial=0)) + 1):
            chosen = labels == number
            here = numbers == number
            amplitude, frequency, stick, loss = np.median(values[:, chosen], axis=1).tolist()
            share = Probability.within(here.reshape(1, -1), ~decided.reshape(1, -1))
            attractor = Attractor(
                attractor=number,
                regime=_most(regime[here]),
                excitation=_most(excitation[here]),
                points=int(here.sum()),
                share=share,
                amplitude=amplitude,
                frequency=frequency if frequency > 0.0 else None,
                stick_fraction=stick,
                contact_loss_fraction=loss,
            )
            attractors.append(attractor)
            if np.ptp(apart[:, chosen], axis=1).max() > 2.0:
                low = values[0, chosen].min()
                high = values[0, chosen].max()
                what = f"attractor {number} holds motions with amplitudes of {low:.3g} to {high:.3g} m"
                sentences.append(f"{what}, and no gap between them: run longer, to see whether they are one")
        if missing := int((~decided).sum()):
            what = "fail, are undecided or have not settled, and belong to no attractor"
            sentences.append(f"{missing} of {decided.size} points {what}: their reasons say what to do")
        return cls(numbers, attractors, sentences)


def _most(texts: NDArray[np.bytes_]) -> str:
    """The most frequent of some texts."""
    names, counts = np.unique(texts, return_counts=True)
    return str(names[counts.argmax()].decode())


def _comparable(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Numbers of motions in units of what the same motion may differ by.

    Within a settled part each frequency drifts by half of its unit at most. The time in a phase may differ by that
    part of the cycle by which amplitudes do.
    """
    with np.errstate(invalid="ignore"):
        sizes = np.log(np.maximum(np.nan_to_num(values[:2]), np.finfo(float).tiny))
    scales = np.log1p([[SAME_AMPLITUDE], [0.01]])
    return np.concatenate([sizes / scales, values[2:] / SAME_AMPLITUDE])


def _grouped(kinds: NDArray[np.int_], apart: NDArray[np.float64]) -> NDArray[np.int64]:
    """The group of each point, from 0: first by kind, then split at every gap above 1 until there is none.

    Groups are counted by kind, and then by the medians of their numbers, amplitudes first.
    """
    groups = np.unique(kinds, return_inverse=True)[1]
    count = 0
    while groups.max(initial=-1) + 1 > count:
        count = groups.max() + 1
        for row in apart:
            order = np.lexsort((row, groups))
            splits = (np.diff(groups[order]) > 0) | (np.diff(row[order]) > 1.0)
            groups[order] = np.concatenate([[0], np.cumsum(splits)])
    middle = [np.median(apart[:, groups == group], axis=1) for group in range(count)]
    first = np.unique(groups, return_index=True)[1]
    return np.asarray(np.argsort(np.lexsort((*np.transpose(middle)[::-1], kinds[first])))[groups])
