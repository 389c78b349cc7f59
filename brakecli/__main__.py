"""`python -m brakecli` and the installed command."""

from brakecli.files.os_signals import guard_streams, handle_signals


def main() -> None:
    """Run the command line; signals are heard before anything large is imported."""
    handle_signals()
    guard_streams()
    from brakecli.cli.app import main as run

    run()


if __name__ == "__main__":
    main()
