"""A group of axes on simulated drives: normal operation, modes, faults and shutdown."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
import pytest

from cdpr_drivers.cia402 import Mode, State, state_of
from cdpr_drivers.errors import BusError, DriveFaultError, ModeRefusedError
from tests.drivers.axis_rig import DRIVE, PERIOD_S, Rig, open_network, open_rig, start_simulator
from tests.fault_texts import alarm

OFF = (State.SWITCH_ON_DISABLED, State.READY, State.FAULT, State.NOT_READY)


def _state(bus: str, node: int = 1) -> State:
    with open_network(bus, [node]) as network:
        return state_of(network.read_int(node, 0x6041))


def test_no_axis_is_enabled_without_a_request(rig: Rig) -> None:
    rig.set_mode()
    rig.group.command.torque_Nm[:] = 1.0
    rig.run(0.2)
    assert rig.group.reached(State.SWITCH_ON_DISABLED)
    assert rig.group.feedback.position_rad[0] == pytest.approx(0.0, abs=0.05)
    assert rig.group.command.sent_torque_Nm[0] == 0.0


def test_torque_turns_the_motor_and_close_removes_power(bus: str) -> None:
    with open_rig(bus, [1, 2]) as rig:
        rig.enable()
        start = rig.group.feedback.position_rad.copy()
        for _ in range(200):
            rig.group.command.torque_Nm[:] = [0.4, -0.4]
            rig.cycle()
        assert np.all(np.sign(rig.group.feedback.position_rad - start) == [1, -1])
        assert rig.group.command.sent_torque_Nm == pytest.approx([0.4, -0.4], abs=3e-3)
        assert rig.group.feedback.torque_Nm == pytest.approx([0.4, -0.4], abs=0.02)
        assert rig.group.missed == 0
    assert _state(bus, 1) in OFF
    assert _state(bus, 2) in OFF


def test_signs_of_the_profile_reverse_angle_and_torque(bus: str) -> None:
    mirrored = DRIVE.model_copy(update={"torque_sign": -1, "position_sign": -1})
    with open_rig(bus, drive=mirrored) as rig:
        rig.enable()
        start = rig.group.feedback.position_rad[0]
        for _ in range(200):
            rig.group.command.torque_Nm[:] = 0.4
            rig.cycle()
        assert rig.group.feedback.position_rad[0] > start + 0.1
        assert rig.network.read_int(1, 0x6071) == pytest.approx(-133, abs=1)


def test_cycles_may_pause_while_drives_are_disabled(rig: Rig) -> None:
    rig.enable()
    rig.reach(State.SWITCH_ON_DISABLED)
    rig.group.stop_cycling()
    rig.network.clock.sleep(1.5)  # longer than the drive tolerates the master's silence
    rig.enable()
    rig.run(0.2)
    assert not rig.network.emergencies


def test_a_pause_of_cycles_is_rejected_while_a_drive_is_enabled(rig: Rig) -> None:
    rig.enable()
    with pytest.raises(DriveFaultError, match="disabled"):
        rig.group.stop_cycling()


def test_a_drive_with_an_rpdo_deadline_waits_in_pre_operational(bus: str) -> None:
    rpdo = DRIVE.rpdos[0].model_copy(update={"event_timer_s": 0.05})
    with open_rig(bus, drive=DRIVE.model_copy(update={"rpdos": (rpdo,)})) as rig:
        rig.enable()
        rig.reach(State.SWITCH_ON_DISABLED)
        rig.group.stop_cycling()
        assert rig.network.wait_for_heartbeat(1, 2.0) == 127
        rig.enable()
        assert not rig.network.emergencies


# -- modes


def test_a_mode_missing_in_6502h_is_rejected(rig: Rig) -> None:
    with pytest.raises(ModeRefusedError, match=r"7 \(interpolated position\).*6502h"):
        rig.group.ask_mode(7)


def test_a_mode_rejected_by_the_drive_is_reported_with_its_reason(rig: Rig) -> None:
    rig.misbehave(3, 1)
    with pytest.raises(ModeRefusedError, match="06090030h"):
        rig.group.ask_mode(Mode.CYCLIC_TORQUE)


def test_a_drive_without_confirmed_mode_is_not_enabled(rig: Rig) -> None:
    with pytest.raises(ModeRefusedError, match="no mode"):
        rig.group.request(State.OPERATION_ENABLED)
    rig.set_mode(Mode.PROFILE_VELOCITY)
    rig.misbehave(3, 2)
    rig.group.ask_mode(Mode.CYCLIC_TORQUE)
    rig.run(1.0)
    assert not rig.group.mode_confirmed()
    with pytest.raises(ModeRefusedError, match=r"mode 10 .* was requested, .* reports 3 "):
        rig.group.request(State.OPERATION_ENABLED)


def test_a_mode_change_while_enabled_raises_an_alarm(rig: Rig) -> None:
    rig.enable()
    rig.misbehave(4, 8)
    text, elapsed = rig.until_alarm(1.0)
    assert "reports mode 8" in text
    assert "not 10" in text
    assert elapsed < 0.05


def test_the_mode_is_not_changed_while_enabled(rig: Rig) -> None:
    rig.enable()
    with pytest.raises(ModeRefusedError, match="while the drive is enabled"):
        rig.group.ask_mode(Mode.PROFILE_TORQUE)


def test_a_mode_that_is_not_in_a_pdo_is_read_by_sdo(bus: str) -> None:
    with open_rig(bus, drive=DRIVE.model_copy(update={"tpdos": DRIVE.tpdos[:1]})) as rig:
        rig.enable()


# -- faults


def test_a_fault_is_latched_and_reported_until_acknowledged(rig: Rig) -> None:
    rig.enable()
    rig.misbehave(1, 0x2310)
    text, _ = rig.until_alarm(1.0)
    assert "reports error 2310h (continuous over current" in text
    rig.run(0.1, alarms=True)
    assert alarm(rig.group) == text
    assert rig.group.faulted().all()
    assert rig.group.reached(State.FAULT)
    with pytest.raises(DriveFaultError, match="acknowledge"):
        rig.group.request(State.OPERATION_ENABLED)
    rig.group.acknowledge_fault()
    rig.run(0.2)
    assert rig.group.reached(State.SWITCH_ON_DISABLED)  # and not enabled again
    assert [e.code for e in rig.network.emergencies] == [0x2310, 0]
    rig.reach(State.OPERATION_ENABLED)


def test_a_fault_reset_by_another_master_does_not_enable_the_drive(rig: Rig) -> None:
    rig.enable()
    rig.misbehave(1, 0x2310)
    rig.until_alarm(1.0)
    rig.run(0.1, alarms=True)
    rig.network.write(1, 0x6040, 0, 0x80)
    rig.run(0.3, alarms=True)
    assert rig.group.reached(State.SWITCH_ON_DISABLED)
    assert "2310h" in alarm(rig.group)
    with pytest.raises(DriveFaultError, match="acknowledge"):
        rig.group.request(State.OPERATION_ENABLED)


def _restart(rig: Rig) -> None:
    rig.network.send(0, bytes([129, 1]))


def _leave_operational(rig: Rig) -> None:
    rig.network.send(0, bytes([128, 1]))


def _mute(rig: Rig) -> None:
    rig.misbehave(5, 1)


def _drop_answers(rig: Rig) -> None:
    rig.misbehave(2, 3)


@pytest.mark.parametrize(
    ("trouble", "told", "within_s"),
    [
        (_restart, "restarted", 0.2),
        (_leave_operational, "has not answered SYNC", 0.2),
        (_mute, "no heartbeat, expected every 100 ms", 0.28),
        (_drop_answers, "has not answered SYNC", 0.05),
    ],
)
def test_an_unrequested_state_change_raises_an_alarm(
    rig: Rig, trouble: Callable[[Rig], None], told: str, within_s: float
) -> None:
    rig.enable()
    rig.group.set_index(0, 0.0)
    trouble(rig)
    text, elapsed = rig.until_alarm(1.0)
    assert told in text
    assert elapsed <= within_s
    assert rig.group.feedback.index_known[0] == (trouble is not _restart)


def test_a_missing_answer_is_reported_rather_than_its_consequences(
    bus: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the master waits for the only drive, the drive also misses the master's heartbeat."""
    # the drive also answers at the end, when its process gets to it
    monkeypatch.setattr("cdpr_drivers.canopen.network.TIMEOUT_S", 60.0)
    with open_rig(bus, lead=False) as rig:
        rig.enable()
        rig.network.write(1, 0x1800, 1, 0x80000181)
        text, _ = rig.until_alarm(0.1)
    assert "(node 1) has not answered SYNC for 1 cycle:" in text


