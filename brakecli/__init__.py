"""Vibration of a brake shoe that slides on a rough wheel, with Amontons friction."""

__version__ = "0.2.0"
SAME_NUMBERS_AS = ("0.1.0",)
"""Earlier versions that compute the same numbers: this one goes on with the sweeps that they have begun."""
