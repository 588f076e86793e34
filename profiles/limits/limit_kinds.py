"""Each limit that a supervisor watches: its number, its words, and what is done about it."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Literal

_DEG = 180.0 / math.pi


class Limit(IntEnum):
    """What can be exceeded; a robot's file calls it by this name in small letters.

    A member is its number, the reaction to it, the text with its value and what is allowed, their
    unit in SI, the factor to the unit of the text, and what is unreliable after it.

    The numbers are in recordings and in compiled kernels: a new one gets a new number.
    """

    reaction: str
    """What is done about it, where a robot's file says nothing more severe."""
    text: str
    """Value and allowed value in the unit people read; "" where others tell the reason."""
    unit: str
    factor: float
    unreliable: Literal["", "pose", "lengths"]
    """What is not to be relied on after it.

    `pose`: that of a platform is not to be believed, or not all of its winches obey. `lengths`: nor
    are the cables' lengths.
    """

    def __new__(
        cls,
        number: int,
        reaction: str = "none",
        text: str = "",
        unit: str = "",
        factor: float = 1.0,
        unreliable: Literal["", "pose", "lengths"] = "",
    ) -> Limit:
        """Return the member with this number."""
        member = int.__new__(cls, number)
        member._value_ = number
        member.reaction, member.text, member.unit = reaction, text, unit
        member.factor, member.unreliable = factor, unreliable
        return member

    NONE = 0
    TORQUE = 1, "clamp", "torque {:.3g} Nm, {:.3g} Nm allowed", "Nm"
    TORQUE_RATE = 2, "clamp", "torque rate {:.3g} Nm/s, {:.3g} Nm/s allowed", "Nm/s"
    SPEED = (3, "quick stop", "speed {:.0f} deg/s, {:.0f} deg/s allowed", "rad/s", _DEG, "lengths")
    FOLLOWING_ERROR = (
        4,
        "quick stop",
        "following error {:.1f} deg, {:.1f} deg allowed",
        "rad",
        _DEG,
        "lengths",
    )
    CABLE_LENGTH = 5, "hold", "cable length {:.3f} m, {:.3f} m allowed", "m"
    TENSION_LOW = 6, "hold", "tension {:.1f} N, at least {:.1f} N required", "N"
    TENSION_HIGH = (7, "controlled stop", "tension {:.1f} N, {:.1f} N allowed", "N", 1.0, "pose")
    SLACK = 8, "hold", "the cable is slack: tension {:.1f} N, slack below {:.1f} N", "N"
    BROKEN_CABLE = (
        9,
        "quick stop",
        "the cable seems broken: tension fell to {:.1f} N at once, from above {:.1f} N",
        "N",
        1.0,
        "lengths",
    )
    TENSION_SENSOR = 10, "controlled stop", "the tension sensor gives no valid reading"
    STALE = (
        11,
        "quick stop",
        "feedback silent or irregular for {:.0f} cycles, {:.0f} allowed",
        "",
        1.0,
        "pose",
    )
    MISSED = 12, "quick stop", "no feedback for {:.0f} cycles, {:.0f} allowed", "", 1.0, "pose"
    MISSED_IN_WINDOW = (13, "controlled stop", "{:.0f} answers missed in a window, {:.0f} allowed")
    LATE = (
        14,
        "controlled stop",
        "the loop was held up for {:.0f} ms, {:.0f} ms allowed",
        "s",
        1e3,
    )
    NOT_FINITE = (
        15,
        "quick stop",
        "the controller's torque is {}, a finite number is required",
        "Nm",
        1.0,
        "pose",
    )
    SAFETY_STOP = 16, "controlled stop"
    """A watch beside the axes wants the motion braked."""
    SAFETY_ALARM = 17, "torque off"
    """A watch beside the axes wants the torque gone."""
    DRIVE = 18, "quick stop", "", "", 1.0, "pose"
    """A drive or its bus has failed."""
    LENGTHS = (
        19,
        "controlled stop",
        "the cables' lengths disagree by {:.1f} mm, {:.1f} mm allowed: cable or encoder failed",
        "m",
        1e3,
        "lengths",
    )
    """The cables' lengths do not agree with each other."""
    ENCODER_JUMP = (
        20,
        "quick stop",
        "angle jumped by {:.1f} deg, {:.1f} deg possible",
        "rad",
        _DEG,
        "lengths",
    )
    """A motor cannot have turned so far since it was last heard."""

    @property
    def key(self) -> str:
        """Its name in a robot's file."""
        return self.name.lower()
