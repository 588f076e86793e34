"""Simulated rails, their safety I/O and load cell, and commands that move them."""

from __future__ import annotations

import json
import math
import os
import struct
import subprocess
import sys
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import canopen
from click.testing import Result
from pymodbus.client import ModbusTcpClient
from tolerant_drive import write_tolerant_drive
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parents[1] / "drivers" / "modbus"))
from safety_rig import PANEL, SafetyIoProcess, ready, start

from cdpr_drivers.errors import DriverError
from cdpr_profiles import load_winch
from cdpr_profiles.places import SHIPPED
from cdpr_sim_bus.devices.sim_rail import RailFault
from cdpr_sim_bus.physics_board import BoardAxis, SafetyIoFault
from cdpr_tools.commands import rail as rail_commands

M_PER_RAD = 0.02 / math.tau
ANSWER_S, MASTER_S = 2.0, 2.0
"""Timeouts of devices and of their master, for a busy machine."""


@dataclass
class Rails:
    """A CiA 402 rail with its safety I/O, a Modbus rail, and the load cell of a winch."""

    bus: str
    io_device: SafetyIoProcess
    winch: BoardAxis
    rail: BoardAxis
    cia402: Path
    modbus: Path
    modbus_port: int
    tension_port: str
    home: Path

    def pull(self, tension_N: float) -> None:
        """Apply this tension to the winch's cable for half a second of its board's time."""
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
        """Move with a command in this process, which is faster."""
        runner = CliRunner(env={"XDG_STATE_HOME": str(self.home)})
        return runner.invoke(rail_commands.app, list(self._move(kind, to_m, slack)))

    def refused(self, kind: str, to_m: float, *slack: str) -> str:
        """Request a move in this process. Return why it was rejected."""
        outcome = self.moved(kind, to_m, *slack)
        assert isinstance(outcome.exception, DriverError), outcome.output
        return str(outcome.exception)

    def _move(self, kind: str, to_m: float, slack: tuple[str, ...]) -> tuple[str, ...]:
        slack = slack or ("--cables-slack-checked",)
        if kind == "modbus":
            return ("move", str(self.modbus), "--to", str(to_m), "--yes", *slack)
        where = ("--bus", self.bus, "--safety-io", self.io_device.reference)
        return ("move", str(self.cia402), "--to", str(to_m), *where, *slack)

    def position_m(self, kind: str) -> float:
        """Return the true position, not that of a command."""
        if kind == "cia402":
            return self.rail.state().motor_rad * M_PER_RAD
        high, low = self._registers(104, 2)
        return (high << 16 | low) * 1e-5

    def speed_m_s(self) -> float:
        """Return the true speed of the CiA 402 rail."""
        return self.rail.state().motor_rad_s * M_PER_RAD

    def braked(self, kind: str) -> bool:
        """Return whether the rail is without power on an applied brake."""
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
        """Mark the robot as calibrated."""
        self._state_file().parent.mkdir(parents=True, exist_ok=True)
        told = {"robot": "spatial-8", "calibrated": True, "why": "camera", "date": "2020-01-01"}
        self._state_file().write_text(json.dumps(told))

    def acknowledge_trip(self) -> None:
        name = f"safety-io.io.127.0.0.1.{self.io_device.port}.json"
        (self.home / "cdpr-rt" / name).unlink()

    def _state_file(self) -> Path:
        return self.home / "cdpr-rt" / "calibration.spatial-8.json"

    def _registers(self, address: int, count: int) -> list[int]:
        with self._modbus() as drive:  # otherwise hundreds of connections stay open during a move
            found: list[int] = drive.read_holding_registers(
                address, count=count, device_id=1
            ).registers
        return found

    def _modbus(self) -> ModbusTcpClient:
        return ModbusTcpClient("127.0.0.1", port=self.modbus_port, timeout=60)


def patient_rail(folder: Path, kind: str, port: int = 502) -> Path:
    """Write the shipped rail with `port` and timeouts for a busy machine. Return it."""
    text = (SHIPPED / "rails" / f"rail-{kind}.toml").read_text()
    drive = write_tolerant_drive(folder, 0.5 * MASTER_S, MASTER_S)
    changes = {
        "cia402": (('"generic-cia402"', f'"{drive}"'),),
        "modbus": (
            ("port = 502\n", f"port = {port}\nanswer_timeout_s = {ANSWER_S}\n"),
            ("brake_timeout_s = 0.5", f"brake_timeout_s = {ANSWER_S}"),
            ("\ntimeout_s = 0.5", f"\ntimeout_s = {MASTER_S}"),
        ),
    }
    for before, after in changes[kind]:
        assert before in text
        text = text.replace(before, after)
    path = folder / f"rail-{kind}.toml"
    path.write_text(text)
    return path


@contextmanager
def another_winch() -> Iterator[tuple[str, Callable[[], None]]]:
    """Yield the separate bus of a simulated winch and a function that enables it."""
    bus = f"winches-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    winch = start("up", "winch-mpp0923d", "--bus", f"simbus:{bus}", "--paced")
    ready(winch)
    network = canopen.Network()
    network.connect(interface="simbus", channel=bus)
    node = network.add_node(1, str(load_winch("winch-mpp0923d").drive.eds))
    node.sdo.RESPONSE_TIMEOUT = 60.0
    node.sdo[0x6060].raw = 4

    def power() -> None:  # by PDO, because all clients share one SDO channel
        node.nmt.state = "OPERATIONAL"
        for word in (6, 7, 15):
            network.send_message(0x201, struct.pack("<Hh", word, 0))
            network.sync.transmit()

    try:
        yield f"simbus:{bus}", power
    finally:
        network.disconnect()
        winch.communicate(b"", timeout=120)
