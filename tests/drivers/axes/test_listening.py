"""Listening to axes of another master. A script plays the master and the drives."""

from __future__ import annotations

import math
import os
import random
import select
import socket
import struct
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial

import numpy as np
import pytest

from cdpr_drivers.axes.listening import ListeningDevice, MonitoredBus, monitored_axis
from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.simbus import connect, exchange
from cdpr_drivers.cia402 import State
from cdpr_drivers.errors import BusError
from cdpr_profiles import load_winch
from cdpr_rt.core.clock import PacedClock, Readable
from cdpr_sim_bus.bus.hub import Hub
from tests.drivers.bus_log import BusLog, logged
from tests.fault_texts import alarm

WINCH = load_winch("winch-mpp0923d")
COUNTS = WINCH.encoder_counts_per_turn
PERIOD_S = 0.02
ENABLED, FAULT = 0x0237, 0x0218
FRAME = struct.Struct("=IB3x8s")


class Stage:
    """A bus on which `says` sends frames as master or as drive."""

    def __init__(self, name: str) -> None:
        self.bus = f"simbus:{name}"
        self.hub = Hub([], name=name)
        self.hub.listen()
        self.thread = threading.Thread(target=self.hub.run)
        self.thread.start()
        self.sock: socket.socket = connect(name)

    def says(self, identifier: int, data: bytes = b"") -> None:
        self.sock.send(FRAME.pack(identifier, len(data), data.ljust(8, b"\0")))

    def answers(self, node: int, counts: int, word: int = ENABLED, torque: int = 0) -> None:
        self.says(0x180 + node, struct.pack("<Hih", word, counts, torque))

    def cycle(self, counts: int) -> None:
        """Send SYNC and the answer of node 1."""
        self.says(0x080)
        self.answers(1, counts)
        self.settle()

    def settle(self) -> None:
        """Wait until the hub has processed all sent frames."""
        exchange(self.sock, None)

    def end(self) -> None:
        self.hub.stop()
        self.thread.join()
        self.hub.close()

    def close(self) -> None:
        self.sock.close()
        if self.thread.is_alive():
            self.end()


class ScriptedClock(PacedClock):
    """A clock that advances only in waits and runs scripted actions at their instants."""

    def __init__(self) -> None:
        super().__init__()
        self.script: deque[tuple[float, Callable[[], None]]] = deque()
        self._now_s = 0.0

    def at(self, time_s: float, act: Callable[[], None]) -> None:
        """Schedule `act` at an instant that is no earlier than those scheduled before."""
        self.script.append((time_s, act))

    @property
    def now_s(self) -> float:
        return self._now_s

    def await_readable(self, source: Readable, until_s: float) -> None:
        while not select.select([source], [], [], 0.0)[0]:
            if not self.script or self.script[0][0] > until_s:
                self._now_s = until_s
                return
            self._now_s, act = self.script.popleft()
            act()


def device(
    stages: Sequence[Stage], nodes: Sequence[Sequence[int]], clock: PacedClock | None = None
) -> ListeningDevice:
    """Return a device whose axes alternate between buses."""
    axis_numbers: list[list[int]] = [[] for _ in stages]
    order = sorted((k, b) for b, each in enumerate(nodes) for k in range(len(each)))
    for place, (_, bus) in enumerate(order):
        axis_numbers[bus].append(place)
    buses = [
        MonitoredBus(
            f"b{i}", BusUrl.parse(stage.bus), [monitored_axis(WINCH, n) for n in each], where
        )
        for i, (stage, each, where) in enumerate(zip(stages, nodes, axis_numbers, strict=True))
    ]
    return ListeningDevice(buses, PERIOD_S, clock or PacedClock())


@contextmanager
def open_stages(count: int) -> Iterator[list[Stage]]:
    with ExitStack() as stack:
        stages = []
        for i in range(count):
            stages.append(Stage(f"listen-{os.getpid()}-{random.randrange(1 << 30)}-{i}"))
            stack.callback(stages[-1].close)
        yield stages


@pytest.fixture
def stage() -> Iterator[Stage]:
    with open_stages(1) as (one,):
        yield one


@pytest.fixture
def two() -> Iterator[list[Stage]]:
    with open_stages(2) as both:
        yield both


def cycle(device: ListeningDevice) -> int:
    device.sync()
    answered = device.receive()
    device.command.torque_Nm[:] = 1.0
    device.transmit()
    return answered


