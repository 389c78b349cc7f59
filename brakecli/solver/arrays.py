"""The types of arrays; nothing here waits for compiled code."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
VECTOR, ROWS, CUBE = range(1, 4)
"""Contiguous arrays of doubles in the signature of an entry: their dimensions."""
