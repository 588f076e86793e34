"""Simulated drives for the tests of the master side."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from axis_rig import Rig, open_network, open_rig, start_simulator


@pytest.fixture(scope="module")
def bus() -> Iterator[str]:
    """A bus with the drives 1 and 2, which each test must leave or find in a state of its own."""
    simulator = start_simulator(nodes=2)
    try:
        yield simulator.bus
    finally:
        simulator.stop()


@pytest.fixture
def rig(bus: str) -> Iterator[Rig]:
    """Drive 1 on `bus`, freshly switched on."""
    with open_network(bus, [1, 2]) as network:
        for node in (1, 2):
            network.reset(node)
            assert network.wait_for_heartbeat(node, 0.0) is None
    with open_rig(bus) as opened:
        yield opened