def test_feedback_states_and_faults_follow_the_drives_answers(stage: Stage) -> None:
    with device([stage], [[1, 2]]) as ears:
        for k in range(1, 4):
            stage.says(0x080)
            stage.answers(1, COUNTS * k, torque=-500)
            stage.answers(2, -COUNTS // 4, FAULT)
            stage.settle()
            assert cycle(ears) == 2
        feedback = ears.feedback
        assert feedback.cycle == 3
        assert feedback.time_s == pytest.approx(3 * PERIOD_S)
        np.testing.assert_allclose(feedback.position_rad, [3 * math.tau, -math.tau / 4], atol=1e-3)
        half = 0.5 * WINCH.motor.rated_torque_Nm
        np.testing.assert_allclose(feedback.torque_Nm, [-half, 0.0])
        assert feedback.statusword.tolist() == [ENABLED, FAULT]
        assert feedback.valid.all() and feedback.alive.all() and feedback.rate_ok.all()
        assert ears.states() == [State.OPERATION_ENABLED, State.FAULT]
        assert ears.faulted().tolist() == [False, True]
        assert "node 2) is in fault" in alarm(ears)
        ears.forget_alarms()
        assert (alarm(ears), ears.faulted().tolist()) == ("", [False, False])
        assert ears.command.sent_torque_Nm.tolist() == [0.0, 0.0]


def frames_not_from_the_script(log: BusLog, said: int) -> int:
    """Return how many frames on the bus the script did not send."""
    return len(log.frames) - said


def test_a_listener_sends_no_frame(two: list[Stage]) -> None:
    with logged(two[0].bus) as first, logged(two[1].bus) as second:
        with device(two, [[1], [1]]) as ears:
            assert cycle(ears) == 0  # without a master
            for k in range(50):
                for bus in two:
                    bus.says(0x080)
                    bus.answers(1, k)
                    bus.settle()
                assert cycle(ears) == 2
            two[0].says(0x081, bytes([0x10, 0x82, 0x11, 0, 0, 0, 0, 0]))
            two[0].says(0x701, b"\0")
            two[1].says(0x080)
            for _ in range(3):
                cycle(ears)
            ears.forget_alarms()
        for bus in two:
            bus.settle()
    assert (frames_not_from_the_script(first, 102), frames_not_from_the_script(second, 101)) == (
        0,
        0,
    )


def test_a_cycle_without_master_ends_and_shows_the_silence(stage: Stage) -> None:
    with device([stage], [[1]]) as ears:
        assert ears.silent_s == math.inf
        begin = time.monotonic()
        for _ in range(3):
            assert cycle(ears) == 0
        assert time.monotonic() - begin > 0.1
        assert ears.feedback.cycle == 0
        assert (alarm(ears), ears.missed, ears.silent_s > 0.5) == ("", 0, True)
        assert not ears.feedback.valid[0]
        begin = time.monotonic()
        stage.says(0x080)
        stage.answers(1, 5)
        stage.settle()
        assert cycle(ears) == 1
        assert ears.silent_s <= time.monotonic() - begin
        assert cycle(ears) == 0
        assert not ears.feedback.valid[0]


def test_a_silent_drive_raises_an_alarm_until_the_master_starts_again(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cdpr_drivers.axes.listening._LOCKSTEP_ANSWER_S", 0.01)
    with device([stage], [[1, 2]]) as ears:
        for _ in range(3):
            assert alarm(ears) == ""
            stage.says(0x080)
            stage.answers(2, 0)
            stage.settle()
            assert cycle(ears) == 1
        assert "node 1) has not answered SYNC for 3 cycles" in alarm(ears)
        assert ears.missed == 3
        assert ears.feedback.valid.tolist() == [False, True]
        time.sleep(0.6)
        stage.says(0x080)
        stage.answers(1, 0)
        stage.answers(2, 0)
        stage.settle()
        assert cycle(ears) == 2
        assert alarm(ears) == ""


def test_actions_of_the_other_master_raise_no_alarm(stage: Stage) -> None:
    with device([stage], [[1]]) as ears:
        for word, mode in ((ENABLED, 10), (0x0240, 6), (ENABLED, 6), (0x0231, 8), (ENABLED, 8)):
            stage.says(0x080)
            stage.answers(1, 0, word)
            stage.says(0x281, struct.pack("<bHi", mode, 0, 0))
            stage.settle()
            assert cycle(ears) == 1
            assert alarm(ears) == ""


def test_an_index_latched_by_the_master_is_known_to_the_listener(stage: Stage) -> None:
    with device([stage], [[1]]) as ears:
        for status in (1, 3, 3):
            stage.says(0x080)
            stage.answers(1, 4000)
            stage.says(0x281, struct.pack("<bHi", 10, status, 1000))
            stage.settle()
            cycle(ears)
            cycle(ears)
        assert ears.feedback.index_known[0]
        assert ears.feedback.index_rad[0] == pytest.approx(1000 / COUNTS * math.tau)
        stage.says(0x701, b"\0")  # the drive restarts, so that its origin changes
        stage.settle()
        cycle(ears)
        assert not ears.feedback.index_known[0]


def test_a_backlog_of_frames_is_processed_cycle_by_cycle(two: list[Stage]) -> None:
    with device(two, [[1, 2], [1, 2]]) as ears:
        for k in range(1, 200):
            for bus in two:
                bus.says(0x080)
                bus.answers(1, k)
                bus.answers(2, -k)
        for bus in two:
            bus.settle()
        for k in range(1, 200):
            assert cycle(ears) == 4
            counts = np.rint(ears.feedback.position_rad * COUNTS / math.tau)
            # the axes alternate between the buses
            assert counts.tolist() == [k, k, -k, -k]
        assert ears.feedback.cycle == 199


@pytest.mark.parametrize("apart", [0.0, 0.01, 0.2])
@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("behind", [0, 1])
def test_buses_a_cycle_apart_get_back_in_step(
    two: list[Stage], behind: int, swapped: bool, apart: float
) -> None:
    """After a SYNC on one bus only, both buses deliver the same cycle again within 20 cycles."""
    clock = ScriptedClock()
    with device(two, [[1], [1]], clock) as ears:
        two[behind].cycle(-1)
        for k in range(40):
            for number, bus in enumerate(reversed(two) if swapped else two):
                clock.at((k + apart * number) * PERIOD_S, partial(bus.cycle, k))
        together = []
        while clock.script:
            cycle(ears)
            first, second = np.rint(ears.feedback.position_rad * COUNTS / math.tau).tolist()
            together.append(first == second and bool(ears.feedback.valid.all()))
        assert not together[0]
        assert all(together[-20:])


@pytest.mark.parametrize(
    ("answered", "apart"), [(0.3, 0.01), (0.755, 0.01), (0.76, 0.05), (0.8, 0.1), (0.9, 0.05)]
)
def test_buses_stay_in_step_however_late_drives_answer(
    two: list[Stage], answered: float, apart: float
) -> None:
    clock = ScriptedClock()

    def sync(bus: Stage) -> None:
        bus.says(0x080)
        bus.settle()

    def answer(bus: Stage, k: int) -> None:
        bus.answers(1, k)
        bus.settle()

    with device(two, [[1], [1]], clock) as ears:
        for k in range(40):
            for number, bus in enumerate(two):
                clock.at((k + apart * number) * PERIOD_S, partial(sync, bus))
            for bus in two:
                clock.at((k + answered) * PERIOD_S, partial(answer, bus, k))
        while clock.script:
            cycle(ears)
            first, second = np.rint(ears.feedback.position_rad * COUNTS / math.tau).tolist()
            assert first == second


def test_a_flood_of_frames_does_not_block_a_cycle(stage: Stage) -> None:
    with device([stage], [[1]]) as ears:
        stop = threading.Event()

        def flood() -> None:
            while not stop.is_set():
                stage.answers(1, 7)

        thread = threading.Thread(target=flood)
        thread.start()
        try:
            for _ in range(4):
                cycle(ears)
        finally:
            stop.set()
            thread.join()


def test_a_bus_that_goes_away_is_reported(stage: Stage) -> None:
    with device([stage], [[1]]) as ears:
        stage.end()
        with pytest.raises(BusError, match="is lost"):
            cycle(ears)


def test_listening_on_a_missing_bus_is_an_error() -> None:
    axis = monitored_axis(WINCH, 1)
    with pytest.raises(BusError, match="no simulated bus"):
        ListeningDevice(
            [MonitoredBus("left", BusUrl.parse("simbus:nobody"), [axis], [0])],
            PERIOD_S,
            PacedClock(),
        )
