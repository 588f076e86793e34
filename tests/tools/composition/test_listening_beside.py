"""A listener receives all feedback of a robot that another master runs, and sends nothing."""

from __future__ import annotations

import math
import struct
import threading
from collections import Counter
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from cdpr_drivers.axes.listening import ListeningDevice, MonitoredBus, monitored_axis
from cdpr_drivers.bus.simbus import connect, exchange
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import Robot, load_robot
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.composition.session import open_robot
from tests.tools.robot_rig import OUT, hold, robot_file, simulated

FRAME = struct.Struct("=IB3x8s")
AXES = (("left", 1), ("right", 1), ("left", 2), ("right", 2))


class Witness:
    """Record all frames on one bus."""

    def __init__(self, name: str) -> None:
        self.sock = connect(name)
        exchange(self.sock, None)
        self.frames: list[bytes] = []
        self.thread = threading.Thread(target=self._read)
        self.thread.start()

    def _read(self) -> None:
        while packet := self.sock.recv(65536):
            if len(packet) != 16:
                return
            self.frames.append(packet)

    def close(self) -> None:
        self.sock.send(b'{"status":true}  ')  # its answer follows all earlier frames
        self.thread.join()
        self.sock.close()

    def counts(self) -> Counter[int]:
        return Counter(FRAME.unpack(frame)[0] for frame in self.frames)

    def positions(self, node: int) -> list[int]:
        """Return 6064h of a node per cycle, from its first answer to SYNC."""
        heard = (FRAME.unpack(frame) for frame in self.frames)
        return [
            struct.unpack_from("<i", data, 2)[0] for can, _, data in heard if can == 0x180 + node
        ]


def listen(robot: Robot, url: str) -> ListeningDevice:
    buses = []
    for name, bus in robot_urls(robot, [url]).items():
        places = robot.axes_on(name)
        axes = [monitored_axis(robot.axes[i].winch, robot.axes[i].node_id) for i in places]
        buses.append(MonitoredBus(name, bus, axes, places))
    return ListeningDevice(buses, robot.sync_period_s, PacedClock())


def test_a_listener_receives_all_feedback_and_sends_nothing(tmp_path: Path) -> None:
    robot = load_robot(robot_file(tmp_path, AXES))
    with simulated(robot.path) as url, ExitStack() as stack:
        witness = {
            name: Witness(str(bus)[len("simbus:") :])
            for name, bus in robot_urls(robot, [url]).items()
        }
        for each in witness.values():
            stack.callback(each.close)
        device = stack.enter_context(listen(robot, url))
        rows: list[np.ndarray] = []
        stop = threading.Event()

        def follow() -> None:
            before = 0
            while not stop.is_set() or device.silent_s < 0.2:
                device.sync()
                device.receive()
                device.transmit()
                if device.feedback.cycle != before:
                    before = device.feedback.cycle
                    rows.append(device.feedback.position_rad.copy())

        thread = threading.Thread(target=follow)
        thread.start()
        try:
            with open_robot(robot, [url], OUT) as session:
                session.enable()
                hold(session, 0.5, [1.0, -1.0, 2.0, -2.0])
                session.disable()
                driven = session.device
        finally:
            stop.set()
            thread.join()
        stack.close()
        cycles, transmits = driven.feedback.cycle, driven.transmits
        for (name, each), group in zip(witness.items(), driven.groups, strict=True):
            counts = each.counts()
            assert counts[0x080] == group.feedback.cycle
            for i in robot.axes_on(name):
                # the commands that the master sent, including those of its shutdown
                assert transmits <= counts[0x200 + robot.axes[i].node_id] <= counts[0x080]
    assert len(rows) >= cycles
    for i, axis in enumerate(robot.axes):
        said = np.array(witness[axis.bus].positions(axis.node_id)) * math.tau / 8192
        heard = np.array(rows)[:, i]
        assert said.size >= cycles
        np.testing.assert_allclose(heard[: said.size], said[: heard.size], atol=1e-9)
    assert np.ptp(np.array(rows), axis=0) == pytest.approx([0.4, 0.4, 0.8, 0.8], abs=0.15)
