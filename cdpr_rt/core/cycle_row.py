"""One cycle as a row of fixed size: all values that are recorded, shown or streamed.

Each quantity is declared only here. The type of the row, its sources, recordings and their schemas,
the status, the live view and the metrics are derived from these tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.states import LoopState, Reaction

Row = NDArray[np.void]
"""A structured array of the type that `cycle_dtype` returns."""


@dataclass(frozen=True)
class CycleField:
    """One quantity of a cycle; its unit is the end of its name."""

    name: str
    kind: str
    """Type of one value, as numpy writes it."""
    source: str
    """Path of attributes from the engine to the value."""
    meaning: str
    wall: bool = False
    """Whether the quantity depends on the computer that runs the loop; all others are determined by
    the bus."""
    status: bool = False
    """Whether the status shows it for each axis; scalars are always shown."""
    live: bool = False
    """Whether the live view shows it: angles in degrees, the longest of each wall time in ms."""
    metric: str = ""
    """Name of the Prometheus metric without prefix, or ""; wall times are histograms."""
    labels: type[LoopState] | type[Reaction] | None = None
    """Enumeration that names its numbers."""

    @property
    def is_wall_time(self) -> bool:
        """Whether the quantity is a duration by the wall clock, in seconds."""
        return self.wall and self.kind == "<f8"


def _listed(members: type[IntEnum], word: str) -> str:
    return ", ".join(f"{member.value} {getattr(member, word)}" for member in members)


SCALAR_FIELDS: Final = (
    CycleField(
        "cycle", "<u8", "cycle.device.feedback.cycle", "SYNCs since cycles began", metric="cycles"
    ),
    CycleField("time_s", "<f8", "cycle.device.feedback.time_s", "bus time of the SYNC"),
    CycleField(
        "stamp_ns", "<i8", "cycle.began_ns", "CLOCK_MONOTONIC when the loop woke for it", wall=True
    ),
    CycleField(
        "lateness_s",
        "<f8",
        "cycle.late_s",
        "delay of the wake-up after its deadline; 0 in lockstep",
        wall=True,
        live=True,
        metric="lateness",
    ),
    CycleField(
        "exchange_s",
        "<f8",
        "exchange_s",
        "from SYNC until the last answer, or the end of the wait for it",
        wall=True,
        live=True,
        metric="exchange",
    ),
    CycleField(
        "compute_s",
        "<f8",
        "compute_s",
        "from the last answer until the last command had been sent",
        wall=True,
        live=True,
        metric="compute",
    ),
    CycleField(
        "missed",
        "<u8",
        "missed",
        "answers that did not come in time, over all axes, since the beginning",
        live=True,
        metric="missed_answers",
    ),
    CycleField(
        "late_cycles",
        "<u8",
        "cycle.lateness.late",
        "cycles that began more than a tenth of a period late, since the beginning",
        wall=True,
        live=True,
        metric="late_cycles",
    ),
    CycleField(
        "stream_age_s",
        "<f8",
        "last_program.stream_age_s",
        "age of the newest sample of the set-point stream; null without a stream",
        live=True,
        metric="stream_age_seconds",
    ),
    CycleField(
        "stream_buttons",
        "<u8",
        "last_program.stream_buttons",
        "buttons of the sample that is played: bit 0 the clutch, "
        "bits 8 to 15 the number of the confirmation",
    ),
    CycleField(
        "state",
        "<u1",
        "life.state",
        f"state of the loop: {_listed(LoopState, 'label')}",
        labels=LoopState,
    ),
    CycleField(
        "program", "<u1", "program_number", "number of the program in the description's list"
    ),
    CycleField(
        "reaction",
        "<u1",
        "reaction",
        f"reaction of the supervisor in this cycle: {_listed(Reaction, 'label')}",
        labels=Reaction,
    ),
    CycleField("limit", "<u1", "limit", f"the limit that caused it: {_listed(Limit, 'key')}"),
    CycleField("limit_axis", "<i2", "limit_axis", "the axis concerned, -1 for none"),
    CycleField("answered", "<u2", "answered", "axes that answered this SYNC", live=True),
    CycleField(
        "lengths_disagree_m",
        "<f8",
        "lengths_disagree_m",
        "disagreement of a platform's cable lengths, as checked by the limit "
        "`lengths`; 0 with slack cables or if none is redundant, null without power",
        live=True,
        metric="lengths_disagree_metres",
    ),
)
"""One value per cycle."""

AXIS_FIELDS: Final = (
    CycleField(
        "setpoint_rad",
        "<f8",
        "setpoint.position_rad",
        "set-point of the motor",
        status=True,
        live=True,
    ),
    CycleField(
        "setpoint_velocity_rad_s", "<f8", "setpoint.velocity_rad_s", "speed of the set-point"
    ),
    CycleField(
        "position_rad",
        "<f8",
        "cycle.device.feedback.position_rad",
        "motor angle as the encoder gives it",
        status=True,
        live=True,
        metric="position_radians",
    ),
    CycleField(
        "velocity_rad_s",
        "<f8",
        "parts.estimator.estimate.velocity_rad_s",
        "motor speed, estimated",
        status=True,
        live=True,
        metric="velocity_radians_per_second",
    ),
    CycleField(
        "torque_actual_Nm",
        "<f8",
        "cycle.device.feedback.torque_Nm",
        "torque that the drive reports",
        status=True,
        live=True,
        metric="torque_newton_metres",
    ),
    CycleField(
        "torque_asked_Nm", "<f8", "asked_Nm", "torque that the controller wanted, before limits"
    ),
    CycleField(
        "torque_sent_Nm",
        "<f8",
        "cycle.device.command.sent_torque_Nm",
        "torque that was sent",
        status=True,
        live=True,
    ),
    CycleField(
        "effort_Nm",
        "<f8",
        "program.controller.effort_Nm",
        "the controller's part of the torque that was sent",
    ),
    CycleField(
        "compensation_Nm",
        "<f8",
        "program.controller.compensation_Nm",
        "the compensation's part of the torque that was sent",
        live=True,
    ),
    CycleField(
        "tension_N",
        "<f8",
        "parts.estimator.estimate.tension_N",
        "cable tension, measured or estimated; null if unknown",
        status=True,
        metric="tension_newtons",
    ),
    CycleField(
        "cable_length_m",
        "<f8",
        "parts.estimator.estimate.cable_length_m",
        "length of the cable; null if unknown",
        status=True,
        live=True,
        metric="cable_length_metres",
    ),
    CycleField(
        "index_rad",
        "<f8",
        "cycle.device.feedback.index_rad",
        "motor angle of the encoder's index, if known",
    ),
    CycleField(
        "statusword",
        "<u2",
        "cycle.device.feedback.statusword",
        "CiA 402 statusword (6041h)",
        status=True,
    ),
    CycleField(
        "valid",
        "?",
        "cycle.device.feedback.valid",
        "whether the drive answered this SYNC",
        status=True,
    ),
    CycleField(
        "alive",
        "?",
        "cycle.device.feedback.alive",
        "whether its heartbeats arrive in time",
        status=True,
    ),
    CycleField(
        "rate_ok", "?", "cycle.device.feedback.rate_ok", "whether its answers arrive at their rate"
    ),
    CycleField(
        "index_known",
        "?",
        "cycle.device.feedback.index_known",
        "whether the encoder's index has been found",
        status=True,
    ),
    CycleField(
        "tension_measured",
        "?",
        "parts.estimator.estimate.tension_measured",
        "whether the tension comes from a sensor",
        status=True,
    ),
)
"""One value for each axis."""

_SEVEN = "x, y, z in m and quaternion w, x, y, z; null if unknown"
POSE_FIELDS: Final = (
    CycleField("pose", "<f8", "last_program.pose", f"the platform's pose: {_SEVEN}"),
    CycleField(
        "pose_setpoint",
        "<f8",
        "program.pose_setpoint",
        f"set-point of the platform's pose: {_SEVEN}",
    ),
)
"""Seven values, nan if they are not known."""

FIELDS: Final = {field.name: field for field in (*SCALAR_FIELDS, *AXIS_FIELDS, *POSE_FIELDS)}
"""All fields of a row by name, in the order of the row."""
SCALARS: Final = tuple(field.name for field in SCALAR_FIELDS)
AXES: Final = tuple(field.name for field in AXIS_FIELDS)
POSES: Final = tuple(field.name for field in POSE_FIELDS)
WALL_TIMES: Final = tuple(field.name for field in FIELDS.values() if field.wall)


_COORDINATES: Final = ("x", "y", "z", "qw", "qx", "qy", "qz")


def column_names(field: str, shape: tuple[int, ...], axes: Sequence[str]) -> list[str]:
    """Return the names of a field's columns in a flat table; `shape` is that of its values.

    They are `time_s` for a scalar, `tension_N[left]` for each axis, `pose[qw]` for a pose. Numbers
    from 0 replace names that are missing or not distinct.
    """
    if len(shape) == 1:
        return [field]
    names = _COORDINATES if field in POSES else axes
    distinct = len(set(names)) == len(names) == shape[1]
    return [f"{field}[{name}]" for name in (names if distinct else range(shape[1]))]


def cycle_dtype(n: int) -> np.dtype[np.void]:
    """Return the type of a row for n axes, aligned to 8 bytes."""
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    fields += [(field.name, field.kind) for field in SCALAR_FIELDS]
    fields += [(field.name, field.kind, (n,)) for field in AXIS_FIELDS]
    fields += [(field.name, field.kind, (7,)) for field in POSE_FIELDS]
    packed = np.dtype(fields)
    spare = -packed.itemsize % 8
    return np.dtype([*fields, ("spare", "u1", (spare,))]) if spare else packed
