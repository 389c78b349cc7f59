"""The version, and the environment that every process of it needs: without any import of its own."""

import os

__version__ = "0.8.0"
__released__ = "2026-11-28"
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Small matrices: threads for linear algebra would spin on the cores of workers, and take 80 MB each."""
_LIBRARIES = ("HDF5_", "MATPLOTLIB", "MPLBACKEND", "NPY_", "NUMBA_", "SCIPY_")
_OF_THE_USER = ("HDF5_USE_FILE_LOCKING", "NUMBA_CACHE_DIR")


def fix_environment() -> None:
    """Let nothing but files and options decide what libraries do: before any of them is imported.

    Variables change numbers, name the backend of a notebook, or load code that ends the process.
    """
    for name in {name for name in os.environ if name.startswith(_LIBRARIES)} - {*_OF_THE_USER}:
        del os.environ[name]
    os.environ.update(ONE_THREAD, MPLBACKEND="agg", HDF5_PLUGIN_PRELOAD="::")  # the latter: no plugins
