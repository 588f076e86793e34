"""The plant file of a simulated safety I/O: the truth about contactor, brakes and switches."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from cdpr_profiles.reading.reader import Profile, read_toml_model

Delay = Annotated[float, Field(ge=0.0, le=10.0)]


class SafetyAxisPlant(Profile):
    """Where the limit switches of one axis stand, on the motor's true angle over all turns."""

    limit_negative_deg: float | None = None
    """Reached below."""
    limit_positive_deg: float | None = None
    """Reached above."""


class SafetyPlant(Profile):
    """Delays of the devices wired to the I/O, and its axes in the order of its profile."""

    contactor_close_s: Delay = 0.03
    contactor_open_s: Delay = 0.015
    brake_release_s: Delay = 0.05
    brake_apply_s: Delay = 0.03
    axes: tuple[SafetyAxisPlant, ...] = ()

    @classmethod
    def load_file(cls, path: Path) -> SafetyPlant:
        """Read a plant file; raises ProfileError."""
        return read_toml_model(path, cls)
