"""Take orders for faults at a bus time, beside the bus, and show the truth to a judge."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.cia402.faults import FAULTS, MEND, Fault
from cdpr_sim_bus.errors import RequestError

if TYPE_CHECKING:
    from cdpr_sim_bus.cia402.drive import SimDrive

_KEYS = ("fault", "axis", "value", "at_s")
_LACKS = {"space": "platform in space", "board": "physics board"}


@dataclass
class InjectedRecord:
    """A fault that was injected; axes count from 1, times are bus times of the axis' bus."""

    fault: str
    axis: int | None
    value: float
    at_s: float
    ended_s: float | None
    """When it was mended or ended; None while it lasts."""


class FaultBench:
    """Takes orders for faults through the sockets of the buses, and shows the truth.

    The requests are `fault`, `broken` and `truth`; docs/reference/wire.md describes them.
    """

    def __init__(self, drives: Sequence[SimDrive]) -> None:
        self._drives = drives
        self._hubs: list[Hub] = []
        self._records: list[InjectedRecord] = []
        for i, drive in enumerate(drives):
            drive.fault_injection.noted = self._recorder(i)

    def connect(self, hubs: Sequence[Hub]) -> None:
        """Accept fault commands on the buses of the drives."""
        by_node = {id(node): hub for hub in hubs for node in hub.nodes}
        self._hubs = [by_node[id(drive)] for drive in self._drives]
        for drive, hub in zip(self._drives, self._hubs, strict=True):
            drive.fault_injection.mates = [
                other.fault_injection
                for other, its in zip(self._drives, self._hubs, strict=True)
                if its is hub
            ]
        for hub in hubs:
            hub.requests = {
                "fault": self._order,
                "broken": lambda _: self._broken(),
                "truth": lambda _: self._truth(),
            }

    # -- orders

    def _order(self, wanted: Any) -> dict[str, Any]:
        """Plan or inject a fault: {"fault", "axis", "value", "at_s"}; only `fault` is required.

        Without a value, the usual one is taken; 0 mends this fault. Return the order with the
        values used. Raises RequestError.
        """
        if not isinstance(wanted, dict) or not {"fault"} <= wanted.keys() <= set(_KEYS):
            raise RequestError(f"fault: expected an object with the keys {', '.join(_KEYS)}")
        name, axis, value = wanted["fault"], wanted.get("axis"), wanted.get("value")
        fault = FAULTS.get(name) if isinstance(name, str) else None
        if fault is None and name != MEND:
            raise RequestError(f"fault {name!r}; allowed: {', '.join((*FAULTS, MEND))}")
        places = self._places(axis, fault)
        at_s = self._time(self._hubs[places[0]], wanted.get("at_s"))
        amount = 0.0
        if fault is not None:
            amount = self._amount(fault, value)
            injection = self._drives[places[0]].fault_injection
            if not injection.has(needs := fault.needs):
                raise RequestError(f"{name}: the robot has no {_LACKS.get(needs, needs)}")
            self._hubs[places[0]].act(at_s, partial(injection.apply, fault, amount))
        elif value is not None:
            raise RequestError(f"{MEND}: takes no value")
        else:
            for i in places:
                self._hubs[i].act(at_s, partial(self._mend, i))
        return {"fault": name, "axis": axis, "value": amount, "at_s": at_s}

    def _places(self, axis: object, fault: Fault | None) -> list[int]:
        """Return the indices, from 0, of the drives that a fault or `MEND` concerns."""
        n = len(self._drives)
        if fault is None and axis is None:
            return list(range(n))
        if (fault is not None and fault.of_robot) or (axis is None and n == 1):
            return [0]
        if not isinstance(axis, int) or isinstance(axis, bool) or not 1 <= axis <= n:
            raise RequestError(f"axis {axis}; allowed: 1 to {n}")
        return [axis - 1]

    @staticmethod
    def _amount(fault: Fault, value: object) -> float:
        if value == 0 and fault.lasts:
            return 0.0
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise RequestError(f"{fault.name}: value {value!r} is not a number")
        try:
            return fault.amount(value)
        except ValueError as error:
            raise RequestError(f"{fault.name} {value}: {error}") from None

    @staticmethod
    def _time(hub: Hub, at_s: object) -> float:
        now_s = hub.now_s
        if at_s is None:
            return now_s
        if isinstance(at_s, bool) or not isinstance(at_s, int | float) or not at_s >= now_s:
            raise RequestError(f"at_s {at_s}; allowed: bus times from now, {now_s}")
        return float(at_s)

    def _mend(self, i: int) -> None:
        injection = self._drives[i].fault_injection
        for name in injection.broken():
            injection.apply(FAULTS[name], 0)

    def _recorder(self, i: int) -> Callable[[Fault, float], None]:
        def note(fault: Fault, amount: float) -> None:
            now_s = self._drives[i].axis.time
            axis = None if fault.of_robot else i + 1
            for record in self._records:
                if (record.fault, record.axis, record.ended_s) == (fault.name, axis, None):
                    record.ended_s = now_s
            if amount:
                ended_s = None if fault.lasts else now_s
                self._records.append(InjectedRecord(fault.name, axis, amount, now_s, ended_s))

        return note

    # -- the truth

    def _broken(self) -> list[dict[str, Any]]:
        return [
            {"fault": name, "axis": i, "value": amount}
            for i, drive in enumerate(self._drives, 1)
            for name, amount in drive.fault_injection.broken().items()
        ]

    def _truth(self) -> dict[str, Any]:
        body = self._drives[0].axis.body
        for record in self._records:  # some faults end without being mended
            injection = self._drives[(record.axis or 1) - 1].fault_injection
            if record.ended_s is None and record.fault not in injection.broken():
                record.ended_s = self._drives[(record.axis or 1) - 1].axis.time
        return {
            "time_s": max(hub.now_s for hub in self._hubs),
            "drives": [drive.truth() for drive in self._drives],
            "platform": None if body is None else body.truth(),
            "faults": [asdict(record) for record in self._records],
        }
