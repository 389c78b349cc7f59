"""The text of docs/paper-claims.md: prose that is fixed here, numbers and tables from the results."""

import math
from itertools import product
from pathlib import Path

import numpy as np
import xarray as xr
from paper_results import (
    ALPHA,
    BETA,
    BOTH,
    C1,
    C2,
    FIRST,
    PAD,
    RATIOS,
    SECOND,
    Array,
    K,
    Results,
    flutter,
    least,
    nonlinearity,
    touching,
)

RANGES = (10.0, 20.0, 30.0)
FIRST_ANGLE = 2.0
"""Degrees: from this angle on straight lines are drawn through the values."""
KB = 0.2 * C1
TAN5 = math.tan(math.radians(5.0))


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table of the page."""
    return "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---"] * len(head), *rows])


def number(value: float, digits: int = 4) -> str:
    """A number of the page; a dash where there is none."""
    return "–" if math.isnan(value) else f"{value:.{digits}f}"


def touching_by_load(results: Results) -> list[float]:
    """K over 2ak at the critical friction coefficient, for every load of load-rough."""
    data = results["load-rough"]
    return [
        touching("rough", load={"force": float(force)}, friction={"coefficient": float(phi)})
        for force, phi in zip(data.load_force.values, data.critical_eigenvalue.values, strict=True)
    ]


def agreement(results: Results) -> str:
    """How far simulation and eigenvalues are apart, over all points; those beyond the error bar one by one."""
    apart = []
    beyond = []
    count = 0
    for name, data in sorted(
        [
            *results.sweeps.items(),
            *(
                (f"least {key:g}" if isinstance(key, float) else f"least {key}", data)
                for key, data in results.refined.items()
            ),
        ]
    ):
        if "critical" not in data or name == "ratio-eigenvalues":
            continue
        places = list(product(*(data[axis].values for axis in data.critical.dims)))
        for place, found, exact, error in zip(
            places,
            data.critical.values.ravel(),
            data.critical_eigenvalue.values.ravel(),
            data.critical_error.values.ravel(),
            strict=True,
        ):
            count += 1
            if math.isnan(found) and math.isnan(exact):
                continue
            if abs(found - exact) <= error:
                apart.append(abs(found - exact) / exact)
                continue
            settings = ", ".join(
                f"{axis} {value:g}" for axis, value in zip(data.critical.dims, place, strict=True)
            )
            beyond.append([f"`{name}`", f"`{settings}`", number(found), number(exact), number(error)])
    half = 100.0 * float(np.median(apart))
    close = f"agree within {half:.1g} % of the value" if half > 1e-9 else "to rounding"
    text = (
        f"Simulation and eigenvalues were compared at {count} points. At {count - len(beyond)} they agree within\n"
        "the error bar of the simulation, or neither finds a critical coefficient in the range searched (half of\n"
        f"them {close}); at {len(beyond)} they do not"
    )
    if not beyond:
        return text.replace("; at 0 they do not", "; there is no exception") + "."
    head = ["sweep", "point", "simulation", "eigenvalues", "error bar"]
    return text + ":\n\n" + table(head, beyond)


def regimes(results: Results) -> str:
    """How often each regime was found."""
    rows = []
    critical = float(results["beta-flat"].critical_eigenvalue.sel({BOTH: 300.0, BETA: 0.0}))
    for name, words in (("regimes-flat", "smooth"), ("regimes-rough", "rough, full contact")):
        data = results[name]
        above = data.friction_coefficient > critical
        for side, part in (
            ("below", data.sel(friction_coefficient=~above)),
            ("above", data.sel(friction_coefficient=above)),
        ):
            found = part.regime.values.ravel().tolist()
            counts = [
                str(found.count(regime)) for regime in ("damped", "relaxation", "quasi-harmonic", "undecided")
            ]
            rows.append([words, side, *counts])
    head = ["surfaces", f"φ against {critical:.4f}", "damped", "relaxation", "quasi-harmonic", "undecided"]
    text = table(head, rows)
    reasons = []
    for name in ("regimes-flat", "regimes-rough"):
        data = results[name]
        for i, j in np.argwhere(data.regime.values == "undecided"):
            phi = float(data.friction_coefficient[i])
            speed = 0.5 * float(data.wheel_angular_speed[j])
            reasons.append(f"- `{name}`, φ = {phi:g}, U = {speed:.3g} m/s: {data.reason.values[i, j]}")
    return text + ("\n\nUndecided, with the reason:\n\n" + "\n".join(reasons) if reasons else "")


def alpha_smooth(results: Results) -> str:
    """Smooth surfaces at c2 = c1 + K."""
    at = results["alpha-flat"].sel({C2: 1.2e7})
    none = at.sel({BOTH: 0.0})
    both = at.sel({BOTH: 300.0})
    rows = [
        [
            f"{angle:g}",
            number(6.0 * math.tan(math.radians(angle))),
            *(
                number(float(data[name][i]))
                for data in (none, both)
                for name in ("critical", "critical_eigenvalue")
            ),
            number(float(both.critical_sustained[i])),
        ]
        for i, angle in enumerate(at[ALPHA].values)
    ]
    head = [
        "α (°)",
        "(1 + c1/K) tan α",
        "no dashpots, simulation",
        "no dashpots, eigenvalues",
        "with dashpots, simulation",
        "with dashpots, eigenvalues",
        "with dashpots, lasts from",
    ]
    return table(head, rows)


def alpha_rough(results: Results) -> str:
    """Rough surfaces at c2 = c1 + K."""
    rough = results["alpha-rough"]
    opened = results["alpha-open"]
    rows = []
    for i, angle in enumerate(rough[ALPHA].values):
        row = [f"{angle:g}"]
        for data, damping in product((rough, opened), (0.0, 300.0)):
            at = data.sel({BOTH: damping})
            row += [number(float(at.critical[i])), number(float(at.critical_eigenvalue[i]))]
        rows.append(row)
    names = [
        f"{words}, {how}"
        for words in ("full, no dashpots", "full, with", "open, no dashpots", "open, with")
        for how in ("simulation", "eigenvalues")
    ]
    return table(["α (°)", *names], rows)


def straightness(results: Results) -> str:
    """Distances from straight lines in α."""
    flat = results["alpha-flat"]
    rows = []

    def add(words: str, angle: Array, friction: Array) -> None:
        kept = angle >= FIRST_ANGLE
        x = angle[kept]
        y = friction[kept]
        pairs = [f"{nonlinearity(x, y, reach, affine):.1f}" for affine in (False, True) for reach in RANGES]
        rows.append([words, *pairs])

    angle = flat[ALPHA].values
    for c2 in flat[C2].values:
        for damping in (0.0, 300.0):
            words = f"smooth, c2/c1 = {c2 / C1:g}, {'with' if damping else 'no'} dashpots"
            add(words, angle, flat.critical.sel({C2: c2, BOTH: damping}).values)
    one = results["alpha-one"].isel({C2: 0})
    for first, second in ((300.0, 0.0), (0.0, 300.0)):
        curve = one.critical.sel({FIRST: first, SECOND: second})
        add(f"smooth, c2/c1 = 1.5, b{1 if first else 2} alone", one[ALPHA].values, curve.values)
    for name, words, dampings in (
        ("alpha-rough", "rough, full contact, c2/c1 = 1.2", (0.0, 300.0)),
        ("alpha-open", "rough, partly open, c2/c1 = 1.2", (300.0,)),
    ):
        for damping in dampings:
            data = results[name]
            add(
                f"{words}, {'with' if damping else 'no'} dashpots",
                data[ALPHA].values,
                data.critical.sel({BOTH: damping}).values,
            )
    head = ["", *(f"{line} {reach:g}°" for line in ("through 0, to", "any line, to") for reach in RANGES)]
    return table(head, rows)


def beta(results: Results) -> str:
    """By the angle of link 1."""
    data = results["beta-flat"]
    rough = results["beta-rough"]
    none = data.sel({BOTH: 0.0})
    both = data.sel({BOTH: 300.0})
    rows = []
    for i, angle in enumerate(data[BETA].values):
        closed = float(flutter(1.2e7, 5.0, float(angle), KB))
        values = [float(each[name][i]) for each in (none, both) for name in ("critical", "critical_eigenvalue")]
        there = rough.critical.sel({BOTH: 300.0}).to_series().get(angle, math.nan)
        rows.append([f"{angle:g}", *(number(value) for value in (closed, *values, float(there)))])
    head = [
        "β (°)",
        "closed form",
        "no dashpots, simulation",
        "no dashpots, eigenvalues",
        "with dashpots, simulation",
        "with dashpots, eigenvalues",
        "with dashpots, rough in full contact",
    ]
    return table(head, rows)


def beta_straightness(results: Results) -> str:
    """Distances from straight lines in β, and their slopes."""
    data = results["beta-flat"]
    rows = []
    for first in (-5.0, -15.0, -30.0):
        row = [f"{first:g}° to 4°"]
        for damping in (0.0, 300.0):
            part = data.critical.sel({BOTH: damping, BETA: slice(first, 4.0)})
            slope, height = np.polyfit(part[BETA].values, part.values, 1)
            away = np.abs(part.values - slope * part[BETA].values - height).max() / part.values.max()
            row += [f"{100.0 * away:.1f}", f"{math.degrees(slope):.2f}"]
        rows.append(row)
    head = ["", "no dashpots: distance (%)", "slope (1/rad)", "with dashpots: distance (%)", "slope (1/rad)"]
    return table(head, rows)


def locking(results: Results) -> str:
    """Divergence by the angle of link 1."""
    data = results["beta-locking"]
    rows = [
        [
            f"{angle:g}",
            *(
                number(float(value), 2)
                for value in (data.critical[0, i], data.critical[1, i], data.critical_eigenvalue[0, i])
            ),
        ]
        for i, angle in enumerate(data[BETA].values)
    ]
    return table(["β (°)", "no dashpots, simulation", "with dashpots, simulation", "eigenvalues, both"], rows)


def equal_links(results: Results, share: float) -> float:
    """The critical friction coefficient at c2 = c1 over the least one, without dashpots."""
    found = results["ratio-flat"].critical.sel({K: share * C1 / PAD, C2: C1, BOTH: 0.0})
    return float(found) / ((1.0 + 1.0 / share) * TAN5)


def dashpot_angle() -> float:
    """The angle (degrees) at which equal dashpots let the critical friction coefficient be least, c2 = c1 + K."""
    return 0.5 * math.degrees(math.asin(2.0 * 300.0 * math.sqrt(1.2e7 / 10.0) / 1.2e7))


def least_values(results: Results) -> str:
    """Where along c2 the critical friction coefficient is least, on smooth surfaces."""
    rows = []
    for share in RATIOS:
        data = results.refined[share].isel({K: 0})
        row = [f"{share:g}", number(1.0 + share), number((1.0 + 1.0 / share) * TAN5)]
        for damping in (0.0, 300.0):
            at = data.sel({FIRST: damping, SECOND: damping})
            found = [least(at[C2].values, at[name].values) for name in ("critical", "critical_eigenvalue")]
            row += [number(each.stiffness / C1) for each in found] + [number(each.friction) for each in found]
        rows.append([*row, f"{equal_links(results, share):.3f}"])
    head = ["K/c1", "1 + K/c1", "(1 + c1/K) tan 5°"]
    for words in ("no dashpots", "with dashpots"):
        head += [f"{words}: c2/c1, simulation", "eigenvalues", "least φ, simulation", "eigenvalues"]
    return table([*head, "φ at c2 = c1 over the least"], rows)


def least_rough(results: Results) -> str:
    """The same on rough surfaces, with dashpots."""
    smooth = results.refined[0.2].isel({K: 0}).sel({FIRST: 300.0, SECOND: 300.0})
    rows = []
    for words, data in (
        ("smooth", smooth),
        ("rough, full contact", results.refined["rough"].isel({FIRST: 0, SECOND: 0})),
        ("rough, partly open", results.refined["open"].isel({FIRST: 0, SECOND: 0})),
    ):
        found = [least(data[C2].values, data[name].values) for name in ("critical", "critical_eigenvalue")]
        name = "open" if "open" in words else "flat"
        changes = {"link2": {"stiffness": found[1].stiffness}, "friction": {"coefficient": found[1].friction}}
        part = touching(name, **changes)
        row = [words, number(part), number(1.0 + 0.2 * part)]
        rows.append(
            row + [number(each.stiffness / C1) for each in found] + [number(each.friction) for each in found]
        )
    head = [
        "surfaces",
        "K / 2ak",
        "1 + K/c1",
        "c2/c1, simulation",
        "eigenvalues",
        "least φ, simulation",
        "eigenvalues",
    ]
    return table(head, rows)


def single_dashpots(results: Results) -> str:
    """One dashpot alone: closed forms against both methods."""
    rows = []
    for share in RATIOS:
        fine = results.refined[share].isel({K: 0})
        wide = results["ratio-eigenvalues"].sel({K: share * C1 / PAD})
        row = [f"{share:g}"]
        for first, second in ((300.0, 0.0), (0.0, 300.0)):
            at = {FIRST: first, SECOND: second}
            worst = []
            for data, name in ((fine, "critical"), (wide, "critical_eigenvalue")):
                curve = data[name].sel(at)
                closed = (1.0 + 1.0 / share) * TAN5 * np.ones(curve.shape)
                if first:
                    closed = curve[C2].values * math.sin(math.radians(10.0)) / (2.0 * share * C1)
                known = ~np.isnan(curve.values)
                worst.append(float(np.abs(curve.values / closed - 1.0)[known].max()))
            row += [f"{each:.1e}" for each in worst]
        rows.append(row)
    head = ["K/c1", "b1 alone: simulation", "eigenvalues", "b2 alone: simulation", "eigenvalues"]
    return table(head, rows)


def lasting(results: Results) -> str:
    """Loss of stability, and lasting vibration from rest, by c2/c1."""
    data = results["ratio-flat"].sel({BOTH: 300.0})
    rows = []
    for i, c2 in enumerate(data[C2].values):
        row = [f"{c2 / C1:g}"]
        for share in RATIOS:
            at = data.sel({K: share * C1 / PAD})
            row += [number(float(at.critical[i])), number(float(at.critical_sustained[i]))]
        rows.append(row)
    head = ["c2/c1", *(f"{words} K/c1 = {share:g}" for share in RATIOS for words in ("stable to,", "lasts from,"))]
    return table(head, rows)


def load(results: Results, touched: list[float]) -> str:
    """By the load on rough surfaces."""
    data = results["load-rough"]
    rows = [
        [
            f"{force:g}",
            number(touched[i]),
            *(number(float(data[name][i])) for name in ("critical", "critical_eigenvalue", "critical_sustained")),
        ]
        for i, force in enumerate(data.load_force.values)
    ]
    return table(["Q (N)", "K / 2ak", "simulation", "eigenvalues", "lasts from"], rows)


def full_contact_shift(results: Results) -> float:
    """The largest distance of φ_cr by simulation on rough surfaces in full contact from that on smooth ones."""
    shifts = []
    for name in ("alpha-rough", "beta-rough", "ratio-rough"):
        data: xr.Dataset = results[name]
        shifts.append(float(np.abs(data.critical - data.critical_eigenvalue).max()))
    return max(shifts)


def page(results: Results, touched: list[float]) -> str:
    """The whole page."""
    at12 = results["alpha-flat"].sel({C2: 1.2e7})
    at12 = at12.sel({ALPHA: slice(FIRST_ANGLE, None)})
    angle = at12[ALPHA].values
    tangent = [nonlinearity(angle, at12.critical.sel({BOTH: 0.0}).values, reach, False) for reach in RANGES]
    damped = [nonlinearity(angle, at12.critical.sel({BOTH: 300.0}).values, reach, False) for reach in RANGES]
    smallest = least(
        *(
            results.refined[0.2].isel({K: 0}).sel({FIRST: 300.0, SECOND: 300.0})[name].values
            for name in (C2, "critical")
        )
    )
    opened = results.refined["open"].isel({FIRST: 0, SECOND: 0})
    least_open = least(opened[C2].values, opened.critical.values)
    base = results["load-rough"]
    equal = [equal_links(results, share) for share in RATIOS]
    template = Path(__file__).with_name("paper-claims.template.md").read_text()
    parts = {
        "tangent_10": f"{tangent[0]:.1f}",
        "tangent_20": f"{tangent[1]:.1f}",
        "tangent_30": f"{tangent[2]:.1f}",
        "damped_10": f"{damped[0]:.1f}",
        "soft_at": f"{100.0 * RATIOS[0]:.0f}",
        "soft_least": f"{(1.0 + 1.0 / RATIOS[0]) * TAN5:.1f}",
        "soft_angle": f"{math.degrees(math.atan(1.0 / (1.0 + 1.0 / RATIOS[0]))):.1f}",
        "soft_excess": f"{100.0 * (equal[0] - 1.0):.1f}",
        "stiff_excess": f"{equal[-1]:.0f}",
        "dashpot_angle": f"{dashpot_angle():.1f}",
        "agreement": agreement(results),
        "regimes": regimes(results),
        "alpha_smooth": alpha_smooth(results),
        "alpha_rough": alpha_rough(results),
        "straightness": straightness(results),
        "beta": beta(results),
        "beta_straightness": beta_straightness(results),
        "locking": locking(results),
        "least_values": least_values(results),
        "least_rough": least_rough(results),
        "single_dashpots": single_dashpots(results),
        "lasting": lasting(results),
        "load": load(results, touched),
        "shift": f"{full_contact_shift(results):.1e}",
        "least_smooth_at": number(smallest.stiffness / C1),
        "least_smooth": number(smallest.friction),
        "least_open_at": number(least_open.stiffness / C1),
        "least_open": number(least_open.friction),
        "load_rise": f"{100.0 * (float(base.critical[0]) / float(base.critical[-1]) - 1.0):.0f}",
        "load_touching": f"{100.0 * touched[0]:.0f}",
    }
    for name, text in parts.items():
        template = template.replace("{" + name + "}", text)
    return template
