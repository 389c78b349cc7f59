"""The regime of a measured signal.

`read` takes a record from a file. `look` judges it: what `cleaning` leaves of it is measured (`measure`, `slips`,
`bursts`), and the rows of `table` decide.
"""
