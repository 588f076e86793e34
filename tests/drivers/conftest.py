"""Simulated drives for tests of the master."""

from __future__ import annotations

import os
import subprocess
import sys
import uuid
from collections.abc import Iterator

import pytest

from tests.drivers.axis_rig import Rig, open_network, open_rig


@pytest.fixture(scope="module")
def simulated_bus() -> Iterator[str]:
    """Yield a bus with drives 1 and 2 that waits only briefly for the master after a SYNC."""
    bus = f"simbus:axes-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    command = [sys.executable, "-m", "cdpr_tools.cli", "sim", "up", "winch-mpp0923d", "--bus", bus]
    command += ["--nodes", "2", "--exit-with-stdin"]
    simulator = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert simulator.stdout is not None
    assert b"ready" in simulator.stdout.readline()
    try:
        yield bus
    finally:
        simulator.communicate(timeout=120)


@pytest.fixture(autouse=True)
def brief_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait less than for real drives: simulated ones are present immediately."""
    monkeypatch.setattr("cdpr_drivers.canopen.boot._BOOT_UP_TIMEOUT_S", 0.4)
    monkeypatch.setattr("cdpr_drivers.canopen.boot._LISTEN_SHARE", 0.1)
    monkeypatch.setattr("cdpr_drivers.canopen.boot._LISTEN_LEAST_S", 0.05)
    monkeypatch.setattr("cdpr_drivers.canopen.network._LOOK_S", 0.02)
    monkeypatch.setattr("cdpr_drivers.axes.axis_group._POWER_OFF_TIMEOUT_S", 0.4)


@pytest.fixture
def bus(simulated_bus: str) -> str:
    """Return a bus with drives 1 and 2, freshly switched on."""
    with open_network(simulated_bus, [1, 2]) as mains:
        for node in (1, 2):
            mains.reset(node)
            assert mains.read_int(node, 0x1001) == 0  # the drive is back
    return simulated_bus


@pytest.fixture
def rig(bus: str) -> Iterator[Rig]:
    """Yield a rig with drive 1 on `bus`, booted."""
    with open_rig(bus) as opened:
        yield opened
