"""Faults injected into a simulator: by orders beside its bus, or by object 2F00h of a drive."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final, Protocol, Self

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import BusError, SdoError, SdoTimeoutError
from cdpr_profiles import Robot, RobotAxis
from cdpr_profiles.bounded_input import parse_json
from cdpr_profiles.eds import load_dictionary
from cdpr_profiles.errors import ProfileError
from cdpr_rt.core.clock import PacedClock
from cdpr_sim_bus.bus.gateways import join
from cdpr_sim_bus.bus.hub import encode
from cdpr_sim_bus.cia402.faults import CELL_OFF, CUT, FAULTS, MEND, SILENCE, SLIP, Fault
from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.frame import FRAME_BYTES
from cdpr_tools.errors import BadInputError, WorkFailedError, raised_as

_OBJECT: Final = 0x2F00
_STATUSWORD, _ERROR_CODE = 0x6041, 0x603F
_FAULT_MASK, _FAULT = 0x4F, 0x08
_VIRTUAL: Final = ("vcan", "vxcan")
"""Prefixes of the names of virtual CAN interfaces on Linux, to which no drive is wired."""
_ANSWER_BYTES: Final = 1 << 18
_ANSWER_S: Final = 10.0
_SHOWN: Final = (CUT, SLIP, CELL_OFF)
"""Lasting faults that can be read by object 2F00h; silence shows itself."""


def named_fault(what: str) -> Fault:
    """Return a fault by its name; raises BadInputError for an unknown one."""
    if what not in FAULTS:
        raise BadInputError(f"FAULT {what!r}; allowed: {', '.join((*FAULTS, MEND))}")
    return FAULTS[what]


def amount_of(what: str, text: str | None) -> float:
    """Return the amount of a fault that a text gives, or the usual one; raises BadInputError."""
    fault = named_fault(what)
    try:
        value = None if text is None else float.fromhex(text) if "x" in text else float(text)
    except ValueError:
        value = math.nan
    try:
        return fault.amount(value)
    except ValueError as error:
        raise BadInputError(f"{what} {text}: {error}") from None


class SimulatorChannel:
    """Orders to a simulator and questions about its truth, beside the frames of a bus.

    No controller may use it. A context manager. Raises BadInputError if no such bus runs.
    """

    def __init__(self, bus: BusUrl) -> None:
        with raised_as(BadInputError, BusSetupError):
            self._sock = join(bus.channel)
        self._bus = bus
        self._sock.settimeout(_ANSWER_S)

    def ask(self, key: str, value: Any = True) -> Any:
        """Return the answer to a request.

        Raises BadInputError if the simulator rejects it, WorkFailedError if it does not answer.
        """
        try:
            self._sock.send(encode({key: value}))
            while True:
                packet = self._sock.recv(_ANSWER_BYTES)
                if not packet:
                    raise WorkFailedError(f"{self._bus}: the simulator has ended")
                if len(packet) != FRAME_BYTES:
                    answer = parse_json(packet, str(self._bus))
                    break
        except (OSError, ProfileError) as error:
            raise WorkFailedError(f"{self._bus}: the simulator does not answer: {error}") from None
        if "error" in answer:
            raise BadInputError(str(answer["error"]))
        return answer[key]

    def close(self) -> None:
        """Close the connection."""
        self._sock.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class FaultAccess(Protocol):
    """Access to the faults of one axis; a context manager. Methods raise WorkFailedError."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...

    def inject(self, what: str, value: str | None) -> float:
        """Inject a fault, or mend; return the amount used. Raises BadInputError."""

    def injected(self) -> list[str]:
        """Return the faults that last, as text."""

    def fault_code(self) -> int:
        """Return the error code of a drive in fault; 0 if it is not in fault or does not answer."""


def fault_access(robot: Robot, axis: RobotAxis, url: BusUrl) -> FaultAccess:
    """Return the access to the faults of an axis.

    Raises BadInputError if the bus does not exist, or if it could be a real one.
    """
    if url.interface == "simbus":
        return _OrderAccess(robot, axis, url)
    return _ObjectAccess(robot, axis, url)


class _OrderAccess:
    """Faults by orders beside the bus, whichever program runs the robot."""

    def __init__(self, robot: Robot, axis: RobotAxis, url: BusUrl) -> None:
        self._robot, self._number = robot, robot.axes.index(axis) + 1
        self._channel = SimulatorChannel(url)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._channel.close()

    def inject(self, what: str, value: str | None) -> float:
        amount = None
        if what != MEND:
            amount = amount_of(what, value)
            _require_cells(self._robot, what)
        order = {"fault": what, "axis": self._number, "value": amount}
        return float(self._channel.ask("fault", order)["value"])

    def injected(self) -> list[str]:
        return [
            FAULTS[one["fault"]].text(one["value"])
            for one in self._channel.ask("broken")
            if one["axis"] == self._number or (one["axis"] is None and self._number == 1)
        ]

    def fault_code(self) -> int:
        drive = self._channel.ask("truth")["drives"][self._number - 1]
        return int(drive["error_code"]) if drive["state"] == "fault" else 0


class _ObjectAccess:
    """Faults by object 2F00h, which a master on a virtual CAN interface can write."""

    def __init__(self, robot: Robot, axis: RobotAxis, url: BusUrl) -> None:
        self._robot, self._axis, node = robot, axis, axis.winch.node_id
        if not (url.interface == "socketcan" and url.channel.startswith(_VIRTUAL)):
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

    def inject(self, what: str, value: str | None) -> float:
        if what == MEND:
            with self._errors():
                for name in (SILENCE, *_SHOWN):
                    self._write(FAULTS[name].sub, 0)
            return 0
        fault, amount = named_fault(what), amount_of(what, value)
        _require_cells(self._robot, what)
        if not fault.sub and what != "pre-operational":
            raise BadInputError(f"{what}: allowed only on a bus simbus:NAME")
        with self._errors():
            if fault.sub:
                self._write(fault.sub, int(amount))
            else:
                self._network.stop_process_data(self._axis.winch.node_id)
        return amount

    def injected(self) -> list[str]:
        node, found = self._axis.winch.node_id, []
        with self._errors():
            for name in _SHOWN:
                try:
                    amount = self._network.read_int(node, _OBJECT, FAULTS[name].sub, attempts=1)
                except SdoTimeoutError:
                    return [f"{SILENCE}, which hides any other fault"]
                found += [FAULTS[name].text(amount)] * bool(amount)
        return found

    def fault_code(self) -> int:
        node = self._axis.winch.node_id
        with self._errors(), suppress(SdoTimeoutError):
            if self._network.read_int(node, _STATUSWORD, attempts=1) & _FAULT_MASK == _FAULT:
                return self._network.read_int(node, _ERROR_CODE)
        return 0

    def _write(self, sub: int, value: int) -> None:
        self._network.write(self._axis.winch.node_id, _OBJECT, sub, value)

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except (SdoError, BusError) as error:
            raise WorkFailedError(f"axis {self._axis.name!r}: {error}") from error


def _require_cells(robot: Robot, what: str) -> None:
    if what == CELL_OFF and robot.tension_sensors is None:
        raise BadInputError(
            f"{what}: {robot.name} has no load cells; allowed only for a robot whose file has "
            "tension_sensors"
        )
