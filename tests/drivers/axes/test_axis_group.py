"""A group of axes on simulated drives: normal operation, modes, faults and shutdown."""

from __future__ import annotations

import math
import signal
import threading
import time

import can
import pytest

from cdpr_drivers.cia402 import Mode, State, state_of
from cdpr_drivers.errors import DriveFaultError, ModeRefusedError
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
    rig.network.send(0, bytes([128, 1]))  # pre-operational
    assert rig.network.wait_for_heartbeat(1, 2.0) == 127
    assert state_of(rig.network.read_int(1, 0x6041)) == State.OPERATION_ENABLED
    assert rig.group.close() == ""
    assert state_of(rig.network.read_int(1, 0x6041)) in OFF


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


def test_feedback_time_and_period_are_those_of_the_bus(rig: Rig) -> None:
    rig.run(0.25)
    assert rig.group.feedback.cycle == 250
    assert rig.group.feedback.time_s == pytest.approx(250 * PERIOD_S)
    assert math.isclose(rig.network.read_int(1, 0x1006) * 1e-6, PERIOD_S)
