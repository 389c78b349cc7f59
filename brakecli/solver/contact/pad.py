"""The pad: constants in a record, tables in one flat buffer of doubles, and the layer that an evaluator works on.

The constants named ..._at are where a table begins in it.
"""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from brakecli import stop
from brakecli.solver.arrays import Floats
from brakecli.solver.contact import EVALUATORS, place_of
from brakecli.solver.records import Contact, Layer, PadNumbers, new
from brakecli.solver.roughness import Surface, height

TILE = 72
"""Edges of cells in a piece of the tables of the wheel."""
BESIDE = 8
"""Edges of cells beyond each end of the pad."""
RISE: tuple[float, ...] = tuple(
    -((-1.0) ** i) / i * math.comb(2 * BESIDE, BESIDE - i) / math.comb(2 * BESIDE, BESIDE)
    for i in range(1, BESIDE + 1)
)
"""What differences of heights at the edges to both sides make of a slope, by a polynomial through all of them.

With z = ωc it misses that of a sine by z^16 (8!)²/17!: 2e-15 of it with 24 cells to a wave, and 1e-7 with 8.
"""

MOST_SUMMED = 10
"""Waves of the wheel up to which their sums at all edges are as fast as a window."""
POINTS = 12
"""Points from which a height in a window is interpolated."""
NODES = 64
"""Fewest nodes, of which all numbers of nodes are multiples; a choice."""


def fewest_nodes(half_length: float, shoe: Surface, wheel: Surface) -> int:
    """Fewest quadrature nodes, an even number as all are.

    There are four to the shortest wave: heights at the edges of cells half a wave long know nothing of it.
    """
    return 2 * max(1, math.ceil(4 * half_length * max([*shoe.turns, *wheel.turns], default=0.0)))


def default_nodes(evaluator: str, half_length: float, shoe: Surface, wheel: Surface) -> int:
    """Quadrature nodes for the shortest wavelength of both surfaces, a multiple of `NODES`."""
    waves = 2.0 * half_length * max([*shoe.turns, *wheel.turns], default=0.0)
    return NODES * max(1, math.ceil(EVALUATORS[evaluator].nodes_per_wave * waves / NODES - 1e-9))


class Pad(NamedTuple):
    """Constants, and tables of a pad on its wheel."""

    constants: PadNumbers
    tables: Floats


