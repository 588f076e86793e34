"""What the loop says of itself, published when it changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from cdpr_rt.runtime.shared_block import SharedBlockError

if TYPE_CHECKING:
    from cdpr_rt.runtime.loop import ControlLoop

_LOOK_NS = 500_000_000
# a letter may take a dozen bytes in JSON
_MOST_TEXT = 500


class StatusPage:
    """Writes the status into the shared memory: at a change, and now and then what has grown."""

    def __init__(self, loop: ControlLoop, clock_ns: Callable[[], int]) -> None:
        self._loop = loop
        self._clock_ns = clock_ns
        self.check: dict[str, Any] = {}
        """What the last check of the bus has seen."""
        self._changed = True
        self._looked_ns = 0
        self._written: dict[str, Any] = {}
        self._told = (loop.life.state, "")

    def touch(self) -> None:
        """Tell that something may have changed."""
        self._changed = True

    def look(self) -> None:
        """Publish what has changed; called every turn."""
        life = self._loop.life
        now_ns = self._clock_ns()
        told = self._told
        if life.state is not told[0] or life.reason is not told[1]:
            self._told = life.state, life.reason
            self._changed = True
        if self._changed or now_ns - self._looked_ns > _LOOK_NS:
            self._changed = False
            self._looked_ns = now_ns
            self.publish()

    def publish(self) -> None:
        """Write the status where it is another than before."""
        status = self._status()
        if status == self._written:
            return
        try:
            self._loop.block.write_status(status)
        except (SharedBlockError, TypeError, ValueError):  # a program that tells too much of itself
            self._publish_less(status)
        self._written = status

    def _publish_less(self, status: Mapping[str, Any]) -> None:
        """Write what is short in any case; where even that cannot be, readers see the one before.

        No loop ends because it cannot be told of.
        """
        less: dict[str, Any] = {
            "program_progress": {},
            "buses": {},
            "notices": [],
            "check": {},
            "reason": str(status["reason"])[:_MOST_TEXT],
            "reason_limit": None,
            "safety": str(status["safety"])[:_MOST_TEXT],
        }
        with suppress(SharedBlockError, TypeError, ValueError):
            self._loop.block.write_status({**status, **less})

    def _progress(self) -> dict[str, Any]:
        try:
            return dict(self._loop.program.progress())
        except Exception as error:  # no motion ends because it cannot be told of
            return {"error": f"{type(error).__name__}: {error}"}

    def _status(self) -> dict[str, Any]:
        loop, life = self._loop, self._loop.life
        lateness = None if loop.cycle is None else loop.cycle.lateness
        return {
            "state": life.state.label,
            "since_ns": life.since_ns,
            "reason": life.reason,
            "reason_limit": life.details,
            "program": loop.program.name,
            "program_number": loop.program_number,
            "program_progress": self._progress(),
            "driving": loop.driving,
            "reacting": loop.reacting.label,
            "busy": loop.busy,
            "read_only": loop.machine.read_only,
            "lockstep": loop.cycle is not None and loop.cycle.device.lockstep,
            "notices": [*loop.notices, *loop.machine.notices],
            "safety": loop.machine.safety,
            "buses": loop.machine.bus_state(),
            "check": self.check,
            "count": {
                "missed": loop.missed,
                "cycles": 0 if loop.cycle is None else loop.cycle.device.feedback.cycle,
                "late": 0 if lateness is None else lateness.late,
                "worst_late_s": 0.0 if lateness is None else lateness.worst_s,
            },
        }
