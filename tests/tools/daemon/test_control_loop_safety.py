"""The loop with a safety I/O: contactor, brakes and emergency stop, checked on the physics."""

from __future__ import annotations

import os
import time
import uuid
from collections.abc import Callable, Iterator

import pytest

from cdpr_rt.core.states import LoopState
from cdpr_sim_bus.physics_board import BoardAxis, PhysicsBoard, SafetyIoFault
from tests.drivers.modbus.safety_rig import (
    SafetyIoProcess,
    board_file,
    patient_profile,
    ready,
    start,
)
from tests.tools.daemon.loop_rig import LoopRig, opened

WINCH = "winch-mpp0923d"


@pytest.fixture(scope="module")
def lab(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[LoopRig, SafetyIoProcess, BoardAxis]]:
    bus = f"simbus:loop-safety-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    folder = tmp_path_factory.mktemp("io")
    before = os.environ.get("XDG_STATE_HOME")
    os.environ["XDG_STATE_HOME"] = str(folder)
    try:
        with board_file() as path:
            simulator = start("up", WINCH, "--bus", bus, "--lockstep", "--board", path)
            ready(simulator)
            io_device = SafetyIoProcess(patient_profile(folder), "--board", path)
            with (
                PhysicsBoard.attach(path) as board,
                opened(WINCH, bus, safety_io=io_device.reference) as rig,
            ):
                yield rig, io_device, board.axis(0)
            io_device.close()
            simulator.communicate(b"", timeout=120)
    finally:
        if before is None:
            del os.environ["XDG_STATE_HOME"]
        else:
            os.environ["XDG_STATE_HOME"] = before


def wait(rig: LoopRig, done: Callable[[], object]) -> None:
    """Turn the loop until `done`, slowly enough for polls of the I/O."""

    def at_ease() -> bool:
        time.sleep(0.002)
        return bool(done())

    rig.turn_until(at_ease)


def jog(rig: LoopRig) -> None:
    wanted = {"velocity_rad_s": [5.0], "timeout_s": 2.0}
    rig.obeyed("program", program="jog", wanted=wanted)
    rig.run(0.3)


def test_brakes_open_after_power_is_on_and_close_before_it_is_off(
    lab: tuple[LoopRig, SafetyIoProcess, BoardAxis],
) -> None:
    rig, _, winch = lab
    assert rig.state is LoopState.READY, rig.status
    assert winch.power_allowed
    assert not winch.brake_released
    number = rig.block.post_command({"do": "enable", "right": rig.right})
    wait(rig, lambda: winch.brake_released)
    assert rig.loop.engine.driving  # the motor held before the brake opened
    wait(rig, lambda: not rig.loop.busy)
    answer = rig.block.take_reply()
    assert answer is not None
    assert (answer["to"], answer["ok"]) == (number, True)
    jog(rig)
    rig.block.post_command({"do": "disable"})
    wait(rig, lambda: not winch.brake_released)
    wait(rig, lambda: rig.state is LoopState.READY)
    rig.block.take_reply()


def test_an_emergency_stop_removes_torque_in_the_next_cycle(
    lab: tuple[LoopRig, SafetyIoProcess, BoardAxis],
) -> None:
    rig, io_device, winch = lab
    rig.block.post_command({"do": "enable", "right": rig.right})
    wait(rig, lambda: rig.loop.engine.driving and not rig.loop.busy)
    rig.block.take_reply()
    jog(rig)
    rig.rows()
    io_device.press()
    wait(rig, lambda: rig.state is LoopState.FAULT)
    wait(rig, lambda: not winch.brake_released)
    wait(rig, lambda: not rig.loop.busy)
    told = rig.status
    assert "emergency-stop chain is open" in told["reason"]
    rows = rig.rows()
    (changes,) = (rows["state"] == LoopState.FAULT).nonzero()
    assert not rows["torque_sent_Nm"][changes].any()
    # the fault remains while the button is pressed
    answer = rig.command("acknowledge")
    assert not answer["ok"]
    assert "chain" in answer["text"]
    assert rig.state is LoopState.FAULT
    io_device.press(False)
    rig.obeyed("acknowledge")
    assert rig.state is LoopState.READY
    assert not winch.brake_released
    assert not winch.state().power_on


def test_a_brake_that_does_not_open_causes_a_fault(
    lab: tuple[LoopRig, SafetyIoProcess, BoardAxis],
) -> None:
    rig, io_device, winch = lab
    io_device.break_(SafetyIoFault.BRAKES_STUCK)
    rig.block.post_command({"do": "enable", "right": rig.right})
    wait(rig, lambda: rig.state is LoopState.FAULT)
    wait(rig, lambda: not rig.loop.busy)
    assert "brake" in rig.status["reason"]
    assert not winch.state().power_on
    io_device.break_(SafetyIoFault(0))
    answer = rig.block.take_reply()
    assert answer is not None
    assert not answer["ok"]
    rig.obeyed("acknowledge")


def test_an_immediate_power_off_during_shutdown_applies_the_brakes(
    lab: tuple[LoopRig, SafetyIoProcess, BoardAxis],
) -> None:
    rig, _, winch = lab
    rig.block.post_command({"do": "enable", "right": rig.right})
    wait(rig, lambda: rig.loop.engine.driving and not rig.loop.busy)
    jog(rig)
    rig.loop.request_stop()
    rig.turn(10)
    assert rig.loop.engine.driving  # the controller brakes
    rig.loop.request_stop()
    rig.turn(2)
    assert rig.loop.engine.driving  # repeating the request changes nothing
    rig.loop.request_power_off()
    rig.turn(2)
    assert not rig.loop.engine.driving
    assert rig.machine._safety is not None
    assert not any(rig.machine._safety.io._outputs[brake] for brake in brake_coils(rig))
    wait(rig, lambda: not winch.brake_released)
    wait(rig, lambda: rig.loop.ended)
    assert not winch.state().power_on
    assert rig.loop.transitions.power_off_unconfirmed == ""


def brake_coils(rig: LoopRig) -> list[int]:
    assert rig.machine._safety is not None
    axes = rig.machine._safety.io.profile.axes
    return [axis.brake.output.coil for axis in axes if axis.brake is not None]
