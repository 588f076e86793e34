"""A third-party master, `BaseNode402` of the `canopen` package, in a separate process."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402
from fork_server import FORKED
from waiting import until

from tests.sim_bus.cia402.drive_rig import EDS, NODE

SIMULATOR = f"""
import pathlib, sys
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.bus.server import serve

drive = SimDrive(pathlib.Path({str(EDS)!r}), {NODE}, Plant())
serve([drive], "simbus:" + sys.argv[1], mode=ClockMode(sys.argv[2]), until_stdin_ends=True)
"""


LONGEST_S = 60.0
PATIENCES = ("CHECK_TPDO", "SWITCH_OP_MODE", "SWITCH_STATE_FINAL")
"""Events for which the package waits only parts of a second."""


@pytest.fixture(params=["paced", "lockstep"])
def node(request: pytest.FixtureRequest) -> Iterator[BaseNode402]:
    name = f"third-party-{request.param}-{os.getpid()}"
    process = subprocess.Popen(
        [*FORKED, SIMULATOR, name, request.param], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    assert "ready" in json.loads(process.stdout.readline())
    network = canopen.Network()
    try:
        network.connect(interface="simbus", channel=name)
        node = BaseNode402(NODE, str(EDS))
        node.sdo.RESPONSE_TIMEOUT = LONGEST_S
        for name in PATIENCES:
            setattr(node, f"TIMEOUT_{name}", LONGEST_S)
        network.add_node(node)
        start(node)
        yield node
    finally:
        network.sync.stop()
        network.disconnect()
        process.communicate()


def start(node: BaseNode402) -> None:
    """Map the PDOs as the package's documentation does, then start the node with a SYNC."""
    states: list[int] = []
    node.nmt.add_heartbeat_callback(states.append)
    node.nmt.send_command(129)
    until(lambda: 0 in states)
    node.sdo[0x1017].raw = 50
    node.nmt.wait_for_heartbeat(timeout=60)
    node.rpdo.read()
    node.tpdo.read()
    for pdo, kind, objects in (
        (node.rpdo[1], 255, (0x6040, 0x6071)),
        (node.tpdo[1], 1, (0x6041, 0x6061, 0x6064)),
    ):
        pdo.clear()
        for index in objects:
            pdo.add_variable(index)
        pdo.trans_type = kind
        pdo.enabled = True
        pdo.save()
    node.tpdo[2].enabled = False
    node.tpdo[2].save()
    node.sdo[0x1006].raw = 10_000
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    node.network.sync.start(0.01)


def test_boots_enables_homes_faults_and_resets(node: BaseNode402) -> None:
    until(lambda: node.state == "SWITCH ON DISABLED")
    for name in ("PROFILED TORQUE", "CYCLIC SYNCHRONOUS TORQUE", "PROFILED POSITION"):
        assert node.is_op_mode_supported(name)
        node.op_mode = name
        assert node.op_mode == name
    assert not node.is_op_mode_supported("INTERPOLATED POSITION")

    node.op_mode = "CYCLIC SYNCHRONOUS TORQUE"
    node.state = "OPERATION ENABLED"
    assert node.state == "OPERATION ENABLED"
    node.state = "SWITCHED ON"
    node.state = "READY TO SWITCH ON"
    node.state = "SWITCH ON DISABLED"

    node.op_mode = "HOMING"
    assert not node.is_homed()
    node.sdo[0x6098].raw = 34
    node.sdo[0x6099][2].raw = 8192
    assert node.homing(timeout=LONGEST_S)
    assert node.is_homed()
    # The zero is at the index, 123.4° from the initial rotor angle.
    # The rotor must be at rest, because the two values are read one after the other.
    stood = -round(123.4 / 360 * 8192)
    until(lambda: abs(node.sdo[0x6064].raw - node.sdo[0x6063].raw - stood) <= 10)

    emergencies: list[int] = []
    node.emcy.add_callback(lambda error: emergencies.append(error.code))
    node.sdo[0x2F00][1].raw = 0xFF01
    until(node.is_faulted)
    until(lambda: emergencies == [0xFF01])
    assert node.sdo[0x603F].raw == 0xFF01
    node.reset_from_fault()
    assert node.state == "OPERATION ENABLED"
    until(lambda: emergencies == [0xFF01, 0x0000])
    node.state = "SWITCH ON DISABLED"


def test_a_master_can_use_the_default_mapping(node: BaseNode402) -> None:
    """The drive has factory settings and the library only does its usual set-up."""
    node.network.sync.stop()
    boot_ups: list[int] = []
    node.nmt.add_heartbeat_callback(boot_ups.append)
    node.nmt.send_command(129)
    until(lambda: 0 in boot_ups)
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    node.network.sync.start(0.01)
    node.op_mode = "CYCLIC SYNCHRONOUS TORQUE"
    assert node.op_mode == "CYCLIC SYNCHRONOUS TORQUE"
    node.state = "OPERATION ENABLED"
    assert node.state == "OPERATION ENABLED"
    node.state = "SWITCH ON DISABLED"
