"""A simulated bus in a separate process, with one node that answers SYNC and SDO-like frames."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator

import pytest
from fork_server import FORKED

SIMULATOR = """
import math, sys
from cdpr_sim_bus.frame import pack_frame
from cdpr_sim_bus.bus.server import serve

class Node:
    node_id = 1
    sync_period_s = 0.001
    accepts = frozenset((0x80, 0x201))
    def __init__(self): self.outbox, self.data = [], bytes(4)
    def receive(self, frame, now):
        if frame[:2] == b"\\x80\\x00":
            self.outbox += [pack_frame(0x281, b"other"), pack_frame(0x181, self.data)]
        else:
            self.data = frame[8:12]
    def advance(self, now): pass
    def next_event(self): return math.inf
    def close(self): pass

serve([Node()], "simbus:" + sys.argv[1], truth_log="truth.bin", until_stdin_ends=True)
"""


class SimulatorProcess:
    """A running simulator and the name of its bus."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.process = subprocess.Popen(
            [*FORKED, SIMULATOR, name], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert self.process.stdout is not None
        assert b"ready" in self.process.stdout.readline()

    def kill(self) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def simulator() -> Iterator[SimulatorProcess]:
    simulator = SimulatorProcess(f"drivers-{os.getpid()}")
    yield simulator
    simulator.kill()
