"""What the real robot reached: Tremblay (thesis), tables 2.1 and 2.2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

OPERATION, SCALE, PLACE = "operation", "scale", "place"


@dataclass(frozen=True)
class Row:
    """One row of both tables; x and y in mm, times in s; sigma of the time over the runs."""

    variable: str
    level: str
    mean_mm: tuple[float, float]
    three_sigma_mm: tuple[float, float]
    time_s: float
    time_sigma_s: float


ROWS: Final = (
    Row(OPERATION, "manual", (0.000, -0.070), (3.61, 3.03), 47.5, 3.6),
    Row(OPERATION, "remote", (-0.343, 0.193), (4.31, 3.39), 89.0, 11.5),
    Row(OPERATION, "on site", (-1.059, 0.083), (3.83, 3.84), 39.9, 5.4),
    Row(SCALE, "8:1", (-0.704, 0.261), (5.30, 4.87), 63.4, 26.2),
    Row(SCALE, "4:1", (-0.826, 0.005), (3.96, 3.36), 58.5, 24.4),
    Row(SCALE, "2:1", (-0.413, 0.087), (3.32, 2.39), 64.4, 26.6),
    Row(PLACE, "A", (-0.632, 0.199), (3.86, 3.08), 65.1, 26.7),
    Row(PLACE, "B", (-0.624, 0.286), (4.17, 3.51), 61.4, 26.7),
    Row(PLACE, "C", (-0.604, -0.210), (4.58, 3.90), 61.0, 24.0),
)

ROUND_TRIPS_S: Final = {"manual": 0.0, "on site": 0.35, "remote": 0.73}
"""Section 2.7. By hand there was no robot between, and hardly a delay: a round trip of 0 s stands
beside that row."""
P_LIMIT: Final = 0.05
SIGNIFICANT: Final = {OPERATION: True, SCALE: True, PLACE: False}
"""Whether the mean norm of the errors differs between its levels (section 2.8, at 95 %)."""
