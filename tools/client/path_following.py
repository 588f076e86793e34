"""Following a path on a running daemon: it plans, runs, and is watched until the end."""

from __future__ import annotations

import re
import time
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final

from cdpr_profiles.reading.bounded_input import read_text
from cdpr_rt.motion.path.reading import require_kind
from cdpr_rt.refusal import CommandRefusal, RefusalCode
from cdpr_tools.client.client import Daemon, HeldRight, await_start
from cdpr_tools.client.motion import RENEW_S, TELL_S, ended_text, finish
from cdpr_tools.client.platform_move import require_platform
from cdpr_tools.client.refusals import DaemonRefusalError, in_typed_words
from cdpr_tools.client.status_text import (
    GO_ON,
    left_text,
    percent_text,
    place_text,
    stage_text,
)
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output, time_text
from cdpr_tools.paths.options import PathOptions
from cdpr_tools.signals import stop_on_signals

_MOST_BYTES: Final = 1 << 20
_NOT_IN_NAMES: Final = re.compile(r"[^A-Za-z0-9_. -]")
_NAME_CHARS: Final = 48
Opened = AbstractContextManager[Daemon]
"""What `open_daemon` returns."""
BACK: Final = "`cdpr path --back MM` steps back"


def follow(
    opened: Opened, out: Output, file: Path, options: PathOptions, feed: float | None
) -> None:
    """Have the daemon plan a file's path, and follow it to its end; `feed` is up to 1."""
    body: dict[str, Any] = {
        "name": plain_name(file),
        "text": read_text(file, _MOST_BYTES),
        "blend_mm": options.blend_mm,
        "ignore": " ".join(options.ignored()),
        "origin_mm": options.origin_mm,
    }
    with opened as daemon:
        _require_platform(daemon, out)
        require_held(daemon.get("/status"))
        with out.stage(f"{file.name}: planning"):
            planned = _planned(daemon, body)
        out.say(
            f"{file.name}: {planned['length_m']:.3f} m in {time_text(planned['duration_s'])}, "
            f"{planned['gain']:.1f} times as fast as at one speed throughout"
        )
        arguments = {"plan": planned["plan"]} | _feed(feed)
        _run(daemon, out, arguments, planned_s=planned["duration_s"])


def plain_name(file: Path) -> str:
    """Return a file's name as a daemon takes it; raises PathError where it is no path's."""
    suffix = require_kind(file)
    stem = _NOT_IN_NAMES.sub("-", file.stem).lstrip("-_. ")[:_NAME_CHARS]
    return f"{stem or 'path'}{suffix}"


def resume_path(opened: Opened, out: Output, back_mm: float | None, feed: float | None) -> None:
    """Go on with the path that was left, or step back along it; without a feed at its own."""
    with opened as daemon:
        _require_platform(daemon, out)
        where = {"resume": True} if back_mm is None else {"back_m": 1e-3 * back_mm}
        _run(daemon, out, where | _feed(feed))


def _feed(feed: float | None) -> dict[str, Any]:
    return {} if feed is None else {"feed": feed}


def _planned(daemon: Daemon, body: dict[str, Any]) -> dict[str, Any]:
    """Return a planned path's figures; raises BadInputError for one that cannot be followed."""
    number = daemon.post("/path", body)["number"]
    with stop_on_signals() as stop_requested:
        while True:
            job = daemon.get("/path")
            if job["number"] != number:
                raise WorkFailedError(f"{body['name']}: somebody else has had a path planned")
            if not job["planning"]:
                break
            if stop_requested():
                raise WorkFailedError("stopped on request; nothing has moved")
            time.sleep(RENEW_S)
    if job["error"]:
        raise BadInputError(str(job["error"]))
    return job


def go_on(daemon: Daemon, out: Output) -> None:
    """Go on along the path that was paused, at its feed."""
    _run(daemon, out, {"resume": True})


def _require_platform(daemon: Daemon, out: Output) -> None:
    await_start(daemon, out)
    require_platform(daemon.get("/description"), "path")


