"""What two versions compute, compared number by number: `make fingerprint BEFORE=commit`.

    python -m benchmarks.fingerprint COMMIT

Every command that computes is run by the commit and by a copy of the working tree, both on the commit's cases.
Compared are all datasets and attributes of result files, all values of JSON, all columns of CSV and all exit
codes. Left out are versions, times, and what a comparison chooses by measured times. Texts with a space are words,
which may be written better; everything else is a number or a name. The exit code is 1 where one of these differs.
"""

import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeAlias

import h5py
import numpy as np

Call: TypeAlias = tuple[str, tuple[str, ...]]
Values: TypeAlias = dict[str, Any]

ROOT = Path(__file__).parents[1]
TIMED = ("seconds", "version", "created", "wall", "per_second", "overhead")
"""Parts of names whose values depend on the clock or the version."""
CHOSEN = ("on_front", "recommended", "margin", "repeats", "left_out")
"""Of a comparison: those that depend on measured times."""
GRID = """case = "relaxation.toml"
[[axis]]
parameter = "friction.coefficient"
values = [0.3, 0.6, 0.9]
[[axis]]
parameter = "link2.angle_deg"
values = [3.0, 6.0, 9.0]
"""
FOLLOWED = """case = "relaxation.toml"
[[axis]]
parameter = "friction.coefficient"
start = 0.5
stop = 0.65
num = 5
direction = "both"
"""
CRITICAL = """case = "relaxation.toml"
[[axis]]
parameter = "link2.angle_deg"
values = [4.0, 8.0]
[critical]
parameter = "friction.coefficient"
lower = 0.1
upper = 1.5
"""
OPENS = """[shoe]
mass = 17.109774
[wheel]
radius = 0.5
angular_speed = 6.74
[link1]
stiffness = 32232120.1
damping = 139.432415
[link2]
stiffness = 31646471.7
damping = 139.432415
angle_deg = 15.583161
[load]
force = 109.98632
[friction]
coefficient = 0.3
[contact]
half_length = 0.05
stiffness = 116877910.0
[roughness]
shoe = { amplitudes = [1.0619e-5, 1.0619e-5], wavelengths = [0.038, 0.028] }
wheel = { amplitudes = [2.1238e-5], wavelengths = [0.038] }
[solver]
step = 2e-5
duration = 0.5
"""
"""A pad that touches in part; the wheel's wave repeats after 11 ms."""
CRITICAL_OPEN = """case = "opens.toml"
[[axis]]
parameter = "link2.angle_deg"
values = [15.583161]
[critical]
parameter = "friction.coefficient"
lower = 1.94
upper = 1.97
tolerance = 2e-3
"""
LANES = """case = "{}.toml"
[[axis]]
parameter = "friction.coefficient"
values = [0.1, 0.3, 0.5, 0.6]
[[axis]]
parameter = "wheel.angular_speed"
values = [0.05, 0.5, 5.0]
"""
BASIN = """case = "branch.toml"
[[axis]]
parameter = "initial.x"
values = [-8e-6, 0.0, 8e-6]
[[axis]]
parameter = "initial.vy"
values = [-4e-3, 0.0, 4e-3]
"""
STUDY = """case = "mode-coupling.toml"
samples = {}
method = "{}"
[[parameter]]
key = "friction.coefficient"
distribution = "normal"
mean = 0.5
deviation = 0.1
[[parameter]]
key = "link2.damping"
distribution = "lognormal"
mean = 300.0
deviation = 60.0
"""
FILES = {
    "grid": GRID,
    "followed": FOLLOWED,
    "critical": CRITICAL,
    "opens": OPENS,
    "critical-open": CRITICAL_OPEN,
    **{f"lanes-{name}": LANES.format(name) for name in ("S", "B", "C")},
    "basin": BASIN,
    "eigenvalues": STUDY.format(128, "eigenvalue"),
    "runs": STUDY.format(16, "run"),
}


