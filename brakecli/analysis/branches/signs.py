"""Where something changes along a branch: tests, points inserted where they are needed, and zeros located."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from brakecli.analysis.branches.multipliers import resonant_pair
from brakecli.analysis.branches.newton import Newton, zero
from brakecli.analysis.branches.point import FLIP, FOLD, TORUS, TURN, End, Point, Special
from brakecli.analysis.branches.problem import Array
from brakecli.solver.tangent import MOST_POWERS

Over = Callable[[], End | None]
"""Why nothing more may be computed, if so."""

MOST_STEPS = 40
"""Steps for one zero or border; some ten are needed."""
NOTHING = 1e-9
"""A test that is smaller at both ends of a stride vanishes identically, as in area-preserving maps."""
ASIDE = 0.1
"""Part of a stride by which a point is moved from where Newton's method fails, or from the ends; a choice."""
ONE_PLACE = 1e-4
"""Length over which a turn and a branch point are the same, as on the outer branch of a pitchfork."""
GRID = np.linspace(0.0, 1.0, 17)
"""Parts of a stride at which the cubic is looked at."""


def special_points(newton: Newton, points: list[Point], over: Over) -> tuple[list[Special], str]:
    """Locate all special points. Points are inserted into the list; the text says why that is incomplete.

    First points are inserted where another word may hold between two neighbours. Then borders are located, so that
    each word has its points up to its borders. Then points are inserted where a test may vanish twice between two
    neighbours. Then each change of sign is located.
    """
    unsearched = _insert(newton, points, over, margins=True)
    specials: list[Special] = []
    if not unsearched:
        specials, unsearched = _borders(newton, points, over)
    if not unsearched:
        unsearched = _insert(newton, points, over)
    for one, other in pairwise(list(points)):
        if not _one_piece(one, other):
            continue
        end = over()
        if end is not None:
            return specials, unsearched or end.reason
        newton.problem.use(one.chart)
        specials += _changes(newton, one, other)
    _between(newton, points, specials)
    places = [special.s for special in specials if special.kind == "branch point"]
    specials = [
        special
        for special in specials
        if special.kind != "fold" or all(abs(special.s - s) >= ONE_PLACE for s in places)
    ]
    return specials, unsearched


def _between(newton: Newton, points: list[Point], specials: list[Special]) -> None:
    """Insert a point between two special points of one stride: what lies between may be stable on its own."""
    for k in range(len(points) - 2, -1, -1):
        one = points[k]
        other = points[k + 1]
        if not _one_piece(one, other):
            continue
        places = sorted(special.s for special in specials if one.s < special.s < other.s)
        newton.problem.use(one.chart)
        fractions = [(0.5 * (a + b) - one.s) / (other.s - one.s) for a, b in pairwise(places)]
        middles = [newton.between(one, other, fraction) for fraction in fractions]
        points[k + 1 : k + 1] = [middle for middle in middles if middle is not None and middle.word == one.word]


def _one_piece(one: Point, other: Point) -> bool:
    return one.chart is other.chart and one.word == other.word


def _borders(newton: Newton, points: list[Point], over: Over) -> tuple[list[Special], str]:
    """Bracket each change of the word to the shortest stride, and insert both ends of the bracket."""
    specials: list[Special] = []
    k = 0
    while k < len(points) - 1:
        one = points[k]
        other = points[k + 1]
        if one.chart is other.chart and one.word != other.word:
            end = over()
            if end is not None:
                return specials, end.reason
            newton.problem.use(one.chart)
            near, far = _bracket(newton, one, other)
            if far is not other:
                points.insert(k + 1, far)
            if near is not one:
                points.insert(k + 1, near)
                k += 1
            error = 0.5 * abs(far.p - near.p) + newton.settings.shortest * abs(float(near.tangent[-1]))
            name = newton.problem.border(near.word, far.word)
            turns = float(near.tangent[-1] * far.tangent[-1]) < 0.0
            p = 0.5 * (near.p + far.p)
            s = 0.5 * (near.s + far.s)
            change = newton.problem.change(near.word, far.word)
            specials.append(Special("grazing", p, error, near, s, name, turns, change))
        k += 1
    return specials, ""


def _bracket(newton: Newton, near: Point, far: Point) -> tuple[Point, Point]:
    """Bisect: the last point of the word of `near`, and the first one of another word."""
    for _ in range(MOST_STEPS):
        chord = far.z - near.z
        if math.sqrt(chord @ chord) <= newton.settings.shortest:
            break
        # the chord may leave a sharp corner too far: then along the tangent of one side, if it stays on that side
        middle = newton.between(near, far, 0.5)
        if middle is not None and not _ordered(near, middle, far):
            middle = None
        middle = middle or _beside(newton, near, far, near) or _beside(newton, near, far, far)
        if middle is None or not newton.holds(middle):
            break
        if middle.word == near.word:
            near = middle
        else:
            far = middle
    return near, far


