"""Planning of paths for the service, in a process that does not keep the service from its work."""

from __future__ import annotations

import asyncio
import json
import tempfile
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from cdpr_rt.errors import ControlError

Plan = Callable[[Path, dict[str, Any]], Awaitable[tuple[int, str]]]
"""Plans a file with the options that came with it; returns the exit status and a JSON text."""


class PathRefusedError(ControlError):
    """A path that the robot cannot follow, or a file that cannot be read."""


class PlannerBusyError(ControlError):
    """No path can be planned now."""


class PathPlanner:
    """Plans one path at a time."""

    def __init__(self) -> None:
        self.work: Plan | None = None
        """Set by who has the robot's file; without it nothing is planned."""
        self._busy = asyncio.Lock()

    async def plan(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Return the figures of a planned path, its name as `plan` among them.

        Raises PathRefusedError, and PlannerBusyError while another one is planned.
        """
        if self.work is None:
            raise PlannerBusyError("this daemon plans no paths")
        if self._busy.locked():
            raise PlannerBusyError("another path is being planned")
        async with self._busy:
            with tempfile.TemporaryDirectory(prefix="cdpr-path-") as folder:
                file = Path(folder) / wanted["name"]
                file.write_text(wanted["text"], encoding="utf-8")
                status, text = await self.work(file, wanted)
        try:
            told = json.loads(text)
        except ValueError:
            raise PlannerBusyError(f"planning ended with status {status}") from None
        if status or not isinstance(told, dict):
            error = str(told.get("error", "refused")) if isinstance(told, dict) else "refused"
            raise PathRefusedError(error.replace(f"{file}", wanted["name"]))
        told["file"] = wanted["name"]
        return told
