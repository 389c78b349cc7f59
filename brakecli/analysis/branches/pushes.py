"""How many pushes seek vibrations beside the branches from flutter: numbers alone, so that `--help` is quick."""

PUSHES = 128
"""In each of five parts of the search, where no number is asked for."""
MOST_PUSHES = 100_000
"""In a part: the search then takes a minute or more."""
