"""The columns of a recorded motion, taken from the rows of its cycles."""

from __future__ import annotations

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime.cycle_row import Row

_AXIS_COLUMNS = (
    "setpoint_rad",
    "setpoint_velocity_rad_s",
    "position_rad",
    "torque_actual_Nm",
    "torque_sent_Nm",
    "effort_Nm",
    "compensation_Nm",
    "statusword",
    "valid",
    "index_rad",
    "index_known",
)


def column_names(n: int) -> list[str]:
    """Return the names of a raw log's columns for n axes."""
    return ["cycle", "time_s", *(f"{name}[{i}]" for i in range(n) for name in _AXIS_COLUMNS)]


def raw_rows(rows: Row) -> FloatArray:
    """Return the rows of cycles (samples,) as those of a raw log, (samples, columns)."""
    n, width = rows["position_rad"].shape[1], len(_AXIS_COLUMNS)
    raw = np.empty((len(rows), 2 + n * width))
    raw[:, 0], raw[:, 1] = rows["cycle"], rows["time_s"]
    for k, name in enumerate(_AXIS_COLUMNS):
        raw[:, 2 + k :: width] = rows[name]
    return raw
