"""Many cases: grids of them, and critical parameters, on many cores and many machines."""
