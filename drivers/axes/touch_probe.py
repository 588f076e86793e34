"""Finding the encoder index during ordinary motion, by the drive's touch probe."""

from __future__ import annotations

from cdpr_drivers.axes.axis_group import AxisGroup
from cdpr_drivers.errors import DriveFaultError

_OFF = 0
# CiA 402-2, 60B8h: probe 1 on, first event only, zero pulse as trigger, positive edge
_NEXT_ZERO_PULSE = 0x15
_ON, _LATCHED = 0x01, 0x02


def arm(group: AxisGroup, axis: int) -> None:
    """Have the drive latch its position at the next zero pulse.

    The position comes with a TPDO in whatever cycle it is latched, and `feedback.index_known`
    tells of it; no SDO is needed then. Raises DriveFaultError when the drive does not arm or its
    PDOs do not carry the result, SdoError when it refuses.
    """
    node = group.axes[axis].node_id
    if 0x60B8 not in group.network.dictionary(node):
        raise DriveFaultError(
            f"node {node}: the drive has no touch probe (60B8h is not in its EDS); find its index "
            "by homing"
        )
    write = group.network.write
    group.expect_index(axis, False)
    write(node, 0x60B8, 0, _OFF)
    write(node, 0x60B8, 0, _NEXT_ZERO_PULSE)
    status = group.network.read_int(node, 0x60B9)
    if not status & _ON or (status & _LATCHED and not group.feedback.valid[axis]):
        raise DriveFaultError(
            f"node {node}: the touch probe did not arm (60B9h = {status:04X}h after 60B8h = "
            f"{_NEXT_ZERO_PULSE:04X}h)"
        )
    group.expect_index(axis, True)
