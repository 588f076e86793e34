"""Commands of a simulated cable robot: true pose, faults, and motors without cables."""

from __future__ import annotations

import contextlib
import json
import time
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from waiting import until

from cdpr_drivers.camera.camera import open_camera
from cdpr_profiles import ProfileError
from cdpr_rt.core.clock import LockstepClock
from cdpr_sim_bus.cia402.faults import MEND
from cdpr_sim_bus.robot.truth_log import HEADER_BYTES
from cdpr_tools.client import client
from cdpr_tools.commands.sim_fault import LIST, fault
from cdpr_tools.errors import BadInputError
from tests.tools.robot_rig import Simulator, simulated, unique

ROBOTS = Path(__file__).parents[3] / "profiles" / "robots"
PLANT = """
[start]
slack_m = 0.0
[scanner]
position_sigma_m = 0.004
rate_Hz = 50.0
[camera]
samples = 4
lens = { width_px = 80, height_px = 64, focal_px = [70.0, 70.0], centre_px = [40.0, 32.0] }
"""


def whole_records(path: Path) -> np.ndarray:
    """Return the records in a log so far."""
    data = path.read_bytes()
    header = json.loads(data[:HEADER_BYTES])
    fields = [(name, kind, *map(tuple, shape)) for name, kind, *shape in header["fields"]]
    record = np.dtype(fields)
    assert record.itemsize == header["record_bytes"]
    assert (len(data) - HEADER_BYTES) % record.itemsize == 0, "records must be complete"
    return np.frombuffer(data[HEADER_BYTES:], record)


def records(path: Path) -> np.ndarray:
    """Return the records at SYNCs."""
    all_of_them = whole_records(path)
    return all_of_them[all_of_them["sync_index"] != 0xFFFFFFFF]


class Robot:
    """planar-3 on a bus, its log, and a third-party client that sends SYNC."""

    def __init__(self, folder: Path) -> None:
        self.name = unique()
        self.log, self.scanner = folder / "pose.bin", folder / "scanner.bin"
        self.camera = folder / "camera"
        plant = folder / "plant.toml"
        plant.write_text(PLANT)
        self.simulator = Simulator(
            *("planar-3", "--bus", f"simbus:{self.name}"),
            *("--plant", str(plant), "--truth-log", str(self.log)),
            *("--scanner", str(self.scanner), "--camera", str(self.camera)),
        )
        self.bus = can.Bus(interface="simbus", channel=f"{self.name}-can0")

    def sync(self, seconds: float) -> np.ndarray:
        """Send a SYNC every 10 ms for `seconds`. Return the last record, read live."""
        before = len(records(self.log))
        count = round(seconds / 0.01)
        for _ in range(count):
            self.bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
            time.sleep(0.01)
        until(lambda: len(records(self.log)) >= before + count, 120.0)
        seen = records(self.log)
        assert len(seen) == before + count
        return seen[-1]

    def fault(self, what: str, value: str | None = None, axis: str | None = None) -> None:
        fault("planar-3", what, value, bus=[f"simbus:{self.name}"], axis=axis)

    def close(self) -> None:
        self.bus.shutdown()
        self.simulator.close()


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    robot = Robot(tmp_path_factory.mktemp("robot"))
    yield robot
    robot.close()


def test_the_pose_is_logged_immediately(robot: Robot):
    before = robot.sync(0.1)
    assert before["rotation"].ravel() == pytest.approx(np.eye(3).ravel(), abs=0.02)
    assert before["tension_N"][:2].min() > 1e-3  # weight of sagging cables
    assert len(before["torque_Nm"]) == 3
    again = robot.sync(0.05)
    assert again["time_s"] > before["time_s"]
    assert again["sync_index"] == before["sync_index"] + 5


def test_a_scanner_measures_the_pose_with_errors(robot: Robot) -> None:
    true = robot.sync(0.5)
    seen = whole_records(robot.scanner)
    assert len(seen) > 10
    every_s = np.diff(seen["time_s"])
    assert every_s.mean() > 0.0199, "rate of at most 50 Hz"
    off = seen["position_m"] - true["position_m"]
    assert (off[:, 2] == 0.0).all()
    assert 0.001 < np.std(off[:, :2]) < 0.007


def test_a_camera_on_the_platform_sees_from_the_true_pose(robot: Robot) -> None:
    true = robot.sync(0.1)
    with open_camera(f"sim:{robot.camera}", LockstepClock()) as camera:
        image = camera.grab()
    assert image is not None and image.pixels.shape == (64, 80)
    assert image.device_time_s == pytest.approx(true["time_s"], abs=1e-9)


