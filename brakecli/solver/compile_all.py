"""A child process that compiles all kernels together with others."""

import gc
import importlib
import os
import pkgutil
from pathlib import Path
from threading import Thread

from brakecli.solver import cache_folder, compiling, kernels
from brakecli.solver.beforehand import SOLVER, TOTAL, is_sound, write


def _end_with_parent() -> None:
    """End this process where the one that has started it has ended: its standard input is at its end then."""
    while os.read(0, 1):
        pass
    os._exit(1)


def child(where: str, k: str) -> None:
    """Compile every kernel that no other child has begun with; every other child begins at the end."""
    compiling.set_alone()
    gc.disable()  # what is compiled is kept to the end: looking for what is not takes 6 % of the time
    Thread(target=_end_with_parent, daemon=True).start()
    folder = Path(where)
    for module in pkgutil.walk_packages([str(SOLVER)], "brakecli.solver."):
        importlib.import_module(module.name)
    if folder != kernels.folder():
        raise SystemExit(f"the cache is {kernels.folder()}")
    write(folder / TOTAL, str(len(kernels.entries)))
    for entry in kernels.entries[:: -1 if int(k) % 2 else 1]:
        try:
            (folder / entry.name).mkdir(mode=cache_folder.OURS)
        except FileExistsError:
            continue
        entry.load()
        if not is_sound(folder / entry.name):
            raise SystemExit("no more can be written there")
