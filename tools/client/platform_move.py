"""What `cdpr move` asks of a platform: from millimetres and degrees to what the daemon takes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from cdpr_profiles.platform import NO_PLATFORM
from cdpr_tools.client.client import Daemon
from cdpr_tools.errors import BadInputError
from cdpr_tools.number_options import numbers

_COORDINATES: Final = {2: ("x", "y"), 3: ("x", "y", "z")}
_ANGLES: Final = {"angle": 2, "rx": 0, "ry": 1, "rz": 2}
"""About which of the room's axes the platform turns, by the name in its robot's file."""
_ROUNDING: Final = 1e-9


class ReferenceFrame(StrEnum):
    """Along and about which axes a relative motion is."""

    ROOM = "room"
    PLATFORM = "platform"


@dataclass(frozen=True)
class PlatformMove:
    """A motion of a platform as it was typed: mm, deg, mm/s."""

    to: str | None
    rotate: str | None
    relative: bool
    frame: ReferenceFrame
    speed: float | None

    @property
    def typed(self) -> str:
        """Return the options that say where to."""
        words = [f"--to {self.to}"] if self.to is not None else []
        words += [f"--rotate {self.rotate}"] if self.rotate is not None else []
        return " ".join(words)

    def arguments(self, daemon: Daemon) -> dict[str, Any]:
        """Return what the program `pose` is to do; raises BadInputError."""
        description = daemon.get("/description")
        require_platform(description, self.typed, "; its axes are moved by AXIS=ANGLE...")
        platform = description["platform"]
        names = _COORDINATES[len(platform["home_m"])]
        turns = [name for name in platform.get("controlled", ()) if name in _ANGLES]
        to = None if self.to is None else numbers("--to", self.to, names, "mm", 1e-3)
        rotate = None
        if self.rotate is not None:
            if not turns:
                raise BadInputError(
                    f"--rotate {self.rotate}: no angle of this platform is controlled; allowed: "
                    f"--to {' '.join(names).upper()}"
                )
            rotate = numbers("--rotate", self.rotate, turns, "deg", math.radians(1.0))
        if self.relative:
            to, rotate = self._from_here(daemon, platform, to, rotate, turns)
        elif self.frame is not ReferenceFrame.ROOM:
            raise BadInputError(f"--frame {self.frame}: allowed: together with --relative")
        arguments: dict[str, Any] = {}
        if to is not None:
            self._check_box(to, names, platform)
            arguments["position_m"] = to
        if rotate is not None:
            self._check_angle(rotate, platform)
            arguments["rotation_rad"] = rotate
        if self.speed is not None:
            arguments["speed_m_s"] = self._checked_speed(self.speed, platform)
        return arguments

    def _from_here(
        self,
        daemon: Daemon,
        platform: dict[str, Any],
        to: list[float] | None,
        rotate: list[float] | None,
        turns: Sequence[str],
    ) -> tuple[list[float] | None, list[float] | None]:
        """Return where a relative motion leads to."""
        from scipy.spatial.transform import Rotation  # noqa: PLC0415  # slow to load

        progress = daemon.get("/status").get("program_progress") or {}
        start_m = progress.get("target_m") or progress.get("position_m")
        if not start_m:
            raise BadInputError("--relative: it is not known where the platform is; tighten first")
        about = [_ANGLES[name] for name in turns]
        turned = progress.get("target_rotation_rad") or progress.get("rotation_rad") or []
        from_home = Rotation.from_rotvec(_in_space(turned, about))
        at_home = platform.get("home_rotation_rad") or (0.0,)
        axes = from_home * Rotation.from_rotvec(
            at_home if len(at_home) == len(_COORDINATES[3]) else (0.0, 0.0, *at_home)
        )
        if self.frame is ReferenceFrame.ROOM:
            axes = Rotation.identity()
        if to is not None:
            way = axes.apply([*to, 0.0][: len(_COORDINATES[3])])
            to = [x + step for x, step in zip(start_m, way, strict=False)]
        if rotate is not None:
            step = Rotation.from_rotvec(axes.apply(_in_space(rotate, about)))
            vector = (step * from_home).as_rotvec()
            rotate = [float(vector[axis]) for axis in about]
        return to, rotate

    def _check_box(
        self, to: Sequence[float], names: Sequence[str], platform: dict[str, Any]
    ) -> None:
        box = zip(names, to, platform["workspace_min_m"], platform["workspace_max_m"], strict=True)
        for name, value, low, high in box:
            if not low - _ROUNDING <= value <= high + _ROUNDING:
                leads = "leads to " if self.relative else ""
                raise BadInputError(
                    f"--to {self.to}: {leads}{name} {1e3 * value:.6g} mm; allowed: "
                    f"{1e3 * low:g} to {1e3 * high:g} mm, the workspace"
                    f"{'' if self.relative else self._in_metres(to, platform)}"
                )

    @staticmethod
    def _in_metres(to: Sequence[float], platform: dict[str, Any]) -> str:
        """Return a hint where what was typed fits the workspace as metres, else an empty text."""
        box = zip(to, platform["workspace_min_m"], platform["workspace_max_m"], strict=True)
        if not all(low <= 1e3 * value <= high for value, low, high in box):
            return ""
        return f"; were metres typed? In mm: --to {' '.join(f'{1e6 * x:g}' for x in to)}"

    def _check_angle(self, rotate: Sequence[float], platform: dict[str, Any]) -> None:
        angle, most = math.hypot(*rotate), float(platform.get("workspace_angle_rad", 0.0))
        if angle > most + _ROUNDING:
            leads = "leads to " if self.relative else ""
            raise BadInputError(
                f"--rotate {self.rotate}: {leads}{math.degrees(angle):.4g} deg from the "
                f"orientation at home; allowed: up to {math.degrees(most):.4g} deg"
            )

    def _checked_speed(self, speed: float, platform: dict[str, Any]) -> float:
        most = 1e3 * float(platform["speed_m_s"])
        if not speed <= most:
            raise BadInputError(f"--speed {speed:g}: allowed: up to {most:g} mm/s")
        return 1e-3 * speed


def _in_space(values: Sequence[float], about: Sequence[int]) -> list[float]:
    vector = [0.0] * len(_COORDINATES[3])
    for axis, value in zip(about, values, strict=False):
        vector[axis] = value
    return vector


def require_platform(description: dict[str, Any], asked: str, instead: str = "") -> None:
    """Raise BadInputError where a daemon's description is of a robot without a platform.

    What was `asked` for comes first, what is possible `instead` last.
    """
    if description.get("platform") is None:
        raise BadInputError(f"{asked}: {description.get('robot')}: {NO_PLATFORM}{instead}")
