"""Why motions, and recordings, ended, out of what a recording tells."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable
from typing import Any, Final

from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.service.recordings.recording_reader import CLOSED, RecordingReader
from cdpr_tools.client.dead_loop import DEAD

_EARLY_ns: Final = 50_000_000
"""A reason may be stamped so long before the row in which its reaction is seen."""

WHILE_ACTIVE: Final = "the recording ends while the robot was active"
LOOP_ENDED: Final = "the control loop ended without a stop"
_WRITER_ENDED: Final = "its writer was ended, or still writes"


class Reasons:
    """The reasons that a loop gave, each stamped when its status was seen: soon after it reacted.

    Stamps are of CLOCK_MONOTONIC, ns.
    """

    def __init__(self, events: Iterable[tuple[int, dict[str, Any]]]) -> None:
        """Take events, each with its stamp."""
        self._told = sorted(
            (at_ns, str(event["text"])) for at_ns, event in events if is_reason(event)
        )

    def after(self, at_ns: int, next_ns: float = float("inf")) -> str:
        """Return the reason of a reaction at `at_ns`, the next one being at `next_ns`; "" for none.

        A state that follows on a reaction has that one's reason.
        """
        k = bisect_left(self._told, (at_ns - _EARLY_ns, ""))
        if k < len(self._told) and self._told[k][0] < next_ns - _EARLY_ns:
            return self._told[k][1]
        return ""


def is_reason(event: dict[str, Any]) -> bool:
    """Whether an event is a reason: one of the service, or one seen in the loop's status."""
    return event.get("kind") == "reason" or ("limit" in event and "cycle" not in event)


def is_fault(event: dict[str, Any]) -> bool:
    """Whether an event is a limit's reaction, or a state that became a fault."""
    of_row = "reaction" in event and "cycle" in event
    return of_row and (event["reaction"] > Reaction.CLAMP or "state fault" in event["text"])


def why_while_active(reader: RecordingReader, last_state: int) -> str:
    """Return why a recording, all of it read, ends in a row of state `last_state` that has power.

    "" where that is none, or another file goes on from there.
    """
    if last_state != LoopState.ACTIVE:
        return ""
    if any(status.get("state") == DEAD for status in reader.status):
        return LOOP_ENDED
    next_name = f"{reader.metadata.get('session')}-{reader.part + 1:03d}.mcap"
    if reader.ended == CLOSED or reader.path.with_name(next_name).exists():
        return ""
    return _WRITER_ENDED
