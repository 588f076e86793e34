"""Third-party software on a real vcan0: a master, python-can's logger, and our LSS master."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402
from waiting import until

from cdpr_profiles import load_drive
from cdpr_sim_bus.bus.client import LocalNode, raw_can_socket
from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.robot.plant import Plant

pytestmark = pytest.mark.vcan

EDS = load_drive("generic-cia402").eds
NODE = 5
SEEN = {0x000, 0x080, 0x080 + NODE, 0x180 + NODE, 0x580 + NODE, 0x600 + NODE, 0x700 + NODE}
"""Identifiers that the logger must record, from boot to fault."""
_LOGGER_S = 240.0
_LONGEST_S = 60.0


@contextmanager
def on_vcan(*nodes: LocalNode) -> Iterator[None]:
    """Run our nodes on vcan0 in a thread."""
    hub = Hub(nodes, mode=ClockMode.PACED, name="vcan0")
    hub.attach(raw_can_socket("vcan0"), essential=True)
    thread = threading.Thread(target=hub.run)
    thread.start()
    try:
        yield
    finally:
        hub.stop()
        thread.join()
        hub.close()


@contextmanager
def third_party() -> Iterator[canopen.Network]:
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    network.connect(interface="socketcan", channel="vcan0")
    try:
        yield network
    finally:
        network.sync.stop()
        network.disconnect()


def identifiers(log: Path) -> set[int]:
    return {int(text, 16) for text in re.findall(r"ID: +([0-9a-f]+) ", log.read_text())}


def test_a_third_party_master_enables_a_drive_while_python_cans_logger_records(
    tmp_path: Path,
) -> None:
    log = tmp_path / "vcan0.txt"
    command = [sys.executable, "-u", "-m", "can.logger", "-i", "socketcan", "-c", "vcan0"]
    with log.open("wb") as printed:
        logger = subprocess.Popen(command, stdout=printed)
    try:
        with on_vcan(SimDrive(EDS, NODE, Plant())), third_party() as network:
            until(lambda: "Connected to" in log.read_text(), _LOGGER_S)
            network.scanner.search(10)
            until(lambda: network.scanner.nodes == [NODE])
            node = network.add_node(BaseNode402(NODE, str(EDS)))
            node.sdo.RESPONSE_TIMEOUT = _LONGEST_S
            node.TIMEOUT_SWITCH_OP_MODE = node.TIMEOUT_SWITCH_STATE_FINAL = _LONGEST_S
            content = bytes(range(256)) * 2
            with node.sdo.open(0x2F10, 0, "wb", size=len(content), block_transfer=True) as stream:
                stream.write(content)
            assert node.sdo.upload(0x2F10, 0) == content
            node.sdo[0x1017].raw = 100
            node.nmt.wait_for_heartbeat(timeout=60)
            node.setup_402_state_machine()
            node.nmt.state = "OPERATIONAL"
            network.sync.start(0.05)
            node.op_mode = "CYCLIC SYNCHRONOUS TORQUE"
            node.state = "OPERATION ENABLED"
            assert node.state == "OPERATION ENABLED"
            codes: list[int] = []
            node.emcy.add_callback(lambda error: codes.append(error.code))
            node.sdo[0x2F00][1].raw = 0xFF01
            until(lambda: codes == [0xFF01])
            until(node.is_faulted)
        # the logger ends only after it has written all waiting frames
        until(lambda: identifiers(log) >= SEEN, _LOGGER_S)
    finally:
        logger.send_signal(2)
        logger.communicate(timeout=120)
