"""Types of the arrays over axes, cables and directions, and their root mean square."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
WordArray = NDArray[np.uint16]


def real_array(given: ArrayLike) -> FloatArray:
    """Convert real numbers to an array; raises TypeError or ValueError for anything else."""
    array = np.asarray(given)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"values of type {array.dtype}; want real numbers")
    return array.astype(float, copy=False)


def rms(values: FloatArray) -> float:
    """Return sqrt(Σ|v|²/m), the root mean square of m numbers (m,) or vectors (m, d).

    It is nan if m is 0.
    """
    return math.sqrt(float(np.square(values).sum()) / len(values)) if len(values) else math.nan


def read_only(array: FloatArray) -> FloatArray:
    """Return a view that shows the values of `array` and cannot be written."""
    view = array.view()
    view.flags.writeable = False
    return view
