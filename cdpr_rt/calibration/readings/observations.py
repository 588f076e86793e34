"""Observations at the poses of a calibration: lengths, tensions, measured poses, markers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers
from cdpr_rt.errors import InvalidRequestError


@dataclass(frozen=True)
class Observations:
    """Readings at N poses of n cables; what was not measured has a standard deviation of inf.

    Positions may be those of another point on the platform than its origin, `target_m` in the
    platform's frame, as of the reflector that a tracker sees.
    """

    length_m: FloatArray
    """Cable lengths without tension as the robot's file and its encoders have them, (N, n)."""
    tension_N: FloatArray
    """(N, n)"""
    start: FloatArray
    """Poses to begin the search at, as arrays of `Pose`, (N, 4, 3)."""
    used: BoolArray
    """Whether a length counts, (N, n)."""
    position_m: FloatArray
    """Measured positions in the room, (N, 3)."""
    position_std_m: FloatArray
    """(N, 3)"""
    rotation: FloatArray
    """Measured rotations, (N, 3, 3)."""
    rotation_std_rad: FloatArray
    """About each of the room's axes, (N, 3)."""
    target_m: FloatArray
    """Point of the platform to which `position_m` belongs, (3,)."""
    reference_m: FloatArray
    """Lengths when the encoders began to count, about which drum errors turn, (n,)."""
    jumps: tuple[tuple[int, int], ...] = ()
    """(cable, pose) where a cable's length jumped: from this pose on it has another offset."""
    markers: SeenMarkers | None = None
    """Markers seen by the camera on the platform, an image for each pose."""
    tension_free: FloatArray | None = None
    """Projections on what noise of tensions is left, (N, n, n), where their balance has told the
    rest; None for all of it."""

    @classmethod
    def of_lengths(
        cls, length_m: FloatArray, tension_N: FloatArray, start: FloatArray
    ) -> Observations:
        """Return lengths (N, n) and tensions (N, n) alone; raises InvalidRequestError."""
        lengths, tensions = np.array(length_m, float), np.array(tension_N, float)
        poses = np.array(start, float)
        count = len(lengths)
        if lengths.shape != tensions.shape or poses.shape != (count, 4, 3):
            raise InvalidRequestError(
                f"lengths {lengths.shape}, tensions {tensions.shape}, poses {poses.shape}: allowed:"
                " (N, n), (N, n) and (N, 4, 3)"
            )
        for name, values in (("lengths", lengths), ("tensions", tensions), ("poses", poses)):
            if not np.isfinite(values).all():
                bad = int(np.argmin(np.isfinite(values).reshape(count, -1).all(axis=1)))
                raise InvalidRequestError(f"{name} of pose {bad + 1}: allowed: finite numbers")
        nowhere = np.full((count, 3), np.inf)
        turn = np.broadcast_to(np.eye(3), (count, 3, 3)).copy()
        used = np.ones(lengths.shape, bool)
        zero = np.zeros((count, 3))
        first = lengths[0].copy() if count else np.zeros(lengths.shape[1])
        return cls(
            lengths, tensions, poses, used, zero, nowhere, turn, nowhere.copy(), np.zeros(3), first
        )

    @property
    def poses(self) -> int:
        """Number of poses."""
        return len(self.length_m)

    @property
    def measured(self) -> BoolArray:
        """At which poses anything was measured from outside, (N,)."""
        any_position = np.isfinite(self.position_std_m).any(axis=1)
        return np.asarray(any_position | np.isfinite(self.rotation_std_rad).any(axis=1))

    def with_positions(
        self, position_m: FloatArray, std_m: FloatArray | float, target_m: FloatArray | None = None
    ) -> Observations:
        """Return the same with positions (N, 3), nan where a coordinate was not measured."""
        measured = np.array(position_m, float)
        known = np.isfinite(measured)
        std = np.where(known, np.broadcast_to(std_m, measured.shape), np.inf)
        if not (std > 0.0).all():
            raise InvalidRequestError("standard deviation of a position: allowed: above 0")
        point = np.zeros(3) if target_m is None else np.array(target_m, float)
        return replace(
            self,
            position_m=np.where(known, measured, 0.0),
            position_std_m=std,
            target_m=point,
        )

    def with_rotations(self, rotation: FloatArray, std_rad: FloatArray | float) -> Observations:
        """Return the same with rotations (N, 3, 3), nan where none was measured."""
        measured = np.array(rotation, float)
        known = np.isfinite(measured).all(axis=(1, 2))
        std = np.where(known[:, None], np.broadcast_to(std_rad, (len(measured), 3)), np.inf)
        if not (std > 0.0).all():
            raise InvalidRequestError("standard deviation of a rotation: allowed: above 0")
        return replace(
            self,
            rotation=np.where(known[:, None, None], measured, np.eye(3)),
            rotation_std_rad=std,
        )

    def unmeasured(self) -> Observations:
        """Return lengths and tensions alone."""
        away = np.full_like(self.position_std_m, np.inf)
        return replace(self, position_std_m=away, rotation_std_rad=away.copy(), markers=None)

    def some(self, chosen: IntArray | BoolArray) -> Observations:
        """Return the chosen poses; jumps stay where they were in time."""
        index = np.arange(self.poses)[chosen]
        jumps = tuple((cable, int((index < pose).sum())) for cable, pose in self.jumps)
        return replace(
            self,
            length_m=self.length_m[index],
            tension_N=self.tension_N[index],
            start=self.start[index],
            used=self.used[index],
            position_m=self.position_m[index],
            position_std_m=self.position_std_m[index],
            rotation=self.rotation[index],
            rotation_std_rad=self.rotation_std_rad[index],
            jumps=jumps,
            tension_free=None if self.tension_free is None else self.tension_free[index],
            markers=None if self.markers is None else self.markers.of_images(index),
        )

    def without_jumps(self, offsets_m: FloatArray) -> Observations:
        """Return lengths from which jumps, one offset each, are taken away."""
        length = self.length_m.copy()
        for (cable, pose), offset in zip(self.jumps, offsets_m, strict=True):
            length[pose:, cable] += offset
        return replace(self, length_m=length, jumps=())
