"""Complete sessions with a simulated drive over a serial adapter and over socketcand."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from typing import Any

import can
import canopen
import pytest

from cdpr_profiles import load_winch

pytestmark = pytest.mark.alone

WINCH = "winch-mpp0923d"
EDS = load_winch(WINCH).drive.eds
OFF, ENABLED, FAULT = 0x40, 0x27, 0x08
CDPR = (sys.executable, "-m", "cdpr_tools.cli")


class Lab:
    """A simulated drive that is reachable in three ways, and a third-party master on its bus."""

    def __init__(self) -> None:
        self.name = name = f"adapters-{os.getpid()}-{uuid.uuid4().hex[:6]}"
        options = ("--bus", f"simbus:{name}", "--slcan", "--socketcand", "0", "--exit-with-stdin")
        self.process = subprocess.Popen(
            [*CDPR, "sim", "up", WINCH, *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert self.process.stdout is not None
        self.ready: dict[str, Any] = json.loads(self.process.stdout.readline())["ready"]
        self._network = canopen.Network()
        self._network.NOTIFIER_CYCLE = 0.05
        self._network.connect(interface="simbus", channel=name)
        self.node = self._network.add_node(1, str(EDS))
        self.node.sdo.RESPONSE_TIMEOUT = 60.0

    def bus(self, gateway: str) -> str:
        """Return the URL of a gateway, for a simulation whose time waits for SYNC."""
        if gateway == "slcan":
            return f"slcan:{self.ready['slcan']}?bitrate=1000000&lockstep=true"
        return f"{self.ready['socketcand']}?lockstep=true"

    def state(self) -> int:
        return int(self.node.sdo[0x6041].raw) & 0x6F

    def close(self) -> None:
        self._network.disconnect()
        self.process.communicate(timeout=120)


@pytest.fixture(scope="module")
def lab() -> Iterator[Lab]:
    lab = Lab()
    yield lab
    lab.close()


def cdpr(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*CDPR, *words, "--json"], capture_output=True, text=True, timeout=60, check=False
    )


@pytest.mark.parametrize("gateway", ["slcan", "socketcand"])
def test_a_complete_session_succeeds_over_each_gateway(lab: Lab, gateway: str) -> None:
    """Boot, mode, power, cycles in closed loop, power off."""
    words = ("drive", "jog", WINCH, "--bus", lab.bus(gateway), "--seconds", "0.4")
    result = cdpr(*words, "--speed-deg-s", "75", "--yes")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout.splitlines()[-1])["moved_deg"] > 10.0
    assert lab.state() == OFF


def test_motion_over_an_adapter_needs_a_confirmation(lab: Lab) -> None:
    result = cdpr("drive", "jog", WINCH, "--bus", lab.bus("slcan"))
    assert result.returncode == 2
    assert "--yes" in result.stderr


@pytest.mark.parametrize("gateway", ["slcan", "socketcand"])
def test_unplugging_the_adapter_in_motion_is_reported_and_the_drive_stops(gateway: str) -> None:
    """The command prints one message and exits with status 1. The drive cuts its power."""
    lab = Lab()
    words = ("drive", "jog", WINCH, "--bus", lab.bus(gateway), "--seconds", "300", "--yes")
    command = subprocess.Popen(
        [*CDPR, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    # read from PDOs: a second SDO client would disturb the command that boots the drive
    filters = [{"can_id": 0x181, "can_mask": 0x7FF}]
    with can.Bus(lab.name, interface="simbus", can_filters=filters) as bus:
        enabled, deadline = 0, time.monotonic() + 120.0
        while enabled < 30:
            assert time.monotonic() < deadline
            assert command.poll() is None
            message = bus.recv(0.1)
            enabled += message is not None and message.data[0] & 0x6F == ENABLED
    os.kill(lab.ready[f"{gateway}_pid"], signal.SIGKILL)
    pulled_at = time.monotonic()
    _, errors = command.communicate(timeout=120)
    assert command.returncode == 1
    assert time.monotonic() - pulled_at < 60.0
    last = errors.strip().splitlines()[-1]
    assert last.startswith("cdpr: ")
    assert "the bus is lost" in last
    assert "Traceback" not in errors
    # after half a second, bus time runs again and the drive misses the heartbeat
    while lab.state() == ENABLED:
        assert time.monotonic() - pulled_at < 60.0
        time.sleep(0.02)
    assert lab.state() in (OFF, FAULT)
    lab.close()