def require_held(status: dict[str, Any]) -> None:
    """Raise WorkFailedError where a path could not be followed: before it is planned for that."""
    state = str(status["state"])
    if state != "active":
        states = {"state": state, "allowed": ["active"]}
        refusal = CommandRefusal(RefusalCode.NOT_IN_STATE, "path", arguments=states)
        raise DaemonRefusalError.of(refusal)
    if (status.get("program_progress") or {}).get("tight") is False:
        raise WorkFailedError("path: the cables are not tight; `cdpr tighten` first")


def _run(daemon: Daemon, out: Output, arguments: dict[str, Any], **figures: Any) -> None:
    ended: dict[str, Any] | None = None
    with stop_on_signals() as stop_requested, daemon.control() as control:
        typed = "--back" if "back_m" in arguments else "--resume"
        with in_typed_words("path", typed, instead="--run with a path's FILE"):
            control.post("/program", {"program": "path", "wanted": arguments})
        watch = _Watch(control, out)
        while ended is None and not watch.paused and not stop_requested():
            time.sleep(RENEW_S)
            ended = watch.look()
        if not watch.paused:
            control.hold()
    if watch.paused:
        out.say(watch.paused)
        figures["paused"] = True
    progress = (ended or {}).get("path") or {}
    if waiting := progress.get("waiting"):
        out.say(f"line {progress['line']}: {waiting}; {GO_ON}")
    if stop_requested():
        out.note(f"held on the path; {GO_ON}, {BACK}")
    figures |= {"path": progress} if progress else {}
    finish(daemon, out, stop_requested(), ended, **figures)


class _Watch:
    """Renews the right to move, tells of the progress, and sees the end."""

    def __init__(self, control: HeldRight, out: Output) -> None:
        self._control, self._out = control, out
        self.paused = ""
        """Where and by whom it was paused, empty until then."""
        self._noted_s, self._stage = time.monotonic(), ""

    def look(self) -> dict[str, Any] | None:
        """Return the progress once nothing more comes by itself, else None.

        Raises WorkFailedError where the program was ended, or cannot go on.
        """
        self._control.renew()
        status = self._control.daemon.get("/status")
        progress: dict[str, Any] = status.get("program_progress") or {}
        path = progress.get("path") or {}
        if status["state"] != "active" or status["program"] != "path":
            why = ended_text(self._control.daemon, status)
            if status["program"] != "hold" or not path or status["reason"]:
                raise WorkFailedError(
                    f"path was ended: {why} ({status['state']}); once the robot is well, {GO_ON}"
                )
            self.paused = f"{left_text(path)}, paused by {why}; {GO_ON}, {BACK}"
            return None
        if progress.get("trouble") and progress.get("done") != 1.0:
            raise WorkFailedError(f"path: {progress['trouble']}")
        over = progress.get("done") == 1.0 and path.get("time_s") == path.get("duration_s")
        if path and not over:
            self._tell(progress, path)
        stands = path.get("waiting") in ("stepped back", "the path waits here")
        return progress if over or stands else None

    def _tell(self, progress: dict[str, Any], path: dict[str, Any]) -> None:
        """Say what has begun, and now and then how far it has come."""
        stage, before, now_s = stage_text("path", path), self._stage, time.monotonic()
        if stage != before:
            self._out.note(f"{stage} ...")
        elif now_s - self._noted_s < TELL_S:
            return
        else:
            on_it = path["stage"] == "path"
            self._out.note(progress_text(path) if on_it else place_text(progress))
        self._stage, self._noted_s = stage, now_s


def progress_text(path: dict[str, Any]) -> str:
    """Return how far a path has come."""
    left_s = (path["duration_s"] - path["time_s"]) / max(path["feed"], 0.01)
    return (
        f"{path['name']}: {percent_text(path)}, line {path['line']}, "
        f"{time_text(left_s)} left at {100.0 * path['feed']:.0f} % feed"
    )
