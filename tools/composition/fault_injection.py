"""Faults injected into a simulated drive by object 2F00h, which real drives do not have."""

from __future__ import annotations

from enum import StrEnum
from typing import Final, NamedTuple

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import BusError, SdoError
from cdpr_profiles import Robot, RobotAxis
from cdpr_profiles.eds import load_dictionary
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.errors import BadInputError, WorkFailedError, raised_as

INJECTION_OBJECT: Final = 0x2F00


class InjectedFault(StrEnum):
    """Faults that can be injected into any axis."""

    CUT_CABLE = "cut-cable"
    SLIP = "slip"
    ENCODER_JUMP = "encoder-jump"
    DRIVE_FAULT = "drive-fault"
    SILENCE = "silence"
    PRE_OPERATIONAL = "pre-operational"
    CELL_OFF = "cell-off"


class FaultInjection(NamedTuple):
    """Sub-index of the object, and its values."""

    sub: int
    usual: int
    least: int
    most: int
    unit: str

    def amount(self, what: str, text: str | None) -> int:
        """Return the value that a text gives, by default the usual one; raises BadInputError."""
        try:
            amount = self.usual if text is None else int(text, 0)
        except ValueError:
            amount = self.least - 1
        if not self.least <= amount <= self.most:
            raise BadInputError(
                f"{what} {text}: allowed: whole numbers {self.least} to {self.most}"
            )
        return amount


_INJECTIONS = {
    InjectedFault.CUT_CABLE: FaultInjection(12, 1, 1, 1, ""),
    InjectedFault.SLIP: FaultInjection(13, 100, 1, 0xFFFF, "mm"),
    InjectedFault.ENCODER_JUMP: FaultInjection(11, 500, -(2**31), 2**31 - 1, "counts"),
    InjectedFault.DRIVE_FAULT: FaultInjection(1, 0x7305, 1, 0xFFFF, ""),
    InjectedFault.SILENCE: FaultInjection(6, 0xFFFF, 1, 0xFFFF, "ms"),
    InjectedFault.PRE_OPERATIONAL: FaultInjection(0, 1, 1, 1, ""),
    InjectedFault.CELL_OFF: FaultInjection(14, 40, -(2**15), 2**15 - 1, "N"),
}


def injection_of(what: str, value: int | None) -> tuple[int, int]:
    """Return sub-index and value of object 2F00h for a fault; raises BadInputError."""
    if what == InjectedFault.PRE_OPERATIONAL:
        raise BadInputError(f"{what}: allowed: with `cdpr sim fault`")
    injection = named_injection(what)
    return injection.sub, injection.amount(what, None if value is None else str(value))


def named_injection(what: str) -> FaultInjection:
    """Return how a fault is injected; raises BadInputError for an unknown one."""
    if what not in _INJECTIONS:
        raise BadInputError(f"FAULT {what!r}; allowed: {', '.join(InjectedFault)}")
    return _INJECTIONS[InjectedFault(what)]


def inject_beside(robot: Robot, axis: RobotAxis, url: BusUrl, what: str, value: str | None) -> int:
    """Inject a fault into an axis, whoever runs the robot; return the value used.

    For pre-operational it sends the NMT command. Raises BadInputError and WorkFailedError.
    """
    injection, winch = named_injection(what), axis.winch
    amount = injection.amount(what, value)
    if what == InjectedFault.CELL_OFF and robot.tension_sensors is None:
        raise BadInputError(
            f"{what}: {robot.name} has no load cells, its tensions are estimated from torques; "
            "allowed: for a robot whose file names tension_sensors"
        )
    with raised_as(BadInputError, BusError):
        network = CanNetwork(
            url, PacedClock(), [winch.node_id], robot.master_node_id, robot.master_heartbeat_s
        )
    try:
        network.add_node(winch.node_id, load_dictionary(winch.drive.eds, winch.node_id))
        if what == InjectedFault.PRE_OPERATIONAL:
            network.stop_process_data(winch.node_id)
        else:
            network.write(winch.node_id, INJECTION_OBJECT, injection.sub, amount)
    except (SdoError, BusError) as error:
        raise WorkFailedError(f"axis {axis.name!r}: {error}") from error
    finally:
        network.close()
    return amount
