"""The growth of disturbances, and random shoes to try it on, without any part of the package.

Runge and Kutta's method of fourth order integrates the equations of the shoe and their derivative. The gap is a
straight line between nodes, so that force and stiffness are closed forms. Newton's method closes the motion over a
period of the wheel. On smooth surfaces Routh and Hurwitz's conditions decide, in fifty digits.
"""

import math
from importlib import import_module
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

mpmath: Any = import_module("mpmath")  # imported so because it has no type hints
Floats = NDArray[np.float64]
Tables = dict[str, Any]
# of the pad; of a period of the fastest motion or passing wave
CELLS = 200
STEPS = 90
NEUTRAL = 1e-5  # damping ratio of the slowest motion that would stop what counts as no growth without dashpots


@njit
def _rates(z: Any, moved: float, links: Any, waves: Any, sines: Any, cosines: Any, shoe: Any, out: Any) -> float:
    """Velocities and accelerations, and those of four disturbances in the columns after; returns the slip."""
    m, cxx, cxy, cyy, bxx, bxy, byy, qx, qy, grip, belt, k, cell = links
    count = waves.shape[1]
    up = np.empty(count)
    along = np.empty(count)
    for i in range(count):
        angle = waves[1, i] * (z[0, 0] - moved) + waves[2, i]
        up[i] = waves[0, i] * math.sin(angle)
        along[i] = waves[0, i] * math.cos(angle)
    force = slope = touching = before = steep_before = 0.0
    for j in range(shoe.size):
        gap = -shoe[j] - z[1, 0]
        steep = 0.0
        for i in range(count):
            gap += up[i] * cosines[i, j] + along[i] * sines[i, j]
            steep += waves[1, i] * (along[i] * cosines[i, j] - up[i] * sines[i, j])
        if j and (gap > 0.0 or before > 0.0):
            if gap > 0.0 and before > 0.0:
                force = force + gap + before
                slope = slope + steep + steep_before
                touching = touching + 2.0
            else:
                high = gap
                low = before
                by_high = steep
                by_low = steep_before
                if high < low:
                    high, low, by_high, by_low = low, high, by_low, by_high
                part = high / (high - low)
                force = force + part * high
                touching = touching + 2.0 * part
                slope += (2.0 * part - part * part) * by_high + part * part * by_low
        before = gap
        steep_before = steep
    force = 0.5 * k * cell * force
    slope = 0.5 * k * cell * slope
    touching = 0.5 * k * cell * touching
    for c in range(5):
        x = z[0, c]
        y = z[1, c]
        vx = z[2, c]
        vy = z[3, c]
        pull = slope * x - touching * y if c else force
        load = 0.0 if c else 1.0
        out[0, c] = vx
        out[1, c] = vy
        out[2, c] = (grip * pull - bxx * vx - bxy * vy - cxx * x - cxy * y - load * qx) / m
        out[3, c] = (pull - bxy * vx - byy * vy - cxy * x - cyy * y - load * qy) / m
    return float((belt - z[2, 0]) * math.copysign(1.0, belt))


@njit
def _passed(
    state: Any, links: Any, waves: Any, sines: Any, cosines: Any, shoe: Any, step: float, steps: int
) -> tuple[Any, float]:
    """State and tangent (columns) after so many steps, and the least slip."""
    z = np.zeros((4, 5))
    slip = np.inf
    z[:, 0] = state
    z[:, 1:] = np.eye(4)
    a = np.empty((4, 5))
    b = np.empty((4, 5))
    c = np.empty((4, 5))
    d = np.empty((4, 5))
    for n in range(steps):
        at = links[10] * n * step
        half = 0.5 * links[10] * step
        slip = min(slip, _rates(z, at, links, waves, sines, cosines, shoe, a))
        _rates(z + 0.5 * step * a, at + half, links, waves, sines, cosines, shoe, b)
        _rates(z + 0.5 * step * b, at + half, links, waves, sines, cosines, shoe, c)
        _rates(z + step * c, at + 2.0 * half, links, waves, sines, cosines, shoe, d)
        z = z + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    return z, slip


def held_by(tables: Tables, number: Any = float, trig: Any = math) -> tuple[Any, ...]:
    """Mass, stiffnesses and damping (xx, xy, yy), stiffness of the contact, load, and grip of a shoe."""
    one = tables["link1"]
    other = tables["link2"]
    beta, alpha = (number(link["angle_deg"]) * number(trig.pi) / 180 for link in (one, other))

    def triple(along: Any, across: Any) -> tuple[Any, Any, Any]:
        s = trig.sin(beta)
        c = trig.cos(beta)
        sa = trig.sin(alpha)
        ca = trig.cos(alpha)
        return along * s**2 + across * ca**2, along * s * c - across * sa * ca, along * c**2 + across * sa**2

    stiff = triple(number(one["stiffness"]), number(other["stiffness"]))
    damped = triple(number(one["damping"]), number(other["damping"]))
    contact = 2 * number(tables["contact"]["half_length"]) * number(tables["contact"]["stiffness"])
    grip = number(tables["friction"]["coefficient"]) * (1 if tables["wheel"]["angular_speed"] > 0 else -1)
    load = number(tables["load"]["force"])
    return (
        number(tables["shoe"]["mass"]),
        stiff,
        damped,
        contact,
        (load * trig.sin(beta), load * trig.cos(beta)),
        grip,
    )


