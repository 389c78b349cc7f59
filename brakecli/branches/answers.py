"""What branches of a case answer: where it squeals by itself, and where it can vibrate beside stable sliding."""

import math
from dataclasses import dataclass
from functools import cached_property

from brakecli.branches.explore import FORCED, SLIDING, Explored, Followed, Mark, Row, crossing
from brakecli.branches.line import Line
from brakecli.branches.sliding import Slide

NARROWEST = 1e-6
"""Part of the range below which an interval is that of rounding."""
Span = tuple[float, float]
"""Two places of the line, the lower one first."""
NONE_BEGINS = "no vibration begins in the range; --start follows one that a run has come to"
ENDS = {"fold", "flip", "torus", "branch point", "grazing stick", "grazing flight", "flutter"}
"""Special points at which a stable part of a branch may end."""


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
    def base(self) -> Followed | None:
        """The forced motion that continues steady sliding as the waves grow; None where nothing forces it."""
        forced = (each for each in self.branches if each.kind == FORCED)
        return next((each for each in forced if not each.note), None)

    @cached_property
    def range(self) -> Span | None:
        """Where the motion is known that continues steady sliding; None where there is none."""
        if self.base is not None:
            places = [self.line.place(row.value) for row in self.base.points]
            return min(places), max(places)
        slides = self._slides
        return (slides[0].p, slides[-1].p) if slides else None

    @property
    def _slides(self) -> list[Slide]:
        """Where there is steady sliding, or a shoe that locks."""
        return [slide for slide in self.explored.slides if not math.isnan(slide.tests[0])]

    @cached_property
    def windows(self) -> list[Span]:
        """Where the motion that continues steady sliding is unstable; a forced one on all of its sheets."""
        if self.base is not None and self.range is not None:
            edges = [self.range[0], *(p for span in self.stable_spans for p in span), self.range[1]]
            gaps = zip(edges[::2], edges[1::2], strict=True)
            return [(low, high) for low, high in gaps if high > low + NARROWEST]
        slides, found = self._slides, list[Span]()
        if not slides:
            return found
        begin = None if slides[0].stable else slides[0].p
        for change in self.explored.changes:
            if change.lost:
                begin = change.p
            elif begin is not None:
                found.append((begin, change.p))
                begin = None
        return found if begin is None else [*found, (begin, slides[-1].p)]

    @property
    def critical_windows_lower(self) -> list[float]:
        """Lower ends of the intervals in which steady sliding is unstable."""
        return [self.line.value(low) for low, _ in self.windows]

    @property
    def critical_windows_upper(self) -> list[float]:
        """Their upper ends."""
        return [self.line.value(high) for _, high in self.windows]

    @cached_property
    def critical(self) -> float | None:
        """The least value at which the motion that continues steady sliding, stable below, loses its stability."""
        lost = [low for low, _ in self.windows if self.range is not None and low > self.range[0]]
        return self.line.value(lost[0]) if lost else None

    @property
    def critical_error(self) -> float | None:
        """The error of that value, as that of the special point there."""
        marks = [mark for mark in (self.base or self.branches[0]).special if mark.kind not in ("end", "budget")]
        if self.critical is None or not marks:
            return None
        return min(marks, key=lambda mark: abs(mark.value - (self.critical or 0.0))).error

    @cached_property
    def stable_spans(self) -> list[Span]:
        """Where the motion that continues steady sliding is stable; a forced one on one of its sheets."""
        if self.base is not None:
            return _merged([(low, high) for low, high, _ in self._stable_parts(self.base)])
        slides = self._slides
        if not slides:
            return []
        edges = [slides[0].p, *(p for window in self.windows for p in window), slides[-1].p]
        return [(low, high) for low, high in zip(edges[::2], edges[1::2], strict=True) if high > low]

    @cached_property
    def coexisting(self) -> list[tuple[float, float, float]]:
        """Intervals with a stable vibration beside stable sliding, and its frequency (Hz) at the lower end."""
        found = []
        for followed in self.branches:
            if followed.kind == SLIDING or followed is self.base:
                continue
            for low, high, frequency in self._stable_parts(followed):
                for begin, end in self.stable_spans:
                    left, right = max(low, begin), min(high, end)
                    if right > left + NARROWEST:
                        found.append((left, right, frequency))
        return sorted(found)

    def _stable_parts(self, followed: Followed) -> list[tuple[float, float, float]]:
        """The stable parts of a branch by their ends in p, each up to the special point behind its last motion."""
        found, part = [], list[Row]()
        places = [mark.value for mark in followed.special if mark.kind in ENDS]
        ends = [self.line.place(value) for value in places]
        for k, row in enumerate([*followed.points, None]):
            if row is not None and row.stable:
                part.append(row)
                continue
            if part:
                low, high = (self.line.place(pick(each.value for each in part)) for pick in (min, max))
                before = followed.points[k - len(part) - 1] if k > len(part) else None
                for beyond in (before, row):
                    if beyond is not None:
                        near = [p for p in ends if self._beside(p, beyond, part)]
                        low, high = min([low, *near]), max([high, *near])
                slowest = min(part, key=lambda each: each.value)
                found.append((low, high, slowest.frequency))
                part = []
        return found

    def _beside(self, p: float, beyond: Row, part: list[Row]) -> bool:
        """Whether a special point lies next to a stable part, on the way to an unstable motion."""
        ends = [self.line.place(row.value) for row in (part[0], part[-1], beyond)]
        room = 1e-6 + 2.0 * min(abs(ends[2] - ends[0]), abs(ends[2] - ends[1]))
        return min(abs(p - each) for each in ends) <= room

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
        found = [
            point.facts.amplitude
            for followed in self.branches
            if followed.kind != SLIDING
            for point in crossing(followed, p)
            if not point.stable
        ]
        return min(found, default=None)

    @property
    def cut(self) -> list[Mark]:
        """The ends of branches that do not reach an end of the range, or steady sliding, or themselves."""
        known = ("it reaches", "it is closed")
        marks = [mark for followed in self.branches[1:] for mark in followed.ended]
        return [mark for mark in marks if not mark.reason.startswith(known)]

    @cached_property
    def sentence(self) -> str:
        """The answer in words."""
        parts = [self._self_excited(), *self._beside_sliding()]
        if self.barrier is not None and self.coexisting:
            parts.append(
                f"at the case's {self.own:.4g} an unstable cycle of {metres(self.barrier)} lies between the two"
            )
        parts += [f"the branch is cut at {mark.value:.6g}: {mark.reason}" for mark in self.cut[:2]]
        return "; ".join([*parts, *self.explored.notes])

    def _self_excited(self) -> str:
        if self.range is None:
            return "nothing slides steadily"
        first, last = self.range
        words = list[str]()
        diverges = {change.p for change in self.explored.changes if change.kind == "divergence"}
        for low, high in self.windows:
            verb = "locks" if low in diverges and self.base is None else "squeals by itself"
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
        what = "steady sliding" if self.base is None else "the motion that the waves force"
        begin, end = (f"{self.line.value(p):.4g}" for p in (first, last))
        where = "throughout" if (first, last) == (0.0, 1.0) else f"from {begin} to {end}, as far as it is known"
        return f"{what} is stable {where}"

    def _beside_sliding(self) -> list[str]:
        if not self.coexisting:
            followed = any(each.kind != SLIDING for each in self.branches)
            return [] if followed or self.range is None or self.explored.notes else [NONE_BEGINS]
        low, _, frequency = self.coexisting[0]
        until = max(end for _, end, _ in self.coexisting)
        begin, end = (f"{self.line.value(p):.4g}" for p in (low, until))
        reaches = any(abs(until - edge) < 1e-9 for edge in (1.0, *(begin for begin, _ in self.windows)))
        where = f"from {begin} on" if reaches else f"from {begin} to {end}"
        what = "stable sliding" if self.base is None else "the motion that the waves force"
        return [f"{where} a vibration at {frequency:.4g} Hz can exist beside {what}"]


def _merged(spans: list[Span]) -> list[Span]:
    """The union of spans, in order."""
    found = list[Span]()
    for low, high in sorted(spans):
        if found and low <= found[-1][1] + NARROWEST:
            found[-1] = found[-1][0], max(high, found[-1][1])
        else:
            found.append((low, high))
    return found


def metres(length: float) -> str:
    """A length with a unit that fits."""
    for exponent, unit in ((0, "m"), (-3, "mm"), (-6, "µm"), (-9, "nm")):
        if length >= 10.0**exponent:
            return f"{length * 10.0**-exponent:.3g} {unit}"
    return f"{length:.3g} m"
