"""What of the model a run has used, what it has left out, and why that was safe."""

from brakecli.solver.integrate import Motion
from brakecli.solver.schedules import values


def modelled(motion: Motion) -> tuple[list[str], list[str]]:
    """Sentences on what was modelled and on what was left out, by the system and by the steps that were taken."""
    system = motion.system
    work = motion.work
    c = system.coefficients
    smooth = system.smooth
    closed = work.evaluators.get("closed-form", 0)
    opened = sum(work.evaluators.values()) - closed
    neither = not smooth and not opened
    rough = f"rough contact of {len(system.shoe.g)} + {len(system.wheel.g)} waves"
    how = "exactly, patch by patch" if system.finds_patches else f"on {system.nodes} nodes"
    friction = "its changes located in time" if system.method.own_steps else "solved for in every step"
    used = {
        "flat contact in closed form": smooth,
        f"{rough}, {how}, in {opened} of {work.steps} steps": not smooth and opened,
        f"{rough} in closed form, in {closed} of {work.steps} steps": not smooth and closed,
        f"stick and slip as a set-valued law, {friction}": c.phi != 0.0,
    }
    left_out = {
        "quadrature of the contact: both surfaces are smooth": smooth,
        "quadrature of the contact: the pad touches everywhere, or nowhere, at every step": neither,
        "the shoe's own roughness, which cancels while the pad touches everywhere": neither and system.shoe.g.size,
        "stick and slip: there is no friction": c.phi == 0.0,
        "the wheel's phase: its surface is the same everywhere": system.wheel.g.size == 0,
        "the load: it is zero": not values(system.load).any(),
        "dashpots: they are zero": c.b_xx == 0.0 == c.b_yy,
    }
    return [text for text, holds in used.items() if holds], [text for text, holds in left_out.items() if holds]
