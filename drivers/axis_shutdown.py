"""The end of driving: power off, made sure of by the drives' own word."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drivers.cia402 import DISABLE_VOLTAGE, POWER_OFF, State, state_of
from drivers.errors import BusError, SdoError

if TYPE_CHECKING:
    from drivers.axis_group import AxisGroup
    from drivers.network import CanNetwork

_TIMEOUT_S = 1.0


def switch_off(group: AxisGroup) -> str:
    """Take torque and power from all drives of `group`; return what stayed uncertain.

    First by the cycle; a drive that does not follow is told by SDO, and as the last resort reset.
    A bus that has gone away is no error here: its drives miss the master's heartbeat and stop.
    """
    for axis in range(group.n):
        group.set_extra_bits(axis, 0)
    try:
        if _by_cycles(group):
            return ""
        left = [
            axis.node_id
            for axis in group.axes
            if not switch_off_by_sdo(group.network, axis.node_id)
        ]
    except BusError as error:
        told = ", ".join(str(axis.node_id) for axis in group.axes)
        return f"node {told}: not known to be without power: {error}"
    if not left:
        return ""
    told = ", ".join(str(node) for node in left)
    return (
        f"node {told}: does not confirm that its power stage is off; it was reset (NMT), "
        "but see to it that it has no power"
    )


def _by_cycles(group: AxisGroup) -> bool:
    """Run cycles with zero torque until every drive reports that its power stage is off."""
    clock = group.clock
    until_s = clock.now_s + _TIMEOUT_S
    group.request(State.SWITCH_ON_DISABLED)
    while clock.now_s < until_s:
        group.command.torque_Nm[:] = 0.0
        group.sync()
        answered = group.receive()
        group.transmit()
        if answered == group.n and all(state in POWER_OFF for state in group.states()):
            return True
        if not group.lockstep:
            clock.sleep(group.period_s)
    return False


def switch_off_by_sdo(network: CanNetwork, node_id: int) -> bool:
    """Take the power from one drive by SDO and return whether it says that it has none.

    One that does not is reset, as the last resort. Raises BusError.
    """
    try:
        network.write(node_id, 0x6040, 0, DISABLE_VOLTAGE)
        if state_of(network.read_int(node_id, 0x6041)) in POWER_OFF:
            return True
    except SdoError:
        pass  # it does not listen to SDO either
    network.reset(node_id)
    return False
