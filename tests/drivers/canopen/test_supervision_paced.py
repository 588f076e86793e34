"""Missing and late answers on a paced bus are tolerated, flagged and not mistaken."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator

import pytest

from cdpr_drivers.errors import BusError
from tests.drivers.axis_rig import DRIVE, Rig, open_network
from tests.drivers.bus_log import logged
from tests.fault_texts import alarm

pytestmark = pytest.mark.alone

PERIOD_S = 20e-3
"""Slow enough for two processes on a busy machine."""
DROP, DELAY = 2, 8


@pytest.fixture(scope="module")
def simulator() -> Iterator[tuple[str, int]]:
    bus = f"simbus:pacing-{uuid.uuid4().hex[:6]}"
    command = [sys.executable, "-m", "cdpr_tools.cli", "sim", "up", "winch-mpp0923d", "--bus", bus]
    command += ["--paced", "--nodes", "2", "--exit-with-stdin"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert "ready" in json.loads(process.stdout.readline())
    try:
        yield bus, process.pid
    finally:
        process.communicate()


@pytest.fixture
def rig(simulator: tuple[str, int]) -> Iterator[Rig]:
    bus, _ = simulator
    with open_network(bus, [1, 2]) as network:
        for node in (1, 2):
            network.reset(node)
            assert network.read_int(node, 0x1001) == 0
        rig = Rig(bus, network, DRIVE, [1, 2], period_s=PERIOD_S)
        with rig.group:
            yield rig


class _Cycles:
    """Run cycles at their deadlines and record the validity of node 2 in each."""

    def __init__(self, rig: Rig) -> None:
        self._group = rig.group
        self.valid: list[bool] = []
        self.rate_ok: list[bool] = []

    def run(self, count: int) -> None:
        feedback = self._group.feedback
        deadline = time.monotonic()
        for _ in range(count):
            deadline += PERIOD_S
            time.sleep(max(0.0, deadline - time.monotonic()))
            self._group.sync()
            self._group.receive()
            self.valid.append(bool(feedback.valid[1]))
            self._group.transmit()
            self.rate_ok.append(bool(feedback.rate_ok[1]))


def test_a_single_missing_answer_is_flagged_but_raises_no_alarm(rig: Rig) -> None:
    cycles = _Cycles(rig)
    cycles.run(10)
    rig.misbehave(DROP, 1, node=2)
    cycles.run(10)
    assert alarm(rig.group) == ""
    missing = cycles.valid.index(False, 10)
    assert not cycles.rate_ok[missing]
    assert rig.group.missed >= 1


def test_an_answer_a_cycle_late_is_flagged_and_raises_no_alarm(rig: Rig) -> None:
    cycles = _Cycles(rig)
    cycles.run(10)
    rig.misbehave(DELAY, 1, node=2)
    with logged(rig.bus) as log:
        cycles.run(30)
    assert alarm(rig.group) == ""
    assert False in cycles.valid[10:]
    # it arrived together with the answer of the next cycle, which was decoded last
    assert rig.group.repeated >= 1
    answers = [f.cycle for f in log.of(0x182)]
    assert len(answers) > len(set(answers))
    assert False in cycles.rate_ok[10:]


def test_a_delayed_simulator_misses_no_heartbeat(rig: Rig, simulator: tuple[str, int]) -> None:
    """The process is stopped for three times as long as a drive tolerates silence."""
    consumer_s = 0.25
    rig.network.write(2, 0x1016, 1, 127 << 16 | round(consumer_s * 1e3))
    cycles = _Cycles(rig)
    cycles.run(5)
    with logged(rig.bus) as log:
        os.kill(simulator[1], signal.SIGSTOP)
        try:
            cycles.run(round(3 * consumer_s / PERIOD_S))
        finally:
            os.kill(simulator[1], signal.SIGCONT)
        cycles.run(10)
    answered = len(log.of(0x182))
    assert log.of(0x082) == []
    assert answered >= 20  # including answers to the SYNCs that waited
    assert rig.network.read_int(2, 0x1001) == 0


def test_a_full_transmit_queue_raises_a_bus_error_without_blocking(
    rig: Rig, simulator: tuple[str, int]
) -> None:
    """The queue fills because the simulator's process is stopped."""
    cycles = _Cycles(rig)
    cycles.run(5)
    os.kill(simulator[1], signal.SIGSTOP)
    try:
        begin = time.monotonic()
        with pytest.raises(BusError, match="accepts or delivers no frames") as caught:
            for _ in range(100_000):
                rig.group.transmit()
        assert time.monotonic() - begin < 5.0
        assert rig.bus in str(caught.value)
    finally:
        os.kill(simulator[1], signal.SIGCONT)
        time.sleep(0.5)  # thousands of frames precede those that switch off
