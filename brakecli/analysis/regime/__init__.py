"""Damped, relaxation or quasi-harmonic: the regime of a run or of a measured signal, with its evidence."""
