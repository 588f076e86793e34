"""Simulated drives of any shipped profile, a session with one, and the true motion."""

from __future__ import annotations

import os
import subprocess
import sys
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cdpr_profiles
from cdpr_profiles import Winch, load_winch
from cdpr_sim_bus.bus.server import serve
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.robot.plant import Plant
from cdpr_tools.composition.session import Session
from cdpr_tools.recordings.truth import NO_SYNC

SHIPPED = Path(cdpr_profiles.__file__).parent
DRIVES = ("generic-cia402", "mnm-profile-torque", "parker-compax3-canopen")
"""Drives whose quirks the simulator has; the other profiles are tested by turning the motor."""
PLANT = """
[drive]
overcurrent_Arms = 4.0
"""
"""A drive that trips at 2.2 Nm, so that a test can cause a fault without injecting it."""

_TRUTH = np.dtype(
    [("sync", "<u4"), ("time", "<f8"), ("angle", "<f8"), ("from_index", "<f8"),
     ("velocity", "<f4"), ("motor_Nm", "<f4"), ("cogging", "<f4"), ("friction", "<f4"),
     ("rise", "<f4")]
)  # fmt: skip
_HEADER_BYTES = 1024
_FLUSHED_CYCLES = 513


def write_winch(folder: Path, drive: str, node_id: int = 1) -> Path:
    """Write and return the file of the shipped winch with a different drive and node id."""
    text = (SHIPPED / "winches" / "winch-mpp0923d.toml").read_text()
    text = text.replace('"generic-cia402"', f'"{drive}"').replace(
        "node_id = 1\n", f"node_id = {node_id}\n"
    )
    path = folder / f"winch-{node_id}-{drive}.toml"
    path.write_text(text)
    return path


def bus_name() -> str:
    return f"simbus:profiles-{os.getpid()}-{uuid.uuid4().hex[:6]}"


class Motion:
    """Run cycles on a session's device without its loop, and read the true motion."""

    def __init__(self, session: Session, truth_log: Path) -> None:
        self.session = session
        self._log = truth_log

    def push(self, torque_Nm: float, cycles: int) -> NDArray[np.void]:
        """Command a torque for some cycles, then zero. Return the true motion meanwhile.

        The torque first acts at the SYNC of the second record.
        """
        device = self.session.device
        first = device.feedback.cycle + 1
        for torque in (torque_Nm,) * cycles + (0.0,) * 2:
            device.sync()
            device.receive()
            device.command.torque_Nm[:] = torque
            device.transmit()
        return self.truth(first, device.feedback.cycle)

    def give_back(self) -> None:
        """Let the loop continue from the present state of the drives."""
        self.session.loop.engine.parts.estimator.reset()
        self.session.loop.engine.parts.supervisor.reset()

    def truth(self, first: int, last: int) -> NDArray[np.void]:
        """Return the true motion at the SYNCs of cycles `first` to `last`."""
        device = self.session.device
        powered = device.command.torque_Nm.copy()
        device.command.torque_Nm[:] = 0.0
        for _ in range(_FLUSHED_CYCLES):  # wait until the simulator has written its buffer
            device.sync()
            device.receive()
            device.transmit()
        device.command.torque_Nm[:] = powered
        self.give_back()
        start = first + self.session.machine.sync_offset - 1
        logged: NDArray[Any] = np.fromfile(self._log, _TRUTH, offset=_HEADER_BYTES)
        records = logged[logged["sync"] != NO_SYNC][start : start + last - first + 1]
        assert records["sync"][0] == start
        assert records.size == last - first + 1
        return records


class MixedSimulator:
    """Several winches with different drive types on one simulated bus in one process."""

    def __init__(self, winches: Sequence[Path]) -> None:
        self.bus = bus_name()
        self.winches: list[Winch] = [load_winch(path) for path in winches]
        command = [sys.executable, __file__, self.bus, *map(str, winches)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._process.stdout is not None
        assert b"ready" in self._process.stdout.readline()

    def stop(self) -> None:
        self._process.communicate(b"", timeout=120)


def _serve(bus: str, winches: Sequence[str]) -> None:
    serve([SimDrive.for_winch(load_winch(w), Plant()) for w in winches], bus, until_stdin_ends=True)


if __name__ == "__main__":
    _serve(sys.argv[1], sys.argv[2:])
