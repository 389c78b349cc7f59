"""The types of arrays; nothing here waits for compiled code."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
VECTOR = 1
ROWS = 2
CUBE = 3
"""Contiguous arrays of doubles in the signature of an entry: their dimensions."""
