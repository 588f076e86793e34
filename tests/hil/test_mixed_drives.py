"""Drives of all shipped types in one group on one bus, each with its mode, unit and PDOs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing

import canopen
import numpy as np
import pytest
from profile_rig import DRIVES, MixedSimulator, write_winch

from cdpr_drivers.axes.axis_group import AxisGroup
from cdpr_drivers.axes.axis_layout import AxisConfig
from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.simbus import open_clock
from cdpr_drivers.canopen.boot import BootSettings, boot_all
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import Mode, State
from cdpr_drivers.errors import ModeRefusedError
from tests.fault_texts import alarm

MASTER, PERIOD_S, HEARTBEAT_S = 127, 1e-3, 0.1


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AxisGroup]:
    folder = tmp_path_factory.mktemp("mixed")
    files = [write_winch(folder, name, node) for node, name in enumerate(DRIVES, 1)]
    with ExitStack() as stack:
        simulator = MixedSimulator(files)
        stack.callback(simulator.stop)
        winches = {winch.node_id: winch for winch in simulator.winches}
        url = BusUrl.parse(simulator.bus)
        clock = stack.enter_context(closing(open_clock([url])))
        network = stack.enter_context(
            closing(CanNetwork(url, clock, list(winches), MASTER, HEARTBEAT_S))
        )
        for node, winch in winches.items():
            network.add_node(node, canopen.import_od(str(winch.drive.eds), node))
        settings = BootSettings(MASTER, PERIOD_S, 3.0, 3.0, counts_per_turn=8192)
        reports = boot_all(network, {node: (w.drive, settings) for node, w in winches.items()})
        network.start_heartbeat()
        axes = [AxisConfig.from_boot(w.drive, reports[n], 3.0) for n, w in winches.items()]
        yield stack.enter_context(AxisGroup(network, axes, PERIOD_S))


def _cycles(group: AxisGroup, count: int, torques_Nm: list[float]) -> None:
    for _ in range(count):
        group.sync()
        assert group.receive() == group.n
        group.command.torque_Nm[:] = torques_Nm
        group.transmit()
        assert alarm(group) == ""


def _until(group: AxisGroup, state: State) -> None:
    group.request(state)
    for _ in range(200):
        _cycles(group, 1, [0.0] * group.n)
        if group.reached(state):
            return
    raise AssertionError(group.states())


def test_different_drives_follow_torques_in_one_group(mixed: AxisGroup) -> None:
    modes = mixed.torque_modes
    assert len(set(modes)) > 1
    mixed.ask_mode(modes)
    _cycles(mixed, 50, [0.0] * mixed.n)
    assert mixed.mode_confirmed()
    _until(mixed, State.OPERATION_ENABLED)
    wanted = [0.5, -0.4, 0.3, -0.2][: mixed.n]
    start = mixed.feedback.position_rad.copy()
    _cycles(mixed, 10, wanted)
    assert mixed.feedback.torque_Nm == pytest.approx(wanted, abs=0.02)
    moved = mixed.feedback.position_rad - start
    assert np.sign(moved).tolist() == np.sign(wanted).tolist()
    _until(mixed, State.SWITCH_ON_DISABLED)


def test_a_mode_that_one_drive_lacks_is_rejected_with_its_name(mixed: AxisGroup) -> None:
    lacking = next(a for a in mixed.axes if Mode.CYCLIC_TORQUE not in a.drive.supported_modes)
    mixed.ask_mode(Mode.HOMING)
    with pytest.raises(ModeRefusedError, match=f"node {lacking.node_id}: mode 10"):
        mixed.ask_mode(Mode.CYCLIC_TORQUE)
    _cycles(mixed, 50, [0.0] * mixed.n)
    assert mixed.mode_confirmed(), "drives that have the mode must not remain in it"
    for axis in mixed.axes:
        assert mixed.network.read_int(axis.node_id, 0x6061) == Mode.HOMING


def test_no_drive_can_be_enabled_after_a_rejected_mode(mixed: AxisGroup) -> None:
    """The drive rejects the mode late: axes before it have changed mode, others have not."""
    mixed.ask_mode(mixed.torque_modes)
    _cycles(mixed, 50, [0.0] * mixed.n)
    assert mixed.mode_confirmed()
    with pytest.raises(ModeRefusedError, match="the drive rejected mode"):
        mixed.ask_mode([*mixed.torque_modes[:-1], -7])
    _cycles(mixed, 50, [0.0] * mixed.n)
    with pytest.raises(ModeRefusedError):
        mixed.request(State.OPERATION_ENABLED)


def test_no_drive_can_be_enabled_before_all_confirm_their_mode(mixed: AxisGroup) -> None:
    mixed.ask_mode(Mode.PROFILE_POSITION)
    _cycles(mixed, 1, [0.0] * mixed.n)
    assert not mixed.mode_confirmed()
    with pytest.raises(ModeRefusedError, match="but the drive reports"):
        mixed.request(State.OPERATION_ENABLED)
    _cycles(mixed, 50, [0.0] * mixed.n)
    assert mixed.mode_confirmed()
