"""One cycle as a row of fixed size: everything that is recorded, shown or streamed of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Row = NDArray[np.void]
"""A structured array of the type that `cycle_dtype` returns."""

_SCALARS = (
    ("cycle", "<u8"),  # SYNCs since cycles began
    ("time_s", "<f8"),  # bus time of the SYNC
    ("stamp_ns", "<i8"),  # CLOCK_MONOTONIC when the loop woke for it
    ("lateness_s", "<f8"),  # wake-up behind its deadline; 0 in lockstep
    ("exchange_s", "<f8"),  # from SYNC until the last answer, or until it was given up
    ("compute_s", "<f8"),  # from the last answer until the last command has been sent
    ("missed", "<u8"),  # answers that did not come in time, over all axes, since the beginning
    ("late_cycles", "<u8"),  # cycles that began more than a tenth of a period late
    ("stream_age_s", "<f8"),  # age of the newest sample of the set-point stream; nan without
    ("stream_buttons", "<u8"),  # those of the sample that is played, see stream_buttons.py
    ("state", "<u1"),  # LoopState
    ("program", "<u1"),  # its number in the robot's description
    ("reaction", "<u1"),  # Reaction of this cycle
    ("limit", "<u1"),  # Limit code that caused it, 0 without
    ("limit_axis", "<i2"),  # the axis concerned, -1 without
    ("answered", "<u2"),  # axes that answered this SYNC
)
_AXES = (
    ("setpoint_rad", "<f8"),
    ("setpoint_velocity_rad_s", "<f8"),
    ("position_rad", "<f8"),
    ("velocity_rad_s", "<f8"),  # estimated
    ("torque_actual_Nm", "<f8"),
    ("torque_asked_Nm", "<f8"),  # by the controller, before limits
    ("torque_sent_Nm", "<f8"),
    ("effort_Nm", "<f8"),
    ("compensation_Nm", "<f8"),
    ("tension_N", "<f8"),  # measured or estimated; nan where neither
    ("cable_length_m", "<f8"),  # nan where it is not known
    ("index_rad", "<f8"),
    ("statusword", "<u2"),
    ("valid", "?"),
    ("alive", "?"),
    ("rate_ok", "?"),
    ("index_known", "?"),
    ("tension_measured", "?"),
)
_POSES = (
    ("pose", "<f8"),  # x y z in m, quaternion w x y z; nan where it is not known
    ("pose_setpoint", "<f8"),
)
SCALARS = tuple(name for name, _ in _SCALARS)
AXES = tuple(name for name, _ in _AXES)
POSES = tuple(name for name, _ in _POSES)
FIELDS = (*SCALARS, *AXES, *POSES)
WALL_TIMES = ("stamp_ns", "lateness_s", "exchange_s", "compute_s", "late_cycles")
"""What a row tells of the machine that ran the loop; all else follows from the bus."""


def cycle_dtype(n: int) -> np.dtype[np.void]:
    """Return the type of a row for n axes, aligned to 8 bytes."""
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = [*_SCALARS]
    fields += [(name, kind, (n,)) for name, kind in _AXES]
    fields += [(name, kind, (7,)) for name, kind in _POSES]
    packed = np.dtype(fields)
    spare = -packed.itemsize % 8
    return np.dtype([*fields, ("spare", "u1", (spare,))]) if spare else packed
