"""What a supervisor limits, what it tolerates, and what is done about each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime.states import Reaction
from profiles.robot_limits import Reactions


class Limit(IntEnum):
    """What can be exceeded; a robot's file calls it by this name in small letters.

    The numbers are in recordings and in compiled kernels: a new one gets a new number.
    """

    NONE = 0
    TORQUE = 1
    TORQUE_RATE = 2
    SPEED = 3
    FOLLOWING_ERROR = 4
    CABLE_LENGTH = 5
    TENSION_LOW = 6
    TENSION_HIGH = 7
    SLACK = 8
    BROKEN_CABLE = 9
    TENSION_SENSOR = 10
    STALE = 11
    MISSED = 12
    MISSED_IN_WINDOW = 13
    LATE = 14
    NOT_FINITE = 15
    SAFETY_STOP = 16
    """A watch beside the axes wants the motion braked."""
    SAFETY_ALARM = 17
    """A watch beside the axes wants the torque gone."""
    DRIVE = 18
    """A drive or its bus has failed."""
    LENGTHS = 19
    """The cables' lengths do not agree with each other."""
    ENCODER_JUMP = 20
    """A motor cannot have turned so far since it was last heard."""

    @property
    def key(self) -> str:
        """Its name in a robot's file."""
        return self.name.lower()


BLINDING: Final = frozenset(
    {
        Limit.SPEED,
        Limit.FOLLOWING_ERROR,
        Limit.TENSION_HIGH,
        Limit.BROKEN_CABLE,
        Limit.STALE,
        Limit.MISSED,
        Limit.NOT_FINITE,
        Limit.DRIVE,
        Limit.LENGTHS,
        Limit.ENCODER_JUMP,
    }
)
"""After these a platform's pose is not to be believed, or not all of its winches obey."""

MISLEADING: Final = frozenset(
    {
        Limit.SPEED,
        Limit.FOLLOWING_ERROR,
        Limit.BROKEN_CABLE,
        Limit.LENGTHS,
        Limit.ENCODER_JUMP,
    }
)
"""After these not even the cables' lengths are known any more."""


def reactions_of(named: Reactions, lowers: bool = False) -> dict[Limit, Reaction]:
    """Return what a robot's file wants done about each limit.

    Of a robot whose platform can be lowered, quick stops of which its file says nothing are
    controlled stops: the winches that are left let it down.
    """
    by_label = {reaction.label: reaction for reaction in Reaction}
    wanted = {limit: by_label[getattr(named, limit.key)] for limit in Limit if limit}
    if lowers:
        for limit in BLINDING:
            if limit.key not in named.model_fields_set:
                wanted[limit] = Reaction.CONTROLLED_STOP
    return wanted


DEFAULT_REACTIONS: Final = reactions_of(Reactions())

_DEG: Final = 180.0 / math.pi
TEXTS: Final[dict[Limit, tuple[str, float, str]]] = {
    Limit.TORQUE: ("torque {:.3g} Nm, {:.3g} Nm allowed", 1.0, "Nm"),
    Limit.TORQUE_RATE: ("torque rate {:.3g} Nm/s, {:.3g} Nm/s allowed", 1.0, "Nm/s"),
    Limit.SPEED: ("speed {:.0f} deg/s, {:.0f} deg/s allowed", _DEG, "rad/s"),
    Limit.FOLLOWING_ERROR: ("following error {:.1f} deg, {:.1f} deg allowed", _DEG, "rad"),
    Limit.CABLE_LENGTH: ("cable length {:.3f} m, {:.3f} m allowed", 1.0, "m"),
    Limit.TENSION_LOW: ("tension {:.1f} N, at least {:.1f} N required", 1.0, "N"),
    Limit.TENSION_HIGH: ("tension {:.1f} N, {:.1f} N allowed", 1.0, "N"),
    Limit.SLACK: ("the cable is slack: tension {:.1f} N, slack below {:.1f} N", 1.0, "N"),
    Limit.BROKEN_CABLE: (
        "the cable seems broken: tension fell to {:.1f} N at once, from above {:.1f} N",
        1.0,
        "N",
    ),
    Limit.TENSION_SENSOR: ("the tension sensor gives no valid reading", 1.0, ""),
    Limit.STALE: ("feedback silent or irregular for {:.0f} cycles, {:.0f} allowed", 1.0, ""),
    Limit.MISSED: ("no feedback for {:.0f} cycles, {:.0f} allowed", 1.0, ""),
    Limit.MISSED_IN_WINDOW: ("{:.0f} answers missed in a window, {:.0f} allowed", 1.0, ""),
    Limit.LATE: ("the loop was held up for {:.0f} ms, {:.0f} ms allowed", 1e3, "s"),
    Limit.LENGTHS: (
        "the cables' lengths disagree by {:.1f} mm, {:.1f} mm allowed: cable or encoder failed",
        1e3,
        "m",
    ),
    Limit.ENCODER_JUMP: ("angle jumped by {:.1f} deg, {:.1f} deg possible", _DEG, "rad"),
    Limit.NOT_FINITE: ("the controller's torque is {}, a finite number is required", 1.0, "Nm"),
}
"""Text with value and allowed value in the unit people read, the factor to it, the unit in SI."""

Bound = float | FloatArray


@dataclass(frozen=True)
class Limits:
    """What the supervisor tolerates: one figure for every axis, or (n,) for each its own."""

    torque_Nm: Bound
    """Torque is clamped to this."""
    speed_rad_s: Bound
    following_error_rad: Bound
    missed_cycles: int = 3
    """Consecutive cycles without an answer that are bridged."""
    torque_rate_Nm_s: Bound = math.inf
    cable_length_min_m: Bound = -math.inf
    cable_length_max_m: Bound = math.inf
    tension_min_N: Bound = -math.inf
    tension_max_N: Bound = math.inf
    slack_N: Bound = -math.inf
    slack_s: float = 0.1
    """For how long a tension may be below `tension_min_N`, and below `slack_N`."""
    broken_within_s: float = 0.05
    """A cable that goes from `tension_min_N` to below `slack_N` faster than this has broken."""
    missed_in_window: int = 1 << 30
    window_cycles: int = 1
    stale_cycles: int = 1 << 30
    """Cycles for which a drive may be unheard or its answers irregular."""
    lengths_disagree_m: float = math.inf
    """By how much the cables of a platform may contradict each other, root mean square."""
    late_s: float = math.inf
    """For how long the loop itself may be held up."""
    reactions: Mapping[Limit, Reaction] = field(default_factory=dict)
    """Where they differ from `DEFAULT_REACTIONS`."""
