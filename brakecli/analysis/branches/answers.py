"""What branches of a case answer: where it squeals by itself, and where it can vibrate beside stable sliding."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from brakecli.analysis.branches.bar import Bound
from brakecli.analysis.branches.explore import Explored, crossing, span
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.point import End, Point
from brakecli.analysis.branches.rows import FORCED, SLIDING, Followed, Mark
from brakecli.analysis.branches.sliding import Slide, stable_spans
from brakecli.analysis.branches.stable_parts import (
    CUT,
    NARROWEST,
    Part,
    Span,
    merge,
    separate,
    stable_parts,
    unite,
)

MEET = 1e-3
"""Part of the range, and of their states, by which two ends of branches differ at most that are one motion."""
SAME = 1e-9
"""Distance of two places of the range that are one, but for rounding."""
NONE_BEGINS = "no vibration begins in the range; --start follows one that a run has come to"


@dataclass(frozen=True)
class Answers:
    """The branches of a case along keys, and what they answer; values in the unit of the keys."""

    explored: Explored
    own: float | None  # value of the keys in the case itself; None where they differ

    @property
    def line(self) -> Line:
        """Along which it was looked."""
        return self.explored.line

    @property
    def parameter(self) -> str:
        """The key, or the keys."""
        return ",".join(self.line.keys)

    @property
    def lower(self) -> float:
        """The lower end of the range."""
        return self.line.low

    @property
    def upper(self) -> float:
        """The upper end of the range."""
        return self.line.high

    @property
    def branches(self) -> list[Followed]:
        """All of them, steady sliding first."""
        return self.explored.branches

    @cached_property
    def bases(self) -> list[Followed]:
        """The forced motions that grow with the waves out of steady sliding; none where nothing forces any."""
        return [branch for branch in self.branches if branch.kind == FORCED and not branch.note]

    @cached_property
    def domain(self) -> list[Span]:
        """Where the motion is known that continues steady sliding."""
        if self.bases:
            return merge([*map(span, self.bases), *self._bridges])
        slides = self._slides
        return [(slides[0].p, slides[-1].p)] if slides else []

    @property
    def range(self) -> Span | None:
        """From the first place to the last one at which that motion is known; None where there is none."""
        return (self.domain[0][0], self.domain[-1][1]) if self.domain else None

    @property
    def _slides(self) -> list[Slide]:
        """Where there is steady sliding, or a shoe that locks."""
        return [slide for slide in self.explored.slides if slide.signs is not None]

    @cached_property
    def windows(self) -> list[tuple[Bound, Bound]]:
        """Where the motion that continues steady sliding is unstable; a forced one on all of its sheets.

        The ends are not known of one in which a branch is lost: it may come back as a stable motion.
        """
        windows = list[tuple[Bound, Bound]]()
        for (first, last), within in zip(self.domain, self._edges, strict=True):
            edges = [Bound(first), *within, Bound(last)]
            for low, high in zip(edges[::2], edges[1::2], strict=True):
                if high.p > low.p + NARROWEST:
                    lost = any(low.p - low.error < p < high.p + high.error for p in self._lost_at)
                    ends = (low._replace(known=False), high._replace(known=False)) if lost else (low, high)
                    windows.append(ends)
        return windows

    @cached_property
    def _cut_ends(self) -> list[tuple[End, Point]]:
        """The ends at which branches of the motion that continues steady sliding are cut."""
        branches = [followed.branch for followed in self.bases if followed.branch and followed.branch.points]
        ends = [
            pair
            for branch in branches
            for pair in zip(branch.ended, (branch.points[0], branch.points[-1]), strict=True)
        ]
        return [(end, point) for end, point in ends if end.kind in CUT]

    @cached_property
    def _lost_at(self) -> list[float]:
        """Where it goes on, and nobody knows how: no branch passes through that motion, or none was followed."""
        cut = [point.p for end, point in self._cut_ends if end.kind != "met" and not self._is_passed(point)]
        return cut + self.explored.unfollowed

    def _is_passed(self, motion: Point) -> bool:
        """Whether another branch of the motion that continues steady sliding passes through a motion."""
        for followed in self.bases:
            points = followed.branch.points if followed.branch is not None else []
            if any(point is motion for point in points):
                continue
            if any(_is_same(point, motion) for point in crossing(followed, motion.p)):
                return True
        return False

    @cached_property
    def _bridges(self) -> list[Span]:
        """Between two such ends that are one motion."""
        return [
            (min(one.p, other.p), max(one.p, other.p))
            for (_, one), (_, other) in combinations(self._cut_ends, 2)
            if abs(one.p - other.p) < MEET and _is_same(one, other)
        ]

    @property
    def critical_windows_lower(self) -> list[float]:
        """Lower ends of the intervals in which steady sliding is unstable."""
        return [self.line.value(low.p) for low, _ in self.windows]

    @property
    def critical_windows_upper(self) -> list[float]:
        """Their upper ends."""
        return [self.line.value(high.p) for _, high in self.windows]

    @cached_property
    def lost(self) -> Bound | None:
        """The least place at which the motion that continues steady sliding, stable below, loses its stability."""
        return next((low for low, _ in self.windows if self.range and low.p > self.range[0]), None)

    @property
    def critical(self) -> float | None:
        """The value there."""
        return self.line.value(self.lost.p) if self.lost else None

    @property
    def critical_error(self) -> float | None:
        """Its error bar."""
        return self.lost.bar * abs(self.upper - self.lower) if self.lost else None

    @cached_property
    def _stable(self) -> list[Part]:
        """Where the motion that continues steady sliding is stable; a forced one on one of its sheets."""
        if self.bases:
            return unite([piece for forced in self.bases for piece in stable_parts(forced)])
        spans = stable_spans(self.explored.slides, self.explored.changes)
        return [
            Part(Bound(low, error=low_error), Bound(high, error=high_error), 0.0)
            for (low, low_error), (high, high_error) in spans
        ]

    @cached_property
    def _edges(self) -> list[list[Bound]]:
        """Both ends of all stable parts in order, for each interval in which the motion is known."""
        edges = []
        for first, last in self.domain:
            own = [piece for piece in self._stable if first <= piece.low.p <= last]
            edges.append(separate([bound for piece in own for bound in (piece.low, piece.high)]))
        return edges

    @cached_property
    def stable_spans(self) -> list[Span]:
        """Where it is stable, by the ends."""
        return [(a.p, b.p) for edges in self._edges for a, b in zip(edges[::2], edges[1::2], strict=True)]

    @cached_property
    def coexisting(self) -> list[tuple[float, float, float]]:
        """Intervals with a stable vibration beside stable sliding, and its frequency (Hz) at the lower end."""
        spans = []
        for followed in self.branches:
            if followed.kind == SLIDING or followed in self.bases:
                continue
            for piece in stable_parts(followed):
                for begin, end in self.stable_spans:
                    low = max(piece.low.p, begin)
                    high = min(piece.high.p, end)
                    if high > low + NARROWEST:
                        spans.append((low, high, piece.frequency))
        return sorted(spans)

    @property
    def coexists_from(self) -> float | None:
        """The least value with a stable vibration beside stable sliding."""
        return self.line.value(self.coexisting[0][0]) if self.coexisting else None

    @cached_property
    def barrier(self) -> float | None:
        """Half of peak to peak of x (m) of the smallest unstable cycle at the case's value; None without one."""
        if self.own is None:
            return None
        p = self.line.place(self.own)
        if not any(low <= p <= high for low, high in self.stable_spans):
            return None
        amplitudes = [
            point.facts.amplitude
            for followed in self.branches
            if followed.kind != SLIDING
            for point in crossing(followed, p)
            if not point.stable
        ]
        return min(amplitudes, default=None)

    @property
    def cut(self) -> list[tuple[int, Mark]]:
        """The ends of branches, and their numbers, that reach neither an end of the range nor a known motion."""
        complete = ("it reaches", "it is closed")
        marks = [(number, mark) for number, followed in enumerate(self.branches) for mark in followed.ended]
        return [(number, mark) for number, mark in marks if number and not mark.reason.startswith(complete)]

    @cached_property
    def sentence(self) -> str:
        """The answer in words."""
        parts = [self._self_excited(), *self._beside_sliding()]
        if self.barrier is not None and self.coexisting:
            parts.append(
                f"at the case's {self.own:.4g} an unstable cycle of {metres(self.barrier)} lies between the two"
            )
        parts += [
            f"branch {number} is cut at {mark.motion.value:.6g}: {mark.reason}" for number, mark in self.cut[:2]
        ]
        return "; ".join(filter(None, [*parts, *self.explored.notes, self.sought]))

    @cached_property
    def _lowest_found(self) -> list[float]:
        """The places from which vibrations exist that pushes have found, in order."""
        found = self.explored.search.islands
        return sorted(min(part.low.p for part in stable_parts(followed)) for followed in found)

    @cached_property
    def pushed(self) -> str:
        """How the vibration was found that exists from `coexists_from` on, if by pushes, in words."""
        begins = {max(p, begin) for p in self._lowest_found[:1] for begin, _ in self.stable_spans}
        by_pushes = bool(self.coexisting) and self.coexisting[0][0] in begins
        return f", found in {self.explored.search.pushes} pushes," if by_pushes else ""

    @cached_property
    def sought(self) -> str:
        """What pushes have come to, but for what `pushed` says, in words; empty where there were none."""
        search = self.explored.search
        if not search.pushes:
            return ""
        lowest = self._lowest_found[1:] if self.pushed else self._lowest_found
        values = " and ".join(f"{self.line.value(p):.4g}" for p in lowest)
        how = f"found in {search.pushes} pushes"
        if len(lowest) == 0 and self.pushed:
            return f"what {search.undecided} of the pushes come to is not known" if search.undecided else ""
        if len(lowest) == 0:
            words = f"no other vibration {how}"
        elif len(lowest) == 1:
            words = f"another vibration, {how}, exists from {values} on"
        else:
            words = f"{len(lowest)} other vibrations, {how}, exist from {values} on"
        return f"{words}; what {search.undecided} of these come to is not known" if search.undecided else words

    def _self_excited(self) -> str:
        if self.range is None:
            return "nothing slides steadily"
        first, last = self.range
        words = list[str]()
        diverges = {change.p for change in self.explored.changes if change.kind == "divergence"}
        for low, high in ((low.p, high.p) for low, high in self.windows):
            verb = "locks" if low in diverges and not self.bases else "squeals by itself"
            begin, end = (f"{self.line.value(p):.4g}" for p in (low, high))
            if low == first and high == last:
                words.append(f"{verb} throughout")
            elif high == last:
                words.append(f"{verb} from {begin} on")
            elif low == first:
                words.append(f"{verb} up to {end}")
            else:
                words.append(f"{verb} from {begin} to {end}")
        if words:
            return " and ".join(words).replace("and squeals by itself ", "and ")
        what = "the motion that the waves force" if self.bases else "steady sliding"
        begin, end = (f"{self.line.value(p):.4g}" for p in (first, last))
        where = "throughout" if (first, last) == (0.0, 1.0) else f"from {begin} to {end}, as far as it is known"
        return f"{what} is stable {where}"

    def _beside_sliding(self) -> list[str]:
        if not self.coexisting:
            followed = any(branch.kind != SLIDING for branch in self.branches)
            return [] if followed or self.range is None or self.explored.notes else [NONE_BEGINS]
        low, _, frequency = self.coexisting[0]
        until = max(end for _, end, _ in self.coexisting)
        begin, end = (f"{self.line.value(p):.4g}" for p in (low, until))
        reaches = any(abs(until - edge) < SAME for edge in (1.0, *(low.p for low, _ in self.windows)))
        where = f"from {begin} on" if reaches else f"from {begin} to {end}"
        what = "the motion that the waves force" if self.bases else "stable sliding"
        return [f"{where} a vibration at {frequency:.4g} Hz{self.pushed} can exist beside {what}"]


def _is_same(one: Point, other: Point) -> bool:
    """Whether two motions at one place have the same state."""
    return np.allclose(one.facts.state, other.facts.state, MEET, MEET * np.abs(one.facts.state).max())


def metres(length: float) -> str:
    """A length with a unit that fits."""
    for exponent, unit in ((0, "m"), (-3, "mm"), (-6, "µm"), (-9, "nm")):
        if length >= 10.0**exponent:
            return f"{length * 10.0**-exponent:.3g} {unit}"
    return f"{length:.3g} m"
