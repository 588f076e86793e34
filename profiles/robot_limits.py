"""The limits that a supervisor monitors, with number, text and reaction, and a robot's values."""

from __future__ import annotations

import math
from collections.abc import Iterator
from enum import IntEnum
from typing import Annotated, Any, Final, Literal, Self

from pydantic import BeforeValidator, Field, create_model, model_validator

from cdpr_profiles.reader import Profile

_DEG = 180.0 / math.pi


class Limit(IntEnum):
    """A limit that can be exceeded; a robot's file uses its name in lower case.

    The value of a member is its number. Its further data are the reaction to it, the text with the
    measured and the allowed value, their SI unit, the factor to the unit of the text, and the data
    that are unreliable after it.

    The numbers are in recordings and in compiled kernels: a new one gets a new number.
    """

    reaction: str
    """Reaction to the limit, unless a robot's file has a more severe one."""
    text: str
    """Measured and allowed value in the unit of messages; "" if another part reports the reason."""
    unit: str
    factor: float
    unreliable: Literal["", "pose", "lengths"]
    """Data that are unreliable after the limit was exceeded.

    `pose`: the platform's pose is unreliable, or not all winches obey. `lengths`: the cables'
    lengths are unreliable too.
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
        "the cable seems broken or has slipped: tension fell suddenly to {:.1f} N, from above "
        "{:.1f} N",
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
        "the loop was delayed for {:.0f} ms, {:.0f} ms allowed",
        "s",
        1e3,
    )
    NOT_FINITE = (
        15,
        "quick stop",
        "the controller's torque is {}; a finite number is required",
        "Nm",
        1.0,
        "pose",
    )
    SAFETY_STOP = 16, "controlled stop"
    """A safety monitor beside the axes requests a controlled stop."""
    SAFETY_ALARM = 17, "torque off"
    """A safety monitor beside the axes requests that the torque is removed."""
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
    """The angle changed by more than a motor can turn since its last feedback."""
    LENGTHS_JUMP = (
        21,
        "controlled stop",
        "the cables' lengths suddenly changed relative to each other by {:.1f} mm, {:.1f} mm "
        "allowed: a cable slipped, broke or met an obstacle",
        "m",
        1e3,
        "lengths",
    )
    """A cable's length has suddenly changed relative to the others."""

    @property
    def key(self) -> str:
        """Name of the limit in a robot's file."""
        return self.name.lower()


_SEVERITY: Final = ("clamp", "hold", "controlled stop", "quick stop", "torque off")
"""Reactions to a limit, from the mildest to the most severe."""


def _one_or_each(value: Any) -> Any:
    return value if isinstance(value, tuple) else (value,)


_Positive = Annotated[float, Field(gt=0, le=1e6)]
PerAxis = Annotated[tuple[_Positive, ...], BeforeValidator(_one_or_each)]
"""One value for all axes (a number in the file), or one for each."""


def _reaction_fields() -> dict[str, Any]:
    return {
        limit.key: (Literal[_SEVERITY[_SEVERITY.index(limit.reaction) :]], limit.reaction)
        for limit in Limit
        if limit
    }


class Reactions(
    create_model("Reactions", __base__=Profile, **_reaction_fields())  # type: ignore[misc]
):
    """The reaction to each limit: the default or a more severe one.

    If a platform can be lowered, a controlled stop replaces quick stop as the default.
    """


class RobotLimits(Profile):
    """The limits of a robot's axes, at the motors unless stated otherwise.

    Limits that the file does not give are derived from motors and cables. If these are unknown, the
    limit is not monitored. The documentation describes each.
    """

    torque_Nm: PerAxis | None = None
    torque_rate_Nm_s: PerAxis | None = None
    speed_rad_s: PerAxis | None = None
    following_error_rad: PerAxis = (math.tau,)
    cable_length_min_m: PerAxis | None = None
    cable_length_max_m: PerAxis | None = None
    tension_min_N: PerAxis | None = None
    tension_max_N: PerAxis | None = None
    slack_N: PerAxis | None = None
    slack_s: float = Field(default=0.1, ge=0, le=10)
    """Longest time that a tension may be below `tension_min_N`, or below `slack_N`."""
    broken_within_s: float = Field(default=0.05, gt=0, le=1)
    """If a tension falls from `tension_min_N` to `slack_N` faster than this, the cable broke."""
    missed_cycles: int = Field(default=10, ge=0, le=1000)
    """Tolerated number of consecutive cycles without an answer."""
    missed_in_window: int = Field(default=50, ge=0, le=10_000)
    window_cycles: int = Field(default=1000, ge=1, le=10_000)
    stale_cycles: int = Field(default=250, ge=1, le=10_000)
    """Tolerated number of cycles in which a drive is silent or its answers are irregular."""
    lengths_disagree_m: float | None = Field(default=None, gt=0, le=10)
    """Largest normalised residual by which the cables of a platform may contradict each other; the
    default depends on the size of the frame, and on whether it is calibrated."""
    late_s: float = Field(default=0.05, gt=0, le=10)
    """Longest allowed delay of the loop."""
    reactions: Reactions = Reactions()

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for low, high in (
            ("cable_length_min_m", "cable_length_max_m"),
            ("slack_N", "tension_min_N"),
            ("tension_min_N", "tension_max_N"),
        ):
            for i, (a, b) in enumerate(_pairs(getattr(self, low), getattr(self, high))):
                if a >= b:
                    raise ValueError(f"{low}[{i}]: value {a:g}; allowed: below {high} ({b:g})")
        if self.slack_N is not None and self.tension_min_N is None:
            raise ValueError("slack_N: allowed only with tension_min_N")
        return self

    def faults(self, axes: int) -> Iterator[tuple[str, str]]:
        """Yield (key, problem) for limits that have neither one value nor one for each axis."""
        for key in type(self).model_fields:
            value = getattr(self, key)
            if isinstance(value, tuple) and len(value) not in (1, axes):
                problem = f"{len(value)} values; allowed: 1 or {axes}, one for each axis"
                yield f"limits.{key}", problem


def _pairs(
    low: tuple[float, ...] | None, high: tuple[float, ...] | None
) -> Iterator[tuple[float, float]]:
    if low is None or high is None:
        return
    n = max(len(low), len(high))
    if {len(low), len(high)} <= {1, n}:
        yield from zip(low * (n // len(low)), high * (n // len(high)), strict=True)
