"""Root mean square of numbers and of vectors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdpr_rt.arrays import rms


@pytest.mark.parametrize(
    ("values", "value"),
    [
        ([3.0, -4.0], math.sqrt(12.5)),
        ([[3.0, 4.0], [0.0, 0.0]], math.sqrt(12.5)),
        ([], math.nan),
        ([1.0, math.nan], math.nan),
    ],
)
def test_rms_is_taken_over_numbers_or_vector_lengths(values: list, value: float) -> None:  # type: ignore[type-arg]
    assert rms(np.array(values)) == pytest.approx(value, nan_ok=True)
