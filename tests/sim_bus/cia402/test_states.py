"""State machine: each command in each state, option codes, mode changes, lost connections."""

from __future__ import annotations

import pytest

from cdpr_sim_bus.robot.plant import Plant
from tests.sim_bus.cia402.drive_rig import NODE, Rig, SdoRefusedError

SOD, RTSO, SO, OE, QSA, FRA, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08
PATH = {SOD: (), RTSO: (6,), SO: (6, 7), OE: (6, 7, 15), QSA: (6, 7, 15, 2)}
COMMANDS = {
    "disable voltage": 0x00,
    "quick stop": 0x02,
    "shutdown": 0x06,
    "switch on": 0x07,
    "enable": 0x0F,
}
# Rows: state; columns in the order of COMMANDS (IEC 61800-7-201, figure of the state machine).
TABLE = {
    SOD: (SOD, SOD, RTSO, SOD, SOD),
    RTSO: (SOD, SOD, RTSO, SO, OE),
    SO: (SOD, SOD, RTSO, SO, OE),
    OE: (SOD, QSA, RTSO, SO, OE),
    QSA: (SOD, QSA, QSA, QSA, OE),
    FAULT: (FAULT, FAULT, FAULT, FAULT, FAULT),
}


def bring_to(rig: Rig, state: int) -> None:
    rig.write(0x605A, 6)  # quick stop stays in QUICK STOP ACTIVE
    if state == FAULT:
        rig.write(0x2F00, 0xFF01, 1)
    else:
        for word in PATH[state]:
            rig.write(0x6040, word)
            rig.run(0.02)
    assert rig.state == state


@pytest.mark.parametrize("state", TABLE)
@pytest.mark.parametrize("column", range(len(COMMANDS)))
def test_each_command_in_each_state_leads_to_the_specified_state(
    rig: Rig, state: int, column: int
) -> None:
    bring_to(rig, state)
    rig.write(0x6040, list(COMMANDS.values())[column])
    rig.run(0.05)
    assert rig.state == TABLE[state][column]


def test_an_enable_command_can_be_cancelled(rig: Rig) -> None:
    rig.write(0x6040, 6)
    rig.write(0x6040, 15)
    rig.write(0x6040, 6)
    rig.run(0.05)
    assert rig.state == RTSO


@pytest.mark.parametrize("option", range(9))
def test_quick_stop_options_stop_the_motor_as_specified(rig: Rig, option: int) -> None:
    rig.write(0x605A, option)
    rig.enable(3)
    rig.write(0x60FF, 40_000)
    rig.cycles(300)
    assert rig.truth[1] == pytest.approx(30.7, rel=0.05)
    rig.word = 0x02
    start = rig.truth[0]
    rig.cycle()
    assert rig.status & 0x6F == (SOD if option == 0 else QSA)
    rig.cycles(400)
    assert rig.status & 0x6F == (QSA if option >= 5 else SOD)
    way = rig.truth[0] - start
    if option == 0:  # coasts: half of v² J / friction
        assert way > 0.3
    elif option in (1, 5):  # 6084h: 819200 counts/s² = 628 rad/s²
        assert way == pytest.approx(30.7**2 / 2 / 628.3, rel=0.15)
    else:
        assert way < 0.35
    assert abs(rig.truth[1]) < 0.05
    rig.word = 0x0F
    rig.cycles(5)
    assert rig.status & 0x6F == (OE if option >= 5 else SOD)


@pytest.mark.parametrize(("index", "word", "end"), [(0x605B, 6, RTSO), (0x605C, 7, SO)])
def test_leaving_operation_brakes_along_the_ramp_or_cuts_power(
    rig: Rig, index: int, word: int, end: int
) -> None:
    ways = []
    for option in (0, 1):
        rig.write(index, option)
        rig.enable(3)
        rig.write(0x60FF, 40_000)
        rig.cycles(300)
        start = rig.truth[0]
        rig.word = word
        rig.cycle()
        assert rig.status & 0x6F == (OE if option else end)
        rig.cycles(600)
        assert rig.status & 0x6F == end
        assert abs(rig.truth[1]) < 0.05
        ways.append(rig.truth[0] - start)
    assert ways[1] < 0.9 < 1.2 * ways[0]


