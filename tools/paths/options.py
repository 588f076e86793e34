"""What the command line leaves to be said of a path's file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.motion.path.gcode import GcodeSettings
from cdpr_tools.errors import BadInputError

DEFAULT_BLEND_mm: Final = 1.0


@dataclass(frozen=True)
class PathOptions:
    """Of G-code alone."""

    origin_mm: str | None = None
    blend_mm: float = DEFAULT_BLEND_mm
    ignore: str = ""

    def settings(self, k: int) -> GcodeSettings:
        """Return them for a robot whose positions have k coordinates; raises BadInputError."""
        words = (self.origin_mm or " ".join("0" * k)).split()
        try:
            origin = np.array([1e-3 * float(word) for word in words])
        except ValueError:
            origin = np.zeros(0)
        if origin.size != k or not np.isfinite(origin).all():
            raise BadInputError(f"--origin {self.origin_mm}: allowed: {k} numbers in mm")
        ignored = self.ignore.replace(",", " ").upper().split()
        return GcodeSettings(origin, 1e-3 * self.blend_mm, frozenset(ignored))