def smooth_is_unstable(tables: Tables) -> bool:
    """Whether steady sliding on smooth surfaces is unstable, or has ended."""
    with mpmath.workdps(50):
        m, (cxx, cxy, cyy), (bxx, bxy, byy), contact, _, grip = held_by(tables, mpmath.mpf, mpmath)
        above = cxy + grip * contact
        below = cyy + contact
        a4 = m * m
        a3 = m * (bxx + byy)
        a2 = m * (cxx + below) + bxx * byy - bxy**2
        a1 = bxx * below + byy * cxx - bxy * (cxy + above)
        a0 = cxx * below - cxy * above
        if a3 == 0:
            return bool(a0 <= 0 or a2 * a2 <= 4 * a4 * a0)
        return bool(a0 <= 0 or a1 <= 0 or a1 * a2 * a3 - a1**2 * a4 - a0 * a3**2 <= 0)


class Wheel:
    """The motion that the wheel of a case forces, by its period."""

    def __init__(self, tables: Tables, part: float = 1.0) -> None:
        """`part`: of the amplitudes of the wheel."""
        m, stiff, damped, contact, load, grip = held_by(tables)
        rough = tables["roughness"]
        half = tables["contact"]["half_length"]
        cell = 2.0 * half / CELLS
        self.belt = tables["wheel"]["radius"] * tables["wheel"]["angular_speed"]
        self.links = np.array([m, *stiff, *damped, *load, grip, self.belt, tables["contact"]["stiffness"], cell])
        place = np.linspace(-half, half, CELLS + 1)

        def waves(name: str) -> Floats:
            omega = 2.0 * np.pi / np.array(rough[name]["wavelengths"])
            flat = np.tan(0.5 * omega * cell) / (0.5 * omega * cell)  # straight lines cut the crests off
            phases = rough[name].get("phases_deg", [0.0] * len(omega))
            return np.array([np.array(rough[name]["amplitudes"]) * flat, omega, np.radians(phases)])

        self.waves = waves("wheel")
        self.waves[0] *= part
        self.sines, self.cosines = (each(np.outer(self.waves[1], place)) for each in (np.sin, np.cos))
        self.shoe = np.zeros(CELLS + 1)
        if "shoe" in rough:
            self.shoe = sum(g * np.sin(w * place + p) for g, w, p in waves("shoe").T)
        lengths = [round(1000.0 * each) for each in rough["wheel"]["wavelengths"]]
        self.period = 1e-3 * math.lcm(*lengths) / abs(self.belt)
        fast = math.sqrt((stiff[0] + stiff[2] + contact) / m) / 2.0 / math.pi
        self.steps = math.ceil(self.period * STEPS * max(fast, 1000.0 * abs(self.belt) / min(lengths)))
        size = math.hypot(*load) / (stiff[2] + contact)
        self.scales = size * np.array([1.0, 1.0, *[2.0 * math.pi * fast] * 2])
        pressed = np.array([[stiff[0], stiff[1] + grip * contact], [stiff[1], stiff[2] + contact]])
        self.rest = np.array([*np.linalg.solve(pressed, -np.array(load)), 0.0, 0.0])
        symmetric = np.array([[stiff[0], stiff[1]], [stiff[1], stiff[2] + contact]]) / m
        slow = math.sqrt(max(np.linalg.eigvalsh(symmetric)[0], 0.0))
        self.level = 0.0 if any(damped) else NEUTRAL * slow

    def passed(self, state: Floats) -> tuple[Floats, float]:
        """State and tangent after a period, and the least slip."""
        arrays = (self.waves, self.sines, self.cosines, self.shoe)
        z, slip = _passed(state, self.links, *arrays, self.period / self.steps, self.steps)
        return z, float(slip)

    def closed(self, state: Floats) -> tuple[Floats, Floats, float] | None:
        """The periodic motion near a state, its tangent over a period and its least slip."""
        z, slip = self.passed(state)
        for _ in range(15):
            gap = np.abs((z[:, 0] - state) / self.scales).max()
            if not np.isfinite(z).all():
                return None
            if gap < 1e-9:
                return state, z[:, 1:], slip
            change = np.linalg.solve(np.eye(4) - z[:, 1:], z[:, 0] - state)
            for part in (1.0, 0.5, 0.2, 0.05):
                moved, slip = self.passed(state + part * change)
                if np.abs((moved[:, 0] - state - part * change) / self.scales).max() < gap:
                    state = state + part * change
                    z = moved
                    break
            else:
                return (state, z[:, 1:], slip) if gap < 1e-6 else None
        return None


def forced(tables: Tables, near: Floats | None = None) -> tuple[float, Floats]:
    """The growth rate (1/s), less what counts as none, and a state of the forced motion.

    The motion near a state is tried first, then the one that grows out of steady sliding with the waves.
    """
    wheel = Wheel(tables)
    found = wheel.closed(near) if near is not None else None
    part = 0.0
    stride = 0.5
    state = wheel.rest
    while found is None and stride > 0.01:
        more = min(part + stride, 1.0)
        grown = Wheel(tables, more).closed(state)
        if grown is None:
            stride *= 0.5
        else:
            part = more
            state = grown[0]
            found = grown if more == 1.0 else None
    if found is None:  # a stable one is reached by waiting
        state = wheel.rest
        for _ in range(60):
            state = wheel.passed(state)[0][:, 0]
        found = wheel.closed(state)
    assert found is not None
    assert found[2] > 0.0  # it slips to one side
    return math.log(float(np.abs(np.linalg.eigvals(found[1])).max())) / wheel.period - wheel.level, found[0]
