"""The pictures of docs/paper-claims.md, drawn from the results of its sweeps."""

import math
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from paper_results import BETA, BOTH, C1, C2, FIRST, PAD, RATIOS, SECOND, K, Results, flutter

DOCS = Path(__file__).parent
BLUE = "#0072B2"
ORANGE = "#E69F00"
VERMILION = "#D55E00"
GREEN = "#009E73"
PURPLE = "#CC79A7"
GREY = "#9A9A9A"
STYLE = {
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.2,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "legend.fontsize": 8.5,
}
REGIMES = {"damped": "#DCE6EE", "relaxation": ORANGE, "quasi-harmonic": BLUE, "undecided": "white"}
KB = 0.2 * C1
"""K of the base case, N/m."""


def panels(width: float, columns: int) -> tuple[Figure, list[Axes]]:
    """A figure with its panels side by side."""
    figure = Figure(figsize=(width, 4.0))
    figure.set_layout_engine("constrained")
    return figure, list(np.atleast_1d(figure.subplots(1, columns)))


def save(figure: Figure, name: str) -> None:
    """Write a picture; nothing in it depends on when or where."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in figure.axes:  # the layout's last digits depend on the order in which it solved for them
        axes.set_position(tuple(round(bound, 6) for bound in axes.get_position().bounds))
    figure.savefig(DOCS / f"paper-{name}.png", dpi=130, metadata={"Software": None})


def regimes(results: Results) -> None:
    """The regime by friction and speed."""
    figure, axes = panels(9.6, 2)
    titles = {"regimes-flat": "Smooth surfaces", "regimes-rough": "Rough surfaces, full contact"}
    for axis, (name, title) in zip(axes, titles.items(), strict=True):
        data = results[name]
        speed, friction = np.meshgrid(0.5 * data.wheel_angular_speed.values, data.friction_coefficient.values)
        for regime, colour in REGIMES.items():
            here = data.regime.values == regime
            if here.any():
                axis.scatter(
                    speed[here], friction[here], s=95, marker="s", c=colour, edgecolors=GREY, lw=0.6, label=regime
                )
        critical = results["beta-flat"].critical_eigenvalue.sel({BOTH: 300.0, BETA: 0.0})
        axis.axhline(float(critical), color=VERMILION, ls="--", label="critical, by eigenvalues")
        axis.set(xscale="log", xlabel="surface speed U (m/s)", ylabel="friction coefficient φ", title=title)
        axis.grid(False)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5)
    save(figure, "regimes")


def dots(axis: Axes, curve: xr.DataArray, scale: float, colour: str, label: str | None, marker: str = "o") -> None:
    """Values by simulation."""
    x = curve[curve.dims[0]].values / scale
    axis.plot(x, curve.values, marker, color=colour, ms=4.5, mfc="none", label=label)


def curve(axis: Axes, values: xr.DataArray, scale: float, colour: str, dashes: str = "-") -> None:
    """Values by eigenvalues."""
    axis.plot(values[values.dims[0]].values / scale, values.values, dashes, color=colour, lw=1.0)


def alpha(results: Results) -> None:
    """The critical friction coefficient by the angle of link 2."""
    figure, axes = panels(9.6, 2)
    angles = np.linspace(0.5, 30.0, 200)
    flat = results["alpha-flat"]
    rough = results["alpha-rough"]
    opened = results["alpha-open"]
    at = flat.sel({C2: 1.2e7})
    axes[0].plot(angles, flutter(1.2e7, angles, 0.0, KB), "--", color=BLUE, lw=1.0, label="(1 + c1/K) tan α")
    for data, colour, marker, words in (
        (at, BLUE, "o", "smooth"),
        (rough, GREEN, "x", "rough, full contact"),
        (opened, VERMILION, "s", "rough, partly open"),
    ):
        damped = data.sel({BOTH: 300.0})
        curve(axes[0], damped.critical_eigenvalue, 1.0, colour)
        dots(axes[0], damped.critical, 1.0, colour, f"{words}, with dashpots", marker)
    dots(axes[0], at.critical.sel({BOTH: 0.0}), 1.0, BLUE, "smooth, no dashpots", ".")
    for c2, colour in ((1.0e7, GREEN), (1.2e7, BLUE), (1.5e7, VERMILION)):
        for damping, dashes in ((0.0, "--"), (300.0, "-")):
            some = flat.sel({C2: c2, BOTH: damping})
            curve(axes[1], some.critical_eigenvalue, 1.0, colour, dashes)
            words = f"c2/c1 = {c2 / C1:g}, {'with' if damping else 'no'} dashpots"
            dots(axes[1], some.critical, 1.0, colour, words, "o" if damping else ".")
    one = results["alpha-one"].isel({C2: 0})
    for first, second, marker in ((300.0, 0.0, "^"), (0.0, 300.0, "v")):
        some = one.sel({FIRST: first, SECOND: second})
        curve(axes[1], some.critical_eigenvalue, 1.0, PURPLE)
        dots(axes[1], some.critical, 1.0, PURPLE, f"c2/c1 = 1.5, b{1 if first else 2} alone", marker)
    axes[0].set(title="c2 = c1 + K", ylabel="critical friction coefficient")
    axes[1].set(title="Smooth, c2 away from c1 + K as well")
    for axis in axes:
        axis.set(xlabel="angle α of link 2 (°)", xlim=(0.0, 31.0), ylim=(0.0, 5.0))
    axes[0].legend(loc="upper left")
    axes[1].legend(loc="upper left", bbox_to_anchor=(0.14, 1.0))
    save(figure, "alpha")


def beta(results: Results) -> None:
    """The critical friction coefficient by the angle of link 1."""
    figure, axes = panels(9.6, 2)
    data = results["beta-flat"]
    locking = results["beta-locking"]
    angles = np.linspace(-30.0, 5.95, 400)
    axes[0].plot(angles, flutter(1.2e7, 5.0, angles, KB), "--", color=GREY, label="closed form, no dashpots")
    for damping, colour in ((0.0, BLUE), (300.0, VERMILION)):
        words = "with dashpots" if damping else "no dashpots"
        curve(axes[0], data.critical_eigenvalue.sel({BOTH: damping}), 1.0, colour)
        dots(axes[0], data.critical.sel({BOTH: damping}), 1.0, colour, words)
        dots(axes[1], locking.critical.sel({BOTH: damping}), 1.0, colour, words, "o" if damping else "x")
    dots(axes[0], results["beta-rough"].critical.sel({BOTH: 300.0}), 1.0, GREEN, "rough, full contact", "x")
    curve(axes[1], locking.critical_eigenvalue.sel({BOTH: 0.0}), 1.0, GREY)
    axes[0].set(title="Flutter", ylabel="critical friction coefficient", ylim=(0.0, 3.5))
    axes[1].set(title="Self-locking (divergence)", ylim=(0.0, 60.0))
    for axis in axes:
        axis.set(xlabel="angle β of link 1 (°), α = 5°")
        axis.legend(loc="upper right")
    save(figure, "beta")


def together(*curves: xr.DataArray) -> xr.DataArray:
    """The values of several curves over c2 as one."""
    return xr.concat([each.drop_vars(K, errors="ignore") for each in curves], C2).sortby(C2)


def ratio(results: Results) -> None:
    """The critical friction coefficient by the stiffness of link 2."""
    figure, axes = panels(9.6, 2)
    stiffness = np.linspace(0.5e7, 3.2e7, 800)
    wide = results["ratio-flat"]
    fine = results["ratio-eigenvalues"]
    opened = results["ratio-open"]
    for share, colour in zip(RATIOS, (PURPLE, ORANGE, BLUE, GREEN), strict=True):
        k = share * C1
        axes[0].plot(stiffness / C1, flutter(stiffness, 5.0, 0.0, k), "--", color=colour, lw=0.9)
        for damping, marker in ((0.0, "."), (300.0, "o")):
            words = f"K/c1 = {share:g}" if damping else None
            dots(axes[0], wide.critical.sel({K: k / PAD, BOTH: damping}), C1, colour, words, marker)
        axes[0].plot(1.0 + share, (1.0 + 1.0 / share) * math.tan(math.radians(5.0)), "*", color=colour, ms=11)
    fine = fine.sel({K: KB / PAD})
    finest = results.refined[0.2].isel({K: 0})
    for (first, second), colour, words in (
        ((0.0, 0.0), GREY, "no dashpots"),
        ((300.0, 300.0), BLUE, "both dashpots"),
        ((300.0, 0.0), PURPLE, "b1 alone"),
        ((0.0, 300.0), ORANGE, "b2 alone"),
    ):
        both = [each.critical_eigenvalue.sel({FIRST: first, SECOND: second}, drop=True) for each in (fine, finest)]
        curve(axes[1], together(*both), C1, colour)
        axes[1].plot([], [], color=colour, label=words)
    dots(axes[1], results["ratio-rough"].critical.sel({BOTH: 300.0}), C1, GREEN, "both, rough, full contact", "x")
    nearest = results.refined["open"].critical_eigenvalue.isel({FIRST: 0, SECOND: 0}, drop=True)
    curve(axes[1], together(opened.critical_eigenvalue, nearest), C1, VERMILION)
    dots(axes[1], opened.critical, C1, VERMILION, "both, rough, partly open", "s")
    axes[0].set(title="Smooth: dots without dashpots, rings with", yscale="log", ylim=(0.1, 12.0))
    axes[0].set(ylabel="critical friction coefficient")
    axes[1].set(title="K/c1 = 0.2: dashpots and roughness", xlim=(0.75, 1.65), ylim=(0.0, 2.0))
    for axis in axes:
        axis.axvline(1.0, color=GREY, lw=0.8, ls=":")
        axis.set(xlabel="c2/c1")
        axis.legend(loc="lower right" if axis is axes[0] else "upper center")
    save(figure, "ratio")


def load(results: Results, touching: list[float]) -> None:
    """The critical friction coefficient by the load on rough surfaces."""
    figure, (axis,) = panels(6.0, 1)
    data = results["load-rough"]
    curve(axis, data.critical_eigenvalue, 1.0, VERMILION)
    dots(axis, data.critical, 1.0, VERMILION, "critical friction coefficient", "s")
    axis.plot(
        data.load_force.values, touching, "-", marker="o", ms=4.0, color=GREY, label="K / 2ak in steady sliding"
    )
    axis.set(xscale="log", xlabel="load Q (N)", title="Roughness that opens the contact", ylim=(0.0, 1.3))
    axis.legend(loc="lower right")
    save(figure, "load")


def draw(results: Results, touching: list[float]) -> None:
    """All pictures; `touching` belongs to the loads of load-rough."""
    with style.context(["default", STYLE]):
        regimes(results)
        alpha(results)
        beta(results)
        ratio(results)
        load(results, touching)
