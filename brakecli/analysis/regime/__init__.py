"""Damped, relaxation or quasi-harmonic: the regime of a run, with its evidence."""
