"""What of the model a run has used, what it has left out, and why that was safe."""

from brakecli.solver.motion import Motion

_OWN = "exact"


def modelled(motion: Motion) -> tuple[list[str], list[str]]:
    """Sentences on what was modelled and on what was left out, by the system and by the steps that were taken."""
    system, work = motion.system, motion.work
    c = system.coefficients
    used, left = [], []
    kinds = work.evaluators
    if system.smooth:
        used.append("flat contact in closed form")
        left.append("quadrature of the contact: both surfaces are smooth")
    else:
        waves = f"{len(system.shoe.g)} + {len(system.wheel.g)} waves"
        open_steps = sum(count for kind, count in kinds.items() if kind != "closed-form")
        if open_steps:
            how = "exactly, patch by patch" if _OWN in kinds else f"on {system.nodes} nodes"
            used.append(f"rough contact of {waves}, {how}, in {open_steps} of {work.steps} steps")
        if closed := kinds.get("closed-form", 0):
            used.append(f"rough contact of {waves} in closed form, in {closed} of {work.steps} steps")
        if not open_steps:
            left.append("quadrature of the contact: the pad touches everywhere, or nowhere, at every step")
            if system.shoe.g.size:
                left.append("the shoe's own roughness, which cancels while the pad touches everywhere")
    if c.phi == 0.0:
        left.append("stick and slip: there is no friction")
    elif system.method.own_steps:
        used.append("stick and slip as a set-valued law, its changes located in time")
    else:
        used.append("stick and slip as a set-valued law, solved for in every step")
    if system.wheel.g.size == 0:
        left.append("the wheel's phase: its surface is the same everywhere")
    if not system.load["value"].any():
        left.append("the load: it is zero")
    if c.b_xx == 0.0 == c.b_yy:
        left.append("dashpots: they are zero")
    return used, left