def build_pad(k: float, half_length: float, shoe: Surface, wheel: Surface, nodes: int) -> Pad:
    """The pad for stiffness k (N/m²), half length (m) and surfaces; `nodes` = 0 without quadrature tables."""
    pad = new(PadNumbers)
    pad.k = k
    pad.half_length = half_length
    pad.nodes = nodes
    pad.shoe_terms = shoe.g.size
    pad.wheel_terms = wheel.g.size
    pad.signals = np.frombuffer(stop.memory, np.uint8).ctypes.data
    top, bottom = _shoe_bounds(half_length, shoe)
    pad.steep, pad.curved = (float(np.abs(wheel.g) @ wheel.omega**n) for n in (1, 2))
    # cells of which the exact contact keeps what it has found: four to the shortest wave
    cells = max(8.0, 4.0 * 2.0 * half_length * max([*shoe.turns, *wheel.turns], default=0.0))
    pad.cell = 2.0 * half_length / cells
    pad.cells = min(math.ceil(cells), 2**16)
    waves = wheel.g.size
    tiles = -(-(nodes // 2 + 1 + BESIDE) // TILE) if nodes else 0
    pad.columns = TILE * tiles
    pad.parts_at = (nodes + 1 + 2 * BESIDE + 7) // 8 * 8
    pad.sines_at = pad.parts_at + 2 * pad.columns
    pad.edges_at = pad.sines_at + 2 * (waves + 7)  # behind what the other evaluators keep
    shapes = {
        "waves_at": (tiles, waves, 2, TILE),  # first, for its tiles must be aligned
        "gap_at": (3 * (waves + shoe.g.size),),
        "wheel_at": (2 * waves,),
        "full_at": (waves,),
        "ss_at": (waves, waves),
        "cc_at": (waves, waves),
        "pr_at": (2 * waves,),
        "nodes_at": (nodes + 1 + 2 * BESIDE if nodes else 0,),
        "rises_at": (nodes + 1 if nodes else 0,),
        "nothing_at": (TILE,),
        "turns_at": (3 * waves,),
    }
    # Large tables are made in their place: a copy of gigabytes would not hear a signal.
    flat = aligned(sum(map(math.prod, shapes.values())))
    table = dict[str, Floats]()
    begin = 0
    for name, shape in shapes.items():
        setattr(pad, name, begin)
        size = math.prod(shape)
        table[name] = flat[begin : begin + size].reshape(shape)
        begin += size
    table["gap_at"][:] = np.concatenate(
        [wheel.g, -shoe.g, wheel.omega, shoe.omega, np.zeros(waves), shoe.phase],
    )
    table["turns_at"][:] = wheel.waves
    table["wheel_at"][:] = np.concatenate([wheel.g, wheel.omega])
    table["full_at"][:] = 2.0 * half_length * k * wheel.g * np.sinc(wheel.omega * half_length / np.pi)
    into = table["ss_at"], table["cc_at"]
    table["pr_at"][:], pad.shoe_mean, pad.shoe_square = _products(half_length, shoe, wheel, into)
    if nodes:
        cell = 2.0 * half_length / nodes
        pad.rows = window_rows(wheel, cell)
        _edge_tables(cell, flattened(shoe, cell), flattened(wheel, cell), table["nodes_at"], table["waves_at"])
        wheel = flattened(wheel, cell)
        turns = np.sin(np.outer(np.arange(1.0, BESIDE + 1.0), wheel.omega * cell))
        pad.rise_error = float(np.abs(wheel.g) @ np.abs(wheel.omega - 2.0 * np.array(RISE) @ turns / cell))
        f1 = table["nodes_at"][BESIDE:-BESIDE]
        for i, weight in enumerate(RISE, 1):
            ahead, behind = (table["nodes_at"][BESIDE + n :][: nodes + 1] for n in (i, -i))
            table["rises_at"][:] += weight * (ahead - behind)
        top = max(top, float(f1.max()))
        bottom = max(bottom, float(-f1.min()))
    pad.shoe_bound = max(top, bottom)
    pad.wheel_bound = np.abs(wheel.g).sum()
    pad.full_up_to = -pad.wheel_bound - top
    pad.clear_from = pad.wheel_bound + bottom
    pad.crest = pad.shoe_bound + pad.wheel_bound
    return Pad(pad, flat)


def flattened(surface: Surface, cell: float) -> Surface:
    """The profile whose heights at both edges of a cell (m) have the mean of that over the cell, everywhere.

    The mean of a sine is that in the middle times sin(z)/z with z = ωc/2, that of both edges cos(z) times it: the
    amplitude becomes g tan(z)/z. So the force of a pad that touches everywhere is the closed form.
    """
    z = 0.5 * surface.omega * cell
    return surface._replace(g=surface.g * np.tan(z) / z)


def interpolation_error(wheel: Surface, spacing: float) -> float:
    """Upper bound (m) of the error of heights that are interpolated from a grid of this spacing (m).

    Between the middle ones of 2n points a polynomial through all of them misses a sine by at most (ω spacing)^2n /
    (2n)! times the product of 1/4, 9/4, …, (n - 1/2)²: Lagrange's remainder.
    """
    middle = math.prod((i + 0.5) ** 2 for i in range(POINTS // 2))
    return float(np.abs(wheel.g) @ (wheel.omega * spacing) ** POINTS) * middle / math.factorial(POINTS)


def window_rows(wheel: Surface, spacing: float) -> int:
    """Points of a window's grid to a cell of this length (m); 0 without window: few waves, or too short ones."""
    if wheel.g.size <= MOST_SUMMED:
        return 0
    allowed = 1e-15 * float(np.abs(wheel.g).sum())  # rounding
    wheel = flattened(wheel, spacing)
    return next((rows for rows in (1, 2, 4, 8, 16) if interpolation_error(wheel, spacing / rows) <= allowed), 0)


def window_width(nodes: int) -> int:
    """Edges of a window, in whole tiles: three times as many as are needed at once."""
    return 3 * TILE * (-(-(nodes + 1 + 2 * BESIDE + POINTS) // TILE) + 1)


class ContactLayer(NamedTuple):
    """The springs of a pad: a record of `Layer`, and the two arrays that its kernels get with it."""

    layer: Layer
    tables: Floats
    scratch: Floats

    @property
    def contact(self) -> Contact:
        """The contact of the last evaluation."""
        return self.layer.contact

    @property
    def angles(self) -> Floats:
        """The phases of the wheel's harmonics, rad."""
        begin = int(self.layer.angles_at)
        return self.scratch[begin : begin + int(self.layer.pad.wheel_terms)]


def build_layer(evaluator: str, pad: Pad, *, moving: bool = False, room: int = 0) -> ContactLayer:
    """What an evaluator works on and fills for this pad, with room for further numbers at the end of the scratch.

    A `moving` one may have a window: places that follow each other are near each other.
    """
    constants, tables = pad
    waves = constants.shoe_terms + constants.wheel_terms
    layer = new(Layer)
    layer.evaluator = place_of(evaluator)
    layer.pad = constants
    window = layer.window
    rows = int(constants.rows) if moving else 0
    size = int(constants.edges_at + 8 * waves + 6 + 3 * constants.cells)
    if rows:
        window.rows = rows
        window.shift = rows.bit_length() - 1
        window.width = window_width(constants.nodes)
        window.spacing = 2.0 * constants.half_length / constants.nodes / rows
        window.at = (size + POINTS + 7) // 8 * 8
        size = int(window.at + rows * window.width)
    layer.angles_at = size
    layer.contact.near = math.inf  # an evaluator that does not know it leaves it
    return ContactLayer(layer, tables, aligned(size + int(constants.wheel_terms) + room))


def aligned(size: int) -> Floats:
    """Zeros that begin where a line of the cache does: reading across lines costs a loop a third of its speed."""
    zeros = np.zeros(size + 8)
    begin = -zeros.ctypes.data // 8 % 8
    return zeros[begin : begin + size]


@lru_cache(maxsize=64)
def _shoe_bounds(a: float, shoe: Surface) -> tuple[float, float]:
    """Upper bounds (m) of f1 and of -f1 on the pad: a fine grid and what curvature can add between its points.

    It has 64 points to the shortest wave.
    They take as long as a short run, and are those of other nodes as well.
    """
    if shoe.g.size == 0:
        return 0.0, 0.0
    xi = np.linspace(-a, a, min(1 + 64 * max(1, math.ceil(2.0 * a * max(shoe.turns))), 10**6))
    f = height(shoe, xi)
    between = float(np.abs(shoe.g) @ shoe.omega**2) * (xi[1] - xi[0]) ** 2 / 8.0
    crest = float(np.abs(shoe.g).sum())
    return min(float(f.max()) + between, crest), min(float(-f.min()) + between, crest)


def _pieces(rows: int, wide: int = 1) -> Iterator[slice]:
    """Rows of `wide` columns, by pieces between which a signal is heard."""
    step = 1 + 100_000 // (1 + wide)  # pairs of waves, or nodes
    return (slice(i, min(i + step, rows)) for i in range(0, rows, step))


def _edge_tables(cell: float, shoe: Surface, wheel: Surface, f1: Floats, waves: Floats) -> None:
    """f1 at all edges, with edges beyond both ends, and g sin(omega xi), g cos(omega xi) of the wheel at those
    from the middle on: by tiles, waves, sine and cosine, and edges.
    """
    for piece in _pieces(f1.size):
        xi = cell * (np.arange(piece.start, piece.stop) - f1.size // 2)
        for g, omega, phase in zip(shoe.g, shoe.omega, shoe.phase, strict=True):
            f1[piece] += g * np.sin(omega * xi + phase)
    for piece in _pieces(len(waves), TILE):
        xi = cell * np.arange(TILE * piece.start, TILE * piece.stop)
        for i, (g, omega) in enumerate(zip(wheel.g, wheel.omega, strict=True)):
            waves[piece, i] = np.stack([g * f(omega * xi).reshape(-1, TILE) for f in (np.sin, np.cos)], 1)


def _products(a: float, shoe: Surface, wheel: Surface, into: tuple[Floats, Floats]) -> tuple[Floats, float, float]:
    """Integrals over the pad of products of harmonics (m³), for the store of a fully touching pad.

    With S = g sin(omega xi), C = g cos(omega xi) of the wheel: ∫ S S and ∫ C C (`into` these), (∫ S f1, ∫ C f1),
    ∫ f1 (per pad length), ∫ f1². ∫ S C and ∫ S are zero by symmetry.
    """

    def pair(f: Surface, h: Surface, sines: Floats, cosines: Floats) -> None:
        """∫ sin sin and ∫ cos cos."""
        for piece in _pieces(f.g.size, h.g.size):
            minus = np.sinc(np.subtract.outer(f.omega[piece], h.omega) * a / np.pi)
            plus = np.sinc(np.add.outer(f.omega[piece], h.omega) * a / np.pi)
            g = a * np.outer(f.g[piece], h.g)
            sines[piece] = g * (minus - plus)
            cosines[piece] = g * (minus + plus)

    sin_1 = np.sin(shoe.phase)
    cos_1 = np.cos(shoe.phase)
    pair(wheel, wheel, *into)
    pair(wheel, shoe, *(mixed := np.empty((2, wheel.g.size, shoe.g.size))))
    pair(shoe, shoe, *(own := np.empty((2, shoe.g.size, shoe.g.size))))
    mean = float(np.sum(shoe.g * sin_1 * np.sinc(shoe.omega * a / np.pi)))
    square = float(cos_1 @ own[0] @ cos_1 + sin_1 @ own[1] @ sin_1)
    return np.concatenate([mixed[0] @ cos_1, mixed[1] @ sin_1]), mean, square
