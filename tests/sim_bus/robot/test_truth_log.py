"""The logs of the true motion and of simulated pose measurements."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from body_lab import body
from scipy.spatial.transform import Rotation

from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.robot_plant import ScannerPlant
from cdpr_sim_bus.robot.truth_log import PoseScanner
from tests.sim_bus.cia402.drive_rig import Rig
from tests.sim_bus.robot.plant_torques import cogging_Nm

HEADER_BYTES = 1024
NO_SYNC = 0xFFFFFFFF


def read(path: Path) -> tuple[dict[str, object], np.ndarray]:
    header = json.loads(path.read_bytes()[:HEADER_BYTES])
    dtype = np.dtype([(name, kind) for name, kind in header["fields"]])
    assert dtype.itemsize == header["record_bytes"]
    return header, np.fromfile(path, dtype, offset=HEADER_BYTES)


def test_the_log_has_one_record_per_sync_that_obeys_newtons_law(tmp_path: Path) -> None:
    plant = Plant.model_validate({"motor": {"initial_angle_deg": 200.0}})
    path = tmp_path / "truth.bin"
    rig = Rig(plant, path)
    rig.enable(10)
    positions, times = [], []
    for k in range(1500):
        rig.torque = round(60 + 20 * math.sin(0.01 * k))
        rig.cycle()
        positions.append(rig.position)
        times.append(rig.now)
    rig.drive.close()
    header, log = read(path)
    log = log[log["sync_index"] != NO_SYNC]
    assert header["node_id"] == 5
    assert list(log["sync_index"]) == list(range(len(log)))
    tail = log[-1500:]
    assert tail["time_s"] == pytest.approx(times)
    # The angle is relative to power-up. The encoder shows it half a millisecond later.
    seen = np.array(positions) * 2 * math.pi / 8192
    midway = 0.5 * (tail["angle_rad"][1:] + tail["angle_rad"][:-1])
    assert np.abs(seen[1:] - midway).max() < 0.006
    between = tail["angle_rad"] - tail["angle_from_index_rad"]
    assert between == pytest.approx(math.radians(123.4 - 200.0), abs=math.pi / 8192)
    assert header["index_rad"] == pytest.approx(math.radians(123.4), abs=math.pi / 8192)
    net = tail["motor_torque_Nm"] - tail["cogging_Nm"] - tail["friction_Nm"]
    gained = np.diff(tail["velocity_rad_s"]) / 1e-3
    mean_net = 0.5 * (net[1:] + net[:-1]) / plant.inertia_kg_m2
    slow = slice(300, None)
    assert np.abs(gained - mean_net)[slow].max() < 0.05 * np.abs(gained).max()
    angle = tail["angle_from_index_rad"] + header["index_rad"]
    rise = tail["temperature_rise_K"]
    expected = np.array(
        [float(cogging_Nm(plant, a, rise_K=r)) for a, r in zip(angle, rise, strict=True)]
    )
    assert np.abs(tail["cogging_Nm"] - expected).max() < 0.03


def test_motion_after_the_last_sync_is_logged_every_20_ms(tmp_path: Path) -> None:
    path = tmp_path / "truth.bin"
    rig = Rig(truth_log=path)
    rig.enable(10)
    rig.torque = 200
    rig.cycles(50)
    ended_s = rig.now
    rig.run(0.5)
    _, log = read(path)
    assert np.count_nonzero(log["sync_index"] != NO_SYNC) == rig.drive.sync_count
    after = log[log["time_s"] > ended_s]
    assert np.diff(after["time_s"][:20]) == pytest.approx(0.02, abs=1.1e-3)
    assert (np.diff(after["angle_rad"]) > 0.0).all()
    assert set(after["sync_index"]) == {NO_SYNC}
    rig.drive.close()


def test_full_disk_ends_the_log_and_not_the_drive(capsys: pytest.CaptureFixture[str]) -> None:
    rig = Rig(truth_log=Path("/dev/full"))
    rig.enable(10)
    rig.cycles(1200)
    assert rig.status & 0x6F == 0x27
    rig.drive.close()
    assert capsys.readouterr().err.count("log /dev/full") == 1


# Poses measured by an external scanner.

PLANT = ScannerPlant(position_sigma_m=0.003, rotation_sigma_rad=0.01, rate_Hz=40.0)
SPACE = {
    "exits": [(x, y, 3.0) for x in (-2.0, 2.0) for y in (-2.0, 2.0)],
    "anchors": [(x, y, 0.1) for x in (-0.1, 0.1) for y in (-0.1, 0.1)],
    "home": (0.1, -0.2, 1.4),
    "start": {"rotation_deg": (10.0, 20.0, -30.0)},
}


def measured(path: Path, robot: CableRobot, seconds: float, seed: int = 1) -> np.ndarray:
    """Return the records of `seconds`, advanced in steps of a millisecond."""
    scanner = PoseScanner(path, robot, PLANT, seed)
    for k in range(round(seconds * 1e3)):
        scanner.append(k, k * 1e-3, ())
    scanner.close()
    data = path.read_bytes()
    header = json.loads(data[:HEADER_BYTES])
    assert header["position_sigma_m"] == 0.003
    fields = [(name, kind, *map(tuple, shape)) for name, kind, *shape in header["fields"]]
    return np.frombuffer(data[HEADER_BYTES:], np.dtype(fields))


def test_pose_measurements_have_the_rate_and_errors_of_the_plant(tmp_path: Path) -> None:
    robot = body(**SPACE)
    seen = measured(tmp_path / "scan", robot, 50.0)
    assert np.allclose(seen["time_s"], np.arange(2000) / 40.0, atol=1e-9)
    off = seen["position_m"] - robot.position_m
    assert np.std(off, axis=0) == pytest.approx([0.003] * 3, rel=0.06)
    assert np.abs(off.mean(axis=0)).max() < 3e-4
    turned = Rotation.from_matrix(seen["rotation"] @ robot.rotation.T).as_rotvec()
    assert np.std(turned, axis=0) == pytest.approx([0.01] * 3, rel=0.06)
    # readings are not correlated with previous ones, nor positions with rotations
    both = np.hstack([off, turned])
    assert np.abs(np.corrcoef(both[1:].T, both[:-1].T)[:6, 6:]).max() < 0.1
    assert np.abs(np.corrcoef(both.T) - np.eye(6)).max() < 0.1


def test_planar_pose_measurements_have_two_coordinates_and_an_angle(tmp_path: Path) -> None:
    seen = measured(tmp_path / "scan", body(), 2.0)
    turned = Rotation.from_matrix(seen["rotation"]).as_rotvec()
    assert (seen["position_m"][:, 2] == 0.0).all()
    assert np.abs(turned[:, :2]).max() == 0.0
    assert np.std(turned[:, 2]) > 0.005


def test_the_same_seed_gives_the_same_measurement_errors(tmp_path: Path) -> None:
    one, again, other = (
        measured(tmp_path / f"scan-{i}", body(), 1.0, seed) for i, seed in enumerate((1, 1, 2))
    )
    assert one.tobytes() == again.tobytes() != other.tobytes()