def _ordered(near: Point, middle: Point, far: Point) -> bool:
    """Whether a point lies ahead of the one before it, or before the one behind it, if their word is the same.

    Where a branch turns by more than a right angle, the chord leads back along it.
    """
    if middle.word == near.word:
        return float((middle.z - near.z) @ near.tangent) > 0.0 and float(middle.tangent @ near.tangent) > 0.0
    if middle.word == far.word:
        return float((far.z - middle.z) @ far.tangent) > 0.0 and float(middle.tangent @ far.tangent) > 0.0
    return True


def _beside(newton: Newton, near: Point, far: Point, base: Point) -> Point | None:
    """A point between two of different words, on the side of one of them."""
    stride = 0.5 * (far.s - near.s) * (1.0 if base is near else -1.0)
    for _ in range(4):
        point = newton.solve(base.z + stride * base.tangent, base.tangent, base.tangent, base.s + stride)
        if point is not None and point.word == base.word:
            return point
        stride *= 0.25
    return None


def _insert(newton: Newton, points: list[Point], over: Over, margins: bool = False) -> str:
    """Insert points until no test, or no margin of the word, may vanish twice between two neighbours."""
    settings = newton.settings
    insertions = newton.settings.insertions
    finished: set[tuple[int, int]] = set()  # pairs, by identity, that need no further look
    alive = list(points)  # keeps every point alive, so that identities stay unique
    while True:
        wanted = [
            (k, fraction)
            for k, fraction in _suspects(points, settings.everywhere, margins)
            if (id(points[k]), id(points[k + 1])) not in finished and points[k + 1].s - points[k].s > settings.gap
        ]
        if not wanted:
            return ""
        for k, fraction in reversed(wanted):  # from the end, so that places stay valid
            end = over()
            if end is not None:
                return end.reason
            if insertions <= 0:
                return f"the budget of {settings.insertions} inserted points is spent"
            one = points[k]
            other = points[k + 1]
            newton.problem.use(one.chart)
            new = newton.between(one, other, fraction) or newton.between(one, other, 0.5)
            if new is None or (new.word != one.word and not margins):
                finished.add((id(one), id(other)))
                continue
            points.insert(k + 1, new)
            alive.append(new)
            insertions -= 1


def _suspects(points: list[Point], everywhere: bool, margins: bool) -> list[tuple[int, float]]:
    """Strides in which a test may vanish twice, with the part of the stride at which that is likeliest."""
    suspects: list[tuple[int, float]] = []
    begin = 0
    for k in range(1, len(points) + 1):
        if k == len(points) or not _one_piece(points[k - 1], points[k]):
            piece = points[begin:k]
            if len(piece) > 1 and (piece[0].margins or not margins):
                s = np.array([point.s for point in piece])
                tests = np.array([point.margins if margins else point.tests for point in piece])
                suspects += [(begin + j, fraction) for j, fraction in _near_zeros(s, tests, everywhere or margins)]
            begin = k
    return suspects


def _near_zeros(s: Array, tests: Array, everywhere: bool) -> list[tuple[int, float]]:
    """Strides of one smooth piece, its parts as above.

    The model is the cubic through the four nearest points, and its doubt is twice its distance from the two
    parabolas through three of them. With fewer points the model is of lower degree and compared with the degree
    below it.
    """
    n = len(s)
    first = tests[:-1]
    last = tests[1:]
    apart = np.diff(s) > 0.0  # a corner may leave two points at one place
    same = apart[:, None] & ((first >= 0.0) == (last >= 0.0)) & (np.maximum(np.abs(first), np.abs(last)) > NOTHING)
    x = s[:-1, None] + np.diff(s)[:, None] * GRID  # (strides, places)
    size = min(n, 4)
    window = np.clip(np.arange(n - 1) - 1, 0, n - size)[:, None] + np.arange(size)
    # (strides, size), (strides, size, tests)
    nodes = s[window]
    values = tests[window]
    # Newton's divided differences
    levels = [values]
    for level in range(1, size):
        width = (nodes[:, level:] - nodes[:, :-level])[:, :, None]
        levels.append(np.diff(levels[-1], axis=1) / np.where(width == 0.0, 1.0, width))
    away = [x - nodes[:, j, None] for j in range(size)]
    model = np.repeat(values[:, 0, None, :], len(GRID), axis=1)
    weight = np.ones_like(x)
    for level in range(1, size):
        weight = weight * away[level - 1]
        model = model + levels[level][:, 0, None, :] * weight[:, :, None]
    top = levels[-1][:, 0, None, :]
    if size == 4:
        doubt = np.maximum(np.abs(away[0] * away[1] * away[2]), np.abs(away[1] * away[2] * away[3]))
        error = 2.0 * np.abs(top) * doubt[:, :, None]
    elif size == 3:
        error = np.abs(top) * np.abs(weight)[:, :, None]
    else:
        # a straight line between two points is in doubt by a little more than half of their difference
        error = 0.6 * np.abs(last - first)[:, None, :] * np.ones_like(model)
    side = np.where(first >= 0.0, 1.0, -1.0)[:, None, :]
    floor = side * model - error
    inner = floor[:, 1:-1]
    middle = np.argmin(inner, axis=1)[:, None]
    before, least, after = (np.take_along_axis(floor, middle + j, axis=1)[:, 0] for j in range(3))
    # the bottom of the parabola through the least value and its neighbours: a window may lie between two places
    bend = after - 2.0 * least + before
    slope = after - before
    curved = bend > np.abs(slope) / 2.0
    offset = np.where(curved, -0.5 * slope / np.where(curved, bend, 1.0), 0.0)
    least = least + 0.25 * slope * offset
    lowest = (middle[:, 0] + 1 + offset) / (len(GRID) - 1)
    suspect = same & (least <= 0.0)
    if not everywhere:  # a test of the multipliers that is negative all along proves the motion unstable
        negative = same & (first < 0.0) & (least > 0.0)
        suspect &= ~negative[:, FOLD:].any(axis=1)[:, None]
    suspects = []
    for k in np.flatnonzero(suspect.any(axis=1)).tolist():
        test = int(np.flatnonzero(suspect[k])[0])
        suspects.append((k, min(max(float(lowest[k, test]), ASIDE), 1.0 - ASIDE)))
    return suspects


