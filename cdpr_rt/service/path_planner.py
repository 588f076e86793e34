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


class PlannerBusyError(ControlError):
    """No path can be planned now."""


class PathPlanRunner:
    """Plans one path at a time; who has asked looks at `job` until it is not `planning`."""

    def __init__(self) -> None:
        self.work: Plan | None = None
        """Set by who has the robot's file; without it nothing is planned."""
        self.job: dict[str, Any] = {"number": 0, "planning": False, "error": None, "plan": None}
        """The last one: `error` says why the robot cannot follow it, `plan` is its name if it can.
        """
        self._task: asyncio.Task[None] | None = None
        self._cancelled = ""

    def begin(self, request: dict[str, Any]) -> dict[str, Any]:
        """Begin to plan a file; returns the job. Raises PlannerBusyError while one is planned."""
        if self.work is None:
            raise PlannerBusyError("this daemon plans no paths")
        if self.job["planning"]:
            raise PlannerBusyError("another path is being planned")
        number = self.job["number"] + 1
        self.job = {"number": number, "planning": True, "error": None, "plan": None}
        self._cancelled = ""
        self._task = asyncio.create_task(self._plan(self.work, request))
        return self.job

    def cancel(self, why: str) -> None:
        """Have a path that is being planned not be followed, as a stop was asked for since."""
        if self.job["planning"]:
            self._cancelled = why

    async def _plan(self, work: Plan, request: dict[str, Any]) -> None:
        answer: dict[str, Any] = {"error": "planning was ended"}
        try:
            with tempfile.TemporaryDirectory(prefix="cdpr-path-") as folder:
                file = Path(folder) / request["name"]
                file.write_text(request["text"], encoding="utf-8")
                status, text = await work(file, request)
            answer = _read(status, text.replace(str(file), request["name"]))
            if self._cancelled:
                answer = {"error": f"not followed: {self._cancelled} while it was planned"}
        except TimeoutError:  # an OSError too, one without words
            answer = {"error": "cannot be planned: takes too long; divide the path"}
        except OSError as error:
            answer = {"error": f"cannot be planned: {error.strerror}"}
        finally:
            self.job = {**answer, "number": self.job["number"], "planning": False}
            self.job.setdefault("plan", None)
            self.job.setdefault("error", None)


def _read(status: int, text: str) -> dict[str, Any]:
    """Return the result of the process."""
    try:
        answer = json.loads(text)
    except ValueError:
        answer = None
    if not isinstance(answer, dict):
        return {"error": f"planning ended with status {status}: out of memory? divide the path"}
    if status:
        return {"error": str(answer.get("error", "refused"))}
    return answer
