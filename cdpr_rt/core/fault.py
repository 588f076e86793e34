"""Faults: the record of a failure, and the functions that format it as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from cdpr_profiles.robot_limits import Limit

IN_FAULT: Final = "in_fault"
"""Code for a drive that is in fault but has reported no cause."""
BUS_LOST: Final = "bus_lost"
BUS_OFF: Final = "bus_off"
POWER_UNCONFIRMED: Final = "power_unconfirmed"
POWER_UNKNOWN: Final = "power_unknown"
PEAK: Final = "peak"
PROGRAM: Final = "program"
LOAD_CELL: Final = "load_cell"
"""Code for a load cell whose tension is no longer known."""
LOAD_CELL_HIGH: Final = "load_cell_high"
OR_LANDED: Final = "or_landed"
"""Code for a cable that lost its tension while the platform was lowered without a pose."""
IN_REASON: Final = (POWER_UNCONFIRMED, POWER_UNKNOWN, PROGRAM)
"""Codes that are part of the reason even if something else failed first."""

IN_DRIVES_FAULT: Final = (Limit.DRIVE, Limit.STALE, Limit.MISSED, Limit.MISSED_IN_WINDOW)
"""Limits that count as part of the fault of the drive concerned."""

Key = tuple[Limit, int, str, str]


class Fault(NamedTuple):
    """One failure; two records with the same `key` are the same fault."""

    limit: Limit
    axis: int = -1
    """Number of the axis, -1 if the fault has no single axis or the axis is not known."""
    code: str = ""
    """Kind within the limit: an error code as "7305h", a word as "silent", "" for the only kind."""
    source: str = ""
    """Device or part that reported it, such as "bus can0 node 2"; "" for the supervisor."""
    value: float = math.nan
    allowed: float = math.nan
    detail: str = ""
    """Meaning of a code, or the text of another part, such as an operating system's error."""
    suspects: tuple[int, ...] = ()
    """Axes that may have caused the fault if `axis` is not known, the most likely first."""

    @property
    def key(self) -> Key:
        """Return the identity of the fault; if there is no single axis, it includes the source."""
        who = "" if self.axis >= 0 else self.source or self.detail
        return self.limit, self.axis, self.code, who

    def explains(self, other: Fault) -> bool:
        """Return whether this fault gives the cause of a drive failure that `other` reports without
        a cause.
        """
        if self.axis < 0 or self.axis != other.axis or self.limit is not Limit.DRIVE:
            return False
        vague = other.limit is not Limit.DRIVE or other.code == IN_FAULT
        return vague and other.limit in IN_DRIVES_FAULT and self.code not in IN_REASON


_BY_CODE: Final = {
    "restarted": "{drive} has restarted, or another device with its node id was switched on: check "
    "its supply, then acknowledge",
    IN_FAULT: "{drive} is in fault and gave no error code: look at its display, then acknowledge",
    "wrong_mode": "{drive} reports mode {detail}: find out what else commands it, then acknowledge",
    "left_enabled": "{drive} left operation enabled without a command and is {detail}: check its "
    "supply and its enable input, then acknowledge",
    "flooding": "{drive} floods the bus with frames{in_brackets}: switch it off and find the cause",
    "silent": "{drive} has not answered SYNC for {cycles}: check its power and its bus cable, "
    "then acknowledge; if its heartbeats still come, its TPDOs were changed",
    "unsteady": "{value:.0f} answers of {drive} to SYNC are missing: check the load of the bus",
    "doubled": "{value:.0f} answers of {drive} to SYNC came twice: look for a second device "
    "with its node id",
    "no_heartbeat": "{drive} sends no heartbeat, expected every {ms:.0f} ms: check its power and "
    "its bus cable, then acknowledge",
    "not_operational": "{drive} left the NMT state operational and is {detail}: find out what else "
    "commands it, then acknowledge",
    "not_finite": "the torque for {drive} was not a finite number; 0 was sent",
    POWER_UNCONFIRMED: "{drive} does not confirm that its power is off, so it was reset: "
    "check that it "
    "has no power",
    BUS_LOST: "{detail}",
    BUS_OFF: "{detail}",
    POWER_UNKNOWN: "may still have power: {detail}",
    LOAD_CELL: "{detail}",
    LOAD_CELL_HIGH: "{source}: {value:.1f} N, {allowed:g} N allowed",
    PEAK: "tension {value:.0f} N or more for some ms, {allowed:.0f} N allowed: the cable "
    "slipped or caught, or the control loop oscillates; check the cable, its drum "
    "and its ends",
}
_ACTIONS: Final = (
    ("73", "check the encoder and its cable"),
    ("71", "check that the motor turns freely"),
    ("2", "check motor and motor cable for overload and short circuit"),
    ("3", "check the supply voltage"),
    ("4", "let the drive cool down and check its load"),
    ("81", "check the bus cable and the load of the bus"),
    ("82", "check the bus cable and the load of the bus"),
    ("8", "check that winch and cable run freely"),
)
"""Advice for an error code of CiA 402, by its first digits."""


def fault_text(fault: Fault, names: Sequence[str]) -> str:
    """Return a fault as text: the axis by `names`, the state, its cause and the remedy."""
    limit, code = fault.limit, fault.code
    if code in _BY_CODE:
        at = f" ({fault.source})" if fault.source else ""
        cycles = f"{fault.value:.0f} cycle{'' if fault.value == 1.0 else 's'}"
        text = _BY_CODE[code].format(
            **fault._asdict(), drive=f"the drive{at}", cycles=cycles,
            ms=1e3 * fault.allowed, in_brackets=f" ({fault.detail})" if fault.detail else "",
        )  # fmt: skip
    elif limit is Limit.DRIVE:
        action = next((what for digits, what in _ACTIONS if code.startswith(digits)), "")
        text = (
            f"the drive ({fault.source}) reports error {code} ({fault.detail}): "
            f"{action or 'look it up in the manual of the drive'}, then acknowledge"
        )
    elif code == PROGRAM:
        text = f"{fault.source}: {fault.detail}"
    else:
        text = fault.detail or limit.text.format(
            limit.factor * fault.value, limit.factor * fault.allowed
        )
    if code == OR_LANDED:
        text += (
            "; or the platform landed, which also slackens a cable suddenly: look at the platform"
        )
    if fault.suspects:
        text += f", one of {', '.join(axis_name(i, names) for i in fault.suspects)}"
    return text if fault.axis < 0 else f"{axis_name(fault.axis, names)}: {text}"


def axis_name(axis: int, names: Sequence[str]) -> str:
    """Return the name of an axis in messages; `axis` counts from 0."""
    return names[axis] if axis < len(names) else f"axis {axis + 1}"


def fault_record(fault: Fault, names: Sequence[str]) -> dict[str, Any]:
    """Return a fault for programs, as in the status; all values in SI units, null for none."""
    value, allowed = (x if math.isfinite(x) else None for x in (fault.value, fault.allowed))
    return {
        "limit": fault.limit.key,
        "axis": fault.axis,
        "name": axis_name(fault.axis, names) if fault.axis >= 0 else None,
        "code": fault.code,
        "source": fault.source,
        "value": value,
        "allowed": allowed,
        "unit": fault.limit.unit,
        "suspects": list(fault.suspects),
        "text": fault_text(fault, names),
    }
