"""Power off of one drive by SDO, for when no cycles run or it does not follow them."""

from __future__ import annotations

from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import DISABLE_VOLTAGE, POWER_OFF, state_of
from cdpr_drivers.errors import SdoError


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
