"""An error that the communication and the drive both report stands until both took it back."""

from __future__ import annotations

from tests.sim_bus.cia402.drive_rig import Rig


def test_the_heartbeat_error_stands_as_long_as_the_fault(rig: Rig) -> None:
    rig.write(0x6007, 1)
    rig.write(0x1016, 127 << 16 | 50, 1)
    rig.enable(10)
    rig.send(0x77F, b"\x05")
    rig.run(0.2)
    assert rig.state == 0x08
    assert rig.emergencies == [(0x8130, 0x11)]
    rig.send(0x77F, b"\x05")  # the master is back, yet the drive is in fault still
    assert rig.read(0x1001) == 0x11
    assert rig.emergencies == [(0x8130, 0x11)]
    rig.write(0x6040, 0x80)
    rig.run(0.01)
    assert rig.read(0x1001) == 0
    assert rig.emergencies == [(0x8130, 0x11), (0, 0)]


def test_a_reset_fault_leaves_the_error_while_the_master_is_missing(rig: Rig) -> None:
    rig.write(0x6007, 1)
    rig.write(0x1016, 127 << 16 | 50, 1)
    rig.enable(10)
    rig.send(0x77F, b"\x05")
    rig.run(0.2)
    rig.write(0x6040, 0x80)
    rig.run(0.01)
    assert rig.read(0x603F) == 0
    assert rig.read(0x1001) == 0x11
    rig.send(0x77F, b"\x05")
    assert rig.read(0x1001) == 0
    assert rig.emergencies[-1] == (0, 0)
