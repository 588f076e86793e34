"""Readings of a planar robot in motion beside motion capture, computed by norms alone."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.geometry_calibration import geometry_sha256
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.readings import CalibrationData, PoseReading

_LIKE_rad = 0.02


@dataclass(frozen=True)
class MovingErrors:
    """Errors of a robot that moves at up to 1 m/s, as standard deviations unless noted."""

    exit_m: float = 0.04
    drum: float = 0.004
    length_m: float = 0.0015
    """Error of a length while the platform moves."""
    alike_s: float = 0.15
    """Time constant with which it is forgotten; 0 for independent errors."""
    point_m: float = 0.0003
    turn_deg: float = 0.3
    offset_s: float = 0.0
    """Time by which measured points are later than lengths, not a deviation."""
    turns_rad: float = _LIKE_rad
    """Rotation of the platform about its target."""


@dataclass(frozen=True)
class MovingRobot:
    """The robot of a file, what was read of the true one, and the truth."""

    robot: Robot
    time_s: FloatArray
    length_m: FloatArray
    pose: FloatArray
    """Measured x, y and angle, (N, 3)."""
    true_pose: FloatArray
    exits_m: FloatArray
    drums: FloatArray

    def data(self, timed: bool = True) -> CalibrationData:
        """Return the file of readings, without tensions."""
        poses = tuple(
            PoseReading(
                target=(*xy.tolist(), 0.0),
                length_m=tuple(length.tolist()),
                time_s=float(time) if timed else None,
            )
            for xy, length, time in zip(self.pose[:, :2], self.length_m, self.time_s, strict=True)
        )
        return CalibrationData(
            robot=self.robot.profile,
            geometry_sha256=geometry_sha256(self.robot),
            simulated=False,
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            poses=poses,
        )

    def write_points(self, path: Path, sigma_mm: str = "", turned: bool = True) -> Path:
        """Write the measured poses as a file of points."""
        rows = ["pose,x_mm,y_mm,sigma_mm" + ",rz_deg" * turned]
        for j, (x, y, angle) in enumerate(self.pose):
            row = f"{j + 1},{1e3 * x:.3f},{1e3 * y:.3f},{sigma_mm}"
            rows.append(row + f",{np.degrees(angle):.4f}" * turned)
        path.write_text("\n".join(rows) + "\n")
        return path

    def with_slip(self, cable: int, pose: int, size_m: float) -> MovingRobot:
        """Return it with a drum that slips before a pose."""
        length = self.length_m.copy()
        length[pose:, cable] -= size_m
        return replace(self, length_m=length)


def uncrossed(path: Path) -> Robot:
    """Return planar-4 with each cable at the nearest corner, which leaves its angle uncertain."""
    text = load_robot("planar-4").path.read_text()
    upper, lower = (re.compile(rf"(anchor_point_m = .*), {y}]") for y in ("-0.1", "0.1"))
    text = lower.sub(r"\1, -0.10]", upper.sub(r"\1, 0.10]", text))
    text = text.replace("workspace_angle_rad = 0.2618", "workspace_angle_rad = 0.1")
    path.write_text(text.replace("[platform]\n", '[platform]\ncable_model = "rigid"\n'))
    return load_robot(path)


def moving_robot(
    robot: Robot, seed: int, errors: MovingErrors | None = None, duration_s: float = 16.0
) -> MovingRobot:
    """Return 50 readings a second on a curve, in two pieces, home first."""
    errors, rng = errors or MovingErrors(), np.random.default_rng(seed)
    platform = robot.platform
    assert platform is not None
    exits, anchors = (np.array(p) for p in (platform.exit_points_m, platform.anchor_points_m))
    half = 0.5 * duration_s
    time = np.concatenate([np.arange(0.0, half, 0.02), np.arange(half, duration_s, 0.02) + 3.0])
    true_exits = exits + rng.normal(0.0, errors.exit_m, exits.shape)
    drums = rng.normal(0.0, errors.drum, len(exits))
    phase = rng.uniform(0.0, 2.0 * np.pi, 2)
    home = np.array(platform.home_m)

    def pose_at(t: FloatArray) -> FloatArray:
        grow = 1.0 - np.exp(-((t / 0.7) ** 2))
        x = home[0] + 0.7 * grow * np.sin(1.3 * t)
        y = home[1] + grow * (0.5 - 0.4 * np.cos(0.83 * t))
        angle = errors.turns_rad * grow * (np.sin(2.1 * t + phase[0]) + np.sin(0.6 * t + phase[1]))
        return np.column_stack([x, y, angle])

    def straight(pose: FloatArray, at: FloatArray) -> FloatArray:
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        turn = np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)
        ends = pose[:, None, :2] + np.einsum("jab,ib->jia", turn, anchors)
        return np.asarray(np.linalg.norm(ends - at, axis=2))

    true = pose_at(time)
    lengths = straight(true, true_exits)
    white = rng.normal(0.0, errors.length_m, lengths.shape)
    keep = np.exp(-0.02 / errors.alike_s) if errors.alike_s else 0.0
    start = white[:1] * keep  # of the same variance from the first reading on
    lengths += lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=0, zi=start)[0]
    begin = straight(np.array([[*home, 0.0]]), exits)
    read = begin + (lengths - straight(pose_at(np.zeros(1)), true_exits)) / (1.0 + drums)
    measured = pose_at(time + errors.offset_s)
    measured[:, :2] += rng.normal(0.0, errors.point_m, measured[:, :2].shape)
    measured[:, 2] += np.radians(rng.normal(0.0, errors.turn_deg, len(measured)))
    return MovingRobot(robot, time, read, measured, true, true_exits, drums)