def test_a_cable_is_cut_while_the_robot_runs(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    assert robot.sync(0.05)["tension_N"][:2].min() > 1e-3
    robot.fault("cut-cable", axis="upper right")
    assert capsys.readouterr().out == "upper right: cut-cable\n"
    assert (robot.sync(0.05)["tension_N"][:2] > 1e-3).tolist() == [True, False]
    # by number; more cable than was taut
    robot.fault("slip", "500", axis="1")
    assert robot.sync(0.05)["tension_N"][0] < 0.5
    capsys.readouterr()
    robot.fault(LIST)
    broken = "upper left: slip 500 mm\nupper right: cut-cable\n"
    assert capsys.readouterr().out == broken
    robot.fault(MEND, axis="upper right")
    robot.fault(MEND)
    assert capsys.readouterr().out == (
        "upper right: mended: cut-cable\nupper left: mended: slip 500 mm\n"
    )
    assert robot.sync(0.5)["tension_N"][:2].min() > 1e-3
    robot.fault(LIST)
    assert capsys.readouterr().out == "nothing is broken\n"


@pytest.mark.parametrize("size", [1, 2, 4])
def test_a_zero_of_any_size_ends_the_silence(
    robot: Robot, size: int, capsys: pytest.CaptureFixture[str]
) -> None:
    robot.fault("silence", axis="lower")
    capsys.readouterr()
    kind = 0x23 | (4 - size) << 2  # an expedited SDO download
    frame = bytes((kind, 0x00, 0x2F, 0x06, 0, 0, 0, 0))
    robot.bus.send(can.Message(arbitration_id=0x603, data=frame, is_extended_id=False))
    time.sleep(0.1)
    robot.fault(LIST)
    assert capsys.readouterr().out == "nothing is broken\n"


def test_a_drive_in_fault_is_listed_with_what_clears_it(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    robot.fault("drive-fault", axis="lower")
    robot.fault(LIST)
    told = "lower: the drive is in fault 0x7305; `cdpr ack` clears it"
    assert told in capsys.readouterr().out.splitlines()
    reset = can.Message(arbitration_id=0, data=b"\x81\x03", is_extended_id=False)
    robot.bus.send(reset)


def test_a_silent_drive_is_listed_and_mended(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    robot.fault("silence", axis="lower")
    robot.fault(LIST)
    robot.fault(MEND)
    robot.fault(LIST)
    assert capsys.readouterr().out.splitlines() == [
        "lower: silence 65535 ms",
        "lower: silence 65535 ms",
        "lower: mended: silence 65535 ms",
        "nothing is broken",
    ]


@pytest.mark.parametrize(
    ("what", "reason"),
    [
        (
            ("slip", None, "upper"),
            "--axis upper: allowed: 1 to 3, or upper left, upper right",
        ),
        (("slip", "0"), "slip 0: allowed: whole numbers 1 to 65535"),
        (("encoder-jump", "far"), "encoder-jump far: allowed: whole numbers"),
        ((MEND, "3"), "mend 3: mend takes no value"),
        (("cell-off",), "cell-off: Planar robot with 3 cables has no load cells"),
    ],
)
def test_an_impossible_fault_is_rejected(robot: Robot, what: tuple[Any, ...], reason: str):
    with pytest.raises(BadInputError, match=reason):
        robot.fault(*what)


def test_a_fault_finds_the_robot_by_the_name_of_its_daemon(
    robot: Robot, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    url = {"url": f"simbus:{robot.name}-can0"}
    told = {"/description": {"reference": "planar-3"}, "/status": {"buses": {"can0": url}}}
    asked: list[str | None] = []

    @contextlib.contextmanager
    def opened(name: str | None, *_: object) -> Iterator[Any]:
        asked.append(name)
        yield types.SimpleNamespace(get=told.__getitem__)

    monkeypatch.setattr(client, "answers", lambda name, _: name == "mine")
    monkeypatch.setattr(client, "open_daemon", opened)
    fault("mine", "slip", "1", axis="lower")
    assert capsys.readouterr().out == "lower: slip 1 mm\n"
    assert set(asked) == {"mine"}
    with pytest.raises(ProfileError, match="no profile named 'yours'"):
        fault("yours", "slip")
    with pytest.raises(ProfileError, match="no profile named 'mine'"):
        fault("mine", "slip", bus=[f"simbus:{robot.name}"])


def test_cutting_a_cable_of_detached_motors_is_rejected() -> None:
    with (
        simulated("planar-3", "--detached") as bus,
        pytest.raises(BadInputError, match="cut-cable: the robot has no cable"),
    ):
        fault("planar-3", "cut-cable", bus=[bus], axis="lower")


def test_the_platform_starts_with_the_orientation_in_the_robots_file(tmp_path: Path) -> None:
    text = (ROBOTS / "suspended-8.toml").read_text()
    said = "mass_kg = 100.0\nhome_rotation_rad = [0.0, 0.1, 0.5]\n"
    text = text.replace("mass_kg = 100.0\n", said).replace(
        "anchor_point_m", "pulley_radius_m = 0.05\nanchor_point_m"
    )
    file, log, name = tmp_path / "robot.toml", tmp_path / "pose.bin", unique()
    file.write_text(text)
    turned = Rotation.from_rotvec((0.0, 0.1, 0.5)).as_matrix()
    with (
        contextlib.closing(
            Simulator(str(file), "--bus", f"simbus:{name}", "--truth-log", str(log))
        ) as simulator,
        can.Bus(interface="simbus", channel=f"{name}-can0") as bus,
    ):
        for _ in range(5):
            bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
            time.sleep(0.01)
        until(lambda: len(records(log)), 120.0)
        seen = records(log)
    assert {bus["truth_log"] for bus in simulator.ready["buses"].values()} == {str(log)}
    assert np.allclose(seen[0]["rotation"], turned, atol=2e-3)
    assert np.allclose(seen[0]["position_m"], (0.0, 0.0, 0.5), atol=2e-3)
    assert seen.dtype["tension_N"].shape == (8,)
