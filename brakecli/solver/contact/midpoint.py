"""The contact by the midpoint rule on cell means: the plain quadrature, for who asks for it by name.

The mean of the gap over a cell is that at both of its edges (`pad.flattened`). Where it is positive the cell
touches as a whole, so that the error falls with the square of its length.
"""

from brakecli.solver.arrays import Floats
from brakecli.solver.contact import MIDPOINT
from brakecli.solver.contact.cells import note, note_more
from brakecli.solver.contact.heights import rises
from brakecli.solver.contact.pad import BESIDE
from brakecli.solver.kernels import FAST, kernel
from brakecli.solver.records import Layer


@kernel(fastmath=FAST)
def _sums(y: float, reach: float, gap: Floats, rises: Floats) -> tuple[float, float, float, float, float, float]:
    """Sums over the touching cells of: gap, 1, gap², rise of f2, gap times rise; and the cells within reach."""
    force = 0.0
    touching = 0.0
    square = 0.0
    rise = 0.0
    work = 0.0
    near = 0.0
    for j in range(gap.size - 1):
        mean = 0.5 * (gap[j] + gap[j + 1]) - y
        near += 1.0 if abs(mean) <= reach else 0.0
        touch = 1.0 if mean > 0.0 else 0.0
        mean = mean if mean > 0.0 else 0.0
        across = 0.5 * (rises[j] + rises[j + 1])
        force += mean
        touching += touch
        square += mean * mean
        rise += touch * across
        work += mean * across
    return force, touching, square, rise, work, near


@kernel
def evaluate(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """See the package. ∂F_y/∂x and ∂V/∂x take the slope of f2 from the neighbouring edges."""
    pad = layer.pad
    n = layer.pad.nodes
    rises(x, layer, tables, scratch)
    gap = scratch[BESIDE : BESIDE + n + 1]
    slopes = scratch[pad.parts_at : pad.parts_at + n + 1]
    force, touching, square, rise, work, near = _sums(y, layer.contact.reach, gap, slopes)
    note(MIDPOINT, force, touching, layer)
    note_more(square, rise, work, near, layer)
