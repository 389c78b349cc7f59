"""Changes to result files that no program should survive by luck: wrong types, lengths, sizes, texts and links."""

import random
from pathlib import Path
from typing import Any

import h5py
import numpy as np

VALUES: list[Any] = [
    *(
        0,
        -1,
        7,
        2**62,
        0.0,
        -0.5,
        np.nan,
        np.inf,
        1e308,
        -1e308,
        5e-324,
        True,
        1j,
        "",
        "x",
        "run",
        "sweep",
        "\x1b[2J",
    ),
    *(np.bytes_(b"\xff\xfe"), np.bytes_(b"done"), h5py.Empty("f8"), "y" * 60_000),
    *(np.array([], "f8"), np.arange(3), np.eye(2), np.array([np.nan]), np.array([b"\xff", b"a"])),
    np.array(["a", "b"], h5py.string_dtype()),
    np.array([b"\xff", b"ok"], h5py.string_dtype()),
    np.array([(1, 2.0)], "i4,f8"),
    *("[shoe]\nmass = 1\n", "[" * 3000, "title = 'no case'"),
]
TEXTS = (
    "kind",
    "resolved_toml",
    "case_toml",
    "failure",
    "status",
    "reasons",
    "regime",
    "title",
    "resolved_sweep_toml",
)
LINKS = ("DIMENSION_LIST", "CLASS", "REFERENCE_LIST", "NAME", "_FillValue")


MOST = 10**6


def forge(path: Path, chance: random.Random) -> str:
    """Change one to three things in a file whose digest has been cut off; what was done, for messages."""
    done = []
    with h5py.File(path, "r+") as file:
        for _ in range(chance.choice((1, 1, 1, 2, 3))):
            nodes: list[str] = ["/"]
            file.visit(nodes.append)
            name = chance.choice(nodes)
            if name == "/" or chance.random() < 0.4:
                done.append(_attribute(file[name], chance))
            else:
                done.append(f"{name}: {_node(file, name, chance)}")
    return "; ".join(done)


def _attribute(node: Any, chance: random.Random) -> str:
    name = chance.choice([*node.attrs, *(TEXTS if node.name == "/" else LINKS)])
    if name in node.attrs:
        del node.attrs[name]
    if chance.random() < 0.15:
        return f"{node.name}@{name} deleted"
    value = chance.choice(VALUES)
    if name == "DIMENSION_LIST" and chance.random() < 0.5:
        kind = chance.choice((h5py.vlen_dtype("i8"), h5py.ref_dtype, h5py.regionref_dtype))
        space = h5py.h5s.create_simple((chance.choice((1, 2)),))
        h5py.h5a.create(node.id, name.encode(), h5py.h5t.py_create(kind, logical=True), space)
        return f"{node.name}@{name} of type {kind}"
    node.attrs[name] = value
    return f"{node.name}@{name} = {str(value)[:30]!r}"


def _node(file: h5py.File, name: str, chance: random.Random) -> str:
    """Put something else in the place of a group or a variable."""
    node = file[name]
    length = 5
    kept = dict(node.attrs) if chance.random() < 0.5 else {}
    if isinstance(node, h5py.Dataset) and node.ndim and node.size <= MOST:  # unless a change has made it huge
        values = node[()]
        length = node.shape[0]
        if values.dtype.kind == "f" and chance.random() < 0.4:
            bad = chance.choice((np.nan, np.inf, 1e308, -1e308, 0.0, 5e-324, 1e200, -1.0))
            node[chance.choice((slice(None), slice(0, 1), slice(-1, None), slice(None, None, 2)))] = bad
            return f"some are {bad}"
    kinds = [
        "nothing",
        "group",
        "type",
        "soft",
        "outside",
        "scalar",
        "other",
        "huge",
        "zipped",
        "chunk",
        "virtual",
    ]
    what = chance.choice([*kinds, "other", "other"])
    other = chance.choice(
        ("f8", "i8", "i1", "c16", "S3", "?", "f2", "u8", h5py.string_dtype(), h5py.ref_dtype, "i4,f8")
    )
    del file[name]
    huge: dict[str, Any] = {"shape": (300_000_000,), "dtype": "f8"}
    if what == "group":
        file.create_group(name)
    elif what == "type":
        file[name] = np.dtype("f8")
    elif what == "soft":
        file[name] = h5py.SoftLink(chance.choice(("/", "/history", "/nowhere", f"/{name}")))
    elif what == "outside":
        file[name] = h5py.ExternalLink("/dev/zero", "/")
    elif what == "scalar":
        file[name] = 1.0
    elif what == "huge":
        file.create_dataset(name, chunks=(1000,), **huge)
    elif what == "zipped":
        file.create_dataset(
            name, (3_000_000,), "f8", data=np.zeros(3_000_000), compression="gzip", chunks=(1_000_000,)
        )
    elif what == "chunk":
        file.create_dataset(name, (length,), "f8", chunks=(200_000_000,), maxshape=(None,))
    elif what == "virtual":
        layout = h5py.VirtualLayout((300_000_000,), "f8")
        layout[:] = h5py.VirtualSource("/dev/null", "x", (300_000_000,))
        file.create_virtual_dataset(name, layout)
    elif what == "other":
        shape = chance.choice(((length,), (length + 1,), (max(length - 1, 0),), (0,), (length, 1), (1, length)))
        file.create_dataset(name, shape, other)
    if what in ("scalar", "huge", "zipped", "chunk", "other"):
        for key, value in kept.items():
            if key not in LINKS:
                file[name].attrs[key] = value
    return f"{what} {other}" if what == "other" else what
