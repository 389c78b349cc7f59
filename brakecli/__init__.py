"""Vibration of a brake shoe that slides on a rough wheel, with Amontons friction."""

__version__ = "0.5.0"
