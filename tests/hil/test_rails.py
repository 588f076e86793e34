"""Rails moved by command: what is refused, what an interrupted move leaves behind."""

from __future__ import annotations

import json
import math
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
from click.testing import Result
from pymodbus.client import ModbusTcpClient
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parents[1] / "drivers" / "modbus"))
from safety_rig import (
    CLOCK,
    PANEL,
    SafetyIoProcess,
    board_file,
    patient_profile,
    ready,
    start,
    wait_until,
)

from cdpr_drivers.errors import DriverError
from cdpr_drivers.modbus.safety_io import SafetyIoError
from cdpr_drivers.rails.rail import RailError
from cdpr_drivers.rails.rail_cia402 import Cia402RailAxis
from cdpr_drivers.rails.rail_modbus import ModbusRailAxis
from cdpr_profiles import load_winch
from cdpr_profiles.catalogue import load_rail_drive
from cdpr_profiles.devices.rail import load_rail
from cdpr_profiles.reading.places import SHIPPED
from cdpr_sim_bus.devices.sim_rail import RailFault
from cdpr_sim_bus.devices.sim_safety_io import SafetyIoFault
from cdpr_sim_bus.physics_board import BoardAxis, PhysicsBoard
from cdpr_tools import cli
from cdpr_tools.commands.devices import rail as rail_commands
from cdpr_tools.errors import BAD_INPUT, BadInputError

FAILED = 1
M_PER_RAD = 0.02 / math.tau


@dataclass
class Rails:
    """A rail on CiA 402 with its safety I/O, one on Modbus, and the load cell of a winch."""

    bus: str
    io_device: SafetyIoProcess
    winch: BoardAxis
    rail: BoardAxis
    modbus: Path
    modbus_port: int
    tension_port: str
    home: Path

    def pull(self, tension_N: float) -> None:
        """Have the winch's cable carry this tension for half a second of its board's time."""
        begun_s = self.winch.time_s
        for step in range(1, 501):
            self.winch.publish(begun_s + 1e-3 * step, tension_N, 0.0, 0.0, False)

    def begin(self, *arguments: str | Path) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "cdpr_tools.cli", "rail", *map(str, arguments), "--json"],
            env={**os.environ, "XDG_STATE_HOME": str(self.home)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def move(self, kind: str, to_m: float, *slack: str) -> subprocess.Popen[str]:
        return self.begin(*self._move(kind, to_m, slack))

    def moved(self, kind: str, to_m: float, *slack: str) -> Result:
        """Move in this process, which is quicker."""
        runner = CliRunner(env={"XDG_STATE_HOME": str(self.home)})
        return runner.invoke(rail_commands.app, list(self._move(kind, to_m, slack)))

    def refused(self, kind: str, to_m: float, *slack: str) -> str:
        """Ask for a move in this process; return why it was refused."""
        outcome = self.moved(kind, to_m, *slack)
        assert isinstance(outcome.exception, DriverError), outcome.output
        return str(outcome.exception)

    def _move(self, kind: str, to_m: float, slack: tuple[str, ...]) -> tuple[str, ...]:
        slack = slack or ("--cables-slack-checked",)
        if kind == "modbus":
            return ("move", str(self.modbus), "--to", str(to_m), "--yes", *slack)
        where = ("--bus", self.bus, "--safety-io", self.io_device.reference)
        return ("move", "rail-cia402", "--to", str(to_m), *where, *slack)

    def position_m(self, kind: str) -> float:
        """The truth, and not what a command tells."""
        if kind == "cia402":
            return self.rail.state().motor_rad * M_PER_RAD
        high, low = self._registers(104, 2)
        return (high << 16 | low) * 1e-5

    def speed_at_braking(self) -> float:
        """Wait for the brake of the CiA 402 rail; return the last speed before it closed."""
        speed, deadline = math.inf, time.monotonic() + 60.0
        while self.rail.brake_released:
            speed = self.rail.state().motor_rad_s * M_PER_RAD
            assert time.monotonic() < deadline
            time.sleep(0.001)
        return speed

    def braked(self, kind: str) -> bool:
        """Whether the rail stands without power on an applied brake."""
        if kind == "cia402":
            return not self.rail.brake_released and not self.rail.state().power_on
        return not self._registers(111, 1)[0] & 0b10011

    def wear_brake(self, kind: str) -> None:
        if kind == "cia402":
            self.io_device.break_(SafetyIoFault.BRAKES_WORN)
        else:
            self.break_modbus(RailFault.BRAKE_WORN)

    def break_modbus(self, fault: RailFault) -> None:
        with self._modbus() as panel:
            panel.write_register(1, int(fault), device_id=PANEL)

    def calibration(self) -> dict[str, Any]:
        held: dict[str, Any] = json.loads(self._state_file().read_text())
        return held

    def forget(self) -> None:
        """Have the robot calibrated."""
        self._state_file().parent.mkdir(parents=True, exist_ok=True)
        told = {"robot": "spatial-8", "calibrated": True, "why": "camera", "date": "2020-01-01"}
        self._state_file().write_text(json.dumps(told))

    def acknowledge_trip(self) -> None:
        name = f"safety-io.io.127.0.0.1.{self.io_device.port}.json"
        (self.home / "cdpr-rt" / name).unlink()

    def _state_file(self) -> Path:
        return self.home / "cdpr-rt" / "calibration.spatial-8.json"

    def _registers(self, address: int, count: int) -> list[int]:
        with self._modbus() as drive:  # or its connections stay, hundreds while a move is awaited
            found: list[int] = drive.read_holding_registers(
                address, count=count, device_id=1
            ).registers
        return found

    def _modbus(self) -> ModbusTcpClient:
        return ModbusTcpClient("127.0.0.1", port=self.modbus_port, timeout=60)


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rails]:
    folder = tmp_path_factory.mktemp("rails")
    bus = f"simbus:rails-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    modbus = folder / "rail-modbus.toml"
    with board_file() as on_rail, board_file() as on_winch:
        drive = start("rail", "rail-cia402", "--bus", bus, "--board", on_rail)
        other = start("rail", "rail-modbus", "--port", "0")
        with PhysicsBoard.create(on_winch, 1) as winch:
            ready(drive)
            cells = start("tension", "rtu-load-cell-1", "--board", on_winch)
            port = int(ready(other)["port"])
            text = (SHIPPED / "rails" / "rail-modbus.toml").read_text()
            modbus.write_text(text.replace("port = 502", f"port = {port}"))
            io_device = SafetyIoProcess(
                patient_profile(folder, 3.0), "--board", on_winch, "--board", on_rail
            )
            with PhysicsBoard.attach(on_rail) as rail:
                tty = ready(cells)["port"]
                axes = winch.axis(0), rail.axis(0)
                yield Rails(bus, io_device, *axes, modbus, port, tty, folder / "state")
            io_device.close()
            for process in (drive, other, cells):
                process.communicate(b"", timeout=120)


