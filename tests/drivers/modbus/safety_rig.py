"""A simulated safety I/O in a separate process, with a physics board."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pymodbus.client import ModbusTcpClient

from cdpr_profiles.places import SHIPPED
from cdpr_profiles.safety_io import SafetyIoProfile, load_safety_io
from cdpr_rt.core.clock import PacedClock
from cdpr_sim_bus.physics_board import PhysicsBoard, SafetyIoFault

CLOCK = PacedClock()
"""While this clock waits, the devices are polled."""
PANEL = 247
DEADLINE_S = 60.0


class SafetyIoProcess:
    """A running `cdpr sim safety-io`, accessed through pymodbus."""

    def __init__(self, profile: Path, *options: str | Path) -> None:
        self.file = profile
        self.process = start("safety-io", profile, "--port", "0", *options)
        self.ready = ready(self.process)
        self.port = int(self.ready["port"])
        self.reference = f"{profile}@127.0.0.1:{self.port}"
        self._client = ModbusTcpClient("127.0.0.1", port=self.port, timeout=60)

    def profile(self, **changes: Any) -> SafetyIoProfile:
        return load_safety_io(self.reference).model_copy(update=changes)

    def press(self, pressed: bool = True) -> None:
        assert not self._client.write_register(0, int(pressed), device_id=PANEL).isError()

    def break_(self, fault: SafetyIoFault) -> None:
        assert not self._client.write_register(1, int(fault), device_id=PANEL).isError()

    def mend(self) -> None:
        """Restore the initial state."""
        self.press(False)
        self.break_(SafetyIoFault(0))
        for coil in (0, 1, 2, 8, 9, 10):
            self.set(coil, False)
        wait_until(lambda: not self.coil(0) and self.input(1))

    def coil(self, address: int) -> bool:
        return bool(self._client.read_coils(address, count=1, device_id=1).bits[0])

    def input(self, address: int) -> bool:
        return bool(self._client.read_discrete_inputs(address, count=1, device_id=1).bits[0])

    def set(self, coil: int, on: bool) -> None:
        assert not self._client.write_coil(coil, on, device_id=1).isError()

    def close(self) -> None:
        self._client.close()
        self.process.communicate(b"", timeout=120)


def start(*arguments: str | Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "cdpr_tools.cli", "sim", *map(str, arguments)]
    return subprocess.Popen(
        [*command, "--exit-with-stdin"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )


def ready(process: subprocess.Popen[bytes]) -> dict[str, Any]:
    assert process.stdout is not None
    line: dict[str, Any] = json.loads(process.stdout.readline())
    return dict(line["ready"])


def wait_until(done: Callable[[], object], timeout_s: float = DEADLINE_S) -> float:
    """Return how long it took. Fail after the timeout."""
    began_s = CLOCK.now_s
    while not done():
        assert CLOCK.now_s - began_s < timeout_s, "timed out"
        CLOCK.sleep(0.005)
    return CLOCK.now_s - began_s


def patient_profile(
    folder: Path,
    watchdog_s: float = 1.0,
    answer_s: float = 0.2,
    trip_s: float = 0.4,
    follow_s: float = 0.3,
) -> Path:
    """Return the shipped profile with timeouts for a busy machine."""
    text = (SHIPPED / "safety_io" / "modbus-remote-io.toml").read_text()
    for key, value in (("answer_timeout_s", answer_s), ("trip_timeout_s", trip_s)):
        line = next(line for line in text.splitlines() if line.startswith(key))
        text = text.replace(line, f"{key} = {value}")
    text = text.replace("\ntimeout_s = 0.3", f"\ntimeout_s = {follow_s}")
    text = text.replace("timeout_s = 0.5", f"timeout_s = {watchdog_s}")
    path = folder / "io.toml"
    path.write_text(text)
    return path


@contextmanager
def board_file() -> Iterator[Path]:
    path = Path(f"/dev/shm/cdpr-test-{os.getpid()}-{uuid.uuid4().hex[:6]}")
    try:
        yield path
    finally:
        path.unlink(missing_ok=True)


@contextmanager
def io_device_on_board(
    folder: Path, axes: int = 2
) -> Iterator[tuple[SafetyIoProcess, PhysicsBoard]]:
    """Yield a simulated I/O on the test's board, with limit switches at -90 and 90 degrees.

    Timeouts are long: tests of timeouts pass shorter ones to `profile`.
    """
    plant = folder / "safety-plant.toml"
    switches = "[[axes]]\nlimit_negative_deg = -90.0\nlimit_positive_deg = 90.0\n"
    plant.write_text(switches)
    with board_file() as path, PhysicsBoard.create(path, axes) as board:
        io_device = SafetyIoProcess(
            patient_profile(folder, 60.0, 5.0, 5.0, 1.5), "--board", path, "--plant", plant
        )
        try:
            yield io_device, board
        finally:
            io_device.close()
