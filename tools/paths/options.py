"""Options of a path's file: origin, blending tolerance, words of G-code that are skipped."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.path.gcode import GcodeSettings
from cdpr_tools.errors import BadInputError

DEFAULT_BLEND_mm: Final = 1.0
_COORDINATES: Final = (2, 3)
_FURTHEST_mm: Final = 1e6
_WORD: Final = re.compile(r"[A-Z](\d{1,4}(\.\d)?)?")
_LIKE_METRES_mm: Final = 20.0
"""An origin with decimals, nowhere further than this, may have been typed in m."""


@dataclass(frozen=True)
class PathOptions:
    """Of G-code alone."""

    origin_mm: str | None = None
    blend_mm: float = DEFAULT_BLEND_mm
    ignore: str = ""

    def __post_init__(self) -> None:
        """Raise BadInputError for what is no origin of any robot, and no word of G-code."""
        for word in self.ignored():
            if not _WORD.fullmatch(word):
                raise BadInputError(
                    f"--ignore {word}: allowed: words of G-code such as 'S T M3', a letter each "
                    "or with its number"
                )
        if self.origin_mm is None:
            return
        origin = self._origin_mm()
        if origin.size not in _COORDINATES or not (np.abs(origin) <= _FURTHEST_mm).all():
            raise BadInputError(
                f"--origin {self.origin_mm}: allowed: 2 or 3 numbers in mm, as many as the robot "
                f"has coordinates, each up to {_FURTHEST_mm:g}"
            )

    def metres_hint(self) -> str:
        """Return that an origin looks as if it were typed in m, an empty text where not."""
        origin = np.zeros(1) if self.origin_mm is None else self._origin_mm()
        if not 0.0 < np.abs(origin).max() < _LIKE_METRES_mm or not (origin % 1.0).any():
            return ""
        in_mm = " ".join(f"{1e3 * x:g}" for x in origin)
        return (
            f"--origin {self.origin_mm}: within {_LIKE_METRES_mm:g} mm of the room's zero; were "
            f"metres typed? In mm: --origin '{in_mm}'"
        )

    def _origin_mm(self) -> FloatArray:
        try:
            return np.array([float(word) for word in str(self.origin_mm).split()])
        except ValueError:
            return np.zeros(0)

    def settings(self, k: int) -> GcodeSettings:
        """Return them for a robot whose positions have k coordinates; raises BadInputError."""
        origin = np.zeros(k) if self.origin_mm is None else 1e-3 * self._origin_mm()
        if origin.size != k:
            raise BadInputError(f"--origin {self.origin_mm}: allowed: {k} numbers in mm")
        return GcodeSettings(origin, 1e-3 * self.blend_mm, frozenset(self.ignored()))

    def ignored(self) -> list[str]:
        """Return the words of G-code that are skipped."""
        return self.ignore.replace(",", " ").upper().split()