@pytest.fixture
def rails(parts: Rails) -> Rails:
    parts.pull(0.0)
    parts.io_device.mend()
    parts.break_modbus(RailFault(0))
    parts.forget()
    return parts


def await_motion(rails: Rails, kind: str, command: subprocess.Popen[str], past_m: float) -> None:
    def moves() -> bool:
        assert command.poll() is None, command.communicate()[1]
        return rails.position_m(kind) > past_m

    wait_until(moves)


def result(command: subprocess.Popen[str], status: int = 0) -> dict[str, Any]:
    out, errors = command.communicate(timeout=120)
    assert "Traceback" not in errors + out, errors
    assert command.returncode == status, errors
    told: dict[str, Any] = json.loads(out.splitlines()[-1])
    return told


@pytest.mark.parametrize("kind", ["cia402", "modbus"])
def test_a_move_arrives_and_voids_the_calibration(rails: Rails, kind: str) -> None:
    target = rails.position_m(kind) + 0.01
    told = result(rails.move(kind, target))
    assert abs(rails.position_m(kind) - target) < 5e-4
    assert abs(told["to_m"] - target) < 5e-4 and told["brake_moved_m"] < 2e-4
    assert rails.braked(kind)
    state = rails.calibration()
    assert state["calibrated"] is False and "was moved from" in state["why"]


@pytest.mark.parametrize("stopped", [False, True])
def test_while_a_slow_disk_is_written_the_drive_hears_its_master_and_ctrl_c_is_heard(
    rails: Rails, monkeypatch: pytest.MonkeyPatch, stopped: bool
) -> None:
    def slow(_fd: int) -> None:  # a busy disk cannot be had here
        if stopped:
            os.kill(os.getpid(), signal.SIGINT)
        time.sleep(2.0 * load_rail_drive("rail-cia402", rail.cia402).heartbeat_consumer_s)

    def enable(axis: Cia402RailAxis) -> None:
        enabled.append(axis)
        really_enable(axis)

    enabled, really_enable = list[Cia402RailAxis](), Cia402RailAxis.enable
    rail = load_rail("rail-cia402")
    assert rail.cia402 is not None
    monkeypatch.setattr(os, "fsync", slow)
    monkeypatch.setattr(Cia402RailAxis, "enable", enable)
    before = rails.position_m("cia402")
    outcome = rails.moved("cia402", before + 0.005)
    moved_m = rails.position_m("cia402") - before
    if stopped:
        assert "stopped on request" in str(outcome.exception)
        assert abs(moved_m) < 2e-4 and rails.braked("cia402")  # its brake's play
        assert not enabled
    else:
        assert outcome.exit_code == 0, outcome.exception
        assert abs(moved_m - 0.005) < 5e-4


