"""The command line: one file per command, which holds its options, one call and what is printed."""
