"""A safety I/O beside a session on a bus: power only behind it, brakes with the power stage."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any, Final

from cdpr_drivers.modbus.safety_io import SafetyIo
from cdpr_profiles.devices.safety_io import load_safety_io
from cdpr_rt.core.clock import Clock
from cdpr_rt.state_file import StateFileError, read_state, state_path

CLOSED: Final = "the chain is closed, the contactor is on"


class SessionSafety:
    """The safety I/O of a session and the axes whose brakes belong to it."""

    def __init__(self, io: SafetyIo, node_ids: Collection[int]) -> None:
        self.io = io
        nodes = set(node_ids)
        self.braked: Final = tuple(
            axis.axis
            for axis in io.profile.axes
            if axis.brake is not None and axis.node_id in nodes
        )

    def drop_brakes(self) -> None:
        """Have the brakes applied as soon as the session ends, without waiting for them."""
        if self.braked:
            self.io.apply_brakes(*self.braked)

    @property
    def tripped(self) -> str:
        """Why the safety I/O ends the motion, or an empty text."""
        return self.io.alarm() or self.io.stop_reason()

    def cause(self, reason: str) -> str:
        """Return why a motion ended, for which the bus gives `reason`.

        An open chain takes the drives' power, so that their faults are heard before the next poll.
        """
        clock = self.io.clock
        clock.wait(lambda: self.tripped, clock.now_s + 3.0 * self.io.profile.poll_period_s)
        tripped = self.tripped
        return reason if not tripped or tripped in reason else f"{tripped} (besides: {reason})"


def trip_file(reference: str) -> Path:
    """Return the file in which a safety I/O's trip is kept until it is acknowledged.

    One for each place, as the same profile may be that of several devices. Raises ProfileError.
    """
    profile = load_safety_io(reference)
    name = Path(reference.partition("@")[0]).stem
    return state_path("safety-io", f"{name}.{profile.host}.{profile.port}")


def kept_trip(reference: str) -> dict[str, Any] | None:
    """Return the trip that is kept (reason, date), None where there is none; tolerates damage."""
    try:
        return read_state(trip_file(reference))
    except StateFileError as error:
        return {"reason": str(error), "date": None}


def connect(reference: str, clock: Clock) -> SafetyIo:
    """Return the safety I/O that `reference` names, not opened yet; raises ProfileError."""
    return SafetyIo(load_safety_io(reference), clock, trip_file(reference))
