"""Limits of a robot and the supervisor's reaction to each."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, Final, Literal, Self

from pydantic import BeforeValidator, Field, create_model, model_validator

from cdpr_profiles.limits.limit_kinds import Limit
from cdpr_profiles.reading.reader import Profile

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
    """The reaction to each limit; the default or a more severe one.

    Where a platform can be lowered, what is left out and would be a quick stop is a controlled one.
    """


class RobotLimits(Profile):
    """The limits of a robot's axes, at the motors unless it says otherwise.

    What is left out follows from the motors and cables, or is not watched where it cannot be
    known, as the documentation says of each.
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
    """For how long a tension may be below `tension_min_N`, and below `slack_N`."""
    broken_within_s: float = Field(default=0.05, gt=0, le=1)
    """A cable that goes from `tension_min_N` to below `slack_N` faster than this has broken."""
    missed_cycles: int = Field(default=10, ge=0, le=1000)
    """Consecutive cycles without an answer that are bridged."""
    missed_in_window: int = Field(default=50, ge=0, le=10_000)
    window_cycles: int = Field(default=1000, ge=1, le=10_000)
    stale_cycles: int = Field(default=250, ge=1, le=10_000)
    """Cycles for which a drive may be unheard or its answers irregular."""
    lengths_disagree_m: float | None = Field(default=None, gt=0, le=10)
    """By how much the cables of a platform may contradict each other, largest normalised residual;
    by the size of the frame, and whether it is calibrated, where left out."""
    late_s: float = Field(default=0.05, gt=0, le=10)
    """For how long the loop itself may be held up."""
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
            raise ValueError("slack_N: allowed: along with tension_min_N")
        return self

    def faults(self, axes: int) -> Iterator[tuple[str, str]]:
        """Yield (key, problem) for figures that are neither one nor one for each axis."""
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
