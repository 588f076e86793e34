"""Waiting for a daemon that is still starting."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from cdpr_tools.client.client import Daemon, answers
from cdpr_tools.client.dead_loop import DEAD, death_text
from cdpr_tools.daemon.launcher_file import launcher_runs
from cdpr_tools.daemon.paths import LAUNCHER_SUFFIX, find_launcher_files
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output

# the first start on a machine compiles the control loop, a slow one for minutes
_START_S, _ASK_S, _TELL_S = 600.0, 0.2, 10.0


def await_socket(robot: str | None, unix: Path | None, out: Output) -> None:
    """Wait until a daemon whose launcher runs can be connected to; not where none does.

    Raises WorkFailedError where it takes too long.
    """
    waiting = _Waiting(out)
    while not answers(robot, unix):
        marks = find_launcher_files(robot)
        if unix is not None:
            marks = [unix.with_suffix(LAUNCHER_SUFFIX)]
        if not any(map(launcher_runs, marks)):
            return  # nor is one to be expected
        waiting.go_on("its simulated drives and its processes come up")


def await_start(daemon: Daemon, out: Output) -> None:
    """Wait until the drives have booted for the first time, or why they have not is known.

    Raises WorkFailedError where it takes too long, or where the control loop has died.
    """
    waiting = _Waiting(out)
    while what := _still(status := daemon.get("/status"), waiting.waited):
        waiting.go_on(what)
    if status["state"] == DEAD:
        raise WorkFailedError(death_text(status))


class _Waiting:
    """Tells now and then that a daemon is still starting."""

    def __init__(self, out: Output) -> None:
        self._out = out
        self._began_s = self._tell_s = time.monotonic()
        self.waited = False

    def go_on(self, what: str) -> None:
        """Wait a moment for `what`; raises WorkFailedError where it takes too long."""
        self.waited = True
        now_s = time.monotonic()
        taken_s = now_s - self._began_s
        if taken_s > _START_S:
            raise WorkFailedError(f"the daemon has not started within {_START_S:g} s")
        if now_s >= self._tell_s:
            after = f" (waiting for {taken_s:.0f} s)" if taken_s >= 1.0 else ""
            self._out.note(f"the daemon is still starting: {what}{after} ...")
            self._tell_s += _TELL_S
        time.sleep(_ASK_S)


def _still(status: dict[str, Any], waited: bool) -> str:
    """Return what is going on in a daemon that is not up yet, "" in one that is.

    One that has been waited for goes on to check its bus; another may stay inactive.
    """
    if status.get("state") == "starting":
        return "its control loop is loaded, and compiled where this machine runs it first"
    booting = ("unconfigured", "inactive") if waited else ("unconfigured",)
    if status.get("state") in booting and not status.get("reason", "none yet"):
        return "its drives are booting"
    return ""
