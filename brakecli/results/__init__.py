"""Result files and tables: what a user gets, whole or not at all.

`write.new_result` writes a result and puts its digest at the end; `read.open_result` opens what fits its
digest. `fields` and `stability_fields` declare each number once: name, unit and meaning, of which files,
`--json`, tables and pages are made.

`atomic` writes any file, `export` makes CSV and sound, `table` reads measured text, `as_xarray` makes trees of
datasets, `contents` says what a file holds and how two differ. `os_signals` defers signals while a file is
written.
"""
