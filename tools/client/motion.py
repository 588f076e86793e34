"""Waiting for the end of a motion that a daemon carries out."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from cdpr_tools.client.client import Daemon, HeldRight
from cdpr_tools.client.status_text import in_millimetres, platform_text
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output

RENEW_S = 0.1
_SETTLE_S = 2.0
_REST_RAD, _REST_RAD_S = math.radians(0.5), math.radians(2.0)


def require_program(daemon: Daemon, name: str) -> dict[str, Any]:
    """Return the status; raises WorkFailedError where the program does not run any more."""
    status = daemon.get("/status")
    if status["state"] != "active" or status["program"] != name:
        why = status["reason"] or _last_command(daemon)
        raise WorkFailedError(f"{name} was ended: {why} ({status['state']})")
    return status


def _last_command(daemon: Daemon) -> str:
    """Return what was asked of the daemon last, and by whom."""
    asked = [one["text"] for one in daemon.get("/events")["events"] if one["kind"] == "command"]
    return str(asked[-1]) if asked else "another program runs"


def await_end(
    control: HeldRight,
    name: str,
    stop_requested: Callable[[], bool],
    seconds: float,
    out: Output | None = None,
) -> dict[str, Any] | None:
    """Renew the right to move until the program is done; return its progress, else None.

    What holds it back meanwhile is noted in `out`.
    """
    deadline, noted = time.monotonic() + seconds, ""
    while not stop_requested() and time.monotonic() < deadline:
        time.sleep(RENEW_S)
        control.renew()
        progress: dict[str, Any]
        progress = require_program(control.daemon, name).get("program_progress", {})
        if progress.get("trouble") and progress.get("done") != 1.0:
            raise WorkFailedError(f"{name}: {in_millimetres(progress['trouble'])}")
        held_back = in_millimetres(progress.get("held_back") or "")
        if out is not None and held_back and not noted:
            out.note(held_back)
        noted = held_back
        if progress.get("done") == 1.0 and progress.get("leg") == progress.get("legs"):
            return progress
    return None


def _at_rest(axis: dict[str, Any]) -> bool:
    angle, setpoint = axis.get("position_rad"), axis.get("setpoint_rad")
    speed = axis.get("velocity_rad_s")
    if angle is None or setpoint is None or speed is None:
        return True
    return bool(abs(speed) < _REST_RAD_S and abs(angle - setpoint) < _REST_RAD)


def finish(
    daemon: Daemon, out: Output, stopped: bool, ended: dict[str, Any] | None = None, **figures: Any
) -> None:
    """Say where the axes are once they have settled, or after a while where they have not.

    `ended` is the progress of what came to its end. Raises WorkFailedError where the user has
    stopped it, or a fault has ended it or is about to.
    """
    deadline = time.monotonic() + _SETTLE_S
    status = daemon.get("/status")
    while not all(map(_at_rest, status["axes"])) and time.monotonic() < deadline:
        time.sleep(RENEW_S)
        status = daemon.get("/status")
    for axis in status["axes"]:
        angle = axis.get("position_rad")
        shown = "-" if angle is None else f"{math.degrees(angle):.3f} deg"
        out.say(f"{axis['name']}: {shown}")
    if text := platform_text(status):
        out.say(text)
    if trouble := (ended or {}).get("trouble"):
        figures["trouble"] = trouble
        out.say(str(trouble))
    out.say(f"{status['state']}, {status['program']}")
    if status["state"] != "active":
        raise WorkFailedError(f"{status['reason'] or 'the power was taken'} ({status['state']})")
    if status.get("reacting", "none") != "none":
        raise WorkFailedError(f"{status['reason']} ({status['reacting']} under way)")
    if stopped:
        raise WorkFailedError("stopped on request; the axes hold where they are")
    angles = {axis["name"]: axis.get("position_rad") for axis in status["axes"]}
    told = {"state": status["state"], "program": status["program"], "position_rad": angles}
    progress = status.get("program_progress") or {}
    keys = ("position_m", "rotation_rad", "trouble")
    told |= {key: progress[key] for key in keys if progress.get(key)}
    out.result({"ok": True, **told, **figures})