def calls(cases: list[str]) -> Iterator[Call]:
    """Commands with their names, in an order in which each finds the files that it needs."""
    for name in cases:
        yield f"check {name}", ("check", f"{name}.toml", "--json")
        yield f"run {name}", ("run", f"{name}.toml", "-o", f"{name}.h5", "--json")
        yield f"stability {name}", ("stability", f"{name}.toml", "--json")
        yield f"classify {name}", ("classify", f"{name}.h5", "--threshold", "stick_cycles=0.9", "--json")
    for scheme in ("three-layer", "event-driven", "piecewise-exact"):
        chosen = ("--set", f'solver.scheme="{scheme}"', "--set", "solver.duration=0.3")
        yield f"run {scheme}", ("run", "relaxation.toml", *chosen, "-o", f"{scheme}.h5", "--json")
    for tolerance in ("1e-3", "1e-6"):
        chosen = ("--set", f"solver={{tolerance={tolerance},duration=0.05}}", "--set", 'contact.evaluator="auto"')
        yield (
            f"promise {tolerance}",
            ("run", "rough-partly-open.toml", *chosen, "-o", f"p{tolerance}.h5", "--json"),
        )
    yield "new branch", ("new", "branch", "-q")
    yield "run settled", ("run", "branch.toml", "-o", "settled.h5", "--json")
    yield (
        "run restarted",
        ("run", "relaxation.toml", "--set", 'initial={from="relaxation.h5"}', "-o", "restarted.h5", "--json"),
    )
    for name in ("grid", "followed", "critical"):
        yield (
            f"sweep {name}",
            ("sweep", f"{name}.toml", "--set", "solver.duration=0.4", "-o", f"{name}.h5", "--json"),
        )
    yield "sweep critical open", ("sweep", "critical-open.toml", "-o", "critical-open.h5", "--json")
    for name in ("S", "B", "C"):
        chosen = ("--set", "solver={tolerance=1e-3,duration=0.05}")
        yield f"lanes {name}", ("sweep", f"lanes-{name}.toml", *chosen, "-o", f"lanes-{name}.h5", "--json")
    yield "basin", ("sweep", "basin.toml", "--set", "solver.duration=20", "-o", "basin.h5", "--json")
    yield "scatter eigenvalues", ("scatter", "eigenvalues.toml", "-o", "eigenvalues.h5", "--json")
    yield "scatter runs", ("scatter", "runs.toml", "--set", "solver.duration=0.3", "-o", "runs.h5", "--json")
    along = ("--parameter", "friction.coefficient=0:1")
    yield "branch", ("branch", "branch.toml", *along, "--switch", "-o", "branches.h5", "--json")
    yield "branch rough", ("branch", "rough-full-contact.toml", *along, "-o", "forced.h5", "--json")
    yield "advise", ("advise", "mode-coupling.toml", "--json")
    yield "advise scatter", ("advise", "mode-coupling.toml", "--scatter", "eigenvalues.toml", "--json")
    yield "stability vary", ("stability", "relaxation.toml", "--vary", "link2.angle_deg=1:10:4", "--json")
    yield "classify signal", ("classify", "signal.csv", "--time-column", "t", "--quantity", "force", "--json")
    chosen = ("--schemes", "two-layer,three-layer", "--steps", "1e-5,5e-6")
    yield "compare", ("compare-schemes", "S.toml", *chosen, "-o", "compared.h5", "--json")
    yield "diff", ("diff", "relaxation.h5", "restarted.h5", "--json")
    for name in ("relaxation", "grid", "branches"):
        yield f"export {name}", ("export", f"{name}.h5", "-o", f"{name}.csv", "-q")
    yield "info", ("info", "grid.h5", "--json")
    for kind in ((), ("sweep",), ("scatter",)):
        yield " ".join(("schema", *kind)), ("schema", *kind)


def stick_slip() -> str:
    """A sawtooth with noise, as a measured force."""
    rng = np.random.default_rng(1)
    lines = ["t,force"]
    force = 0.0
    for index in range(20000):
        force = 0.0 if force > 1.0 + 0.2 * rng.random() else force + 0.01
        lines.append(f"{index * 1e-3},{force + 0.01 * rng.normal()}")
    return "\n".join(lines) + "\n"


def prepare(folder: Path, tree: Path) -> list[str]:
    """Put all inputs into the folder; the names of the cases that are run whole."""
    cases = sorted(tree.glob("cases/*.toml"))
    for path in (*cases, *tree.glob("cases/accuracy/*.toml")):
        (folder / path.name).write_bytes(path.read_bytes())
    for name, text in FILES.items():
        (folder / f"{name}.toml").write_text(text)
    (folder / "signal.csv").write_text(stick_slip())
    return [path.stem for path in cases]


