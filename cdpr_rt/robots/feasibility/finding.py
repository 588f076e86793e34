"""What is found about a robot's file."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """Something about a key of a robot's file: what is wrong, and what to change."""

    key: str
    text: str
    impossible: bool
    """Whether the robot cannot work like this; else it can, less well than it seems."""


def rounded_down(value: float) -> str:
    """Return a value to three digits, none of which makes it larger."""
    digits = 2 - math.floor(math.log10(value))
    return f"{math.floor(value * 10.0**digits) / 10.0**digits:g}"
