"""Simulated drives for the tests of the master side."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from axis_rig import Rig, open_network, open_rig, start_simulator

from drivers.network import CanNetwork


@pytest.fixture(scope="module")
def simulated_bus() -> Iterator[str]:
    """A bus with the drives 1 and 2."""
    simulator = start_simulator(nodes=2)
    try:
        yield simulator.bus
    finally:
        simulator.stop()


@pytest.fixture(autouse=True)
def brief_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulated drives are there at once: do not wait as long as for real ones."""
    monkeypatch.setattr("drivers.boot._BOOT_UP_TIMEOUT_S", 0.4)
    monkeypatch.setattr("drivers.boot._LISTEN_SHARE", 0.1)
    monkeypatch.setattr("drivers.network._LOOK_S", 0.02)


@pytest.fixture(scope="module")
def mains(simulated_bus: str) -> Iterator[CanNetwork]:
    """What switches the drives of `bus` off and on."""
    with open_network(simulated_bus, [1, 2]) as network:
        yield network


@pytest.fixture
def bus(simulated_bus: str, mains: CanNetwork) -> str:
    """A bus with the drives 1 and 2, freshly switched on."""
    for node in (1, 2):
        mains.reset(node)
        assert mains.read_int(node, 0x1001) == 0  # it is there again
    return simulated_bus


@pytest.fixture
def rig(bus: str) -> Iterator[Rig]:
    """Drive 1 on `bus`, booted."""
    with open_rig(bus) as opened:
        yield opened
