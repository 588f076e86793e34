"""A robot on two simulated buses: boot, one device over both, faults on one of them."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

import cdpr_profiles
from cdpr_drivers.cia402 import POWER_OFF, Mode, State, state_of
from cdpr_drivers.errors import BusError, ModeRefusedError, RobotBootError
from cdpr_profiles import load_robot
from cdpr_rt.errors import ControlError, TripError
from cdpr_tools.composition.session import Session, open_robot
from tests.tools.robot_rig import (
    OUT,
    Simulator,
    hold,
    robot_file,
    simulated,
    unique,
)

pytestmark = pytest.mark.long

EIGHT = load_robot("bench-8")


@pytest.fixture(scope="module")
def bus() -> Iterator[str]:
    """Yield the bus of eight winches on two buses, simulated in lockstep."""
    with simulated("bench-8") as url:
        yield url


@pytest.fixture
def session(bus: str) -> Iterator[Session]:
    with open_robot(EIGHT, [bus], OUT) as opened:
        yield opened


def asked(session: Session, index: int) -> list[int]:
    """Read an object of each drive by SDO."""
    networks = session.machine.networks
    return [networks[axis.bus].read_int(axis.node_id, index) for axis in session.robot.axes]


def drive_states(session: Session) -> list[State]:
    return [state_of(word) for word in asked(session, 0x6041)]


def counts(session: Session) -> list[int]:
    return asked(session, 0x6064)


def test_eight_drives_boot_within_two_seconds_of_bus_time(bus: str):
    name = bus.removeprefix("simbus:")
    with open_robot(EIGHT, [bus], OUT) as opened:
        assert opened.boot_s < 2.0
        for of_bus, status in opened.machine.simulated_status().items():
            assert status["name"] == f"{name}-{of_bus}"
            # the time of all frames so far, with SDO, on a real wire at 1 Mbit/s
            assert status["load"] * status["bus_time_s"] < 1.0
        assert [report.node_id for report in opened.machine.reports] == list(range(1, 9))
        opened.idle(0.01)
        assert all(state != State.OPERATION_ENABLED for state in opened.device.states())


def test_all_axes_run_as_one_device(session: Session):
    session.enable()
    device = session.device
    assert device.lockstep
    before, begin = device.feedback.position_rad.copy(), counts(session)
    speeds = np.linspace(-2.0, 2.0, 8)
    hold(session, 1.0, speeds)
    moved = device.feedback.position_rad - before
    np.testing.assert_allclose(moved, 0.9 * speeds, atol=0.15)
    assert device.feedback.time_s == pytest.approx(device.feedback.cycle * 1e-3)
    assert device.missed == 0
    session.disable()
    # the drives confirm that the axes are in the order of the file
    turned = (np.array(counts(session)) - begin) * 2 * np.pi / 8192
    np.testing.assert_allclose(turned, 0.9 * speeds, atol=0.2)
    # both buses carried each SYNC
    assert (
        len(
            {status["sync_count"] % 10**9 for status in session.machine.simulated_status().values()}
        )
        == 1
    )


def test_the_arrays_of_each_bus_are_views_of_the_whole(session: Session):
    device = session.device
    for group, first in zip(device.groups, (0, 4), strict=True):
        for whole, part in (
            (device.feedback.position_rad, group.feedback.position_rad),
            (device.feedback.valid, group.feedback.valid),
            (device.feedback.statusword, group.feedback.statusword),
            (device.command.torque_Nm, group.command.torque_Nm),
            (device.command.sent_torque_Nm, group.command.sent_torque_Nm),
        ):
            assert part.base is not None
            assert np.shares_memory(whole[first : first + 4], part)


def test_axes_may_alternate_between_buses(tmp_path: Path):
    path = robot_file(tmp_path, [("b", 3), ("a", 1), ("a", 2), ("b", 1)])
    robot = load_robot(path)
    with simulated(path) as url, open_robot(robot, [url], OUT) as opened:
        assert [axis.node_id for axis in opened.device.axes] == [3, 1, 2, 1]
        opened.enable()
        before, begin = opened.device.feedback.position_rad.copy(), counts(opened)
        speeds = np.array([3.0, -2.0, 1.0, -4.0])
        hold(opened, 0.8, speeds)
        moved = opened.device.feedback.position_rad - before
        np.testing.assert_allclose(moved, 0.7 * speeds, atol=0.15)
        assert np.all(opened.device.feedback.valid)
        opened.disable()
        turned = (np.array(counts(opened)) - begin) * 2 * np.pi / 8192
        np.testing.assert_allclose(turned, 0.7 * speeds, atol=0.25)


def test_a_fault_on_one_bus_stops_the_axes_of_both(bus: str):
    with (
        pytest.raises(
            TripError, match=r"axis 6: the drive \(bus can1 node 6\) reports error 7305h \(incr"
        ),
        open_robot(EIGHT, [bus], OUT) as opened,
    ):
        opened.enable()
        opened.machine.networks["can1"].write(6, 0x2F00, 1, 0x7305)
        try:
            hold(opened, 10.0)
        finally:
            (fault,) = opened.device.faults()
            assert opened.device.faults()[0] is fault  # the same object in each cycle
    with (
        pytest.raises(ControlError, match=r"^axis 6: the drive \(bus can1 node 6\) "),
        open_robot(EIGHT, [bus], OUT) as opened,
    ):
        pytest.fail("the robot was opened with a drive in fault")
    with open_robot(EIGHT, [bus], OUT, reset=True) as opened:
        assert all(state in POWER_OFF for state in drive_states(opened))
        opened.enable()
        assert opened.device.reached(State.OPERATION_ENABLED)
        opened.disable()


def test_a_mode_rejected_on_one_bus_enables_no_drive_on_the_other(session: Session):
    device = session.device
    device.groups[1].ask_mode(Mode.HOMING)
    session.idle(0.001)
    with pytest.raises(ModeRefusedError, match=r"node 5 \(axis 5\): mode 6 .* was requested"):
        device.request(State.OPERATION_ENABLED)
    session.idle(0.05)
    assert all(state == State.SWITCH_ON_DISABLED for state in device.states())


def test_a_lost_bus_leaves_the_drives_of_the_other_without_power(tmp_path: Path):
    robot = load_robot(robot_file(tmp_path, [("left", 1), ("right", 1)]))
    left, right = (Simulator("winch-mpp0923d", "--bus", f"simbus:{unique()}") for _ in range(2))
    buses = [f"left={left.ready['bus']}", f"right={right.ready['bus']}"]
    try:
        with (
            pytest.raises(TripError, match="is lost") as caught,
            open_robot(robot, buses, OUT) as opened,
        ):
            opened.enable()
            hold(opened, 0.3)
            left.kill()
            hold(opened, 1e4)
        assert any("may still have power" in note for note in caught.value.__notes__)
        one = load_robot(robot_file(tmp_path, [("right", 1)]))
        with open_robot(one, buses[1:], OUT) as opened:
            # the master switched it off, not its heartbeat timeout
            assert drive_states(opened) == [State.SWITCH_ON_DISABLED]
            assert opened.machine.networks["right"].read_int(1, 0x1003) == 0
    finally:
        left.close()
        right.close()


@pytest.mark.alone
def test_a_silent_bus_does_not_delay_switching_off_on_the_other(tmp_path: Path):
    robot = load_robot(robot_file(tmp_path, [("left", 1), ("right", 1)], period_s=0.01))
    left, right = (
        Simulator("winch-mpp0923d", "--bus", f"simbus:{unique()}", "--paced") for _ in range(2)
    )
    buses = [f"left={left.ready['bus']}", f"right={right.ready['bus']}"]
    try:
        with pytest.raises(TripError), open_robot(robot, buses, OUT) as opened:
            opened.enable()
            hold(opened, 0.5, gain_Nm_rad=0.05)
            left.process.send_signal(signal.SIGSTOP)
            hold(opened, 1e4, gain_Nm_rad=0.05)
        left.process.send_signal(signal.SIGCONT)
        one = load_robot(robot_file(tmp_path, [("right", 1)], period_s=0.01))
        with open_robot(one, buses[1:], OUT) as opened:
            assert drive_states(opened) == [State.SWITCH_ON_DISABLED]
            # the master switched it off: a drive that misses the heartbeat would be in fault
            assert opened.machine.networks["right"].read_int(1, 0x1003) == 0
    finally:
        left.process.send_signal(signal.SIGCONT)
        left.close()
        right.close()


def test_an_optional_drive_may_be_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    with simulated(robot_file(tmp_path, [("a", 1), ("b", 1)])) as url:
        path = robot_file(tmp_path, [("a", 1), ("a", 7), ("b", 1)], optional=1)
        with open_robot(load_robot(path), [url], OUT) as opened:
            told = capsys.readouterr().err
            assert "axis 2 (optional) is left out" in told
            assert "node 7 did not boot (step B)" in told
            assert [axis.bus for axis in opened.robot.axes] == ["a", "b"]
            opened.enable()
            hold(opened, 0.3)
            assert opened.device.missed == 0


def test_a_drive_that_does_not_boot_is_named_with_its_bus(tmp_path: Path):
    drives, winches = (Path(cdpr_profiles.__file__).parent / kind for kind in ("drives", "winches"))
    drive = (drives / "generic-cia402.toml").read_text()
    other = drive.replace("revision = 0x00010000", "revision = 0x00020000")
    eds = f'eds = "{drives / "generic-cia402.eds"}"'
    (tmp_path / "other.toml").write_text(other.replace('eds = "generic-cia402.eds"', eds))
    winch = (winches / "winch-mpp0923d.toml").read_text()
    (tmp_path / "odd.toml").write_text(winch.replace('"generic-cia402"', '"other"'))
    path = robot_file(tmp_path, [("a", 1), ("b", 1)])
    before, after = path.read_text().rsplit("winch-mpp0923d", 1)
    with simulated(path) as url:
        path.write_text(f"{before}odd{after}")
        with (
            pytest.raises(RobotBootError, match=r"on bus b: node 1 did not boot \(step N\)"),
            open_robot(load_robot(path), [url], OUT),
        ):
            pytest.fail("the robot was opened without a drive")


@pytest.mark.alone
def test_paced_buses_run_as_one_device(tmp_path: Path):
    axes = [(bus, node) for bus in ("a", "b") for node in (1, 2, 3, 4)]
    path = robot_file(tmp_path, axes, period_s=0.01)
    with simulated(path, "--paced") as url, open_robot(load_robot(path), [url], OUT) as opened:
        assert not opened.device.lockstep
        opened.enable()
        begin = time.monotonic()
        hold(opened, 1.0, gain_Nm_rad=0.05)
        assert time.monotonic() - begin > 0.9
        assert opened.device.feedback.cycle > 100
        assert np.all(opened.device.feedback.valid)
        opened.disable()


def test_paced_and_lockstep_buses_together_are_rejected(tmp_path: Path):
    robot = load_robot(robot_file(tmp_path, [("left", 1), ("right", 1)]))
    with ExitStack() as stack:
        buses = [
            f"{bus}={stack.enter_context(simulated('winch-mpp0923d', clock))}"
            for bus, clock in (("left", "--lockstep"), ("right", "--paced"))
        ]
        with pytest.raises(BusError, match="is paced, bus left is lockstep"):
            stack.enter_context(open_robot(robot, buses, OUT))
