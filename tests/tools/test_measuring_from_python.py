"""`cdpr_rt.commission` and `cdpr_rt.calibrate`: bad arguments, Ctrl-C, data of earlier runs.

The examples run both to their results.
"""

from __future__ import annotations

import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdpr_rt as cdpr
from tests.slower_robot import slower_robot


@pytest.mark.parametrize(
    ("wrong", "error", "message"),
    [
        ({"winch": "winch-9"}, cdpr.InvalidRobot, "winch-9"),
        ({"bus": "nonsense:"}, cdpr.InvalidArgument, "nonsense"),
        ({"bus": "socketcan:can0"}, cdpr.InvalidArgument, "on socketcan:can0 will turn; give yes"),
        ({"bandwidth_Hz": 0.5}, cdpr.InvalidArgument, "bandwidth_Hz: 0.5; allowed: 1 to 100"),
        ({"index": "switch"}, cdpr.InvalidArgument, "index: 'switch'; allowed: 'homing', 'probe'"),
        ({"plant": "none.toml"}, cdpr.InvalidArgument, r"none\.toml"),
        ({"bus": 5}, cdpr.InvalidArgument, "bus: 5; allowed: a text"),
        ({"bandwidth_Hz": "fast"}, cdpr.InvalidArgument, "bandwidth_Hz: 'fast'; allowed: 1 to"),
        ({"plant": 5}, cdpr.InvalidArgument, "plant: 5; allowed: a path"),
        ({"folder": [5]}, cdpr.InvalidArgument, r"folder: \[5\]; allowed: a path"),
        ({"safety_io": 5}, cdpr.InvalidArgument, "safety_io: 5; allowed: a text"),
    ],
)
def test_wrong_arguments_of_commission_start_no_motor(
    wrong: dict[str, Any], error: type[cdpr.Error], message: str, tmp_path: Path
) -> None:
    given = {"winch": "winch-mpp0923d", "bus": "simbus:", "folder": tmp_path / "out", **wrong}
    with pytest.raises(error, match=message):
        cdpr.commission(**given)
    assert not list(tmp_path.rglob("*.raw"))


def test_commission_keeps_earlier_files_unless_it_may_overwrite_them(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    wanted = r"folder .*: contains other files; .* with overwrite=True"
    with pytest.raises(cdpr.InvalidArgument, match=wanted):
        cdpr.commission("winch-mpp0923d", bus="simbus:", folder=tmp_path)


def test_commission_in_another_thread_is_rejected_because_ctrl_c_must_stop_it(
    tmp_path: Path,
) -> None:
    with ThreadPoolExecutor(1) as threads:
        done = threads.submit(cdpr.commission, "winch-mpp0923d", bus="simbus:", folder=tmp_path)
        with pytest.raises(cdpr.Error, match="call it from the main thread"):
            done.result()


def test_calibrate_rejects_what_is_no_robot_handle() -> None:
    with pytest.raises(cdpr.InvalidArgument, match="robot: 'planar-4'; give what simulate, conn"):
        cdpr.calibrate("planar-4")  # type: ignore[arg-type]


@pytest.mark.long
def test_ctrl_c_ends_a_commissioning_and_has_its_usual_effect_afterwards(tmp_path: Path) -> None:
    over = threading.Event()

    def press() -> None:
        while not list(tmp_path.rglob("*.raw")) and not over.wait(0.05):
            pass
        os.kill(os.getpid(), signal.SIGINT)

    pressed = threading.Thread(target=press)
    pressed.start()
    try:
        with pytest.raises(KeyboardInterrupt, match="stopped"):
            cdpr.commission("winch-mpp0923d", bus="simbus:", folder=tmp_path, quick=True)
    finally:
        over.set()
        pressed.join()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.long
def test_poses_of_a_failed_calibration_are_kept_and_continued_only_on_request(
    tmp_path: Path,
) -> None:
    folder, seen = tmp_path / "out", list[np.ndarray]()

    def measured(by_cables_m: np.ndarray) -> list[float]:
        seen.append(by_cables_m)
        return [0.0, 1.3, 0.0]

    def broken(_by_cables_m: np.ndarray) -> None:
        raise OSError("the tracker does not answer")

    with cdpr.simulate(slower_robot(tmp_path, "planar-4")) as robot:
        robot.enable()
        with pytest.raises(cdpr.Error, match="the cables do not hold the platform"):
            cdpr.calibrate(robot, poses=15, folder=folder)
        robot.tighten()
        statuses = list[object]()
        robot.on_status = statuses.append
        wrong: dict[str, Any]
        for wrong in (
            {"measured_std_m": 0.0},
            {"measured_std_m": "2 mm"},
            {"known_exit_m": 1.0},
            {"poses": 3},
            {"identify": 5},
            {"measured": 5},
            {"folder": 5},
        ):
            with pytest.raises(cdpr.InvalidArgument, match=rf"^{next(iter(wrong))}"):
                cdpr.calibrate(robot, **{"folder": folder, **wrong})
        with pytest.raises(cdpr.InvalidArgument, match=r"measured: returned .*; allowed: 2 numb"):
            cdpr.calibrate(robot, measured=measured, poses=15, folder=folder)
        assert seen[0] == pytest.approx(robot.position_m, abs=1e-3)
        with pytest.raises(cdpr.InvalidArgument, match=r"contains 1 poses; .*resume=True"):
            cdpr.calibrate(robot, poses=15, folder=folder)
        with pytest.raises(OSError, match="the tracker does not answer"):
            cdpr.calibrate(robot, measured=broken, poses=15, folder=folder, resume=True)
        assert robot.state == "active"
        before = len(statuses)
        robot.wait(0.1)
        assert len(statuses) > before  # the handle shows its status to the script again


@pytest.mark.long
def test_only_a_simulated_robot_with_a_platform_has_a_true_pose() -> None:
    with cdpr.simulate("planar-3") as robot:
        assert robot.true_pose == pytest.approx([0.0, 1.3, 0.0, 1.0, 0.0, 0.0, 0.0], abs=2e-3)
    with (
        cdpr.simulate("bench-2") as bench,
        pytest.raises(cdpr.InvalidArgument, match="true_pose: bench-2 has no platform"),
    ):
        _ = bench.true_pose
    with cdpr.run("bench-2", bus="simbus:") as remote, pytest.raises(cdpr.Error, match="simulate"):
        _ = remote.true_pose
