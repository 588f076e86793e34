"""What a device beside the robot measures of its pose."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from body_lab import body
from scipy.spatial.transform import Rotation

from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.logs.pose_logs import PoseScanner
from cdpr_sim_bus.robot.logs.truth_log import HEADER_BYTES
from cdpr_sim_bus.robot.robot_plant import ScannerPlant

PLANT = ScannerPlant(position_sigma_m=0.003, rotation_sigma_rad=0.01, rate_Hz=40.0)
SPACE = {
    "exits": [(x, y, 3.0) for x in (-2.0, 2.0) for y in (-2.0, 2.0)],
    "anchors": [(x, y, 0.1) for x in (-0.1, 0.1) for y in (-0.1, 0.1)],
    "home": (0.1, -0.2, 1.4),
    "start": {"rotation_deg": (10.0, 20.0, -30.0)},
}


def measured(path: Path, robot: CableRobot, seconds: float, seed: int = 1) -> np.ndarray:
    """Return the records of so many seconds with an instant each millisecond."""
    scanner = PoseScanner(path, robot, PLANT, seed)
    for k in range(round(seconds * 1e3)):
        scanner.append(k, k * 1e-3, ())
    scanner.close()
    data = path.read_bytes()
    header = json.loads(data[:HEADER_BYTES])
    assert header["position_sigma_m"] == 0.003
    fields = [(name, kind, *map(tuple, shape)) for name, kind, *shape in header["fields"]]
    return np.frombuffer(data[HEADER_BYTES:], np.dtype(fields))


def test_it_measures_at_its_rate_with_the_errors_that_its_plant_says(tmp_path: Path) -> None:
    robot = body(**SPACE)
    seen = measured(tmp_path / "scan", robot, 50.0)
    assert np.allclose(seen["time_s"], np.arange(2000) / 40.0, atol=1e-9)
    off = seen["position_m"] - robot.position_m
    assert np.std(off, axis=0) == pytest.approx([0.003] * 3, rel=0.06)
    assert np.abs(off.mean(axis=0)).max() < 3e-4
    turned = Rotation.from_matrix(seen["rotation"] @ robot.rotation.T).as_rotvec()
    assert np.std(turned, axis=0) == pytest.approx([0.01] * 3, rel=0.06)
    # one reading knows nothing of the one before it, nor a position of its rotation
    both = np.hstack([off, turned])
    assert np.abs(np.corrcoef(both[1:].T, both[:-1].T)[:6, 6:]).max() < 0.1
    assert np.abs(np.corrcoef(both.T) - np.eye(6)).max() < 0.1


def test_in_a_plane_it_measures_three_figures(tmp_path: Path) -> None:
    seen = measured(tmp_path / "scan", body(), 2.0)
    turned = Rotation.from_matrix(seen["rotation"]).as_rotvec()
    assert (seen["position_m"][:, 2] == 0.0).all()
    assert np.abs(turned[:, :2]).max() == 0.0
    assert np.std(turned[:, 2]) > 0.005


def test_the_same_seed_has_the_same_errors(tmp_path: Path) -> None:
    one, again, other = (
        measured(tmp_path / f"scan-{i}", body(), 1.0, seed) for i, seed in enumerate((1, 1, 2))
    )
    assert one.tobytes() == again.tobytes() != other.tobytes()
