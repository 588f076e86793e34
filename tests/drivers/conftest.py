"""Simulated drives for the tests of the master side."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from axis_rig import Rig, open_network, open_rig, start_simulator


@pytest.fixture(scope="module")
def simulated_bus() -> Iterator[str]:
    """A bus with the drives 1 and 2."""
    simulator = start_simulator(nodes=2)
    try:
        yield simulator.bus
    finally:
        simulator.stop()


@pytest.fixture
def bus(simulated_bus: str) -> str:
    """A bus with the drives 1 and 2, freshly switched on."""
    with open_network(simulated_bus, [1, 2]) as network:
        for node in (1, 2):
            network.reset(node)
            assert network.read_int(node, 0x1001) == 0  # it is there again
    return simulated_bus


@pytest.fixture
def rig(bus: str) -> Iterator[Rig]:
    """Drive 1 on `bus`, booted."""
    with open_rig(bus) as opened:
        yield opened
