"""Waiting for the end of a motion that a daemon carries out."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from cdpr_tools.client.client import Daemon, HeldRight
from cdpr_tools.client.status_text import (
    DEAD,
    death_text,
    place_text,
    platform_text,
    stage_text,
    target_text,
    tightness_text,
)
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output

RENEW_S = 0.1
TELL_S = 2.0
"""How often a motion says how far it has come."""
_SETTLE_S = 2.0
_REST_RAD, _REST_RAD_S = math.radians(0.5), math.radians(2.0)


def require_program(daemon: Daemon, name: str) -> dict[str, Any]:
    """Return the status; raises WorkFailedError where the program does not run any more."""
    status = daemon.get("/status")
    if status["state"] != "active" or status["program"] != name:
        raise WorkFailedError(f"{name} was ended: {ended_text(daemon, status)} ({status['state']})")
    return status


def ended_text(daemon: Daemon, status: dict[str, Any]) -> str:
    """Return why a program does not run any more."""
    if status["state"] == DEAD:
        return death_text(status)
    if status["reason"]:
        return str(status["reason"])
    # what was asked of the daemon last, and by whom
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

    How it goes on, and what holds it back meanwhile, is told in `out`.
    """
    deadline, notes = time.monotonic() + seconds, ProgressNotes(out)
    while not stop_requested() and time.monotonic() < deadline:
        time.sleep(RENEW_S)
        control.renew()
        progress: dict[str, Any]
        progress = require_program(control.daemon, name).get("program_progress", {})
        if progress.get("trouble") and progress.get("done") != 1.0:
            raise WorkFailedError(f"{name}: {progress['trouble']}")
        notes(name, progress)
        if is_done(progress):
            return progress
    return None


def is_done(progress: dict[str, Any]) -> bool:
    """Whether a program has come to its end, of a sweep that of its last leg."""
    return progress.get("done") == 1.0 and progress.get("leg") == progress.get("legs")


class ProgressNotes:
    """Says how a motion goes on, each thing once: its stages, what holds it back, its progress.

    What is in a `status` of before is not said.
    """

    def __init__(self, out: Output | None, status: dict[str, Any] | None = None) -> None:
        self._out = out
        self._stage = self._held_back = ""
        if status is not None:
            progress = status.get("program_progress") or {}
            self._stage = _stage(str(status["program"]), progress)
            self._held_back = progress.get("held_back") or ""
        self._next_s = time.monotonic() + TELL_S

    def __call__(self, program: str, progress: dict[str, Any]) -> None:
        """Take in the progress of a program."""
        if self._out is None:
            return
        stage = _stage(program, progress)
        if stage and stage != self._stage:
            self._out.note(f"{stage} ...")
            self._next_s = time.monotonic() + TELL_S
        held_back = progress.get("held_back") or ""
        if held_back and not self._held_back:
            self._out.note(held_back)
        self._stage, self._held_back = stage, held_back
        if not is_done(progress) and time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + TELL_S
            if text := _so_far(progress):
                self._out.note(text)


def _stage(program: str, progress: dict[str, Any]) -> str:
    return stage_text(program, progress) or target_text(progress)


def _so_far(progress: dict[str, Any]) -> str:
    """Return how far a motion has come: where the platform is, else the share that is done."""
    if place := place_text(progress):
        return place
    if not (done := progress.get("done")):
        return ""
    leg = f"leg {progress['leg']} of {progress['legs']}, " if "legs" in progress else ""
    return f"{leg}{100.0 * done:.0f} %"


def _at_rest(axis: dict[str, Any]) -> bool:
    angle, setpoint = axis.get("position_rad"), axis.get("setpoint_rad")
    speed = axis.get("velocity_rad_s")
    if angle is None or setpoint is None or speed is None:
        return True
    return bool(abs(speed) < _REST_RAD_S and abs(angle - setpoint) < _REST_RAD)


def finish(
    daemon: Daemon,
    out: Output,
    stopped: bool,
    ended: dict[str, Any] | None = None,
    where: str = "",
    **figures: Any,
) -> None:
    """Say where the platform or the axes are once they have settled, or have not for a while.

    `ended` is the progress of what came to its end, `where` the words for that. Raises
    WorkFailedError where the user has stopped it, or a fault has ended it or is about to.
    """
    deadline = time.monotonic() + _SETTLE_S
    status = daemon.get("/status")
    while not all(map(_at_rest, status["axes"])) and time.monotonic() < deadline:
        time.sleep(RENEW_S)
        status = daemon.get("/status")
    if status["state"] == "active":
        out.say(*_where(status, where if ended and not stopped else ""))
    if trouble := (ended or {}).get("trouble"):
        figures["trouble"] = trouble
        out.say(str(trouble))
    if status["state"] != "active":
        raise WorkFailedError(f"{ended_text(daemon, status)} ({status['state']})")
    if status.get("reacting", "none") != "none":
        raise WorkFailedError(f"{ended_text(daemon, status)} ({status['reacting']} under way)")
    if stopped:
        raise WorkFailedError("stopped on request, and held there")
    angles = {axis["name"]: axis.get("position_rad") for axis in status["axes"]}
    there = {"state": status["state"], "program": status["program"], "position_rad": angles}
    progress = status.get("program_progress") or {}
    keys = ("position_m", "rotation_rad", "trouble")
    there |= {key: progress[key] for key in keys if progress.get(key)}
    out.result({"ok": True, **there, **figures})


def _where(status: dict[str, Any], where: str) -> list[str]:
    """Return where everything has ended: a platform as a whole, else axis by axis."""
    if where:
        return [where]
    tightness = tightness_text(status)
    place = platform_text(status)
    if tightness and place:
        return [f"{place}; {tightness}"]
    lines = []
    for axis in status["axes"]:
        angle = axis.get("position_rad")
        shown = "-" if angle is None else f"{math.degrees(angle):.2f} deg"
        lines.append(f"{axis['name']}: {shown}")
    held = "held there, with power" if status["program"] == "hold" else f"runs {status['program']}"
    return [*lines, *([place] if place else []), tightness or held]
