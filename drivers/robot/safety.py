"""A safety I/O for a session on a bus: it must allow power; brakes follow the power stage."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from cdpr_drivers.modbus.safety_io import SafetyIo
from cdpr_profiles.robot_limits import Limit
from cdpr_profiles.safety_io import load_safety_io
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.fault import Fault
from cdpr_rt.state_file import StateFileError, read_state, state_path

CLOSED: Final = "the chain is closed, the contactor is on"


class SessionSafety:
    """The safety I/O of a session and the axes whose brakes it controls; the loop queries it."""

    def __init__(self, io: SafetyIo, node_ids: Sequence[int]) -> None:
        self.io = io
        self.node_ids = node_ids
        """Nodes of the axes, in their order."""
        self.braked: Final = tuple(
            axis.axis
            for axis in io.profile.axes
            if axis.brake is not None and axis.node_id in node_ids
        )

    def drop_brakes(self) -> None:
        """Apply the brakes as soon as the session ends, without waiting for them."""
        if self.braked:
            self.io.apply_brakes(*self.braked)

    def fault(self) -> Fault | None:
        """Return why the safety I/O ends the motion; None if it does not."""
        limit, trip = Limit.SAFETY_ALARM, self.io.alarm()
        if not trip:
            limit, trip = Limit.SAFETY_STOP, self.io.stop_reason()
        if not trip:
            return None
        nodes = {axis.axis: axis.node_id for axis in self.io.profile.axes}
        node = nodes.get(trip.axis)
        found = [i for i, known in enumerate(self.node_ids) if known == node]
        i = found[0] if len(found) == 1 else -1  # with several buses a node id is ambiguous
        return Fault(limit, i, trip.code, self.io.name, detail=trip)

    def await_trip(self) -> Fault | None:
        """Poll the safety I/O, then return why it ends the motion; None if it does not.

        An open chain cuts the drives' power, so their faults arrive before the next poll.
        """
        clock = self.io.clock
        clock.wait(self.fault, clock.now_s + 3.0 * self.io.profile.poll_period_s)
        return self.fault()


def trip_file(reference: str) -> Path:
    """Return the file that keeps a safety I/O's trip until it is acknowledged.

    Each reference has its own file, because several devices may share a profile. Raises
    ProfileError.
    """
    profile = load_safety_io(reference)
    name = Path(reference.partition("@")[0]).stem
    return state_path("safety-io", f"{name}.{profile.host}.{profile.port}")


def kept_trip(reference: str) -> dict[str, Any] | None:
    """Return the stored trip (reason, date), or None; for a damaged file, its error."""
    try:
        return read_state(trip_file(reference))
    except StateFileError as error:
        return {"reason": str(error), "date": None}


def connect(reference: str, clock: Clock) -> SafetyIo:
    """Return the safety I/O that `reference` names, not yet opened; raises ProfileError."""
    return SafetyIo(load_safety_io(reference), clock, trip_file(reference))
