"""Follow a path on a running daemon: plan, run and watch it until the end."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any, Final

from cdpr_rt.motion.way_points import read_source, require_kind
from cdpr_rt.refusal import CommandRefusal, RefusalCode
from cdpr_rt.robot import Faulted, MotionEnded, Robot, end_text
from cdpr_tools.client.client import Daemon
from cdpr_tools.client.motion import LOOK_S, carry_out, finish, require_platform
from cdpr_tools.client.refusals import DaemonRefusalError, in_typed_words
from cdpr_tools.client.status_text import CONTINUE, left_text, next_steps
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output, time_text
from cdpr_tools.robots.path_options import PathOptions
from cdpr_tools.signals import stop_on_signals

_MOST_BYTES: Final = 1 << 20
_NOT_IN_NAMES: Final = re.compile(r"[^A-Za-z0-9_. -]")
_NAME_CHARS: Final = 48
BACK: Final = "`cdpr path back MM` steps back"


def follow(
    daemon: Daemon, out: Output, file: Path, options: PathOptions, feed: float | None
) -> None:
    """Let the daemon plan the path of a file and follow it to its end; `feed` is at most 1."""
    body = {**path_source(file), **options.request()}
    require_platform(daemon.get("/description"), "path")
    require_held(daemon.get("/status"))
    with out.stage(f"{file.name}: planning"):
        planned = _planned(daemon, body, daemon.post("/path", body)["number"])
    for notice in planned.get("notices", ()):
        out.note(f"{file.name}: {notice}")
    duration_s, lasts = 0.0, True
    while lasts:
        lasts_text = time_text(planned["duration_s"])
        out.say(f"{file.name}: {planned['length_m']:.3f} m in {lasts_text}")
        arguments = {"plan": planned["plan"]} | _feed(feed)
        duration_s += planned["duration_s"]
        line = planned.get("next_line")
        if line is None:
            _run(daemon, out, arguments, planned_s=duration_s)
            return
        # a path that needs several plans: plan the next one while this one is followed
        body["line"] = line
        number = daemon.post("/path", body)["number"]
        rest = f"`cdpr path run {file} --line {line}`"
        later = f"the path from line {line} on has not been followed yet; next: {rest}"
        lasts = _run(daemon, out, arguments, later, planned_s=duration_s)
        if lasts:
            out.note(f"{file.name}: continues with line {line}")
            planned = _planned(daemon, body, number)


def path_source(file: Path) -> dict[str, str]:
    """Return a path file's name and text for the daemon; raises PathError and ProfileError."""
    return {"name": plain_name(file), "text": read_source(file, _MOST_BYTES)}


def plain_name(file: Path) -> str:
    """Return a file's name for the daemon; raises PathError if it is not a path file's name."""
    suffix = require_kind(file)
    stem = _NOT_IN_NAMES.sub("-", file.stem).lstrip("-_. ")[:_NAME_CHARS]
    return f"{stem or 'path'}{suffix}"


def resume_path(
    daemon: Daemon, out: Output, feed: float | None = None, back_mm: float | None = None
) -> None:
    """Continue the interrupted path, or move back along it; by default at its last feed."""
    require_platform(daemon.get("/description"), "path")
    where = {"resume": True} if back_mm is None else {"back_m": 1e-3 * back_mm}
    _run(daemon, out, where | _feed(feed))


def _feed(feed: float | None) -> dict[str, Any]:
    return {} if feed is None else {"feed": feed}


def _planned(daemon: Daemon, body: dict[str, Any], number: int) -> dict[str, Any]:
    """Return the data of a planned path; raises BadInputError if it cannot be followed."""
    with stop_on_signals() as stop_requested:
        while True:
            job = daemon.get("/path")
            if job["number"] != number:
                raise WorkFailedError(
                    f"{body['name']}: another client has planned a path meanwhile; plan again"
                )
            if not job["planning"]:
                break
            if stop_requested():
                raise WorkFailedError("stopped on request; nothing has moved")
            time.sleep(LOOK_S)
    if job["error"]:
        raise BadInputError(str(job["error"]))
    return job


def require_held(status: dict[str, Any]) -> None:
    """Raise WorkFailedError if the robot is in no state to follow a path, before one is planned."""
    state = str(status["state"])
    if state != "active":
        states = {"state": state, "allowed": ["active"]}
        refusal = CommandRefusal(RefusalCode.NOT_IN_STATE, "path", arguments=states)
        raise DaemonRefusalError.of(refusal)
    if (status.get("program_progress") or {}).get("tight") is False:
        steps = next_steps(status) if status.get("last_stop") else []
        text = "path: the cables are not tight; `cdpr tighten` first"
        raise WorkFailedError("; ".join([text, *map(str.strip, steps)]))


def _run(
    daemon: Daemon, out: Output, arguments: dict[str, Any], later: str = "", **figures: Any
) -> bool:
    """Run a plan or its remaining part until it ends, or is stopped or paused.

    `later` describes what follows the plan. Return whether that must be followed now.
    """
    paused, goes_on = "", False

    def motion(robot: Robot) -> None:
        nonlocal paused, goes_on
        try:
            robot.run("path", **arguments)
        except MotionEnded as error:
            if not (paused := _paused(robot.status)):
                raise MotionEnded(f"{error}; when the robot works again, {CONTINUE}") from None
            return
        except Faulted as error:
            raise Faulted(f"{error}; when the robot works again, {CONTINUE}") from None
        goes_on = bool(later) and not (robot.status["program_progress"].get("path") or {}).get(
            "waiting"
        )
        if not goes_on:  # a hold would also end the planning of the next part
            robot.hold()

    typed = "path back" if "back_m" in arguments else "path resume"
    with in_typed_words("path", typed, instead="cdpr path run FILE"):
        outcome = carry_out(daemon, out, motion, notice="")
    if goes_on and not outcome.stopped:
        return True
    if goes_on:
        daemon.post("/hold")
    progress = {} if paused else (outcome.ended or {}).get("path") or {}
    if later:
        out.note(later)
    if paused:
        out.say(paused)
        figures["paused"] = True
    if waiting := progress.get("waiting"):
        out.say(f"line {progress['line']}: {waiting}; {CONTINUE}")
    if outcome.stopped:
        out.note(f"held on the path; {CONTINUE}, {BACK}")
    figures |= {"path": progress} if progress else {}
    finish(daemon, out, outcome, **figures)
    return False


def _paused(status: dict[str, Any]) -> str:
    """Return where and by whom a path was paused; empty if something else ended it."""
    path = (status.get("program_progress") or {}).get("path")
    if (status["state"], status["program"]) != ("active", "hold") or not path or status["reason"]:
        return ""
    return f"{left_text(path)}, paused by {end_text(status)}; {CONTINUE}, {BACK}"
