"""`python -m brakecli` is `brakecli`."""

from brakecli.cli import main

main()