def test_a_drive_disabled_by_another_master_is_not_enabled_again(rig: Rig) -> None:
    rig.enable()
    with (
        can.Bus(interface="simbus", channel=rig.bus[7:]) as other,
        can.Bus(interface="simbus", channel=rig.bus[7:]) as third,
    ):
        rig.cycle()
        # the other master's controlword follows ours, and both precede the next SYNC
        while (heard := other.recv(60.0)) is not None and heard.arbitration_id != 0x201:
            pass
        other.send(can.Message(arbitration_id=0x201, data=bytes(4), is_extended_id=False))
        while (heard := third.recv(60.0)) is not None and heard.data != bytes(4):
            pass
        assert heard is not None
        text, _ = rig.until_alarm(0.1)
    assert "left operation enabled without a command" in text
    rig.run(0.1, alarms=True)
    assert rig.group.reached(State.SWITCH_ON_DISABLED)


# -- the end


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_drives_are_off_after_the_block_ends_with_or_without_an_error(
    bus: str, error: type[BaseException]
) -> None:
    with pytest.raises(error), open_rig(bus, [1, 2]) as rig:
        rig.enable()
        rig.group.command.torque_Nm[:] = 0.3
        rig.run(0.1)
        raise error
    assert _state(bus, 1) in OFF
    assert _state(bus, 2) in OFF


