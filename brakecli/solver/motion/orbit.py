"""Follow a motion on smooth pads, without samples, until it is known what becomes of it.

At constant speed and load it either comes so near to steady sliding that no event can follow, or its returns to
the section ẋ = 0 come close to one another, and there is a limit cycle.

**Linear motions.** The modes of steady sliding bound them: the sum of |a_q V_q|, with the amplitudes a_q of the
motion beside steady sliding along the eigenvectors V_q, is not reached at any later time where they decay, and it
is multiplied by exp(σ_q t) where they grow.

**Limit cycles.** Each fall of ẋ through 0 is a point s = (x, y, ẏ) of the section ẋ = 0, and the return map P
leads from one to the next. Newton's iteration s + (I - M)⁻¹ (P(s) - s) finds the point that returns to itself,
and with it the orbit. M = dP/ds is the derivative of the flow over a period, less what it has along the velocity
f of the motion: with n along ẋ, the section takes away f (n·w) / (n·f). The eigenvalues of M are Floquet's
multipliers. If all lie within the unit circle, the orbit attracts its neighbours.
"""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.block import BELT, MOST_SMOOTH_EVENTS, MOST_TURNS, V_X, V_Y, Block, Way, X, Y
from brakecli.solver.kernels import kernel
from brakecli.solver.motion import exact, extent
from brakecli.solver.motion.advance import advance, begin, fly
from brakecli.solver.motion.events import DONE, LONG, STALLED, TURNED
from brakecli.solver.plant import Plant
from brakecli.solver.roughness import TWO_PI
from brakecli.solver.tangent import MOST_POWERS

GOING_ON, LINEAR, FOUND, ENDED = range(4)
"""What a motion has come to: nothing yet; no event can follow; an orbit; the end of the time, or of progress."""
CLOSED = 1e-11
"""Part of the size of a cycle by which an orbit may fail to close."""
_FIRST = 3  # falls before an orbit is sought, and between two tries, which grow further apart
_MANY = 1000  # more often no phase is entered in a cycle


@kernel
def _sizes(o: Way, x: float, y: float, v_y: float) -> float:
    """A distance on the section over the amplitude of the cycle: the largest of |x|, |y| and |v_y| T/2π."""
    return max(abs(x), abs(y), abs(v_y) * o.period / TWO_PI) / o.amplitude


@kernel
def _put_on_section(m: Block, point: Floats) -> None:
    m.z[X] = point[0]
    m.z[Y] = point[1]
    m.z[V_X] = 0.0
    m.z[V_Y] = point[2]


@kernel(inline=False)
def _once_around(p: Plant, scratch: Floats, o: Way) -> bool:
    """From `point` over a period, and on to the section: the return in `image`, and M; False where there is none.

    The rest of the way to the section, -ẋ/ẍ, is followed along the velocity. It vanishes as Newton's iteration
    closes the orbit, which is closed only when it has: M is that of the time flown.
    """
    m = p.block
    _put_on_section(m, o.point)
    if fly(p, scratch, o.period, 4) != DONE or m.velocity[V_X] >= 0.0:
        return False
    remaining = -m.z[V_X] / m.velocity[V_X]
    o.period += remaining
    o.late = remaining
    for column in range(3):
        o.by_point[column] = -m.columns[column if column < 2 else V_Y, V_X] / m.velocity[V_X]
    for row in range(3):
        i = row if row < 2 else V_Y
        o.image[row] = m.z[i] + remaining * m.velocity[i]
        for column in range(3):
            moved = m.columns[column if column < 2 else V_Y, i]
            o.map[row, column] = moved + m.velocity[i] * o.by_point[column]
    return True


@kernel(inline=False)
def _solved(o: Way, x: float, y: float, z: float) -> tuple[float, float, float]:
    """(I - M)⁻¹ of a vector, by Cramer's rule; far away where there is none."""
    a = 1.0 - o.map[0, 0]
    b = -o.map[0, 1]
    c = -o.map[0, 2]
    d = -o.map[1, 0]
    e = 1.0 - o.map[1, 1]
    f = -o.map[1, 2]
    g = -o.map[2, 0]
    h = -o.map[2, 1]
    i = 1.0 - o.map[2, 2]
    whole = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    if whole == 0.0:
        return 1e300, 1e300, 1e300
    one = x * (e * i - f * h) - b * (y * i - f * z) + c * (y * h - e * z)
    two = a * (y * i - f * z) - x * (d * i - f * g) + c * (d * z - y * g)
    three = a * (e * z - y * h) - b * (d * z - y * g) + x * (d * h - e * g)
    return one / whole, two / whole, three / whole


