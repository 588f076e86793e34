"""Gateways to the simulated bus: processes of their own, each a client of the hub."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from contextlib import suppress
from typing import Any

from cdpr_sim_bus.bus.client import bus_address
from cdpr_sim_bus.bus.control import encode
from cdpr_sim_bus.errors import BusSetupError

_STOP_TIMEOUT_S = 5.0
_PRIORITY = 40


def join(name: str) -> socket.socket:
    """Return a socket connected to the bus `name`, without frames yet.

    Raises:
        BusSetupError: no such bus runs.
    """
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        sock.connect(bus_address(name))
        sock.send(encode({"filters": []}))
    except OSError as error:
        sock.close()
        raise BusSetupError(f"simbus:{name}: cannot be joined: {error.strerror}") from None
    sock.setblocking(False)
    return sock


def receive_all(sock: socket.socket, *, listen: bool) -> None:
    """Set the filters to all frames, or to none."""
    sock.send(encode({"filters": [[0, 0]] if listen else []}))


def raise_priority() -> None:
    """Run at real-time priority, as an adapter's own processor would, where that is allowed."""
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))


def report(message: dict[str, Any]) -> None:
    """Print one line of JSON for the simulator that started this gateway."""
    print(json.dumps(message), flush=True)


class Gateway:
    """A gateway process, which ends with the simulator; a kill unplugs it."""

    def __init__(self, module: str, *arguments: str) -> None:
        """Start `module` and wait until it is up.

        Raises:
            BusSetupError: it could not start; holds its reason.
        """
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # a Ctrl-C at the terminal is the simulator's to handle
        )
        assert self._process.stdout is not None  # opened with PIPE
        line = self._process.stdout.readline()
        self.report: dict[str, Any] = json.loads(line) if line else {"error": f"{module} ended"}
        """What it reported at its start."""
        if "error" in self.report:
            self.close()
            raise BusSetupError(self.report["error"])

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def close(self) -> None:
        """End it."""
        assert self._process.stdin is not None  # opened with PIPE
        assert self._process.stdout is not None
        self._process.stdin.close()
        try:
            self._process.wait(_STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()
