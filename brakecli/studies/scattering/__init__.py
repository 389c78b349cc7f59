"""Brakes are not built to their drawing: how likely they vibrate, and which scatter decides on it."""
