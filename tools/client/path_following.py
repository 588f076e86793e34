"""Following a path on a running daemon: it plans, runs, and is watched until the end."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from cdpr_profiles.reading.bounded_input import read_text
from cdpr_tools.client.client import Daemon, HeldRight, open_daemon
from cdpr_tools.client.motion import RENEW_S, finish, require_program
from cdpr_tools.client.status_text import in_millimetres
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.paths.options import PathOptions
from cdpr_tools.paths.times import time_text
from cdpr_tools.signals import stop_on_signals

_MOST_BYTES: Final = 1 << 20
_TOLD_EVERY_S: Final = 5.0


@dataclass(frozen=True)
class Where:
    """Which daemon."""

    robot: str | None
    socket: Path | None
    url: str | None
    key_file: Path | None


def follow(where: Where, out: Output, file: Path, options: PathOptions, feed: float) -> None:
    """Have the daemon plan a file's path, and follow it to its end."""
    body: dict[str, Any] = {
        "name": file.name,
        "text": read_text(file, _MOST_BYTES),
        "blend_mm": options.blend_mm,
        "ignore": options.ignore,
        "origin_mm": options.origin_mm,
    }
    with open_daemon(*_four(where)) as daemon:
        _require_platform(daemon)
        out.note(f"{file.name}: planning ...")
        planned = _planned(daemon, body)
        out.say(
            f"{file.name}: {planned['length_m']:.3f} m in {time_text(planned['duration_s'])}, "
            f"{planned['gain']:.1f} times as fast as at one speed throughout"
        )
        wanted = {"plan": planned["plan"], "feed": feed}
        _run(daemon, out, wanted, planned_s=planned["duration_s"])


def take_up(where: Where, out: Output, back_mm: float | None, feed: float) -> None:
    """Go on with the path that was left, or step back along it."""
    with open_daemon(*_four(where)) as daemon:
        _require_platform(daemon)
        wanted: dict[str, Any] = {"resume": True, "feed": feed}
        if back_mm is not None:
            wanted = {"back_m": 1e-3 * back_mm, "feed": feed}
        _run(daemon, out, wanted)


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


def _four(where: Where) -> tuple[str | None, Path | None, str | None, Path | None]:
    return where.robot, where.socket, where.url, where.key_file


def _require_platform(daemon: Daemon) -> None:
    if "path" not in daemon.get("/description").get("programs", []):
        raise BadInputError("path: only for robots whose platform is moved as a whole")


def _run(daemon: Daemon, out: Output, wanted: dict[str, Any], **figures: Any) -> None:
    ended: dict[str, Any] | None = None
    with stop_on_signals() as stop_requested, daemon.control() as control:
        try:
            control.post("/program", {"program": "path", "wanted": wanted})
        except (BadInputError, WorkFailedError) as error:
            raise type(error)(in_millimetres(str(error))) from None
        watch = _Watch(control, out)
        while ended is None and not stop_requested():
            time.sleep(RENEW_S)
            ended = watch.look()
        control.hold()
    told = (ended or {}).get("path") or {}
    if waiting := told.get("waiting"):
        out.say(f"line {told['line']}: {waiting}; `cdpr path --resume` goes on")
    if stop_requested():
        out.note("held on the path; `cdpr path --resume` goes on, `cdpr path --back MM` steps back")
    figures |= {"path": told} if told else {}
    finish(daemon, out, stop_requested(), ended, **figures)


class _Watch:
    """Renews the right to move, tells of the progress, and sees the end."""

    def __init__(self, control: HeldRight, out: Output) -> None:
        self._control, self._out = control, out
        self._told_s = time.monotonic()

    def look(self) -> dict[str, Any] | None:
        """Return the progress once nothing more comes by itself, else None.

        Raises WorkFailedError where the program was ended, or cannot go on.
        """
        self._control.renew()
        progress: dict[str, Any]
        progress = require_program(self._control.daemon, "path").get("program_progress", {})
        path = progress.get("path") or {}
        if progress.get("trouble") and progress.get("done") != 1.0:
            raise WorkFailedError(f"path: {in_millimetres(progress['trouble'])}")
        over = progress.get("done") == 1.0 and path.get("time_s") == path.get("duration_s")
        now_s = time.monotonic()
        if now_s - self._told_s >= _TOLD_EVERY_S and path and not over:
            self._told_s = now_s
            self._out.note(progress_text(path))
        stands = path.get("waiting") in ("stepped back", "the path waits here")
        return progress if over or stands else None


def progress_text(path: dict[str, Any]) -> str:
    """Return how far a path has come."""
    share = path["time_s"] / max(path["duration_s"], 1e-9)
    left_s = (path["duration_s"] - path["time_s"]) / max(path["feed"], 0.01)
    return (
        f"{path['name']}: {100.0 * share:.0f} %, line {path['line']}, "
        f"{time_text(left_s)} left at {100.0 * path['feed']:.0f} % feed"
    )