def test_a_drive_that_ignores_pdos_is_switched_off_by_sdo(rig: Rig) -> None:
    rig.enable()
    rig.network.write(1, 0x1016, 1, 0)  # otherwise it stops because the heartbeat is missing
    _leave_operational(rig)
    assert rig.network.wait_for_heartbeat(1, 2.0) == 127
    assert state_of(rig.network.read_int(1, 0x6041)) == State.OPERATION_ENABLED
    assert rig.group.close() == ""
    assert state_of(rig.network.read_int(1, 0x6041)) in OFF


def test_a_killed_simulator_raises_a_bus_error() -> None:
    simulator = start_simulator()
    try:
        with pytest.raises(BusError, match="is lost") as caught, open_rig(simulator.bus) as rig:
            rig.enable()
            rig.run(0.1)
            simulator.process.send_signal(signal.SIGKILL)
            rig.run(1e6)
        assert any("may still have power" in n for n in caught.value.__notes__)
    finally:
        simulator.stop()


def test_a_stopped_simulator_process_only_delays_lockstep_cycles() -> None:
    simulator = start_simulator()
    try:
        with open_network(simulator.bus, [1]) as network:
            rig = Rig(simulator.bus, network, DRIVE, [1])
            rig.enable()
            simulator.process.send_signal(signal.SIGSTOP)
            go_on = (simulator.process.send_signal, [signal.SIGCONT])
            stopped = time.monotonic()
            threading.Timer(1.5, *go_on).start()  # longer than any timeout of a drive
            rig.run(0.5)
            assert time.monotonic() - stopped > 1.4
            assert rig.group.reached(State.OPERATION_ENABLED)
            assert rig.group.missed == 0
            assert rig.group.close() == ""
            assert not network.emergencies
    finally:
        simulator.stop()


_DYING_MASTER = """
import sys
sys.path.insert(0, {folder!r})
from tests.drivers.axis_rig import open_rig
from tests.fault_texts import alarm
with open_rig({bus!r}) as rig:
    rig.enable()
    rig.group.command.torque_Nm[:] = 0.05
    for k in range(10**9):
        rig.cycle()
        if k == 200:
            print("driving", flush=True)
"""


@pytest.mark.parametrize(
    "hang",
    # paced drives, whose 1 kHz master has to keep up with the wall clock
    [pytest.param(False, id="killed"), pytest.param(True, id="hung", marks=pytest.mark.alone)],
)
def test_drives_stop_when_the_master_dies_or_hangs(hang: bool) -> None:
    """A hung master is tested on a paced bus: in lockstep it would only stop the time."""
    simulator = start_simulator(paced=hang)
    code = _DYING_MASTER.format(folder=str(Path(__file__).parents[3]), bus=simulator.bus)
    command = [sys.executable, "-c", code]
    master = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert master.stdout is not None
    try:
        assert master.stdout.readline() == "driving\n"
        with open_network(simulator.bus, [1]) as network:
            assert state_of(network.read_int(1, 0x6041)) == State.OPERATION_ENABLED
            master.send_signal(signal.SIGSTOP if hang else signal.SIGKILL)
            # without a leader, the consumer's 0.5 s are wall-clock time
            deadline = time.monotonic() + 60.0
            while state_of(network.read_int(1, 0x6041)) == State.OPERATION_ENABLED:
                assert time.monotonic() < deadline
                network.clock.sleep(0.02)
            assert network.emergencies[-1].code == 0x8130
    finally:
        master.kill()
        master.communicate()
        simulator.stop()


def test_feedback_time_and_period_are_those_of_the_bus(rig: Rig) -> None:
    rig.run(0.25)
    assert rig.group.feedback.cycle == 250
    assert rig.group.feedback.time_s == pytest.approx(250 * PERIOD_S)
    assert math.isclose(rig.network.read_int(1, 0x1006) * 1e-6, PERIOD_S)
