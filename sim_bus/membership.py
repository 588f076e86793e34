"""What a gateway to the simulated bus needs: a member's socket, and its life beside the hub."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from contextlib import suppress
from typing import Any

from sim_bus.client import bus_address
from sim_bus.control import encode
from sim_bus.errors import BusSetupError

_STOP_TIMEOUT_S = 5.0
_PRIORITY = 40


def join(name: str) -> socket.socket:
    """Return a socket that is a member of the bus `name` and takes no frames yet.

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


def listen_to_all(sock: socket.socket, *, listen: bool) -> None:
    """Ask the hub for every frame, or for none."""
    sock.send(encode({"filters": [[0, 0]] if listen else []}))


def go_first() -> None:
    """Go before ordinary processes, as an adapter's own processor does, where that is allowed."""
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))


def tell(message: dict[str, Any]) -> None:
    """Tell the simulator that started this gateway how it got on, as one line."""
    print(json.dumps(message), flush=True)


class Gateway:
    """A gateway in a process of its own, which ends with the simulator, or pulled out by a kill."""

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
        self.told: dict[str, Any] = json.loads(line) if line else {"error": f"{module} ended"}
        """What it told when it was up."""
        if "error" in self.told:
            self.close()
            raise BusSetupError(self.told["error"])

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
