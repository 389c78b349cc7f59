"""A small evaluator for the test of the registry: smooth surfaces, the layer as one spring."""

from brakecli.solver.arrays import Floats
from brakecli.solver.contact import kinds
from brakecli.solver.kernels import kernel
from brakecli.solver.records import Layer

KIND = kinds().index("spring")  # a file is imported when its row is there


@kernel
def evaluate(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    pad = layer.pad
    contact = layer.contact
    touching = 1.0 if y < 0.0 else 0.0
    contact.stiffness = touching * 2.0 * pad.half_length * pad.k
    contact.normal_force = -contact.stiffness * y
    contact.fraction = touching
    contact.store = -0.5 * contact.normal_force * y
    contact.tangential = contact.store_x = 0.0
    contact.kind = KIND
    contact.valid = 1 if pad.shoe_terms + pad.wheel_terms == 0 else 0
