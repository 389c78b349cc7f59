"""How many pushes seek vibrations beside the branches from flutter: numbers alone, so that `--help` is quick."""

PUSHES = 128
"""At a value, where no number is asked for."""
MOST_PUSHES = 100_000
"""At a value: five times as many take a minute or more."""
