"""Plant files: the true behaviour of a simulated device, which no controller may read."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from cdpr_profiles.reader import Profile


class PlantFile(Profile):
    """Content of one plant file; missing keys have their defaults."""

    @classmethod
    def load_file(cls, path: str | Path | None) -> Self:
        """Return the content of a file; the defaults for None.

        Raises cdpr_profiles.errors.ProfileError with file, key, value and the allowed values.
        """
        return cls() if path is None else super().load_file(path)
