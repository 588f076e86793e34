"""What leads: a device in somebody's hand, or a script in its place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Protocol

from cdpr_rt.service.stream_packet import LARGEST_SCALE, REACH_M
from tools.errors import BadInputError

SMALLEST_SCALE: Final = 1e-3
_REACH_USED: Final = 0.9


@dataclass(frozen=True)
class End:
    """Why somebody does not lead any more."""

    text: str
    failed: bool = False
    """Whether it was not meant to end so."""
    arrive: bool = False
    """Whether the robot is to go where it was led first; it brakes at once otherwise."""


@dataclass(frozen=True)
class Hand:
    """Where the hand is at one moment, and what it does there."""

    position_m: tuple[float, float] = (0.0, 0.0)
    """From where it began; unscaled."""
    clutch: bool = True
    """Whether it moves without leading."""
    confirmed: int = 0
    """How often it has confirmed to have reached a target."""
    trouble: str = ""
    """Why it cannot lead just now; the robot stays where it is meanwhile."""
    end: End | None = None


class HandDevice(Protocol):
    """Something that tells where the hand is whenever it is asked; never waits."""

    @property
    def hint(self) -> str:
        """Say how to use it, in a line."""

    def read(self, now_s: float) -> Hand:
        """Return where the hand is at `now_s`, which only grows."""

    def close(self) -> None:
        """Leave everything as it was."""


class LimitedHand:
    """A hand's position (2,) that is moved, within what packets may carry at a scale."""

    def __init__(self, scale: float) -> None:
        self._reach_m = _REACH_USED * REACH_M / max(scale, 1.0)
        self.position_m = (0.0, 0.0)

    def move(self, x_m: float, y_m: float) -> None:
        """Move it by so much."""
        reach_m = self._reach_m
        x, y = self.position_m[0] + x_m, self.position_m[1] + y_m
        self.position_m = (min(max(x, -reach_m), reach_m), min(max(y, -reach_m), reach_m))


def parse_scale(text: str) -> float:
    """Return how many metres the robot moves for a metre of the hand: 8 for "8:1", or a number.

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
