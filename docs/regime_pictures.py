"""The pictures of docs/regimes.md: an example of each row that gives a verdict or that is often met.

Each example runs, and fails where another row than the one that it names has decided. `make regime-pictures` takes
a minute.
"""

import tomllib
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import tomli_w
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from paper_pictures import GREY, ORANGE, STYLE
from PIL import Image

from brakecli.analysis.regime.decision import Thresholds
from brakecli.case.read import parse_case
from brakecli.results.read import open_result
from brakecli.solver.quantities import ContactState
from brakecli.studies.runs.run import run

DOCS = Path(__file__).parent
CASES = DOCS.parent / "cases"
RUN = "#5B9BC8"
STICK = "#3A3A3A"
JUDGED = "#E9EEF3"
COLUMNS = 400  # of a panel, in each of which the least and the largest vx are drawn
STRIPS = 80  # of a panel, in each of which it is shown whether the shoe sticks
COLOURS = 64  # of a picture: enough for smooth edges of few hues, in a file of moderate size
Array = NDArray[np.float64]


class Example(NamedTuple):
    """A case whose verdict one row gives, and how it is shown."""

    title: str
    row: str
    case: str  # of the folder cases
    changes: str  # as after --set
    after: float  # s, for which the motion is continued on the smooth wheel


class Shown(NamedTuple):
    """What a run shows: velocities in mm/s, times in s."""

    time: Array
    vx: Array
    state: Array
    wheel: float  # speed of its surface
    numbers: dict[str, Any]


