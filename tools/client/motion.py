"""Motions that a command runs on a daemon's robot: show progress, end on Ctrl-C, report the end."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.refusal import RefusalCode
from cdpr_rt.robot import Robot, end_text, is_at_rest
from cdpr_tools.client import status_text
from cdpr_tools.client.client import Daemon
from cdpr_tools.client.daemon_robot import commanded
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.signals import HELD, stop_on_signals

LOOK_S = 0.1
_SETTLE_S = 2.0


class _OverError(Exception):
    """The user has requested the end of the motion, or its time is up."""


@dataclass
class Outcome:
    """How a motion has ended."""

    stopped: bool = False
    """Whether the user has stopped it."""
    ended: dict[str, Any] | None = None
    """The progress of the motion at its regular end; None if it was ended earlier."""


def carry_out(
    daemon: Daemon,
    out: Output,
    motion: Callable[[Robot], object],
    *,
    seconds: float = math.inf,
    notice: str = HELD,
) -> Outcome:
    """Run a motion on the daemon's robot; Ctrl-C ends it, and the robot holds.

    The motion also ends after `seconds`. Raises the command's errors if something else ends it.
    """
    outcome, notes, deadline = Outcome(), status_text.ProgressNotes(out), time.monotonic() + seconds

    def look(status: Mapping[str, Any]) -> None:
        if stop_requested() or time.monotonic() > deadline:
            raise _OverError
        notes(status)
        outcome.ended = status.get("program_progress") or {}

    with stop_on_signals(notice) as stop_requested, commanded(daemon) as robot:
        robot.on_status = look
        try:
            motion(robot)
        except _OverError as over:
            outcome.ended = None
            if failed := getattr(over, "__notes__", []):
                raise WorkFailedError("; ".join(failed)) from None
        outcome.stopped = stop_requested()
    return outcome


def run_to_end(
    daemon: Daemon,
    out: Output,
    program: str,
    arguments: Mapping[str, Any],
    where: str = "",
    **figures: Any,
) -> None:
    """Run a program to its end, hold, and report where the robot is, or `where`."""

    def motion(robot: Robot) -> None:
        robot.run(program, **arguments)
        robot.hold()

    try:
        outcome = carry_out(daemon, out, motion)
    except DaemonRefusalError as error:
        if error.refusal is not None and error.refusal.code is RefusalCode.NOT_TIGHT:
            for step in status_text.next_steps(daemon.get("/status")):
                error.add_note(step.strip())
        raise
    except WorkFailedError as error:
        if program == "tighten" and (put_back := status_text.put_back_text(daemon.get("/status"))):
            error.add_note(put_back)
        raise
    finish(daemon, out, outcome, where, **figures)


def finish(
    daemon: Daemon,
    out: Output,
    outcome: Outcome,
    where: str = "",
    **figures: Any,
) -> None:
    """Report where the platform or the axes are, once they have settled or a timeout has passed.

    `where` is the text to report after a regular end. Raises WorkFailedError if the user
    has stopped the motion, or a fault has ended it or is about to.
    """
    stopped, ended = outcome.stopped, outcome.ended
    deadline = time.monotonic() + _SETTLE_S
    status = daemon.get("/status")
    while not all(map(is_at_rest, status["axes"])) and time.monotonic() < deadline:
        time.sleep(LOOK_S)
        status = daemon.get("/status")
    if status["state"] == status_text.DEAD:
        raise WorkFailedError(status_text.death_text(status))
    if status["state"] == "active":
        out.say(*where_text(status, where if ended and not stopped else ""))
    if trouble := (ended or {}).get("trouble"):
        figures["trouble"] = trouble
        out.say(str(trouble))
    if status["state"] != "active":
        raise WorkFailedError(f"{end_text(status)} ({status['state']})")
    if status.get("reacting", "none") != "none":
        raise WorkFailedError(f"{end_text(status)} ({status['reacting']} under way)")
    if stopped:
        held = status["program"] == "hold"
        rest = "and held there" if held else f"but {status['program']} runs"
        raise WorkFailedError(f"stopped on request, {rest}")
    angles = {axis["name"]: axis.get("position_rad") for axis in status["axes"]}
    there = {"state": status["state"], "program": status["program"], "position_rad": angles}
    progress = status.get("program_progress") or {}
    keys = ("position_m", "rotation_rad", "trouble")
    there |= {key: progress[key] for key in keys if progress.get(key)}
    out.result({"ok": True, **there, **figures})


def where_text(status: dict[str, Any], where: str = "") -> list[str]:
    """Return where the platform is, or each axis, and what holds it; or `where` if it is given."""
    if where:
        return [where]
    tightness = status_text.tightness_text(status)
    place = status_text.platform_text(status)
    if tightness and place:
        return [f"{place}; {tightness}"]
    lines = []
    for axis in status["axes"]:
        angle = axis.get("position_rad")
        shown = "-" if angle is None else f"{math.degrees(angle):.2f} deg"
        lines.append(f"{axis['name']}: {shown}")
    held = "held there, with power" if status["program"] == "hold" else f"runs {status['program']}"
    return [*lines, *([place] if place else []), tightness or held]


def require_platform(description: dict[str, Any], asked: str, instead: str = "") -> None:
    """Raise BadInputError if a daemon's description is of a robot without a platform.

    The message begins with the request `asked` and ends with the alternative `instead`.
    """
    if description.get("platform") is None:
        raise BadInputError(f"{asked}: {description.get('robot')}: {NO_PLATFORM}{instead}")