@pytest.mark.parametrize("kind", ["cia402", "modbus"])
def test_a_brake_that_does_not_hold_is_found_before_the_move(rails: Rails, kind: str) -> None:
    before = rails.position_m(kind)
    rails.wear_brake(kind)
    error = rails.refused(kind, before + 0.3)
    assert "the applied brake does not hold: pushed with 10 % of the rated torque" in error
    assert abs(rails.position_m(kind) - before) < 0.05
    assert "slipped by" in rails.calibration()["why"]


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (RailFault.TARGET_LOST, "holding register 100 was set to"),
        (RailFault.DRIVE_FAULT, "the drive is in fault"),
        (RailFault.BRAKE_STUCK, "the brake is not released 0.5 s after it was told to"),
        (RailFault.TRUNCATED, "the answer was cut off after"),
        (RailFault.SILENT, "no answer within 0.2 s from unit 1"),
    ],
)
def test_a_drive_that_does_not_do_as_it_is_told_is_not_moved(
    rails: Rails, fault: RailFault, said: str
) -> None:
    before = rails.position_m("modbus")
    rails.break_modbus(fault)
    error = rails.refused("modbus", 0.9)
    rails.break_modbus(RailFault(0))
    assert said in error
    assert rails.position_m("modbus") == before


@pytest.mark.alone  # load cells and who reads them live by the wall clock
def test_tight_cables_refuse_the_move_and_end_it(rails: Rails) -> None:
    before = rails.position_m("cia402")
    cells = ("--sensors", "rtu-load-cell-1", "--tension-port", rails.tension_port)
    rails.pull(40.0)
    error = rails.refused("cia402", before + 0.3, *cells)
    assert "not moved unless the cables are slack: winch 1 has 4" in error
    assert "(5 N allowed)" in error
    assert abs(rails.position_m("cia402") - before) < 1e-4
    assert rails.calibration()["calibrated"] is True
    rails.pull(0.0)
    command = rails.move("cia402", before + 0.5, *cells)
    await_motion(rails, "cia402", command, before + 0.01)
    rails.pull(40.0)
    assert "the cables are not slack any more" in result(command, FAILED)["error"]
    assert rails.braked("cia402")
    assert before + 0.01 < rails.position_m("cia402") < before + 0.3


def test_a_winch_with_power_refuses_the_move_and_ends_it(rails: Rails) -> None:
    before = rails.position_m("modbus")
    bus = f"winches-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    winch = start("up", "winch-mpp0923d", "--bus", f"simbus:{bus}", "--paced")
    ready(winch)
    network = canopen.Network()
    network.connect(interface="simbus", channel=bus)
    try:
        node = network.add_node(1, str(load_winch("winch-mpp0923d").drive.eds))
        node.sdo.RESPONSE_TIMEOUT = 60.0
        slack = ("--cables-slack-checked", "--winch-bus", f"simbus:{bus}")
        command = rails.move("modbus", before + 0.5, *slack)
        await_motion(rails, "modbus", command, before + 0.005)
        node.sdo[0x6060].raw = 4
        for word in (6, 7, 15):
            node.sdo[0x6040].raw = word
        error = result(command, FAILED)["error"]
        assert f"a winch may have power: node 1 on simbus:{bus} is" in error
        assert rails.braked("modbus")
        assert rails.position_m("modbus") < before + 0.4
        before = rails.position_m("modbus")
        error = rails.refused("modbus", before + 0.1, *slack)
        assert f"not moved while a winch has power: node 1 on simbus:{bus} is" in error
        assert rails.position_m("modbus") == before
    finally:
        network.disconnect()
        winch.communicate(b"", timeout=120)


