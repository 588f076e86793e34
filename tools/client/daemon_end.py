"""The end of a daemon: request it, wait for it, and report the power of the drives."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from cdpr_rt.core.shared_block import SharedBlockError
from cdpr_rt.service.link import STARTING
from cdpr_tools.client.client import Daemon
from cdpr_tools.client.status_text import (
    DEAD,
    ProgressNotes,
    after_stop_text,
    has_died,
    power_text,
    unheard_axes,
)
from cdpr_tools.daemon.estop import (
    end_leftover_processes,
    end_starting,
    launcher_left,
    status_in_memory,
)
from cdpr_tools.daemon.loop_file import LoopFile
from cdpr_tools.errors import NoDaemonError, WorkFailedError
from cdpr_tools.output import Output

_WATCH_S = 0.2
_END_S = 90.0
"""Longest time until a daemon has ended, without the time to lower a platform."""
_LAUNCHER_S = 10.0
"""Once the loop has ended, a working launcher ends the service within this time."""


def end_daemon(daemon: Daemon, out: Output, socket: Path | None) -> None:
    """Request the end of the daemon and wait for it.

    Raises WorkFailedError if it does not end, or if a drive may still have power.

    `socket` is None for a daemon on another machine, which is known only by its answers.
    """
    status, description = _status_before_end(daemon, socket)
    if status.get("state") == STARTING and socket is not None and (lines := end_starting(socket)):
        out.say(*lines)
        return
    had_died, ended, dies = has_died(status), status, ""
    end_s = _END_S + float(description.get("lowering_s", 0.0))
    if lines := _ask_to_end(daemon, socket):
        out.say(*lines)
        return
    notes, deadline = ProgressNotes(out, status), time.monotonic() + end_s
    alone_at = deadline
    if status["state"] == "active":
        out.note("stopping: the robot brakes, then the power goes off ...")
    while time.monotonic() < deadline:
        try:
            status = daemon.get("/status")
        except NoDaemonError as error:
            if status["state"] != DEAD and _may_run(socket, error):
                time.sleep(_WATCH_S)
                continue
            ended_text = "; ".join(filter(None, (after_stop_text(ended), dies)))
            if had_died or dies or unheard_axes(ended):
                raise WorkFailedError(ended_text) from None
            out.say(ended_text)
            return
        if has_died(status) and not had_died and not dies:
            # If drives do not confirm, the loop ends with an error, and the service stays to report
            # it. Otherwise clients may see the end of the loop before the service has also ended.
            dies = str(status["reason"])
            with suppress(NoDaemonError):  # the next request detects it
                daemon.post("/shutdown")
        if status["state"] == DEAD:  # the launcher ends the other processes
            alone_at = min(alone_at, time.monotonic() + _LAUNCHER_S)
            if time.monotonic() > alone_at:
                raise WorkFailedError(_without_launcher(daemon, status))
        if not had_died:
            if status["state"] != DEAD:  # meanwhile a drive may have stopped answering
                ended = status
            notes(status)
        time.sleep(_WATCH_S)
    raise WorkFailedError(f"the daemon still runs {end_s:g} s after it was asked to end")


def _status_before_end(
    daemon: Daemon, socket: Path | None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return status and description; do not wait for a service that hangs or is flooded."""
    if socket is not None:
        with suppress(WorkFailedError, OSError, SharedBlockError):
            return status_in_memory(LoopFile.read(LoopFile.beside(socket)))
    return daemon.get("/status"), daemon.get("/description")


def _ask_to_end(daemon: Daemon, socket: Path | None) -> list[str]:
    """Request the end of the daemon; end it if its service does not obey, and return how."""
    try:
        daemon.post("/shutdown")
    except NoDaemonError as error:
        if socket is None:
            raise WorkFailedError(_unknown_end(error)) from None
        return end_leftover_processes(None, socket)
    return []


def _may_run(socket: Path | None, error: NoDaemonError) -> bool:
    """Whether the loop of a silent daemon may run; raises WorkFailedError if unknown."""
    if socket is None:
        raise WorkFailedError(_unknown_end(error))
    path = LoopFile.beside(socket)
    try:
        return path.exists() and LoopFile.read(path).runs()
    except (OSError, WorkFailedError) as unread:
        if not os.path.lexists(path):  # removed in the meantime, because the loop has ended
            return False
        raise WorkFailedError(_unknown_end(unread)) from None


def _unknown_end(error: Exception) -> str:
    return (
        f"{error}; the daemon was asked to end, but it is not known whether it has: "
        "look at the robot"
    )


def _without_launcher(daemon: Daemon, status: dict[str, Any]) -> str:
    """Return what is known about a daemon whose loop has ended and whose launcher does nothing."""
    left = launcher_left(Path(daemon.where)) or "its launcher does not respond"
    return f"{status['reason']}; {power_text(status)}; {left}"
