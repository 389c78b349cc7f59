"""The contact in closed form: smooth surfaces, or a pad that a bound proves to touch (or to clear) everywhere."""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.contact.heights import eights, phases
from brakecli.solver.kernels import kernel, stopped
from brakecli.solver.records import Contact, Layer, PadNumbers

CLEAR, PARTLY, FULL = range(3)


@kernel
def coverage(y: float, pad: PadNumbers) -> int:
    """FULL or CLEAR where bounds on the surfaces prove that the pad touches everywhere or nowhere, or PARTLY."""
    if y >= pad.clear_from:
        return CLEAR
    return FULL if y <= pad.full_up_to else PARTLY


@kernel
def full_contact(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """The pad touches everywhere: F_y = 2ak [-y - mean f1 + Σ g2 sinc(ω2 a) sin(ω2 (x - travel))]."""
    pad = layer.pad
    contact = layer.contact
    k = pad.k
    length = 2.0 * pad.half_length
    n = pad.wheel_terms
    omega_at = pad.wheel_at + n
    cosines_at = pad.sines_at + eights(layer)
    full_at = pad.full_at
    ss_at = pad.ss_at
    cc_at = pad.cc_at
    pr_at = pad.pr_at
    phases(x, layer, tables, scratch)
    sines = scratch[pad.sines_at : pad.sines_at + n]
    cosines = scratch[cosines_at : cosines_at + n]
    # k ∫ (f2 - f1) and its derivative by x
    mean_force = -k * length * pad.shoe_mean
    tangential = 0.0
    for i in range(n):
        mean_force += tables[full_at + i] * sines[i]
        tangential += tables[full_at + i] * tables[omega_at + i] * cosines[i]
    # ∫ (f2 - f1)² and its derivative by x
    square = pad.shoe_square
    square_x = 0.0
    for i in range(n):
        if stopped(pad.signals):
            return
        ss = -tables[pr_at + i]
        cc = -tables[pr_at + n + i]
        square += cosines[i] * ss + sines[i] * cc
        for j in range(n):
            ss += tables[ss_at + i * n + j] * cosines[j]
            cc += tables[cc_at + i * n + j] * sines[j]
        square += cosines[i] * ss + sines[i] * cc
        square_x += 2.0 * tables[omega_at + i] * (cosines[i] * cc - sines[i] * ss)
    # Eq. (2); zero where rounding, or a pad that touches in part, makes the sum negative.
    contact.normal_force = max(mean_force - k * length * y, 0.0)
    contact.stiffness = k * length
    contact.tangential = tangential
    contact.fraction = 1.0
    contact.store = 0.5 * k * (square + length * y * y) - y * mean_force
    contact.store_x = 0.5 * k * square_x - y * tangential
    contact.kind = CLOSED_FORM
    contact.valid = 1
    contact.near = 0.0 if y + contact.reach <= pad.full_up_to else k * length
    contact.blur = 0.0


@kernel
def full_press(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """`full_contact` without what is stored."""
    pad = layer.pad
    contact = layer.contact
    length = 2.0 * pad.half_length
    n = pad.wheel_terms
    omega_at = pad.wheel_at + n
    cosines_at = pad.sines_at + eights(layer)
    force = -pad.k * length * (pad.shoe_mean + y)
    tangential = 0.0
    phases(x, layer, tables, scratch)
    for i in range(n):
        force += tables[pad.full_at + i] * scratch[pad.sines_at + i]
        tangential += tables[pad.full_at + i] * tables[omega_at + i] * scratch[cosines_at + i]
    # Eq. (2)
    contact.normal_force = max(force, 0.0)
    contact.stiffness = pad.k * length
    contact.tangential = tangential
    contact.fraction = 1.0
    contact.kind = CLOSED_FORM
    contact.valid = 1


@kernel
def clear(contact: Contact) -> None:
    """The pad touches nowhere: no force, nothing stored."""
    contact.normal_force = contact.stiffness = contact.tangential = contact.fraction = 0.0
    contact.store = contact.store_x = 0.0
    contact.near = math.inf
    contact.blur = 0.0
    contact.kind = CLOSED_FORM
    contact.valid = 1


@kernel
def evaluate(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """See the package; `valid` is 0 where a rough pad may touch in part, which this evaluator cannot know."""
    covered = coverage(y, layer.pad)
    if covered == CLEAR:
        clear(layer.contact)
    else:
        full_contact(x, y, layer, tables, scratch)
        if covered == PARTLY:
            layer.contact.valid = 0
