"""Plant files: what is true of something simulated, which no controller may read."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from cdpr_profiles.reading.reader import Profile


class PlantFile(Profile):
    """What one plant file says; what it leaves out is as the defaults have it."""

    @classmethod
    def load_file(cls, path: str | Path | None) -> Self:
        """Return what a file says, the defaults for None.

        Raises cdpr_profiles.errors.ProfileError naming file, key, value and what is allowed.
        """
        return cls() if path is None else super().load_file(path)
