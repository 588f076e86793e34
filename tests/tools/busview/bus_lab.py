"""Simulated drives on separate buses, and commands."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import can

WINCH = "winch-mpp0923d"
Result = subprocess.CompletedProcess[str]
Process = subprocess.Popen[str]
MARK = can.Message(arbitration_id=0x7FE, is_extended_id=False)
PROBE = can.Message(arbitration_id=0x7FF, data=[1], is_extended_id=False)


def command(*arguments: str | Path) -> list[str]:
    return [sys.executable, "-m", "cdpr_tools.cli", *map(str, arguments)]


def begin(*arguments: str | Path) -> Process:
    return subprocess.Popen(
        command(*arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def last_json(text: str) -> dict[str, Any]:
    return dict(json.loads(text.splitlines()[-1]))


class Lab:
    """Simulated drives on a separate bus."""

    def __init__(self, name: str, *options: str) -> None:
        self.name = f"{name}-{os.getpid()}"
        self.bus = f"simbus:{self.name}"
        arguments = ["sim", "up", WINCH, "--bus", self.bus, "--exit-with-stdin", *options]
        self.process = subprocess.Popen(
            command(*arguments), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ready(self) -> None:
        assert self.process.stdout is not None
        assert self.bus in self.process.stdout.readline()

    def join(self) -> can.BusABC:
        return can.Bus(self.name, "simbus")

    def passed(self, ear: can.BusABC) -> list[can.Message]:
        """Return the frames that a client received since the last call."""
        with self.join() as other:
            other.send(MARK)
        messages = []
        while (message := ear.recv(60.0)) is not None and message.arbitration_id != 0x7FE:
            messages.append(message)
        assert message is not None
        return messages

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.communicate("", timeout=120)
