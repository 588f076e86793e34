"""Limits of a supervisor, and the reaction to each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from cdpr_profiles.limits.robot_limits import Limit, Reactions
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.states import Reaction

POSE_UNRELIABLE: Final = frozenset(limit for limit in Limit if limit.unreliable)
"""Limits after which a platform's pose is unreliable, or not all of its winches obey."""

LENGTHS_UNRELIABLE: Final = frozenset(limit for limit in Limit if limit.unreliable == "lengths")
"""Limits after which not even the cables' lengths are known any more."""


def reactions_of(named: Reactions, lowers: bool = False) -> dict[Limit, Reaction]:
    """Return the reaction to each limit by a robot's file.

    Of a robot whose platform can be lowered, quick stops of which its file says nothing are
    controlled stops: the winches that are left let it down.
    """
    by_label = {reaction.label: reaction for reaction in Reaction}
    wanted = {limit: by_label[getattr(named, limit.key)] for limit in Limit if limit}
    if lowers:
        for limit in POSE_UNRELIABLE:
            if limit.key not in named.model_fields_set:
                wanted[limit] = Reaction.CONTROLLED_STOP
    return wanted


DEFAULT_REACTIONS: Final = reactions_of(Reactions())

Bound = float | FloatArray


@dataclass(frozen=True)
class Limits:
    """Limits of the axes: one figure for all, or (n,) one for each.

    Those left out are not watched; the figures that robots have by default are `RobotLimits`'.
    """

    torque_Nm: Bound
    """Torque is clamped to this."""
    speed_rad_s: Bound
    following_error_rad: Bound
    missed_cycles: int
    """Consecutive cycles without an answer that are bridged."""
    torque_rate_Nm_s: Bound = math.inf
    cable_length_min_m: Bound = -math.inf
    cable_length_max_m: Bound = math.inf
    tension_min_N: Bound = -math.inf
    tension_max_N: Bound = math.inf
    slack_N: Bound = -math.inf
    slack_s: float = math.inf
    """For how long a tension may be below `tension_min_N`, and below `slack_N`."""
    broken_within_s: float = 0.0
    """A cable that goes from `tension_min_N` to below `slack_N` faster than this has broken."""
    runaway_m_s: float = math.inf
    """A cable that comes in faster than its set-point by more, without its tension, has broken."""
    missed_in_window: int = 1 << 30
    window_cycles: int = 1
    stale_cycles: int = 1 << 30
    """Cycles for which a drive may be unheard or its answers irregular."""
    lengths_disagree_m: float = math.inf
    """Largest normalised residual of a platform's cable lengths."""
    late_s: float = math.inf
    """For how long the loop itself may be held up."""
    reactions: Mapping[Limit, Reaction] = field(default_factory=dict)
    """Reactions that differ from `DEFAULT_REACTIONS`."""
