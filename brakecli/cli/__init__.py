"""The command line: one file for each command, which calls a function and prints its view.

`app` is the program: its groups of commands, and the end of every failure in one sentence and an exit code.
`options.with_options` makes the record of a command options of the shell; `output` prints results on standard
output, warnings and progress on standard error.

A command is imported when it is asked for, and heavy libraries inside it, so that `--help` is quick.
"""
