"""A robot on two buses with one safety I/O, checked on the physics board."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from cdpr_drivers.errors import DriveFaultError
from cdpr_profiles import load_robot
from cdpr_rt.errors import TripError
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_tools.composition.session import open_robot
from tests.drivers.modbus.safety_rig import SafetyIoProcess, board_file, patient_profile, wait_until
from tests.tools.robot_rig import OUT, hold, robot_file, simulated


def test_the_emergency_stop_removes_torque_on_each_bus(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    path = robot_file(tmp_path, [("a", 1), ("b", 2)])
    with board_file() as shared, simulated(path, "--board", str(shared)) as url:
        io_device = SafetyIoProcess(patient_profile(tmp_path), "--board", shared)
        pressed = threading.Timer(0.5, io_device.press)
        try:
            with PhysicsBoard.attach(shared) as board:
                axes = [board.axis(i) for i in range(2)]
                with (
                    pytest.raises((TripError, DriveFaultError)) as caught,
                    open_robot(
                        load_robot(path), [url], OUT, safety_io=io_device.reference
                    ) as session,
                ):
                    session.enable()
                    assert all(axis.state().power_on for axis in axes)
                    assert axes[0].brake_released
                    pressed.start()
                    hold(session, 1e4, [3.0, -3.0])
                assert "the emergency-stop chain is open" in str(caught.value)
                wait_until(lambda: not any(axis.state().power_on for axis in axes))
                assert not axes[0].brake_released
        finally:
            pressed.cancel()
            io_device.close()
