"""A winch with a safety I/O. Reactions are checked on the physics board, not in output."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import canopen
import pytest
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parents[1] / "drivers" / "modbus"))
from safety_rig import CLOCK, SafetyIoProcess, board_file, patient_profile, ready, start, wait_until

from cdpr_drivers.errors import DriverError
from cdpr_drivers.modbus.safety_io import SafetyIo
from cdpr_profiles import load_winch
from cdpr_rt.errors import ControlError
from cdpr_sim_bus.physics_board import BoardAxis, PhysicsBoard, SafetyIoFault
from cdpr_tools.commands import drive as drive_commands
from cdpr_tools.commands import io as io_commands
from cdpr_tools.errors import BadInputError, WorkFailedError

WINCH = "winch-mpp0923d"
TRIP_S = 2.0


@dataclass
class Lab:
    """A simulated winch and its safety I/O.

    The bus is in lockstep: a busy machine slows it down but misses no cycle. The I/O follows the
    wall clock, so that many seconds of bus time pass until it reacts.
    """

    bus: str
    board_path: Path
    winch: BoardAxis
    folder: Path
    io_device: SafetyIoProcess

    def begin(self, *arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "cdpr_tools.cli", *arguments, "--json"]
        return subprocess.Popen(
            command,
            env={**os.environ, "XDG_STATE_HOME": str(self.folder)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def jog(self, seconds: float) -> subprocess.Popen[str]:
        behind = ("--safety-io", self.io_device.reference, "--seconds", str(seconds))
        return self.begin("drive", "jog", WINCH, "--bus", self.bus, "--speed-deg-s", "600", *behind)

    def refused_jog(self, seconds: float) -> str:
        """Jog in this process, which is faster. Return why it failed."""
        behind = [
            "--bus",
            self.bus,
            "--safety-io",
            self.io_device.reference,
            "--seconds",
            str(seconds),
        ]
        runner = CliRunner(env={"XDG_STATE_HOME": str(self.folder)})
        outcome = runner.invoke(drive_commands.app, ["jog", WINCH, *behind])
        assert isinstance(outcome.exception, DriverError | ControlError), outcome.output
        return str(outcome.exception)

    def drive(self, action: str) -> dict[str, Any]:
        behind = ("--safety-io", self.io_device.reference)
        return result(self.begin("drive", action, WINCH, "--bus", self.bus, *behind))

    def io(self, action: str) -> dict[str, Any]:
        runner = CliRunner(env={"XDG_STATE_HOME": str(self.folder)})
        arguments = [action, self.io_device.reference, "--json"]
        outcome = runner.invoke(io_commands.app, arguments, catch_exceptions=False)
        told: dict[str, Any] = json.loads(outcome.stdout.splitlines()[-1])
        return told

    def moving(self) -> bool:
        return self.winch.state().motor_rad_s > 5.0


def result(command: subprocess.Popen[str], status: int = 0) -> dict[str, Any]:
    out, errors = command.communicate(timeout=120)
    assert "Traceback" not in errors + out, errors
    assert command.returncode == status, errors
    told: dict[str, Any] = json.loads(out.splitlines()[-1])
    return told


@pytest.fixture(scope="module")
def simulator() -> Iterator[tuple[str, Path]]:
    bus = f"simbus:safety-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    with board_file() as board:
        process = start("up", WINCH, "--bus", bus, "--lockstep", "--board", board)
        ready(process)
        yield bus, board
        process.communicate(b"", timeout=120)


@pytest.fixture(scope="module")
def module_io_device(
    simulator: tuple[str, Path], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[SafetyIoProcess]:
    folder = tmp_path_factory.mktemp("io")
    # long timeouts, because a device may have to wait for a core
    patient = patient_profile(folder, 60.0, TRIP_S, TRIP_S, 1.5)
    io_device = SafetyIoProcess(patient, "--board", simulator[1])
    yield io_device
    io_device.close()


@pytest.fixture
def lab(
    simulator: tuple[str, Path], module_io_device: SafetyIoProcess, tmp_path: Path
) -> Iterator[Lab]:
    bus, path = simulator
    with PhysicsBoard.attach(path) as board:
        _mend_drive(bus)  # without a leader, bus time follows the wall clock
        module_io_device.mend()
        yield Lab(bus, path, board.axis(0), tmp_path, module_io_device)


def _mend_drive(bus: str) -> None:
    network = canopen.Network()
    network.connect(interface="simbus", channel=bus.partition(":")[2])
    try:
        node = network.add_node(1, str(load_winch(WINCH).drive.eds))
        node.sdo.RESPONSE_TIMEOUT = 60.0
        if node.sdo[0x6041].raw & 0x08:
            node.nmt.send_command(129)
        wait_until(lambda: node.sdo[0x6041].raw & 0x4F == 0x40)
    finally:
        network.disconnect()


def test_the_emergency_stop_removes_torque_in_motion(lab: Lab) -> None:
    command = lab.jog(600)
    wait_until(lab.moving)
    assert lab.winch.brake_released
    lab.io_device.press()
    wait_until(lambda: not lab.winch.state().power_on)
    wait_until(lambda: not lab.winch.brake_released)
    error = result(command, status=1)["error"]
    assert "the emergency-stop chain is open (input 0 reads 0)" in error
    lab.io_device.press(False)
    assert "chain is open" in lab.io("ack")["acknowledged"]["reason"]
    assert lab.drive("reset")["state"] == "switch on disabled"


def test_an_io_silent_for_longer_than_allowed_stops_the_motion(lab: Lab) -> None:
    command = lab.jog(600)
    wait_until(lab.moving)
    lab.io_device.process.send_signal(signal.SIGSTOP)
    time.sleep(0.1)
    lab.io_device.process.send_signal(signal.SIGCONT)  # shorter than the trip timeout: no reaction
    time.sleep(0.5)
    wait_until(lab.moving)
    assert command.poll() is None
    lab.io_device.break_(SafetyIoFault.SILENT)
    wait_until(lambda: not lab.winch.state().power_on)
    assert "no good poll" in result(command, status=1)["error"]


def test_an_open_chain_is_reported_before_power_is_on(lab: Lab) -> None:
    lab.io_device.press()
    error = lab.refused_jog(1)
    assert "the emergency-stop chain is open (input 0)" in error
    assert "release the buttons" in error
    assert lab.io("show")["chain_ok"] is False
    assert not lab.io_device.coil(0)


def test_a_brake_that_stays_applied_ends_the_session(lab: Lab) -> None:
    lab.io_device.break_(SafetyIoFault.BRAKES_STUCK)
    error = lab.refused_jog(1)
    assert "the brake of winch 1 is not released" in error
    wait_until(lambda: not lab.winch.state().power_on)


def test_commands_switch_lamps_and_brakes(lab: Lab) -> None:
    lamp = lab.begin("io", "light", lab.io_device.reference, "green", "--seconds", "3")
    wait_until(lambda: lab.io_device.coil(10))
    assert result(lamp)["ok"]
    assert not lab.io_device.coil(10)
    brake = ("brake", lab.io_device.reference, "winch 1", "--seconds", "0.5")
    refused(*brake, said="not confirmed")
    command = lab.begin("io", *brake[:-1], "60", "--yes")
    wait_until(lambda: lab.winch.brake_released)
    command.terminate()
    assert result(command)["ok"]
    assert not lab.winch.brake_released
    with SafetyIo(lab.io_device.profile(), CLOCK) as other:
        other.energise()
        with pytest.raises(WorkFailedError, match="wait until the command that uses it"):
            CliRunner().invoke(io_commands.app, [*brake, "--yes"], catch_exceptions=False)
        assert not other.alarm()
        assert lab.io("off")["contactor_closed"] is False
        assert not lab.winch.power_allowed
        wait_until(other.alarm)  # it may not switch power on again
    refused("light", lab.io_device.reference, "pink", said="red, yellow, green")
    refused("brake", lab.io_device.reference, "winch 9", said="'winch 1', 'rail 1'")


def test_io_watch_prints_changes_and_switches_nothing(lab: Lab) -> None:
    watching = subprocess.Popen(
        [sys.executable, "-m", "cdpr_tools.cli", "io", "watch", lab.io_device.reference],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert watching.stdout is not None
    lines = [watching.stdout.readline() for _ in range(6)]
    lab.io_device.press()
    while not lines[-1].strip().endswith("chain  OPEN"):
        lines.append(watching.stdout.readline())
        assert lines[-1], "watch ended before it showed the open chain"
    watching.send_signal(signal.SIGINT)
    more, errors = watching.communicate(timeout=120)
    assert (watching.returncode, more) == (0, ""), (
        errors
    )  # one line per input, and one for the change
    told = [line for line in lines if "emergency-stop chain" in line]
    assert [line.split("chain")[1].strip() for line in told] == ["closed (ok)", "OPEN"]
    assert not lab.io_device.coil(8)  # not even the red lamp


def refused(*arguments: str, said: str) -> None:
    outcome = CliRunner().invoke(io_commands.app, [*arguments])
    assert isinstance(outcome.exception, BadInputError)
    assert said in str(outcome.exception)


def test_a_lost_io_causes_a_controlled_stop(lab: Lab) -> None:
    """This test must be last, because its safety I/O does not return."""
    command = lab.jog(600)
    wait_until(lab.moving)
    os.kill(lab.io_device.process.pid, signal.SIGKILL)
    # contactor and brake are out of reach: the drive stops the motor
    assert lab.winch.brake_released
    wait_until(lambda: lab.winch.state().motor_rad_s < 0.1)
    wait_until(lambda: not lab.winch.state().power_on)
    error = result(command, status=1)["error"]
    assert f"no good poll for {TRIP_S:.0f}." in error and f"{TRIP_S:g} s allowed" in error
