"""What commands compute: one case, many, brakes that scatter, and schemes against each other.

`runs.run.run` simulates a case and writes its file; `sweeps.driver.sweep` does so for a grid, on many cores or
machines; `scattering.scatter.scatter` for samples of a study; `comparison.compare.compare` for all schemes.

A `LoadedCase` goes in, or a sweep or study of one; a report comes out, whose `numbers()` are those of `--json`,
and a result file. `runs/` also keeps a tolerance, refuses what is too large and advises what to change.

`api.commands` calls these functions, and `views` shows their reports.
"""
