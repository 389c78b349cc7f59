"""What can be asked, in the shell and in Python.

`records` has the options of each command, a record each, with what is said of them; `options` makes docstrings
and signatures of these. `commands` computes what a command is asked, by its record: the shell prints it, Python
returns it.

`cases`, `many` and `results` are the functions of `import brakecli`, which return xarray objects; `calls` is
what is around each of them. `values` reads what options hold, `inputs` files, `measured` how a signal was
measured, `verdict` says what a file shows, and `progress` how far long work has come.

`cli` is above: one file for each command, which prints.
"""
