"""Readings of a synthetic robot with random errors, computed without code of the calibration.

Lengths are norms plus stretch, with a closed-form tension distribution. Images are projections by
OpenCV.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final

import cv2
import numpy as np
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from cdpr_profiles import Robot
from cdpr_profiles.camera import CameraIntrinsics, KnownMarker, MarkerSheets
from cdpr_profiles.geometry_calibration import geometry_sha256
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.calibration.readings import (
    CalibrationData,
    CameraSetup,
    HandEye,
    ImageReading,
    PoseReading,
)
from cdpr_rt.model.rigid_body import G_m_s2

WIDTH_px, HEIGHT_px = 1280, 1024
LENS: Final = (1104.0, 1106.0, 645.3, 505.8, -0.112, 0.083, 4e-4, -3e-4, -0.012)
HAND_EYE_m, HAND_EYE_deg = (0.02, -0.01, -0.28), (180.0, 0.0, 0.0)
_CORNERS = np.array([(-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (-0.5, -0.5, 0.0)])
_PITCH_m, _MIDDLE_m = 0.32, (-0.15, 0.1, 0.0)
_EDGE_px = 4.0
_SLACK_N, _MOST_N = 25.0, 125.0


@dataclass(frozen=True)
class ErrorBudget:
    """Errors of a robot, its camera and its sheets. Values are standard deviations unless noted."""

    exit_m: float = 0.03
    """Coordinates of an exit point, measured with a tape."""
    home_m: float = 0.01
    """Coordinates of the stand relative to home in the file."""
    home_deg: float = 0.5
    drum: float = 0.002
    """Relative error of the length paid out per motor turn."""
    elongation: float = 0.43
    """Relative excess of cable elongation over the file, the same in each trial."""
    encoder_m: float = 1.5e-4
    """Noise of a length at each pose."""
    tension_N: float = 1.0
    """Noise of a reported tension at each pose."""
    spread_N: float = 20.0
    """Variation of tensions between poses, beyond the least ones that hold the platform."""
    corner_px: float = 0.1
    """Noise of a coordinate of a corner."""
    focal: float = 1e-3
    """Relative error of the focal length by ChArUco."""
    centre_px: float = 0.7
    distortion: float = 1.0
    """Factor of the typical error of k1. Those of k2 and k3 are proportional, the rest is small."""
    hand_eye_m: float = 0.003
    hand_eye_deg: float = 1.0
    print_scale: float = 0.002
    """Relative size error common to all sheets."""
    sheet_scale: float = 5e-4
    """Relative size error of each sheet and direction."""
    bend_m: float = 3e-4
    """Deviation of a sheet's corners from its plane."""
    known_m: float = 5e-4
    """Measured places of known markers."""


_DISTORTION = np.array([1.3e-3, 6.9e-3, 7e-5, 9e-5, 1.2e-2])


@dataclass(frozen=True)
class SheetLayout:
    """Sheets around the robot, in rows on the floor."""

    rows: int = 6
    columns: int = 7
    size_m: float = 0.1
    height_m: float = 0.001
    """Deviation of the sheets' centres from the floor."""
    tilt_deg: float = 0.3
    known: int = 0
    """Number of sheets with measured places: the corners of the grid first, then others."""

    @property
    def known_ids(self) -> list[int]:
        """Return the ids with known places, spread so that they determine the tilt of the floor."""
        last = self.rows * self.columns - 1
        corners = [0, last, self.columns - 1, last - self.columns + 1]
        others = [k for k in range(2, last, 5) if k not in corners]
        return (corners + others)[: self.known]


@dataclass(frozen=True)
class SyntheticReadings:
    """A robot with its true geometry and its readings."""

    poses: FloatArray
    """True poses of the platform, (N, 4, 3)."""
    exits_m: FloatArray
    drums: FloatArray
    markers_m: FloatArray
    """True centres of the sheets, (m, 3)."""
    marker_rotation: FloatArray
    data: CalibrationData


