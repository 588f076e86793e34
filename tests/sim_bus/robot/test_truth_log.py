"""The log of the true motion, read back as the report reads it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from cdpr_sim_bus.robot.plant import Plant
from tests.sim_bus.cia402.drive_rig import Rig
from tests.sim_bus.robot.plant_torques import cogging_Nm

HEADER_BYTES = 1024
NO_SYNC = 0xFFFFFFFF


def read(path: Path) -> tuple[dict[str, object], np.ndarray]:
    header = json.loads(path.read_bytes()[:HEADER_BYTES])
    dtype = np.dtype([(name, kind) for name, kind in header["fields"]])
    assert dtype.itemsize == header["record_bytes"]
    return header, np.fromfile(path, dtype, offset=HEADER_BYTES)


def test_one_record_per_sync_that_obeys_newton(tmp_path: Path) -> None:
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
    # The angle counts from power-up, as the encoder does, half a millisecond later.
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


def test_what_happens_when_the_syncs_end_is_in_the_log_at_once(tmp_path: Path) -> None:
    """The motor turns on by itself; a record is there every 20 ms."""
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