def test_leaving_operation_can_be_cancelled_during_the_ramp(rig: Rig) -> None:
    rig.enable(3)
    rig.write(0x60FF, 40_000)
    rig.cycles(300)
    rig.word = 7
    rig.cycles(10)
    rig.word = 15
    rig.cycles(300)
    assert rig.status & 0x6F == OE
    assert rig.truth[1] == pytest.approx(30.7, rel=0.05)


@pytest.mark.parametrize("option", [1, 2, 3, 4])
def test_each_halt_option_stops_the_motor_and_motion_can_continue(rig: Rig, option: int) -> None:
    rig.write(0x605D, option)
    rig.enable(3)
    rig.write(0x60FF, 40_000)
    rig.cycles(300)
    rig.word = 0x10F
    rig.cycle()
    assert rig.status & 0x046F == OE
    rig.cycles(300)
    assert rig.status & 0x046F == OE | 0x0400
    assert abs(rig.truth[1]) < 0.05
    rig.word = 0x00F
    rig.cycles(300)
    assert rig.truth[1] == pytest.approx(30.7, rel=0.05)


def test_halt_in_a_torque_mode_reduces_the_torque_along_its_slope(rig: Rig) -> None:
    rig.write(0x6087, 2000)
    rig.enable(10)
    rig.torque = 100
    rig.cycles(20)
    rig.word = 0x10F
    rig.cycles(26)
    assert rig.actual_torque == pytest.approx(50, abs=4)
    rig.cycles(50)
    assert rig.actual_torque == 0
    rig.word = 0x0F
    rig.cycles(20)
    assert rig.actual_torque == 100


class TestModes:
    def test_supported_modes_are_accepted_and_others_rejected(self, rig: Rig) -> None:
        supported = rig.read(0x6502)
        for mode in range(-10, 20):
            if mode == 0 or (mode > 0 and supported >> (mode - 1) & 1):
                rig.set_mode(mode)
            else:
                with pytest.raises(SdoRefusedError) as refused:
                    rig.write(0x6060, mode)
                assert refused.value.code == 0x06090030
                before = rig.read(0x6061)
                rig.run(0.02)
                assert rig.read(0x6061) == before

    def test_a_mode_does_not_act_before_it_is_displayed(self, rig: Rig) -> None:
        rig.enable(10)
        rig.torque = 200
        rig.cycles(10)
        rig.write(0x6060, 3)
        rig.cycles(3)
        assert rig.actual_torque == 200
        rig.cycles(300)
        assert rig.read(0x6061) == 3
        assert abs(rig.truth[1]) < 0.1