def synthetic_readings(
    robot: Robot,
    targets: FloatArray,
    nominal: FloatArray,
    errors: ErrorBudget,
    layout: SheetLayout,
    seed: int,
    *,
    hand_eye_known: bool = True,
) -> SyntheticReadings:
    """Return readings near the poses `nominal` (N, 4, 3), which are `targets` (N, 6) as numbers.

    The first is home. The platform misses its targets because of errors in the geometry.
    """
    rng = np.random.default_rng(seed)
    poses = _missed(nominal, errors, rng)
    platform = robot.platform
    assert platform is not None
    n = len(robot.axes)
    exits = np.array(platform.exit_points_m) + rng.normal(0.0, errors.exit_m, (n, 3))
    drums = rng.normal(0.0, errors.drum, n)
    length, tension = _read_cables(robot, poses, nominal[0], exits, drums, errors, rng)
    position, rotation = _sheets(layout, rng)
    setup, place, turn = _setup(errors, layout, position, rotation, rng, hand_eye_known)
    images = _images(poses, place, turn, position, rotation, layout, errors, rng)
    readings = tuple(
        PoseReading(
            target=tuple(targets[j].tolist()),
            length_m=tuple(length[j].tolist()),
            tension_N=tuple(tension[j].tolist()),
            image=ImageReading.of(images[j]),
        )
        for j in range(len(poses))
    )
    data = CalibrationData(
        robot=robot.profile,
        geometry_sha256=geometry_sha256(robot),
        simulated=True,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        camera=setup,
        poses=readings,
    )
    return SyntheticReadings(poses, exits, drums, position, rotation, data)


