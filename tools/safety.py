"""A safety I/O beside a session on a bus: power only behind it, brakes with the power stage."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cdpr_rt.clock import Clock
from cdpr_rt.state_file import StateFileError, read_state, state_path
from drivers.modbus.safety_io import SafetyIo
from profiles.safety_io import load_safety_io
from tools.output import Output

if TYPE_CHECKING:  # it brings a compiler along, which a look at the I/O does without
    from cdpr_rt.executive import Executive

# a brake that does not follow trips by itself
_FOR_EVER_S = 1e5


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

    def release_brakes(self, executive: Executive) -> None:
        """Release the brakes once the drives hold the axes; raises TripError, SafetyIoError."""
        if self.braked:
            self.io.release_brakes(*self.braked)
            executive.step(lambda: self._are(True), _FOR_EVER_S, "the release of the brakes")

    def apply_brakes(self, executive: Executive) -> None:
        """Apply the brakes before the drives let go; raises TripError, SafetyIoError."""
        if self.braked:
            self.io.apply_brakes(*self.braked)
            executive.step(lambda: self._are(False), _FOR_EVER_S, "the brakes to be applied")

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

    def _are(self, released: bool) -> bool:
        told = self.io.state.brakes_released
        return all(told[axis] == released for axis in self.braked)


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


@contextmanager
def open_safety(
    reference: str | None, out: Output, node_ids: Collection[int], clock: Clock
) -> Iterator[SessionSafety | None]:
    """Connect to a safety I/O and close its contactor, for as long as the block runs.

    The brakes of `node_ids` go with the session; others are left to the caller.

    None where none is named. Raises ModbusError for an I/O that does not answer and SafetyIoError
    where it forbids to energise, or did not open its contactor at the end.
    """
    if reference is None:
        yield None
        return
    with connect(reference, clock) as io:
        io.energise()
        session = SessionSafety(io, node_ids)
        out.note(f"{io.name}: the chain is closed, the contactor is on")
        if node_ids and any(axis.brake for axis in io.profile.axes) and not session.braked:
            out.note("none of its brakes belongs to this session's nodes (key node_id): none moves")
        yield session