HARD = "initial.vx=-3.0"
NARROW = "contact.half_length=0.0001 contact.stiffness=1e10"
HIGH = "wheel.angular_speed=4.0 roughness.wheel.wavelengths=[{}] roughness.wheel.amplitudes=[{}]"
NO_DASHPOTS = "link1.damping=0.0 link2.damping=0.0"
SMOOTH = (
    Example("Slides, and theory says that it decays", "linear, decays", "damped", "solver.duration=0.3", 0.15),
    Example(
        "Slides, and theory says that it grows", "linear, grows", "quasi-harmonic", "solver.duration=0.2", 1.0
    ),
    Example(
        "Still far from sliding",
        "fades",
        "quasi-harmonic",
        f"friction.coefficient=0.5 {HARD} solver.duration=0.05",
        0.2,
    ),
    Example(
        "Lasts, with stick in each cycle",
        "lasts: limit cycle with stick",
        "relaxation",
        "solver.duration=0.3",
        0.15,
    ),
    Example(
        "Lasts without stick", "lasts: limit cycle without stick", "quasi-harmonic", "solver.duration=1.0", 0.5
    ),
    Example(
        "Lasts, but falls for long",
        "on its way: limit cycle without stick",
        "quasi-harmonic",
        "friction.coefficient=0.58 initial.vx=-12.0 initial.vy=3.0 link1.damping=30.0 link2.damping=30.0 "
        "solver.duration=0.5",
        4.0,
    ),
    Example(
        "Comes to no limit cycle, sliding unstable",
        "lasts, irregular: quasi-harmonic",
        "relaxation",
        f"{NO_DASHPOTS} solver.duration=2.0",
        1.0,
    ),
    Example(
        "No dashpots, sliding stable",
        "no dashpots",
        "quasi-harmonic",
        f"friction.coefficient=0.5 {HARD} {NO_DASHPOTS} solver.duration=0.5",
        0.25,
    ),
    Example(
        "No friction",
        "no friction",
        "damped",
        f"friction.coefficient=0.0 {HARD} initial.y=0.002 solver.duration=0.05",
        0.2,
    ),
    Example(
        "The wheel stands",
        "standing wheel",
        "damped",
        f"wheel.angular_speed=0.0 friction.coefficient=0.1 {HARD} solver.duration=0.1",
        0.15,
    ),
    Example(
        "The wheel stands, and the shoe sticks",
        "at rest",
        "damped",
        "wheel.angular_speed=0.0 initial.vx=1.0 solver.duration=0.1",
        0.05,
    ),
    Example("The wheel stops", "changes", "brake-stop", "", 0.0),
)
ROUGH = (
    Example(
        "Slides, shaken by waves",
        "linear, forced",
        "rough-full-contact",
        "initial.vx=1e-4 solver.duration=0.6",
        0.3,
    ),
    Example(
        "Waves, no friction",
        "forced, no friction",
        "rough-partly-open",
        "friction.coefficient=0.0 solver.duration=1.5",
        0.5,
    ),
    Example(
        "Only the waves keep it up",
        "forced, neighbours",
        "rough-partly-open",
        "solver.duration=1.5",
        0.5,
    ),
    Example(
        "Only the waves, and weak dashpots",
        "forced, level",
        "rough-partly-open",
        "link1.damping=10.0 link2.damping=5.0 solver.duration=1.0",
        1.5,
    ),
    Example(
        "Only the waves, but not settled yet",
        "dies out, not yet",
        "rough-partly-open",
        'initial={at="equilibrium"} solver.duration=0.2',
        0.5,
    ),
    Example(
        "High waves: friction takes energy",
        "forced, friction takes",
        "relaxation",
        f"{NARROW} roughness.wheel.wavelengths=[0.0008] roughness.wheel.amplitudes=[1.5e-3] link1.damping=30.0 "
        "link2.damping=30.0 solver.duration=0.6",
        0.3,
    ),
    Example(
        "High waves give more than friction",
        "forced, roughness gives",
        "quasi-harmonic",
        f"{HIGH.format(0.017, '500e-6')} solver.duration=1.0",
        2.0,
    ),
    Example(
        "High waves hold the vibration down",
        "forced, another level",
        "quasi-harmonic",
        f"{HIGH.format(0.0115, '600e-6')} solver.duration=1.0",
        2.0,
    ),
    Example(
        "Low waves change little",
        "self-excited: quasi-harmonic",
        "quasi-harmonic",
        f"{HIGH.format(0.03, '20e-6')} solver.duration=1.0",
        0.5,
    ),
    Example(
        "A wave near its frequency leads it",
        "locked to the waves: quasi-harmonic",
        "quasi-harmonic",
        f"{HIGH.format(0.0115, '200e-6')} solver.duration=1.5",
        1.0,
    ),
    Example(
        "Waves and friction keep it up",
        "either",
        "relaxation",
        f"{NARROW} roughness.wheel.wavelengths=[0.000288] roughness.wheel.amplitudes=[100e-6] solver.duration=0.6",
        0.3,
    ),
    Example(
        "Too early to say",
        "still changes",
        "quasi-harmonic",
        f"{HIGH.format(0.0125, '500e-6')} solver.duration=1.0",
        2.0,
    ),
)
LOOKS = (
    Example(
        "Relaxation: stick in each cycle",
        "lasts: limit cycle with stick",
        "relaxation",
        "output.sample_interval=1e-5",
        0.0,
    ),
    Example(
        "Quasi-harmonic: one line, no stick",
        "lasts: limit cycle without stick",
        "quasi-harmonic",
        "output.sample_interval=1e-5",
        0.0,
    ),
    Example(
        "Irregular: stick in some of the cycles",
        "self-excited: irregular",
        "relaxation",
        f"{NARROW} roughness.wheel.wavelengths=[0.0005] roughness.wheel.amplitudes=[400e-6] link1.damping=30.0 "
        "link2.damping=30.0 solver.duration=0.6",
        0.0,
    ),
)


def computed(text: str, changes: list[str], folder: Path) -> tuple[Shown, dict[str, Any]]:
    """A run, and the tables of its case with the last state as the start."""
    loaded = parse_case(text, "example", changes)
    numbers = run(loaded, folder / "example.h5", force=True).numbers()
    with open_result(folder / "example.h5") as stored:
        time, vx, state = (np.array(stored.read("history", name)) for name in ("time", "vx", "state"))
        start = {name: float(stored.read("history", name)[-1]) for name in ("x", "y", "vx", "vy")}
        tables = tomllib.loads(stored.text("resolved_toml"))
    tables["initial"] = {"at": "rest", **start}
    wheel = tables["wheel"]["radius"] * tables["wheel"].get("angular_speed", 0.0)  # none where it changes
    return Shown(time, 1e3 * vx, state, 1e3 * wheel, numbers), tables


