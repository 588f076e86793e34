"""`cdpr doctor` on a machine with a real CAN interface."""

from pathlib import Path

import pytest

from cdpr_tools.host.host_checks import list_interfaces, look_around

pytestmark = pytest.mark.vcan


def test_doctor_finds_the_interface_and_its_queue_length() -> None:
    interface = next(one for one in list_interfaces() if one.name == "vcan0")
    assert interface.is_virtual
    assert (interface.is_up, interface.state, interface.bitrate_bit_s) == (True, "up", 0)
    queue = Path("/sys/class/net/vcan0/tx_queue_len").read_text()
    assert interface.queue_frames == int(queue)
    findings = {finding.what: finding for finding in look_around()}
    assert "vcan0" in findings["SocketCAN"].found
    assert f"queue of {interface.queue_frames} frames" in findings["CAN vcan0"].found
