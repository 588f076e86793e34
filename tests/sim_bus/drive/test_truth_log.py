"""The log of the true motion, read back as the report reads it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from drive_rig import Rig

from sim_bus.plant import Plant

HEADER_BYTES = 1024


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
        [float(plant.cogging_Nm(a, rise_K=r)) for a, r in zip(angle, rise, strict=True)]
    )
    assert np.abs(tail["cogging_Nm"] - expected).max() < 0.03


def test_flushed_when_the_syncs_pause(tmp_path: Path) -> None:
    path = tmp_path / "truth.bin"
    rig = Rig(truth_log=path)
    rig.enable(10)
    rig.cycles(20)
    rig.run(0.3)
    _, log = read(path)
    assert len(log) == rig.drive.sync_count
    rig.drive.close()


def test_full_disk_ends_the_log_and_not_the_drive(capsys: pytest.CaptureFixture[str]) -> None:
    rig = Rig(truth_log=Path("/dev/full"))
    rig.enable(10)
    rig.cycles(1200)
    assert rig.status & 0x6F == 0x27
    rig.drive.close()
    assert capsys.readouterr().err.count("truth log /dev/full") == 1