def both(example: Example) -> tuple[Shown, Shown | None]:
    """The run of an example, and what comes after it on the smooth wheel."""
    with TemporaryDirectory() as folder:
        text = (CASES / f"{example.case}.toml").read_text()
        shown, tables = computed(text, example.changes.split(), Path(folder))
        if (row := shown.numbers["evidence"]["row"]) != example.row:
            reason = shown.numbers["reasons"][0]
            raise SystemExit(f"{example.title}: the row is {row}, not {example.row}; {reason}")
        if not example.after:
            return shown, None
        tables.get("roughness", {}).pop("wheel", None)
        tables["solver"]["duration"] = example.after
        later, _ = computed(tomli_w.dumps(tables), [], Path(folder))
        return shown, later._replace(time=later.time + shown.time[-1])


def band(axis: Axes, shown: Shown, width: float, colour: str) -> None:
    """The least and the largest vx over time, and at the bottom where the shoe sticks."""
    part = (shown.time[-1] - shown.time[0]) / width
    edges = _edges(len(shown.time), COLUMNS * part)
    low, high = (each.reduceat(shown.vx, edges[:-1]) for each in (np.minimum, np.maximum))
    middle = 0.5 * (shown.time[edges[:-1]] + shown.time[edges[1:]])
    axis.fill_between(middle, low, high, color=colour, lw=0.6)
    edges = _edges(len(shown.time), STRIPS * part)
    sticks = np.maximum.reduceat(shown.state == ContactState.STICK, edges[:-1])
    begins = shown.time[edges[:-1]][sticks]
    lengths = np.diff(shown.time[edges])[sticks]
    axis.bar(begins, 0.045, lengths, align="edge", color=STICK, transform=axis.get_xaxis_transform())


def _edges(samples: int, parts: float) -> NDArray[np.int64]:
    """The first samples of equal parts, and the last of all."""
    return np.linspace(0, samples - 1, min(max(int(parts), 2), samples - 1) + 1).astype(np.int64)


def level(evidence: dict[str, Any]) -> str:
    """Whether it lasts, in words."""
    limits = Thresholds()
    change = evidence["level_change"]
    error = evidence["level_change_error"]
    steady = abs(change) <= max(limits.sure_errors * error, 2.0 * limits.settled_within)
    word = "grows" if change > 0.0 else "falls"
    if steady:
        word = "steady" if abs(change) <= 2.0 * limits.settled_within else "no sure change"
    return f"level: {word}, $e^{{{change:.2f} \\pm {error:.2f}}}$"


def answers(numbers: dict[str, Any]) -> str:
    """The row and the answers, in words."""
    evidence = numbers["evidence"]
    lines = [f"“{evidence['row'].partition(':')[0]}”"]
    if "level_change" in evidence:
        lines.append(level(evidence))
    if numbers["growth_rate"] is not None:
        lines.append(f"theory: {numbers['growth_rate']:.3g} 1/s")
    elif "lyapunov_exponent" in evidence:
        lines.append(f"neighbours: {evidence['lyapunov_exponent']:.2g} ± {evidence['lyapunov_error']:.1g} 1/s")
    if evidence.get("growth_rate") and "linear" not in evidence:
        lines.append(f"sliding: {'unstable' if evidence['growth_rate'] > 0.0 else 'stable'}")
    if "without_waves" in evidence:
        size = evidence.get("amplitude_without_waves")
        word = "dies out" if evidence["without_waves"] == "dies" else "lasts"
        lines.append(f"smooth wheel: {word}{f', {1e6 * size:.3g} µm' if size else ''}")
    if "power_of_friction" in evidence:
        friction, waves = (evidence[f"power_of_{name}"] for name in ("friction", "roughness"))
        lines.append(f"friction {_watt(friction)}, waves {_watt(waves)}")
    return "\n".join(lines)


def _watt(power: float) -> str:
    return f"{power:.0f} W" if abs(power) >= 10.0 else f"{power:.2g} W"


def verdict(numbers: dict[str, Any]) -> str:
    """The verdict in words."""
    excitation = "" if numbers["excitation"] == "none" else f", {numbers['excitation']}"
    return f"{numbers['regime']}{excitation}"


