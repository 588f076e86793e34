"""A group of axes on a paced bus, where time does not wait for the master."""

from __future__ import annotations

import json
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator

import pytest

from cdpr_drivers.bus.adapters import AdapterPort
from cdpr_drivers.canopen import network
from cdpr_drivers.cia402 import Mode, State, state_of
from tests.drivers.axis_rig import DRIVE, Rig, open_network
from tests.fault_texts import alarm

pytestmark = pytest.mark.alone

PERIOD_S = 10e-3
"""Slow enough for two processes on a busy machine."""


@pytest.fixture(scope="module")
def paced_bus() -> Iterator[str]:
    bus = f"simbus:paced-{uuid.uuid4().hex[:6]}"
    command = [sys.executable, "-m", "cdpr_tools.cli", "sim", "up", "winch-mpp0923d", "--bus", bus]
    command += ["--paced", "--nodes", "2", "--exit-with-stdin"]
    simulator = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert simulator.stdout is not None
    assert "ready" in json.loads(simulator.stdout.readline())
    try:
        yield bus
    finally:
        simulator.communicate()


@pytest.fixture(params=["packed", "python-can"])
def rig(
    paced_bus: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Rig]:
    if request.param == "python-can":
        monkeypatch.setattr(network, "open_port", AdapterPort)
    with open_network(paced_bus, [1, 2]) as opened:
        for node in (1, 2):
            opened.reset(node)
            assert opened.read_int(node, 0x1001) == 0
        rig = Rig(paced_bus, opened, DRIVE, [1, 2], period_s=PERIOD_S)
        with rig.group:
            yield rig


def _cycles(rig: Rig, count: int, patience_s: float = 1.0) -> list[str]:
    """Run cycles one period apart and return the alarm after each.

    An answer may take `patience_s`, so that a busy machine does not look like a lost drive.
    """
    alarms = []
    deadline = time.monotonic()
    for _ in range(count):
        deadline = max(deadline + PERIOD_S, time.monotonic())  # late cycles are not caught up
        time.sleep(max(0.0, deadline - time.monotonic()))
        rig.group.sync()
        rig.group.receive(time.monotonic() + patience_s)
        rig.group.transmit()
        alarms.append(alarm(rig.group))
    return alarms


def _enable(rig: Rig) -> None:
    rig.group.ask_mode(Mode.CYCLIC_TORQUE)
    _cycles(rig, 40)
    rig.group.request(State.OPERATION_ENABLED)
    _cycles(rig, 20)
    assert rig.group.reached(State.OPERATION_ENABLED)


def test_axes_are_exchanged_in_real_time(rig: Rig) -> None:
    assert not rig.group.lockstep
    _enable(rig)
    before, missed = rig.group.feedback.position_rad.copy(), rig.group.missed
    rig.group.command.torque_Nm[:] = [0.3, -0.3]
    assert set(_cycles(rig, 60)) == {""}
    assert (rig.group.feedback.position_rad - before)[0] > 0.1
    assert (rig.group.feedback.position_rad - before)[1] < -0.1
    assert rig.group.missed == missed


def test_the_wait_for_an_answer_ends_within_the_period(rig: Rig) -> None:
    _cycles(rig, 20)
    rig.misbehave(2, 250, node=2)
    waits = []
    for _ in range(20):
        rig.group.sync()
        begin = time.monotonic()
        rig.group.receive()
        waits.append(time.monotonic() - begin)
        rig.group.transmit()
        time.sleep(1e-3)
    assert 0.59 * PERIOD_S < sorted(waits)[len(waits) // 2] < PERIOD_S
    assert not rig.group.feedback.valid[1]
    rig.misbehave(2, 0, node=2)


def test_two_lost_answers_are_tolerated_and_the_third_raises_an_alarm(rig: Rig) -> None:
    _enable(rig)
    rig.misbehave(2, 2, node=2)
    assert "no answer" not in "".join(_cycles(rig, 20, 0.1))
    rig.misbehave(2, 200, node=2)
    alarms = [text for text in _cycles(rig, 5, 0.02) if text]
    assert alarms
    assert "(node 2) has not answered SYNC for 3 cycles" in alarms[0]
    rig.misbehave(2, 0, node=2)


def test_late_answers_are_discarded_at_the_next_sync(rig: Rig) -> None:
    _cycles(rig, 20)
    group = rig.group
    group.sync()
    group._late = True  # as after a cycle that ended before its answers arrived
    time.sleep(2 * PERIOD_S)
    group.sync()
    assert not group.feedback.valid.any()
    assert group.receive() == 2
    group.transmit()


def test_close_switches_off(paced_bus: str, rig: Rig) -> None:
    _enable(rig)
    assert rig.group.close() == ""
    with open_network(paced_bus, [1, 2]) as network:
        for node in (1, 2):
            assert state_of(network.read_int(node, 0x6041)) == State.SWITCH_ON_DISABLED
