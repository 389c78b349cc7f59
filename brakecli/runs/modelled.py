"""What of the model a run has used, what it has left out, and why that was safe."""

from brakecli.case.case import Scheme
from brakecli.case.system import Setup
from brakecli.solver.motion import Work

_OWN = "exact"


def scene(setup: Setup, work: Work) -> tuple[list[str], list[str]]:
    """Sentences on what was modelled and on what was left out, by the case and by the steps that were taken."""
    case = setup.case
    used, left = [], []
    kinds = work.evaluators
    if setup.smooth:
        used.append("flat contact in closed form")
        left.append("quadrature of the contact: both surfaces are smooth")
    else:
        waves = f"{len(setup.shoe.g)} + {len(setup.wheel.g)} waves"
        open_steps = sum(count for kind, count in kinds.items() if kind != "closed-form")
        if open_steps:
            how = "exactly, patch by patch" if _OWN in kinds else f"on {setup.nodes} nodes"
            used.append(f"rough contact of {waves}, {how}, in {open_steps} of {work.steps} steps")
        if closed := kinds.get("closed-form", 0):
            used.append(f"rough contact of {waves} in closed form, in {closed} of {work.steps} steps")
        if not open_steps:
            left.append("quadrature of the contact: the pad touches everywhere, or nowhere, at every step")
            if setup.shoe.g.size:
                left.append("the shoe's own roughness, which cancels while the pad touches everywhere")
    if case.friction.coefficient == 0.0:
        left.append("stick and slip: there is no friction")
    elif case.solver.scheme in (Scheme.EVENT_DRIVEN, Scheme.AUTO):
        used.append("stick and slip as a set-valued law, its changes located in time")
    else:
        used.append("stick and slip as a set-valued law, solved for in every step")
    if setup.wheel.g.size == 0:
        left.append("the wheel's phase: its surface is the same everywhere")
    if not setup.load["value"].any():
        left.append("the load: it is zero")
    if not (case.link1.damping or case.link2.damping):
        left.append("dashpots: they are zero")
    return used, left
