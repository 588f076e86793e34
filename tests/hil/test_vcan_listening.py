"""Listening to another master on a real vcan0, where the kernel counts all sent frames."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import pytest

from cdpr_drivers.axes.listening import ListeningDevice, MonitoredBus, monitored_axis
from cdpr_drivers.bus import BusUrl, open_port
from cdpr_drivers.bus.frames import FRAME
from cdpr_profiles import load_winch
from cdpr_rt.core.clock import PacedClock
from tests.fault_texts import alarm

pytestmark = pytest.mark.vcan

SENT = Path("/sys/class/net/vcan0/statistics/tx_packets")


def test_a_listener_receives_feedback_and_sends_no_frame() -> None:
    winch, url = load_winch("winch-mpp0923d"), BusUrl.parse("socketcan:vcan0")
    talker = open_port(url, [])
    axis = monitored_axis(winch, 1)
    with ListeningDevice([MonitoredBus("can0", url, [axis], [0])], 0.001, PacedClock()) as device:
        before = int(SENT.read_text())
        for k in range(100):
            talker.send(FRAME.pack(0x080, 0, bytes(8)))
            answer = struct.pack("<Hih", 0x0237, 100 * k, 0)
            talker.send(FRAME.pack(0x181, len(answer), answer))
            device.sync()
            assert device.receive() == 1
            device.command.torque_Nm[:] = 1.0
            device.transmit()
            turned = 100 * k / winch.encoder_counts_per_turn * math.tau
            assert device.feedback.position_rad[0] == pytest.approx(turned)
        assert alarm(device) == ""
        device.forget_alarms()
    talker.close()
    assert int(SENT.read_text()) - before == 200