def test_a_rail_on_modbus_heeds_the_safety_io_and_one_command(rails: Rails) -> None:
    before = rails.position_m("modbus")
    slack = ("--cables-slack-checked", "--safety-io", rails.io_device.reference)
    command = rails.move("modbus", before + 0.5, *slack)
    await_motion(rails, "modbus", command, before + 0.005)
    with pytest.raises(RailError, match="enabled already: another command moves it"):
        ModbusRailAxis(load_rail(rails.modbus), CLOCK).open()
    rails.io_device.press()
    assert "the emergency-stop chain is open" in result(command, FAILED)["error"]
    assert rails.braked("modbus")
    rails.io_device.press(False)
    rails.acknowledge_trip()


def test_a_real_drive_is_not_moved_unasked_because_a_simulated_bus_is_named(rails: Rails) -> None:
    arguments = ["move", str(rails.modbus), "--to", "0.9", "--cables-slack-checked"]
    outcome = CliRunner().invoke(rail_commands.app, [*arguments, "--bus", rails.bus])
    assert isinstance(outcome.exception, BadInputError)
    assert "not confirmed" in str(outcome.exception)


@pytest.mark.parametrize("kind", ["cia402", "modbus"])
def test_an_interrupted_move_is_stopped_and_braked_and_voids_the_calibration(
    rails: Rails, kind: str
) -> None:
    before = rails.position_m(kind)
    command = rails.move(kind, before + 0.5)
    await_motion(rails, kind, command, before + 0.005)
    command.send_signal(signal.SIGINT)
    if kind == "cia402":
        assert abs(rails.speed_at_braking()) < 0.2 * 0.05  # of the move's speed
    assert "stopped on request" in result(command, FAILED)["error"]
    assert rails.braked(kind)
    assert rails.position_m(kind) < before + 0.4
    assert rails.calibration()["calibrated"] is False


@pytest.mark.parametrize("kind", ["cia402", "modbus"])
def test_a_command_that_dies_leaves_no_rail_that_moves(rails: Rails, kind: str) -> None:
    before = rails.position_m(kind)
    command = rails.move(kind, before + 0.5)
    await_motion(rails, kind, command, before + 0.005)
    command.kill()
    command.communicate()
    if kind == "cia402":  # the drive misses its master before the I/O does
        wait_until(lambda: abs(rails.rail.state().motor_rad_s) < 0.05)
        assert rails.rail.brake_released
    wait_until(lambda: rails.braked(kind))
    assert rails.position_m(kind) < before + 0.4
    assert rails.calibration()["calibrated"] is False


def test_a_safety_io_that_falls_silent_ends_a_move(rails: Rails) -> None:
    before = rails.position_m("cia402")
    command = rails.move("cia402", before + 0.3)
    await_motion(rails, "cia402", command, before + 0.005)
    rails.io_device.break_(SafetyIoFault.SILENT)
    assert "no good poll" in result(command, FAILED)["error"]
    assert rails.position_m("cia402") < before + 0.2
    assert not rails.rail.state().power_on
    rails.acknowledge_trip()


def test_the_emergency_stop_ends_a_move(rails: Rails) -> None:
    before = rails.position_m("cia402")
    command = rails.move("cia402", before + 0.5)
    await_motion(rails, "cia402", command, before + 0.005)
    rails.io_device.press()
    wait_until(lambda: rails.braked("cia402"))
    assert "the emergency-stop chain is open" in result(command, FAILED)["error"]
    rails.io_device.press(False)
    where = ["reset", "rail-cia402", "--bus", rails.bus, "--safety-io", rails.io_device.reference]
    runner = CliRunner(env={"XDG_STATE_HOME": str(rails.home)})
    with pytest.raises(SafetyIoError, match="tripped on"):
        runner.invoke(rail_commands.app, where, catch_exceptions=False)
    rails.acknowledge_trip()
    assert "no fault" in runner.invoke(rail_commands.app, where, catch_exceptions=False).stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--to", "1.5", "--cables-slack-checked"), "--to 1.5: allowed are 0 to 1.2 m"),
        (("--to", "0.1", "--safety-io", "nobody"), "the cables must be slack"),
        (("--to", "0.1", "--cables-slack-checked"), "--safety-io: Rail 1"),
        (
            ("--to", "0.1", "--safety-io", "nobody", "--sensors", "rtu-load-cell-1"),
            "--tension-port",
        ),
    ],
)
def test_what_a_move_needs_is_said_before_anything_moves(
    arguments: tuple[str, ...], said: str
) -> None:
    command = ["move", "rail-cia402", "--bus", "simbus:nobody", *arguments]
    outcome = CliRunner().invoke(rail_commands.app, command)
    assert cli.exit_status(outcome.exception) == BAD_INPUT
    assert said in str(outcome.exception)
