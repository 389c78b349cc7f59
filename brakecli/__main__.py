"""`python -m brakecli` and the installed command."""

import atexit
import gc
import os

from brakecli.files.os_signals import guard_streams, handle_signals


def main() -> None:
    """Run the command line; signals are heard before anything large is imported."""
    handle_signals()
    # Small matrices: threads for linear algebra would spin on the cores of workers, and take 80 MB each.
    os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    guard_streams()
    # Otherwise the interpreter searches every imported module for garbage as it ends, which takes 0.2 s.
    atexit.register(gc.freeze)
    from brakecli.cli.app import main as run

    run()


if __name__ == "__main__":
    main()