class TestConnection:
    @pytest.mark.parametrize(
        ("option", "end", "code"), [(0, OE, 0), (1, FAULT, 0x8130), (2, SOD, 0), (3, SOD, 0)]
    )
    def test_lost_heartbeat_acts_as_6007h_specifies(
        self, rig: Rig, option: int, end: int, code: int
    ) -> None:
        rig.write(0x6007, option)
        rig.write(0x1016, 127 << 16 | 50, 1)
        rig.enable(10)
        for _ in range(5):
            rig.send(0x77F, b"\x05")
            rig.cycles(40)
        assert rig.status & 0x6F == OE
        rig.run(0.2)
        assert rig.state == end
        assert rig.read(0x603F) == code
        assert (0x8130, 0x11) in rig.emergencies

    def test_lost_heartbeat_does_not_change_the_state_while_not_enabled(self, rig: Rig) -> None:
        rig.write(0x1016, 127 << 16 | 50, 1)
        rig.write(0x6040, 6)
        rig.send(0x77F, b"\x05")
        rig.run(0.2)
        assert rig.state == RTSO

    def test_nmt_stop_faults_an_enabled_drive(self, rig: Rig) -> None:
        rig.enable(10)
        rig.nmt(2)
        rig.run(0.05)
        rig.nmt(128)
        assert rig.state == FAULT

    @pytest.mark.parametrize(("drops", "end"), [(False, OE), (True, SOD)])
    def test_pre_operational_keeps_torque_or_cuts_power_by_plant(
        self, drops: bool, end: int
    ) -> None:
        rig = Rig(Plant.model_validate({"drive": {"off_when_pre_operational": drops}}))
        rig.write(0x6007, 2)
        rig.enable(10)
        rig.torque = 200
        rig.cycles(20)
        rig.nmt(128)
        rig.run(0.05)
        assert rig.state == end
        assert (rig.read(0x6077, signed=True) == 0) == drops

    def test_a_missed_rpdo_deadline_faults_an_enabled_drive(self, rig: Rig) -> None:
        rig.map_pdos()
        rig.nmt(128)
        rig.write(0x1400, 0x80000200 + NODE, 1)
        rig.write(0x1400, 255, 2)
        rig.write(0x1400, 20, 5)
        rig.write(0x1400, 0x200 + NODE, 1)
        rig.nmt(1)
        rig.enable(10)
        rig.cycles(50)
        assert rig.status & 0x6F == OE
        rig.run(0.1)
        assert rig.state == FAULT
        assert rig.read(0x603F) == 0x8250

    def test_node_reset_forgets_position_and_state(self, rig: Rig) -> None:
        rig.enable(10)
        rig.torque = 200
        rig.cycles(100)
        assert rig.position > 100
        rig.nmt(129)
        rig.run(0.5)
        assert rig.state == SOD
        assert rig.read(0x6061) == 0
        moved = rig.truth[0]
        assert abs(moved) > 0.1
        assert abs(rig.read(0x6064, signed=True)) < 8192 * 8

    def test_the_error_remains_until_the_master_is_back_and_the_fault_is_reset(
        self, rig: Rig
    ) -> None:
        lose_master(rig)
        assert rig.state == FAULT
        assert rig.emergencies == [(0x8130, 0x11)]
        rig.send(0x77F, b"\x05")  # the master is back, but the drive is still in fault
        assert rig.read(0x1001) == 0x11
        assert rig.emergencies == [(0x8130, 0x11)]
        rig.write(0x6040, 0x80)
        rig.run(0.01)
        assert rig.read(0x1001) == 0
        assert rig.emergencies == [(0x8130, 0x11), (0, 0)]

    def test_a_fault_reset_keeps_the_error_while_the_master_is_missing(self, rig: Rig) -> None:
        lose_master(rig)
        rig.write(0x6040, 0x80)
        rig.run(0.01)
        assert (rig.read(0x603F), rig.read(0x1001)) == (0, 0x11)
        rig.send(0x77F, b"\x05")
        assert rig.read(0x1001) == 0
        assert rig.emergencies[-1] == (0, 0)


def lose_master(rig: Rig) -> None:
    """Enable the drive, which then misses the heartbeats of its master."""
    rig.write(0x6007, 1)
    rig.write(0x1016, 127 << 16 | 50, 1)
    rig.enable(10)
    rig.send(0x77F, b"\x05")
    rig.run(0.2)


class TestFixedObjects:
    @pytest.mark.parametrize(("index", "sub"), [(0x608F, 1), (0x6091, 1), (0x607E, 0)])
    def test_scaling_cannot_be_changed(self, rig: Rig, index: int, sub: int) -> None:
        value = rig.read(index, sub)
        rig.write(index, value, sub)
        with pytest.raises(SdoRefusedError):
            rig.write(index, value + 1, sub)