def _read_cables(
    robot: Robot,
    poses: FloatArray,
    home: FloatArray,
    exits: FloatArray,
    drums: FloatArray,
    errors: ErrorBudget,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Return reported lengths and tensions, (N, n). `home` is that of the file."""
    platform = robot.platform
    assert platform is not None
    anchors = np.array(platform.anchor_points_m)
    soft = np.array([1.0 / axis.winch.cable.stiffness_N for axis in robot.axes])
    arm = np.einsum("jab,ib->jia", poses[:, 1:], anchors)
    away = exits - poses[:, None, 0] - arm
    straight = np.linalg.norm(away, axis=2)
    tension = _tensions(
        away / straight[..., None],
        arm,
        platform.mass_kg,
        np.abs(rng.normal(0.0, 1.0, straight.shape)) * errors.spread_N,
    )
    free = straight / (1.0 + soft * (1.0 + errors.elongation) * tension)
    # the encoders start at the lengths of home in the file
    corners = home[0] + anchors @ home[1:].T
    start = np.linalg.norm(np.array(platform.exit_points_m) - corners, axis=1)
    start = start / (1.0 + soft * tension[0])
    length = start + (free - free[0]) / (1.0 + drums)
    length += rng.normal(0.0, 1.0, length.shape) * errors.encoder_m
    measured_N = np.maximum(
        tension + rng.normal(0.0, errors.tension_N, tension.shape), _SLACK_N / 5.0
    )
    return length, measured_N


def _missed(nominal: FloatArray, errors: ErrorBudget, rng: np.random.Generator) -> FloatArray:
    poses = nominal.copy()
    poses[:, 0] += rng.normal(0.0, errors.home_m, (len(poses), 3))
    turns = np.radians(rng.normal(0.0, errors.home_deg, (len(poses), 3)))
    poses[:, 1:] = Rotation.from_rotvec(turns).as_matrix() @ poses[:, 1:]
    return poses


def _tensions(
    u: FloatArray, arm: FloatArray, mass_kg: float, preferred_N: FloatArray
) -> FloatArray:
    """Return tensions (N, n) that hold the platform, nearest to the wanted ones; thesis (3.80)."""
    W = np.concatenate([u, np.cross(arm, u)], axis=2).transpose(0, 2, 1)
    load = np.array([0.0, 0.0, -mass_kg * G_m_s2, 0.0, 0.0, 0.0])
    held, n = 1e3, u.shape[1]
    found = [
        lsq_linear(
            np.vstack([held * one, np.eye(n)]),
            np.concatenate([-held * load, preferred]),
            (_SLACK_N, _MOST_N),
        ).x
        for one, preferred in zip(W, preferred_N, strict=True)
    ]
    return np.array(found)


def _sheets(layout: SheetLayout, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    count = layout.rows * layout.columns
    row, column = np.divmod(np.arange(count), layout.columns)
    middle = np.column_stack(
        [
            (column - 0.5 * (layout.columns - 1)) * _PITCH_m,
            (0.5 * (layout.rows - 1) - row) * _PITCH_m,
            np.zeros(count),
        ]
    )
    along = rng.normal(0.0, 0.02, (count, 2))
    height = np.abs(rng.normal(0.0, layout.height_m, count))
    turns = rng.normal(0.0, 1.0, (count, 3)) * np.radians((layout.tilt_deg, layout.tilt_deg, 10.0))
    position = np.array(_MIDDLE_m) + middle + np.column_stack([along, height])
    return position, Rotation.from_rotvec(turns).as_matrix()


def _setup(
    errors: ErrorBudget,
    layout: SheetLayout,
    position: FloatArray,
    rotation: FloatArray,
    rng: np.random.Generator,
    hand_eye_known: bool,
) -> tuple[CameraSetup, FloatArray, FloatArray]:
    """Return the described camera and sheets, and the true pose of the camera."""
    sigma = np.array([*LENS[:2], 1.0, 1.0, *_DISTORTION])
    sigma *= [*[errors.focal] * 2, *[errors.centre_px] * 2, *[errors.distortion] * 5]
    off = rng.normal(0.0, sigma)
    # ChArUco's errors of both focal lengths are nearly equal, and so are those of the distortion
    off[1], off[5:] = LENS[1] * off[0] / LENS[0], 0.0
    lens = np.array(LENS) + off
    place = np.array(HAND_EYE_m) + rng.normal(0.0, errors.hand_eye_m, 3)
    turn = Rotation.from_rotvec(np.radians(rng.normal(0.0, errors.hand_eye_deg, 3)))
    turn = turn * Rotation.from_rotvec(np.radians(HAND_EYE_deg))
    known = tuple(
        KnownMarker(
            id=k,
            position_m=tuple((position[k] + rng.normal(0.0, errors.known_m, 3)).tolist()),
            rotation_deg=tuple(np.degrees(_vector(rotation[k])).tolist()),
        )
        for k in layout.known_ids
    )
    hand_eye = HandEye(
        position_m=HAND_EYE_m,
        rotation_deg=HAND_EYE_deg,
        position_std_m=max(errors.hand_eye_m, 1e-4),
        rotation_std_deg=max(errors.hand_eye_deg, 0.01),
    )
    setup = CameraSetup(
        intrinsics=CameraIntrinsics(
            width_px=WIDTH_px,
            height_px=HEIGHT_px,
            focal_px=tuple(lens[:2].tolist()),
            centre_px=tuple(lens[2:4].tolist()),
            distortion=tuple(lens[4:].tolist()),
            sigmas=tuple(sigma.tolist()),
        ),
        sheets=MarkerSheets(size_m=layout.size_m, known=known),
        size_std=max(errors.print_scale, 1e-4),
        known_std_m=max(errors.known_m, 1e-4),
        hand_eye=hand_eye if hand_eye_known else None,
    )
    return setup, place, np.asarray(turn.as_matrix())


def _images(
    poses: FloatArray,
    place: FloatArray,
    turn: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    layout: SheetLayout,
    errors: ErrorBudget,
    rng: np.random.Generator,
) -> list[Sighting]:
    """Return noisy images of the true sheets through the true lens."""
    count = len(position)
    scale = 1.0 + rng.normal(0.0, errors.print_scale) * np.ones((count, 1, 2))
    scale = scale + rng.normal(0.0, errors.sheet_scale, (count, 1, 2))
    sheet = layout.size_m * _CORNERS * np.concatenate([scale, np.ones((count, 1, 1))], axis=2)
    bend = rng.normal(0.0, errors.bend_m, (count, 4))
    sheet[..., 2] += bend - bend.mean(axis=1, keepdims=True)
    corners = sheet @ rotation.transpose(0, 2, 1) + position[:, None]
    matrix = np.array([[LENS[0], 0.0, LENS[2]], [0.0, LENS[1], LENS[3]], [0.0, 0.0, 1.0]])
    seen = []
    for j, pose in enumerate(poses):
        R = (pose[1:] @ turn).T
        t = -R @ (pose[0] + pose[1:] @ place)
        depth = (corners @ R.T + t)[..., 2]
        at, _ = cv2.projectPoints(
            corners.reshape(-1, 1, 3), Rotation.from_matrix(R).as_rotvec(), t, matrix,
            np.array(LENS[4:]),
        )  # fmt: skip
        at = at.reshape(count, 4, 2)
        inside = (at > _EDGE_px).all(axis=2) & (
            at < (WIDTH_px - _EDGE_px, HEIGHT_px - _EDGE_px)
        ).all(axis=2)
        there = (inside & (depth > 0.1)).all(axis=1)
        at = at + rng.normal(0.0, errors.corner_px, at.shape)
        seen.append(Sighting(f"pose {j + 1}", {int(k): at[k] for k in np.flatnonzero(there)}))
    return seen


def _vector(rotation: FloatArray) -> FloatArray:
    return np.asarray(Rotation.from_matrix(rotation).as_rotvec())