@kernel(inline=False)
def _measured(p: Plant, scratch: Floats, o: Way) -> bool:
    """Go round the orbit for its numbers; False where it takes another way than the motion did.

    Its falls are not counted: of a short rise and fall of ẋ within a step the motion may have seen nothing.
    """
    m = p.block
    way = 0
    for k in range(o.turns):
        way += o.ways[k]
    m.band = 0.0
    for _ in range(2):  # the first round is for the band
        _put_on_section(m, o.point)
        p.work.belt = 0.0
        m.account = 1
        ends = fly(p, scratch, o.period, 0)
        exact.add_works(p.c, p.exact, m, p.work)
        m.account = 0
        m.band = math.sqrt(m.square / o.period)
    o.force = p.work.belt / (m.z[BELT] * o.period)
    o.amplitude = 0.5 * (m.high[X] - m.low[X])
    for k in range(1, m.events + 1):
        way -= _MANY ** m.word[k]
    return ends == DONE and way == 0


@kernel(inline=False)
def _closed(p: Plant, scratch: Floats, o: Way) -> bool:
    """Find the orbit of `turns` falls near the last return; False where none is found that the motion comes to.

    By Newton's method: the point moves by (I - M)⁻¹ (return - point).
    """
    s = o.returns
    at = o.point
    k = o.turns
    near = 0.1  # of the size of a cycle: what is farther off may lead elsewhere
    for i in range(3):
        at[i] = s[0, i]
    for _ in range(6):
        if not _once_around(p, scratch, o):
            return False
        x, y, v_y = _solved(o, o.image[0] - at[0], o.image[1] - at[1], o.image[2] - at[2])
        o.error = max(_sizes(o, x, y, v_y), TWO_PI * abs(o.late) / o.period)
        if not o.error < near:
            return False
        if o.error < CLOSED:
            break
        at[0] += x
        at[1] += y
        at[2] += v_y
        o.period += o.by_point[0] * x + o.by_point[1] * y + o.by_point[2] * v_y
    if o.error >= CLOSED:
        return False
    for i in range(3):  # does the last return follow from the one before it as M says?
        o.image[i] = s[0, i] - at[i]
        for j in range(3):
            o.image[i] -= o.map[i, j] * (s[k, j] - at[j])
    was = _sizes(o, s[k, 0] - at[0], s[k, 1] - at[1], s[k, 2] - at[2])
    o.away = _sizes(o, s[0, 0] - at[0], s[0, 1] - at[1], s[0, 2] - at[2])
    # the return may differ from what the multipliers say, by a fourth and by what an orbit fails to close
    if not (_sizes(o, o.image[0], o.image[1], o.image[2]) <= 0.25 * was + 100.0 * CLOSED and was < near):
        return False
    return _measured(p, scratch, o)


@kernel(inline=False)
def _bound(m: Block, o: Way, seconds: float) -> None:
    """How far from steady sliding a linear motion can come in a time t: Σ |a| exp(max(σ, 0) t) of its modes."""
    for k in range(3):
        o.bound[k] = 0.0
    for q in range(4):
        real = 0.0
        imaginary = 0.0
        for i in range(4):
            real += o.into[0, q, i] * (m.z[i] - o.equilibrium[i])
            imaginary += o.into[1, q, i] * (m.z[i] - o.equilibrium[i])
        powers = max(o.growth[q], 0.0) * seconds
        size = math.hypot(real, imaginary) * (math.exp(powers) if powers < MOST_POWERS else math.inf)
        for k in range(3):
            o.bound[k] += size * o.reach[q, k]


@kernel(inline=False)
def _stays_linear(m: Block, o: Way) -> bool:
    """Whether the motion slides steadily, or beside that, and no event can come before the end."""
    if m.phase != o.sliding:
        return False
    _bound(m, o, o.duration - m.time)
    return o.bound[1] < o.room[0] and o.bound[2] < o.room[1]  # type: ignore[no-any-return]


