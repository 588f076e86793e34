"""Texts of the alarms of a group of axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_drivers.axes import axis_codec as codec
from cdpr_drivers.axes.axis_codec import Ints
from cdpr_drivers.axes.axis_layout import AxisConfig
from cdpr_drivers.canopen.error_control import STATE_NAMES
from cdpr_drivers.cia402 import State, fault_text, mode_name

_MASTER_LOST_CODES = (0x8130, 0x8250)
"""EMCY codes of a drive that misses the master's heartbeat or commands."""


def alarm_text(axes: Sequence[AxisConfig], ints: Ints) -> str:
    """Return the alarms of all axes in words, the likeliest cause of each axis' first."""
    raised = [int(i) for i in np.flatnonzero(ints[codec.ALARM])]
    return "; ".join(f"{axes[i].label}: {_axis_text(axes[i], ints[:, i])}" for i in raised)


def _axis_text(axis: AxisConfig, column: Ints) -> str:
    bits = int(column[codec.ALARM])
    displayed, requested = int(column[codec.MODE_DISPLAYED]), int(column[codec.MODE_REQUESTED])
    code = int(column[codec.EMERGENCY])
    emergency = f"EMCY {fault_text(code)}"
    # while an answer is awaited nothing is sent: a master that the drive misses is no cause then
    master_lost = bits & codec.SILENT and code in _MASTER_LOST_CODES
    texts = (
        (
            codec.RESTARTED,
            "the drive has restarted (unexpected boot-up message), or another device with its "
            "node id was switched on: boot it anew",
        ),
        (0 if master_lost else codec.EMERGENCY_MESSAGE, emergency),
        (codec.FAULT, "the drive is in fault"),
        (
            codec.WRONG_MODE,
            f"the drive reports mode {mode_name(displayed)}, not {mode_name(requested)}",
        ),
        (
            codec.LEFT_ENABLED,
            "the drive left operation enabled by itself and is "
            f"{State(int(column[codec.STATE])).label}",
        ),
        (codec.FLOODING, "it floods the bus with frames: switch it off and find out why"),
        (codec.SILENT, _silence(column)),
        (codec.UNSTEADY, _unsteadiness(column)),
        (
            codec.NO_HEARTBEAT,
            f"no heartbeat, expected every {axis.drive.heartbeat_producer_s * 1e3:.0f} ms",
        ),
        (
            codec.NOT_OPERATIONAL,
            "the drive left the NMT state operational and is "
            f"{STATE_NAMES.get(int(column[codec.NMT_STATE]), 'in an unknown state')} "
            f"(state {column[codec.NMT_STATE]})",
        ),
        (codec.EMERGENCY_MESSAGE if master_lost else 0, emergency),
        (codec.NOT_FINITE, "a torque that is not a finite number was asked for; 0 was sent"),
    )
    return ", ".join(text for bit, text in texts if bits & bit)


def _silence(column: Ints) -> str:
    return (
        f"no answer to SYNC for {_cycles(column[codec.SILENT_CYCLES])}, the last heartbeat "
        f"{_cycles(column[codec.HEARTBEAT_AGE])} ago (without heartbeats it lacks power or cable; "
        "with them its TPDOs are off or changed: boot it anew)"
    )


def _cycles(count: int) -> str:
    return f"{count} cycle{'' if count == 1 else 's'}"


def _unsteadiness(column: Ints) -> str:
    missed, repeated = int(column[codec.MISSED]), int(column[codec.REPEATED])
    text = (
        f"its answers to SYNC are unsteady: {missed} missing and {repeated} double since the first "
        "cycle"
    )
    if repeated > missed:
        return f"{text}; two devices may have this node id"
    return f"{text}; look at the load of the bus"
