"""Exchange of one cycle between the controller and n axes: feedback, command, set-point."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, WordArray
from cdpr_rt.core.clock import Clock


class AxisFeedback:
    """State of n axes as latched by the drives at one SYNC; overwritten in place every cycle.

    Shapes are (n,). Angles are motor angles in the drive's own origin; `index_rad` is where the
    encoder index lies on that scale, meaningful where `index_known`.
    """

    def __init__(self, n: int) -> None:
        self.cycle = 0
        """SYNCs since the cyclic exchange was started."""
        self.time_s = 0.0
        """Bus time of the SYNC, counted from the first cycle."""
        self.position_rad: FloatArray = np.zeros(n)
        self.torque_Nm: FloatArray = np.zeros(n)
        """Torque actual value (6077h)."""
        self.statusword: WordArray = np.zeros(n, np.uint16)
        self.valid: BoolArray = np.zeros(n, np.bool_)
        """Whether the axis answered this SYNC."""
        self.alive: BoolArray = np.zeros(n, np.bool_)
        """Whether its drive is heard and operational, as of the end of the last cycle."""
        self.rate_ok: BoolArray = np.zeros(n, np.bool_)
        """Whether its answers come once to each SYNC: just now, and hardly ever not before."""
        self.index_rad: FloatArray = np.zeros(n)
        self.index_known: BoolArray = np.zeros(n, np.bool_)


class AxisCommand:
    """Command of one cycle to n axes; shapes are (n,)."""

    def __init__(self, n: int) -> None:
        self.torque_Nm: FloatArray = np.zeros(n)
        self.sent_torque_Nm: FloatArray = np.zeros(n)
        """Torque that went out after quantisation to the drive's unit; written by the device."""


class Setpoint:
    """Desired motion of n axes at one instant; shapes are (n,), motor side, drive's origin."""

    def __init__(self, n: int) -> None:
        self.position_rad: FloatArray = np.zeros(n)
        self.velocity_rad_s: FloatArray = np.zeros(n)
        self.acceleration_rad_s2: FloatArray = np.zeros(n)
        self.arrays = (self.position_rad, self.velocity_rad_s, self.acceleration_rad_s2)


class AxisDevice(Protocol):
    """A group of n axes that is exchanged once per cycle.

    Order in a cycle: `sync`, `receive`, then the controller writes `command`, then `transmit`.
    """

    n: int
    period_s: float
    lockstep: bool
    """Whether the next SYNC goes out as soon as the last one has been answered."""
    commands_s: float
    """How long the commands of a cycle are on the wire at most, on the slowest bus."""
    feedback: AxisFeedback
    command: AxisCommand

    @property
    def clock(self) -> Clock:
        """The robot's time."""

    def sync(self) -> None:
        """Send the SYNC that opens the cycle."""

    def receive(self) -> int:
        """Wait for the answers, decode them into `feedback`; return how many axes answered."""

    def transmit(self) -> None:
        """Encode `command` and send it, to act from the next SYNC on."""

    def alarm(self) -> str:
        """Return why the drives must not go on being driven, or an empty text; cheap to call."""
