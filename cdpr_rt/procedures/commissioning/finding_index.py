"""The two ways to find the encoder index."""

from typing import Literal

Index = Literal["homing", "probe"]
"""By a homing method, or by the touch probe during ordinary motion."""