def computed(tree: Path, cases: Path, folder: Path) -> dict[str, Values]:
    """All values of all commands, as the package of this tree computes them."""
    found = dict[str, Values]()
    for name, arguments in calls(prepare(folder, cases)):
        before = set(folder.iterdir())
        ran = subprocess.run(
            [sys.executable, "-m", "brakecli", *arguments],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(tree)},
            capture_output=True,
            text=True,
            check=False,
        )
        found[name] = {"exit code": ran.returncode, **of_json(ran.stdout, "json")}
        for path in sorted(set(folder.iterdir()) - before):
            found[name] |= of_hdf5(path) if path.suffix == ".h5" else {path.name: path.read_text()}
        print(f"{folder.name}: {name}", flush=True)
    return found


def of_json(text: str, name: str) -> Values:
    """Each value of a JSON text under its path, or the text itself."""
    try:
        return dict(leaves(json.loads(text), name))
    except ValueError:
        return {"text": text}


def leaves(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """The values of nested tables and lists, with their paths."""
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(inner, f"{path}/{key}")
    else:
        yield path, value


def of_hdf5(path: Path) -> Values:
    """Each dataset and attribute of a file, but those by which HDF5 links dimensions."""
    found: Values = {}

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        for key, value in item.attrs.items():
            if key not in ("DIMENSION_LIST", "REFERENCE_LIST", "CLASS", "NAME") and not key.startswith("_N"):
                found[f"{name}@{key}"] = np.asarray(value)
        if isinstance(item, h5py.Dataset):
            found[name] = np.asarray(item[()])

    with h5py.File(path) as file:
        visit("", file)
        file.visititems(visit)
    return {f"{path.name}:{name}": value for name, value in found.items()}


def difference(old: Any, new: Any) -> str:
    """How two values differ: empty, `words`, or by how much of the largest."""
    old = np.asarray(old)
    new = np.asarray(new)
    if old.shape == new.shape and old.dtype.kind == new.dtype.kind and old.tobytes() == new.tobytes():
        return ""
    if old.shape == new.shape and old.dtype.kind in "OU" and (old == new).all():
        return ""
    if old.shape == new.shape and {old.dtype.kind, new.dtype.kind} <= set("fiub"):
        old = old.astype(float)
        new = new.astype(float)
        if (np.isnan(old) != np.isnan(new)).any():
            return "missing values differ"
        apart, largest = (np.abs(np.nan_to_num(each)).max(initial=0.0) for each in (new - old, old))
        return f"{apart / max(largest, 1e-300):.1e} of the largest"
    texts = [text for value in (old, new) for text in map(str, value.ravel().tolist())]
    return (
        "words"
        if old.shape == new.shape and all(" " in text for text in texts)
        else f"{texts[:1]} {texts[-1:]}"[:80]
    )


def compare(before: dict[str, Values], after: dict[str, Values]) -> int:
    """Print what differs; how many numbers or names do."""
    numbers = list[str]()
    words = list[str]()
    for name in before | after:
        old = before.get(name, {})
        new = after.get(name, {})
        for key in old | new:
            if any(part in key for part in (*TIMED, *CHOSEN * (name == "compare"))):
                continue
            how = difference(old[key], new[key]) if key in old and key in new else "gone" if key in old else "new"
            if how:
                (words if how == "words" else numbers).append(f"{name}: {key}: {how}")
    print(*(f"words    {line}" for line in words), *(f"NUMBERS  {line}" for line in numbers), sep="\n")
    values = sum(map(len, before.values()))
    print(f"{len(numbers)} numbers or names and {len(words)} words differ, of {values} of {len(before)} commands.")
    return len(numbers)


def main(commit: str) -> int:
    """Compare the working tree with a commit."""
    archive = subprocess.run(["git", "archive", commit], cwd=ROOT, capture_output=True, check=True).stdout
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(2) as pool:
        old, new, before, after = (Path(scratch, name) for name in ("old", "new", "before", "after"))
        before.mkdir()
        after.mkdir()
        with tarfile.open(fileobj=io.BytesIO(archive)) as packed:
            packed.extractall(old, filter="data")
        shutil.copytree(ROOT / "brakecli", new / "brakecli")
        both = [pool.submit(computed, tree, old, folder) for tree, folder in ((old, before), (new, after))]
        return int(compare(*(each.result() for each in both)) > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
