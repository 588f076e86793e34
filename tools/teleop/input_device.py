"""Input devices of a teleoperation: their samples, and how they end."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Protocol

from cdpr_rt.service.stream_packet import LARGEST_SCALE, REACH_M
from cdpr_tools.errors import BadInputError

SMALLEST_SCALE: Final = 1e-3
_REACH_USED: Final = 0.9
TURN_RAD_PER_m: Final = math.radians(100.0)
"""Rotation of a hand for an input of one metre: a tenth of a degree per millimetre."""

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Directions = tuple[int, tuple[int, ...]]
"""Number of coordinates of a platform, and the room's axes about which it turns."""


@dataclass(frozen=True)
class End:
    """Why a teleoperation ends."""

    text: str
    failed: bool = False
    """Whether the teleoperation ends because of a failure."""
    arrive: bool = False
    """Whether the robot first moves to its last target; otherwise it brakes immediately."""


@dataclass(frozen=True)
class InputSample:
    """One sample of an input device."""

    position_m: Vector = (0.0, 0.0, 0.0)
    """Displacement since the start, unscaled; in a plane the last coordinate is ignored."""
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Rotation since the start, w x y z, about the room's axes."""
    clutch: bool = True
    """Whether the clutch is open: the robot does not follow."""
    confirmed: int = 0
    """Number of targets confirmed so far."""
    trouble: str = ""
    """Why the device has no position at present; the robot holds meanwhile."""
    end: End | None = None


class InputDevice(Protocol):
    """A device that is polled for samples; never waits."""

    @property
    def hint(self) -> str:
        """Return a line on how to use it."""

    def read(self, now_s: float) -> InputSample:
        """Return the sample at `now_s`, which never decreases."""

    def close(self) -> None:
        """Restore terminal or device."""


class Hand:
    """A position, limited to what packets can carry at a scale, and a rotation."""

    def __init__(self, scale: float) -> None:
        self._reach_m = _REACH_USED * REACH_M / max(scale, 1.0)
        self.go_back()

    def go_back(self) -> None:
        """Return the hand to its start."""
        self.position_m: Vector = (0.0, 0.0, 0.0)
        self.quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def move(self, way_m: Vector) -> None:
        """Move the hand by this vector."""
        reach_m = self._reach_m
        x, y, z = (
            min(max(at + by, -reach_m), reach_m)
            for at, by in zip(self.position_m, way_m, strict=True)
        )
        self.position_m = (x, y, z)

    def turn(self, vector_rad: Vector) -> None:
        """Turn the hand further by a rotation vector along the room's axes."""
        self.quaternion = product(from_vector(vector_rad), self.quaternion)


def from_vector(vector_rad: Vector) -> Quaternion:
    """Return the quaternion w x y z of a rotation vector."""
    angle = math.hypot(*vector_rad)
    share = math.sin(0.5 * angle) / angle if angle > 0.0 else 0.0
    x, y, z = vector_rad
    return math.cos(0.5 * angle), share * x, share * y, share * z


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the rotation by `q`, then by `p`, normalised."""
    w = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3]
    x = p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2]
    y = p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1]
    z = p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]
    size = math.hypot(w, x, y, z)
    return w / size, x / size, y / size, z / size


def parse_scale(text: str) -> float:
    """Return the robot's motion in metres for one metre of the hand: 8 for "8:1", or a number.

    Raises BadInputError.
    """
    robot, colon, hand = text.partition(":")
    try:
        scale = float(robot) / (float(hand) if colon else 1.0)
    except (ValueError, ZeroDivisionError):
        scale = math.nan
    if not SMALLEST_SCALE <= scale <= LARGEST_SCALE:
        raise BadInputError(
            f"--scale {text}: allowed: {SMALLEST_SCALE:g} to {LARGEST_SCALE:g}, as a number or as "
            "ROBOT:HAND such as 8:1"
        )
    return scale