def panel(axis: Axes, example: Example) -> None:
    """One example: the run in blue, what comes after it on the smooth wheel in orange."""
    shown, later = both(example)
    end = float(shown.time[-1])
    ends = [float(shown.time[0]), float((later or shown).time[-1])]
    axis.axvspan(0.5 * end, end, color=JUDGED, lw=0.0)
    band(axis, shown, ends[1] - ends[0], RUN)
    size = max(float(np.abs(shown.vx[len(shown.vx) // 2 :]).max()), 0.05 * float(np.abs(shown.vx).max()))
    if later:
        band(axis, later, ends[1] - ends[0], ORANGE)
        size = min(max(size, float(np.abs(later.vx).max())), 6.0 * size)
    if 0.0 < abs(shown.wheel) < 2.0 * size:
        axis.axhline(shown.wheel, color="black", ls="--", lw=0.9)
        size = max(size, abs(shown.wheel))
    axis.axvline(end, color=GREY, lw=0.9)
    axis.set(xlim=ends, ylim=(-1.35 * size, 2.7 * size))
    axis.text(
        0.98, 0.98, answers(shown.numbers), transform=axis.transAxes, ha="right", va="top", fontsize=7.5,
        linespacing=1.2, bbox={"facecolor": "white", "alpha": 0.8, "lw": 0.0, "pad": 1.0},
    )  # fmt: skip
    axis.set_title(f"{example.title}\n{verdict(shown.numbers)}", fontsize=9)


def gallery(name: str, examples: tuple[Example, ...]) -> None:
    """All examples of a kind of wheel, three in a row."""
    rows = -(-len(examples) // 3)
    figure = Figure(figsize=(9.6, 2.5 * rows + 0.4))
    figure.set_layout_engine("constrained")
    panels = figure.subplots(rows, 3).ravel()
    for axis, example in zip(panels, examples, strict=False):
        panel(axis, example)
    for axis in panels[len(examples) :]:
        axis.set_axis_off()
    for axis in figure.axes[::3]:
        axis.set_ylabel("vx (mm/s)")
    for axis in figure.axes[-3:]:
        axis.set_xlabel("time (s)")
    key = [
        figure.axes[0].fill_between([], [], color=RUN, label="the run"),
        figure.axes[0].fill_between([], [], color=ORANGE, label="continued on the smooth wheel"),
        figure.axes[0].fill_between([], [], color=STICK, label="sticks now and then"),
        figure.axes[0].fill_between([], [], color=JUDGED, label="second half: the level"),
        figure.axes[0].plot([], [], color="black", ls="--", lw=0.9, label="speed of the wheel")[0],
    ]
    figure.legend(handles=key, loc="outside lower center", ncols=5)
    save(figure, name)


def looks() -> None:
    """Some cycles of what lasts."""
    figure = Figure(figsize=(9.6, 2.9))
    figure.set_layout_engine("constrained")
    for axis, example in zip(figure.subplots(1, 3), LOOKS, strict=True):
        shown, _ = both(example)
        part = shown.time >= shown.time[-1] - 0.04
        time = 1e3 * (shown.time[part] - shown.time[part][0])
        axis.plot(time, shown.vx[part], color=RUN)
        for state, colour, words in (
            (ContactState.STICK, STICK, "sticks"),
            (ContactState.SEPARATED, ORANGE, "no contact"),
        ):
            axis.fill_between(
                time, 0.0, 1.0, where=shown.state[part] == state, color=colour, alpha=0.25, lw=0.0, label=words,
                transform=axis.get_xaxis_transform(),
            )  # fmt: skip
        if shown.wheel < 2.0 * np.abs(shown.vx[part]).max():
            axis.axhline(shown.wheel, color="black", ls="--", lw=0.9)
        evidence = shown.numbers["evidence"]
        words = f"{evidence['stick_cycles']:.0%} of cycles stick, {evidence['harmonic_share']:.0%} in one line"
        axis.set_title(f"{example.title}\n{words}", fontsize=9)
        axis.set(xlabel="time (ms)", xlim=(0.0, time[-1]))
    figure.axes[0].set_ylabel("vx (mm/s)")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    line = figure.axes[0].plot([], [], color="black", ls="--", lw=0.9)[0]
    figure.legend([*handles, line], [*labels, "speed of the wheel"], loc="outside lower center", ncols=3)
    save(figure, "looks")


def save(figure: Figure, name: str) -> None:
    """Write a picture; nothing in it depends on when or where."""
    drawn = BytesIO()
    figure.savefig(drawn, dpi=115, metadata={"Software": None})
    picture = Image.open(drawn).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    picture.save(DOCS / f"regimes-{name}.png", optimize=True)


def main() -> None:
    """Draw them all."""
    with style.context(["default", STYLE]):
        gallery("smooth", SMOOTH)
        gallery("rough", ROUGH)
        looks()


if __name__ == "__main__":
    main()
