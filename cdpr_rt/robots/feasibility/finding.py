"""What is found about a robot's file."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """Something about a key of a robot's file: what is wrong, and what to change."""

    key: str
    text: str
    impossible: bool
    """Whether the robot cannot work like this; else it can, less well than it seems."""
