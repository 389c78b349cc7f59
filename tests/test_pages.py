"""Every example of the pages runs, in the order in which the page has it, each page in a folder of its own."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import wavfile

from tests.campaign import campaign
from tests.commands import ROOT, brakecli, environment

PAGES = ("README.md", *(f"docs/{page.name}" for page in sorted((ROOT / "docs").glob("*.md"))))
BLOCK = re.compile(r"^```(sh|python|toml)\n(.*?)^```", re.MULTILINE | re.DOTALL)
ELSEWHERE = ("make ", "python3 -m venv", "~/", "dask ", "h5dump ")  # installation, and other programs


def signal() -> str:
    """A force in N, sampled at 10 kHz for one second."""
    rows = (f"{n / 1e4:.4f},{math.sin(0.08 * math.pi * n):.6f}" for n in range(10_000))
    return "t,force\n" + "\n".join(rows) + "\n"


def prepare(folder: Path, text: str) -> None:
    """Give a page the files that it speaks of and does not make."""
    (folder / "cases").symlink_to(ROOT / "cases")
    (folder / "signal.csv").write_text(signal())
    tone = np.sin(0.08 * math.pi * np.arange(10_000))
    wavfile.write(folder / "brake.wav", 10_000, (10_000 * tone).astype(np.int16))
    with h5py.File(folder / "recorder.h5", "w") as file:
        file["run3/position"] = 1e-6 * tone
    given = [] if "\nbrakecli new squeal" in text else [("new", "squeal"), ("run", "squeal.toml")]
    given += [("run", "cases/relaxation.toml")] if '"relaxation.h5"' in text else []
    for line in given:
        brakecli(*line, cwd=folder).told(0)


@campaign
@pytest.mark.parametrize("page", PAGES)
def test_the_examples_of_a_page_run(page: str, tmp_path: Path) -> None:
    content = (ROOT / page).read_text(encoding="utf-8")
    prepare(tmp_path, content)
    path = {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    for kind, text in BLOCK.findall(content):
        if kind == "toml":
            if name := re.match(r"# (\S+\.toml)\n", text):
                (tmp_path / name[1]).write_text(text)
            continue
        lines = [line for line in text.splitlines() if not line.startswith(ELSEWHERE) and "tcp://host" not in line]
        program = [sys.executable, "-W", "error", "-c"] if kind == "python" else ["bash", "-ec"]
        command = [*program, "\n".join(lines)]
        done = subprocess.run(command, cwd=tmp_path, env=environment() | path, capture_output=True, text=True)
        assert done.returncode == 0, f"{text}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
