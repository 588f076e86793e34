"""The simulator as a process of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from fork_server import FORKED

SIMULATOR = """
import math, pathlib, sys
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.errors import SimulatorError
from cdpr_sim_bus.bus.server import serve

class Node:
    node_id = 1
    sync_period_s = 0.0
    accepts = None
    def __init__(self): self.outbox = []
    def receive(self, frame, now): pass
    def advance(self, now): pass
    def next_event(self): return math.inf
    def close(self): pathlib.Path(sys.argv[2]).write_text("closed")

try:
    serve([Node()], sys.argv[1], mode=ClockMode.PACED, until_stdin_ends=True)
except SimulatorError as error:
    sys.exit(str(error))
"""


class Simulator:
    def __init__(self, bus: str, trace: Path, stdin: int = subprocess.PIPE) -> None:
        self.trace = trace
        self.process = subprocess.Popen(
            [*FORKED, SIMULATOR, bus, str(trace)],
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def ready(self) -> dict[str, object]:
        assert self.process.stdout is not None
        line = json.loads(self.process.stdout.readline())
        assert list(line) == ["ready"]
        return dict(line["ready"])

    def ended(self) -> tuple[int, str]:
        _, errors = self.process.communicate(timeout=120)
        return self.process.returncode, errors


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[Simulator]:
    simulator = Simulator(f"simbus:server-{os.getpid()}", tmp_path / "trace")
    yield simulator
    simulator.process.kill()
    simulator.process.wait()


def test_it_says_when_it_is_ready(simulator: Simulator) -> None:
    ready = simulator.ready()
    assert ready["bus"] == f"simbus:server-{os.getpid()}"
    assert ready["pid"] == simulator.process.pid
    assert (ready["mode"], ready["nodes"]) == ("paced", [1])


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_in_order(simulator: Simulator, number: signal.Signals) -> None:
    simulator.ready()
    simulator.process.send_signal(number)
    assert simulator.ended() == (0, "")
    assert simulator.trace.read_text() == "closed"


def test_it_ends_with_the_command_that_started_it(simulator: Simulator) -> None:
    simulator.ready()
    assert simulator.process.stdin is not None
    simulator.process.stdin.close()
    assert simulator.process.wait(120) == 0
    assert simulator.trace.read_text() == "closed"


def test_a_name_in_use_ends_it_with_one_message(simulator: Simulator, tmp_path: Path) -> None:
    simulator.ready()
    second = Simulator(f"simbus:server-{os.getpid()}", tmp_path / "second")
    status, message = second.ended()
    assert status == 1
    assert "is in use by another simulator" in message
    assert "Traceback" not in message


@pytest.mark.parametrize(
    ("bus", "message"),
    [("slcan:/dev/ttyACM0", "run on simbus:NAME or socketcan:IFACE"), ("simbus:", "allowed are")],
)
def test_a_bus_it_cannot_serve_is_refused(bus: str, message: str, tmp_path: Path) -> None:
    status, errors = Simulator(bus, tmp_path / "trace").ended()
    assert status == 1
    assert message in errors
    assert "Traceback" not in errors


def test_a_real_interface_that_is_not_there_is_named(tmp_path: Path) -> None:
    status, errors = Simulator("socketcan:nocan9", tmp_path / "trace").ended()
    assert status == 1
    assert "socketcan:nocan9" in errors
    assert "Traceback" not in errors
