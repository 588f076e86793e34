"""Options of a G-code file: its place in the room, blending of corners, ignored words."""

from __future__ import annotations

import math
import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.gcode import GcodeSettings
from cdpr_rt.motion.way_points import GCODE
from cdpr_tools.errors import BadInputError

DEFAULT_BLEND_mm: Final = 1.0
_COORDINATES: Final = (2, 3)
_FURTHEST_mm: Final = 1e6
_WORD: Final = re.compile(r"[A-Z](\d{1,4}(\.\d)?)?")
_CODE: Final = re.compile(r"[A-Z]\d{1,4}(\.\d)?")
_SYSTEMS: Final = re.compile(r"\s*\b(G5[5-9])\b")
_MIRRORED: Final = {"": (1.0, 1.0, 1.0), "x": (-1.0, 1.0, 1.0), "y": (1.0, -1.0, 1.0)}
_DWELLS_s: Final = {"s": 1.0, "ms": 1e-3}
_LIKE_METRES_mm: Final = 20.0
"""An origin with decimals and no coordinate larger than this may have been typed in m."""


@dataclass(frozen=True)
class PathOptions:
    """Options that apply to G-code only."""

    origin_mm: str | None = None
    blend_mm: float = DEFAULT_BLEND_mm
    ignore: str = ""
    z_mm: float | None = None
    scale: float = 1.0
    rotate_deg: float = 0.0
    mirror: str = ""
    dwell: str = "s"
    line: int = 0

    def __post_init__(self) -> None:
        """Raise BadInputError for an invalid option, such as an impossible origin or word."""
        for word in self.ignored():
            if not _WORD.fullmatch(word):
                raise BadInputError(
                    f"--ignore {word}: allowed: words of G-code such as 'S T M3', a letter, or a "
                    "letter with its number"
                )
        if self.mirror not in _MIRRORED:
            raise BadInputError(f"--mirror {self.mirror}: allowed: x, y")
        if self.dwell not in _DWELLS_s:
            raise BadInputError(f"--dwell {self.dwell}: allowed: s, ms")
        if self.origin_mm is None:
            return
        for origin in self._origins_mm().values():
            if origin.size not in _COORDINATES or not (np.abs(origin) <= _FURTHEST_mm).all():
                raise BadInputError(
                    f"--origin {self.origin_mm}: allowed: 2 or 3 numbers in mm, one for each "
                    f"coordinate of the robot, each up to {_FURTHEST_mm:g}; then "
                    "optionally G55 and "
                    "its numbers, and so on to G59"
                )

    def require_use(self, file: Path) -> None:
        """Raise BadInputError for G-code options with a file of way points."""
        given = {name for name, value in asdict(self).items() if value != getattr(type(self), name)}
        given -= {"blend_mm", "line"}
        if given and file.suffix.lower() not in GCODE:
            names = " ".join("--" + name.split("_", 1)[0] for name in sorted(given))
            raise BadInputError(
                f"{names}: allowed only with G-code; {file.name} contains way points"
            )

    def request(self) -> dict[str, Any]:
        """Return the options in the form that a daemon accepts."""
        return asdict(self) | {"ignore": " ".join(self.ignored())}

    def metres_hint(self) -> str:
        """Return a hint that the origin may have been typed in m, else an empty text."""
        origin = np.zeros(1) if self.origin_mm is None else self._origins_mm()["G54"]
        if not 0.0 < np.abs(origin).max() < _LIKE_METRES_mm or not (origin % 1.0).any():
            return ""
        in_mm = " ".join(f"{1e3 * x:g}" for x in origin)
        return (
            f"--origin {self.origin_mm}: within {_LIKE_METRES_mm:g} mm of the room's zero; "
            f"are these metres? In mm: --origin '{in_mm}'"
        )

    def _origins_mm(self) -> dict[str, FloatArray]:
        """Return the zeros of the coordinate systems, G54 first; an invalid zero is empty."""
        first, *others = _SYSTEMS.split(str(self.origin_mm).upper())
        texts = {"G54": first, **dict(zip(others[::2], others[1::2], strict=True))}
        try:
            return {
                system: np.array([float(word) for word in text.split()])
                for system, text in texts.items()
            }
        except ValueError:
            return {"G54": np.zeros(0)}

    def settings(self, k: int) -> GcodeSettings:
        """Return the settings for a robot with k coordinates; raises BadInputError."""
        origins_m = {"G54": np.zeros(k)}
        if self.origin_mm is not None:
            origins_m = {system: 1e-3 * place for system, place in self._origins_mm().items()}
        if any(place.size != k for place in origins_m.values()):
            raise BadInputError(f"--origin {self.origin_mm}: allowed: {k} numbers in mm")
        if self.z_mm is not None and k < 3:
            raise BadInputError(f"--z {self.z_mm:g}: allowed only for a robot that moves in space")
        c, s = math.cos(math.radians(self.rotate_deg)), math.sin(math.radians(self.rotate_deg))
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return GcodeSettings(
            origins_m.pop("G54"), 1e-3 * self.blend_mm, frozenset(self.ignored()), origins_m,
            None if self.z_mm is None else 1e-3 * self.z_mm,
            self.scale * turn @ np.diag(_MIRRORED[self.mirror]), _DWELLS_s[self.dwell],
        )  # fmt: skip

    def ignored(self) -> list[str]:
        """Return the G-code words to ignore."""
        words = self.ignore.replace(",", " ").upper().split()
        return [
            f"{word[0]}{float(word[1:]):g}" if _CODE.fullmatch(word) else word for word in words
        ]