@kernel(inline=False)
def _note_return(at: Floats, o: Way, fall: float) -> bool:
    """Note a return to the section, `at`; whether it lies close to the one `turns` before."""
    s = o.returns
    for k in range(MOST_TURNS, 0, -1):
        for i in range(3):
            s[k, i] = s[k - 1, i]
        o.fell[k] = o.fell[k - 1]
        if k < MOST_TURNS:
            o.lows[k] = o.lows[k - 1]
            o.ways[k] = o.ways[k - 1]
    s[0, 0] = at[X]
    s[0, 1] = at[Y]
    s[0, 2] = at[V_Y]
    o.fell[0] = fall
    o.lows[0] = o.low
    o.ways[0] = o.way
    o.falls += 1
    o.low = s[0, 0]
    o.way = 0
    o.events = 0
    if o.falls < max(o.next_try, _FIRST):
        return False
    low = o.lows[0]
    high = s[0, 0]
    for k in range(1, min(MOST_TURNS, o.falls - 1) + 1):
        low = min(low, o.lows[k - 1])
        high = max(high, s[k - 1, 0])
        o.period = fall - o.fell[k]
        o.amplitude = 0.5 * (high - low)
        o.turns = k
        if _sizes(o, s[0, 0] - s[k, 0], s[0, 1] - s[k, 1], s[0, 2] - s[k, 2]) < 0.02:  # near enough for Newton
            return True
    return False


@kernel(inline=False)
def _tried(p: Plant, scratch: Floats, o: Way) -> bool:
    """Seek an orbit near the last return. Where there is none the motion goes on as if nothing had been sought."""
    m = p.block
    o.phase = m.phase
    o.time = m.time
    for i in range(4):
        o.saved[i] = m.z[i]
    o.next_try = o.falls + _FIRST + (o.falls - o.next_try) // 2
    if _closed(p, scratch, o):
        o.on_orbit = 1
        return True
    _go_on(p, o)
    return False


@kernel(inline=False)
def _go_on(p: Plant, o: Way) -> None:
    """Go on with the motion that was left for an orbit."""
    m = p.block
    for i in range(4):
        m.z[i] = o.saved[i]
    m.phase = o.phase
    m.time = o.time
    o.on_orbit = 0
    _follow(m)
    exact.look(p.exact, m.phase, m.z)


@kernel
def _follow(m: Block) -> None:
    """Carry the motion alone, and note its phases."""
    m.count = 0
    m.measures = 0
    m.events = 0
    m.limit = MOST_SMOOTH_EVENTS


@kernel(inline=False)
def seek(p: Plant, scratch: Floats, o: Way) -> int:
    """Follow the motion until something is known of all that is to come; what that is, or `GOING_ON`."""
    m = p.block
    if o.started == 0:
        m.z[X] = m.x
        m.z[Y] = m.y
        m.z[V_X] = m.v_x
        m.z[V_Y] = m.v_y
        m.knot = math.inf
        o.low = m.x
        begin(p, scratch)
        _follow(m)
        o.started = 1
        if _stays_linear(m, o):
            return LINEAR
    if o.on_orbit == 1:
        _go_on(p, o)
    for _ in range(2000):  # turning points: Python hears signals in between
        if m.time >= o.duration or o.events > MOST_SMOOTH_EVENTS:
            return ENDED
        ends = advance(p, scratch, o.duration, True)
        for k in range(1, m.events + 1):
            o.way += _MANY ** m.word[k]
        o.events += m.events
        m.events = 0
        if ends == LONG:
            return GOING_ON
        if ends == STALLED:
            return ENDED
        if ends != TURNED:
            continue
        if m.begin[V_X] < 0.0:
            o.low = min(o.low, min(m.begin[X], m.z[X]))
            continue
        theta = extent.zero_of_velocity(p.exact, m)
        if _note_return(p.exact.at, o, m.time + (theta - m.taken) * m.span) and _tried(p, scratch, o):
            return FOUND
        if _stays_linear(m, o):
            return LINEAR
    return GOING_ON


@kernel(inline=False)
def swing(p: Plant, scratch: Floats, o: Way, seconds: float) -> None:
    """Widen `low` and `high` to the least and largest x of a linear motion from `m.z` on, for some time.

    It ends early where the modes that are left can reach no further.
    """
    m = p.block
    m.phase = o.sliding
    m.time = 0.0
    _follow(m)
    m.measures = 1
    exact.make(p.c, p.exact, m.phase, m.h)
    exact.look(p.exact, m.phase, m.z)
    extent.begin(m)
    ends = TURNED
    while ends in (TURNED, LONG):
        ends = advance(p, scratch, seconds, True)
        o.low = min(o.low, m.low[X])
        o.high = max(o.high, m.high[X])
        _bound(m, o, seconds)
        if o.equilibrium[X] + o.bound[0] <= o.high and o.equilibrium[X] - o.bound[0] >= o.low:
            return