def _changes(newton: Newton, one: Point, other: Point) -> list[Special]:
    """The special points between two neighbours of one smooth piece."""
    specials = []
    turns = _differ(one, other, TURN)
    if turns:
        specials.append(_locate(newton, one, other, "fold", lambda point: point.tests[TURN]))
    # a change of the bordered determinant that neither p nor det(I - M) shows is none of the motion
    if one.orientation[0] * other.orientation[0] < 0.0 and (turns or _differ(one, other, FOLD)):
        top = max(one.orientation[1], other.orientation[1])
        specials.append(_locate(newton, one, other, "branch point", lambda point: _determinant(point, top)))
    if _differ(one, other, FLIP):
        specials.append(_locate(newton, one, other, "flip", lambda point: point.tests[FLIP]))
    if _differ(one, other, TORUS) and not (_saddle(one) and _saddle(other)):
        torus = _locate(newton, one, other, "torus", lambda point: point.tests[TORUS])
        if not _saddle(torus.point):
            specials.append(torus)
    return specials


def _differ(one: Point, other: Point, test: int) -> bool:
    a = one.tests[test]
    b = other.tests[test]
    return (a >= 0.0) != (b >= 0.0) and max(abs(a), abs(b)) > NOTHING and not (math.isnan(a) or math.isnan(b))


def _determinant(point: Point, top: float) -> float:
    sign, log = point.orientation
    return sign * math.exp(max(log - top, -MOST_POWERS))


def _saddle(point: Point) -> bool:
    """Whether the pair with a product near one is real: a neutral saddle, at which no torus is born."""
    pair = resonant_pair(point.multipliers)
    return pair is None or abs(pair[0].imag) <= 1e-9 * abs(pair[0])


def _locate(newton: Newton, one: Point, other: Point, kind: str, test: Callable[[Point], float]) -> Special:
    """Locate a zero between two neighbours by the Illinois method, with Newton's method at each place."""
    low = test(one)
    high = test(other)
    best = one
    error = abs(other.p - one.p)
    side = 0
    for _ in range(MOST_STEPS):
        fraction = zero(low, high, 1e-7)  # nearer to an end Newton's method would find the end again
        # Newton's method fails very near a branch point: then a little before it, or behind it
        for trial in (fraction, (1.0 - ASIDE) * fraction, ASIDE + (1.0 - ASIDE) * fraction):
            new = newton.between(one, other, trial)
            if new is not None:
                break
        if new is None or new.word != one.word:
            break
        error = abs(new.p - best.p)
        moved = abs(new.s - best.s)
        best = new
        value = test(new)
        # at a fold p hardly moves, so the place itself must stand still as well
        if value == 0.0 or math.isnan(value) or (error < 1e-9 and moved < 1e-6):
            break
        if (value >= 0.0) == (low >= 0.0):
            one = new
            low = value
            high *= 0.5 if side == 1 else 1.0  # an end that stays twice would slow the secant down
            side = 1
        else:
            other = new
            high = value
            low *= 0.5 if side == -1 else 1.0
            side = -1
    return Special(kind, best.p, max(error, 1e-11), best, best.s, "", kind == "fold")
