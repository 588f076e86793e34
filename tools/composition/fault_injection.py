"""Faults injected into a simulated drive by its object 2F00h."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import StrEnum
from typing import Final, NamedTuple, Self

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import BusError, SdoError, SdoTimeoutError
from cdpr_profiles import Robot, RobotAxis
from cdpr_profiles.eds import load_dictionary
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.errors import BadInputError, WorkFailedError, raised_as

INJECTION_OBJECT: Final = 0x2F00
_STATUSWORD, _ERROR_CODE = 0x6041, 0x603F
_FAULT_MASK, _FAULT = 0x4F, 0x08


class InjectedFault(StrEnum):
    """Faults that can be injected into any axis."""

    CUT_CABLE = "cut-cable"
    SLIP = "slip"
    ENCODER_JUMP = "encoder-jump"
    DRIVE_FAULT = "drive-fault"
    SILENCE = "silence"
    PRE_OPERATIONAL = "pre-operational"
    CELL_OFF = "cell-off"
    PUT_BACK = "put-back"
    """Not a fault but the remedy for some: it replaces the person who carries the platform home."""


class FaultInjection(NamedTuple):
    """Sub-index of the object, and its values."""

    sub: int
    usual: int
    least: int
    most: int
    unit: str

    def amount(self, what: str, text: str | None) -> int:
        """Return the value that a text gives, or the usual value; raises BadInputError."""
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
    InjectedFault.PUT_BACK: FaultInjection(15, 1, 1, 1, ""),
}
_VIRTUAL: Final = ("vcan", "vxcan")
"""Prefixes of the names of virtual CAN interfaces on Linux, to which no drive is wired."""
_LASTING: Final = (InjectedFault.CUT_CABLE, InjectedFault.SLIP, InjectedFault.CELL_OFF)
"""Faults, in addition to silence, that last until they are mended; the others happen once."""
MEND: Final = "mend"
"""Repairs all lasting faults."""


def writes_of(what: str, value: int | None) -> list[tuple[int, int]]:
    """Return sub-indices and values of object 2F00h for a fault or `MEND`; raises BadInputError."""
    if what == MEND:
        return [(_INJECTIONS[fault].sub, 0) for fault in (InjectedFault.SILENCE, *_LASTING)]
    if what == InjectedFault.PRE_OPERATIONAL:
        raise BadInputError(f"{what}: allowed only with `cdpr sim fault`")
    injection = named_injection(what)
    return [(injection.sub, injection.amount(what, None if value is None else str(value)))]


def named_injection(what: str) -> FaultInjection:
    """Return how a fault is injected; raises BadInputError for an unknown one."""
    if what not in _INJECTIONS:
        raise BadInputError(f"FAULT {what!r}; allowed: {', '.join((*InjectedFault, MEND))}")
    return _INJECTIONS[InjectedFault(what)]


def fault_words(what: str, amount: int) -> str:
    """Return a fault and its value with its unit as text."""
    if what in (InjectedFault.CUT_CABLE, InjectedFault.PRE_OPERATIONAL, InjectedFault.PUT_BACK):
        return what
    if what == InjectedFault.DRIVE_FAULT:
        return f"{what} {amount:#06x}"
    return f"{what} {amount} {named_injection(what).unit}"


class InjectionAccess:
    """Access to object 2F00h of one simulated drive, whichever program runs the robot.

    A context manager.

    Raises BadInputError if the bus does not exist. Its methods raise WorkFailedError.
    """

    def __init__(self, robot: Robot, axis: RobotAxis, url: BusUrl) -> None:
        self._robot, self._axis, node = robot, axis, axis.winch.node_id
        virtual = url.interface == "socketcan" and url.channel.startswith(_VIRTUAL)
        if not (url.is_simulated or virtual):
            raise BadInputError(
                f"bus {url}: allowed: a simulated bus, or socketcan:vcan0 and the like; real "
                "drives may use object 2F00h for something else"
            )
        with raised_as(BadInputError, BusError):
            self._network = CanNetwork(
                url, PacedClock(), [node], robot.master_node_id, robot.master_heartbeat_s
            )
        self._network.add_node(node, load_dictionary(axis.winch.drive.eds, node))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._network.close()

    def inject(self, what: str, value: str | None) -> int:
        """Inject a fault or mend; return the value used. "pre-operational" is sent as NMT command.

        Raises BadInputError for an invalid value.
        """
        if what == MEND:
            with self._errors():
                for sub, zero in writes_of(what, None):
                    self._write(sub, zero)
            return 0
        injection = named_injection(what)
        amount = injection.amount(what, value)
        if what == InjectedFault.CELL_OFF and self._robot.tension_sensors is None:
            raise BadInputError(
                f"{what}: {self._robot.name} has no load cells; allowed only for a robot whose "
                "file has tension_sensors"
            )
        with self._errors():
            if what == InjectedFault.PRE_OPERATIONAL:
                self._network.stop_process_data(self._axis.winch.node_id)
            else:
                self._write(injection.sub, amount)
        return amount

    def injected(self) -> list[str]:
        """Return the faults that last, as text."""
        node, found = self._axis.winch.node_id, []
        with self._errors():
            for what in _LASTING:
                try:
                    amount = self._network.read_int(
                        node, INJECTION_OBJECT, _INJECTIONS[what].sub, attempts=1
                    )
                except SdoTimeoutError:
                    return [f"{InjectedFault.SILENCE}, which hides any other fault"]
                found += [fault_words(what, amount)] * bool(amount)
        return found

    def fault_code(self) -> int:
        """Return the error code of a drive in fault; 0 if it is not in fault or does not answer."""
        node = self._axis.winch.node_id
        with self._errors(), suppress(SdoTimeoutError):
            if self._network.read_int(node, _STATUSWORD, attempts=1) & _FAULT_MASK == _FAULT:
                return self._network.read_int(node, _ERROR_CODE)
        return 0

    def _write(self, sub: int, value: int) -> None:
        self._network.write(self._axis.winch.node_id, INJECTION_OBJECT, sub, value)

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except (SdoError, BusError) as error:
            raise WorkFailedError(f"axis {self._axis.name!r}: {error}") from error
