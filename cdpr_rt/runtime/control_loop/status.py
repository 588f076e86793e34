"""The loop's status, published when it changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from cdpr_rt.core.shared_block import SharedBlockError
from cdpr_rt.runtime.control_loop.engine import Engine
from cdpr_rt.runtime.control_loop.transition_runner import TransitionRunner
from cdpr_rt.runtime.control_loop.transitions import Transitions

_CHECK_NS = 500_000_000
# a character may take a dozen bytes in JSON
_MOST_TEXT = 500
_AFTERWARDS = ("hold", "idle")
"""What runs once another program has been ended."""


class StatusPage:
    """Writes the status into the shared memory, at every change of state and twice a second."""

    def __init__(
        self,
        engine: Engine,
        runner: TransitionRunner,
        transitions: Transitions,
        clock_ns: Callable[[], int],
    ) -> None:
        self._engine, self._life = engine, engine.life
        self._runner = runner
        self._transitions = transitions
        self._clock_ns = clock_ns
        self._checked_ns = 0
        self._written: dict[str, Any] = {}
        self._failure = ""
        """Program that failed last and why, until another one moves."""

    def update(self) -> None:
        """Publish what has changed; called every turn."""
        now_ns = self._clock_ns()
        if self._life.changed or now_ns - self._checked_ns > _CHECK_NS:
            self._life.changed = False
            self._checked_ns = now_ns
            self.publish()

    def publish(self) -> None:
        """Write the status where it differs from the last one."""
        status = self._status()
        if status == self._written:
            return
        try:
            self._engine.block.write_status(status)
        except (SharedBlockError, TypeError, ValueError):  # the program's progress is too long
            self._publish_short(status)
        self._written = status

    def _publish_short(self, status: Mapping[str, Any]) -> None:
        """Write only what is short in any case; where that fails too, readers keep the last one.

        A loop does not end because its status cannot be published.
        """
        less: dict[str, Any] = {
            "program_progress": {},
            "failure": str(status["failure"])[:_MOST_TEXT],
            "buses": {},
            "notices": [],
            "check": {},
            "reason": str(status["reason"])[:_MOST_TEXT],
            "reason_limit": None,
            "safety": str(status["safety"])[:_MOST_TEXT],
        }
        with suppress(SharedBlockError, TypeError, ValueError):
            self._engine.block.write_status({**status, **less})

    def _progress(self) -> dict[str, Any]:
        try:
            return dict(self._engine.program.progress())
        except Exception as error:  # nor does a motion
            return {"error": f"{type(error).__name__}: {error}"}

    def _note_failure(self, progress: Mapping[str, Any]) -> None:
        """Keep why a program fails: its client ends it then, and its progress is gone."""
        name, trouble = self._engine.program.name, progress.get("trouble")
        if trouble and progress.get("done") != 1.0:
            self._failure = f"{name}: {trouble}"
        elif name not in _AFTERWARDS:
            self._failure = ""

    def _status(self) -> dict[str, Any]:
        engine, life = self._engine, self._life
        progress = self._progress()
        self._note_failure(progress)
        lateness = None if engine.cycle is None else engine.cycle.lateness
        return {
            "state": life.state.label,
            "since_ns": life.since_ns,
            "reason": life.reason,
            "reason_limit": life.details,
            "program": engine.program.name,
            "program_number": engine.program_number,
            "program_progress": progress,
            "failure": self._failure,
            "driving": engine.driving,
            "reacting": engine.reacting.label,
            "busy": self._runner.busy,
            "read_only": engine.machine.read_only,
            "lockstep": engine.cycle is not None and engine.cycle.device.lockstep,
            "notices": [*engine.notices, *engine.parts.notices(), *engine.machine.notices],
            "safety": engine.machine.safety,
            "buses": engine.machine.bus_state(),
            "check": self._transitions.check_result,
            "count": {
                "missed": engine.missed,
                "cycles": 0 if engine.cycle is None else engine.cycle.device.feedback.cycle,
                "late": 0 if lateness is None else lateness.late,
                "worst_late_s": 0.0 if lateness is None else lateness.worst_s,
            },
        }
