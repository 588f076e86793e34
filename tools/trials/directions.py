"""The controlled directions of a platform, and true poses as coordinates in these directions.

A place is (d,): k coordinates of the platform's origin, m, and then the controlled entries of the
rotation vector from the orientation at home, rad. A pose is a position (3,) and a rotation (3, 3).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_profiles import Robot
from cdpr_profiles.platform import NO_PLATFORM, Platform
from cdpr_rt.arrays import FloatArray
from cdpr_tools.errors import BadInputError

_ABOUT = {"rx": 0, "ry": 1, "rz": 2, "angle": 2}


@dataclass(frozen=True)
class Directions:
    """The controlled directions of a platform, and the bounds of its places."""

    names: tuple[str, ...]
    """A name for each direction, positions first."""
    home_rotation: FloatArray
    """Rotation matrix at home, (3, 3)."""
    low_m: FloatArray
    """Lower bounds of the coordinates, (k,)."""
    high_m: FloatArray
    angle_rad: float
    """The largest angle from the orientation at home."""
    speed: FloatArray
    """The highest speed in each direction, (d,)."""
    acceleration: FloatArray

    @classmethod
    def of(cls, platform: Platform) -> Directions:
        """Return the directions of a platform."""
        k, turns = len(platform.home_m), len(platform.controlled) - len(platform.home_m)
        home = np.array(platform.home_rotation_rad)
        return cls(
            platform.controlled,
            Rotation.from_rotvec(np.pad(home, (3 - home.size, 0))).as_matrix(),
            np.array(platform.workspace_min_m),
            np.array(platform.workspace_max_m),
            platform.workspace_angle_rad,
            np.repeat([platform.speed_m_s, platform.angular_speed_rad_s], [k, turns]),
            np.repeat(
                [platform.acceleration_m_s2, platform.angular_acceleration_rad_s2], [k, turns]
            ),
        )

    @property
    def k(self) -> int:
        """Number of coordinates of the origin."""
        return len(self.low_m)

    @property
    def d(self) -> int:
        """Number of controlled directions."""
        return len(self.names)

    @property
    def turns(self) -> tuple[int, ...]:
        """Indices of the directions that are angles; empty if no angles are controlled."""
        return tuple(range(self.k, self.d))

    @property
    def middle(self) -> FloatArray:
        """The middle of the workspace, at the orientation at home, (d,)."""
        return np.pad(0.5 * (self.low_m + self.high_m), (0, self.d - self.k))

    def arguments(self, place: FloatArray, speed_m_s: float | None = None) -> dict[str, Any]:
        """Return the arguments with which the program `pose` moves to a place."""
        arguments: dict[str, Any] = {"position_m": place[: self.k].tolist()}
        if self.angle_rad > 0.0:
            arguments["rotation_rad"] = place[self.k :].tolist()
        if speed_m_s is not None:
            arguments["speed_m_s"] = speed_m_s
        return arguments

    def marked(self, place: FloatArray, prefix: str) -> dict[str, list[float]]:
        """Return a place in the form of a recording's mark."""
        place_marked = {f"{prefix}_m": place[: self.k].tolist()}
        if self.turns:
            place_marked[f"{prefix}_rotation_rad"] = place[self.k :].tolist()
        return place_marked

    def place(self, mark: Mapping[str, Any], prefix: str) -> FloatArray:
        """Return the place (d,) from a mark."""
        return np.array([*mark[f"{prefix}_m"], *mark.get(f"{prefix}_rotation_rad", ())], float)

    def rotations(self, places: FloatArray) -> FloatArray:
        """Return the rotations (m, 3, 3) of places (m, d): exp(φ) Q_home."""
        vectors = np.zeros((len(places), 3))
        vectors[:, self.about] = places[:, self.k :]
        return np.asarray(Rotation.from_rotvec(vectors).as_matrix() @ self.home_rotation)

    def places(self, position_m: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return places (m, d) from positions (m, 3) and rotation matrices (m, 3, 3)."""
        turned = self.turn_between(self.home_rotation, rotation) if self.turns else None
        angles = np.zeros((len(position_m), 0)) if turned is None else turned[:, self.about]
        return np.hstack([position_m[:, : self.k], angles])

    def turn_between(self, from_rotation: FloatArray, to_rotation: FloatArray) -> FloatArray:
        """Return the rotation vectors of R_to R_from^T, (m, 3), in rad along the room's axes.

        Rotation about uncontrolled axes is left out. With one such axis, the result is the
        shortest turn between the two directions of the axis, which moves with the platform. With
        two, the entries along them are 0.
        """
        if len(self._free) == 1:
            carried = self.home_rotation.T[:, self._free[0]]
            return _shortest_turns(from_rotation @ carried, to_rotation @ carried)
        turn = to_rotation @ np.swapaxes(from_rotation, -1, -2)
        vectors = np.asarray(Rotation.from_matrix(turn).as_rotvec())
        vectors[..., self._free] = 0.0
        return vectors

    @property
    def _free(self) -> list[int]:
        """Indices of the rotation vector's uncontrolled entries; empty in a plane."""
        return [] if self.k == 2 else [i for i in range(3) if i not in self.about]

    @property
    def about(self) -> list[int]:
        """Indices of the rotation vector's controlled entries."""
        return [_ABOUT[name] for name in self.names[self.k :]]


def platform_of(robot: Robot) -> Platform:
    """Return a robot's platform; raises BadInputError for a robot without one."""
    if robot.platform is None:
        raise BadInputError(f"{robot.path}: {NO_PLATFORM}")
    return robot.platform


def rotations_of(quaternion: FloatArray) -> FloatArray:
    """Return the rotations (m, 3, 3) of quaternions w x y z, (m, 4)."""
    return np.asarray(Rotation.from_quat(quaternion[:, [1, 2, 3, 0]]).as_matrix())


def _shortest_turns(from_axis: FloatArray, to_axis: FloatArray) -> FloatArray:
    """Return the rotation vectors (m, 3) of the shortest turns from unit vectors to others."""
    across = np.cross(from_axis, to_axis)
    sine = np.linalg.norm(across, axis=-1, keepdims=True)
    angle = np.arctan2(sine, np.sum(from_axis * to_axis, axis=-1, keepdims=True))
    return np.asarray(across * np.divide(angle, sine, out=np.ones_like(sine), where=sine > 0.0))
