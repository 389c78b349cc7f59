"""`python -m brakecli` and the installed command."""

import atexit
import gc
import os
import sys

from brakecli.about import fix_environment

if os.name == "nt":  # before anything is imported that Windows lacks
    sys.stderr.write("brakecli: does not run on Windows itself; use its Subsystem for Linux (WSL)\n")
    sys.exit(2)
from brakecli.results.os_signals import guard_streams, handle_signals, ignore_signals


def main() -> None:
    """Run the command line; signals are heard before anything large is imported."""
    handle_signals()
    fix_environment()
    guard_streams()
    atexit.register(ignore_signals)  # Python would end by the signal itself, without an exit code
    # Otherwise the interpreter searches every imported module for garbage as it ends, which takes 0.2 s.
    atexit.register(gc.freeze)
    from brakecli.cli.app import main as run

    run()


if __name__ == "__main__":
    main()
