"""`cdpr teleop ROBOT`: from the daemon's address to the robot that holds again."""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any, Final
from urllib.parse import urlsplit

from rich.live import Live

from cdpr_rt.service.stream_client import StreamClient
from tools.daemon.client import Daemon, open_daemon
from tools.daemon.settings import Address, read_key
from tools.errors import BadInputError, CommandError, WorkFailedError
from tools.output import Output
from tools.signals import stop_on_signals
from tools.teleop.hand import End, HandDevice
from tools.teleop.session import Session
from tools.teleop.view import View

_STATUS_S: Final = 0.3
_PICTURES_Hz: Final = 10.0
_EVERYWHERE: Final = frozenset({"0.0.0.0", "::", ""})


@dataclass(frozen=True)
class Wish:
    """What the user has asked for."""

    robot: str
    take_up: Callable[[], HandDevice]
    """Opens the device that leads."""
    scale: float
    via: str | None
    """HOST:PORT of the stream, None to have the daemon tell it."""
    socket: Path | None
    url: str | None
    key_file: Path | None


def lead(wish: Wish, out: Output) -> None:
    """Lead until somebody ends it; the robot holds then.

    Raises BadInputError, and WorkFailedError where it was not the user who ended it.
    """
    name = Path(wish.robot).stem
    known = wish.url is None and wish.socket is None
    with open_daemon(name if known else None, wish.socket, wish.url, wish.key_file) as daemon:
        status = daemon.get("/status")
        description = daemon.get("/description")
        if name not in (status["robot"], description.get("robot"), description.get("reference")):
            raise BadInputError(f"{wish.robot}: {daemon.where} runs {status['robot']}")
        host, port = stream_address(status, wish)
        program, wanted = _program_of(description)
        key = None if wish.key_file is None else read_key(wish.key_file)
        with closing(wish.take_up()) as device, daemon.control() as control:
            control.post("/program", {"program": program, "wanted": wanted})
            with StreamClient(host, port, key, control.token) as stream:
                number = description["programs"].index(program)
                session = Session(stream, device, wish.scale, number)
                out.note(f"{program} by {host}:{port}; {device.hint}")
                end = _shown(session, View(session, description), daemon, out)
            with suppress(CommandError) if end.failed else nullcontext():  # it tells why itself
                control.hold()
        _tell(session, end, daemon, out)


def _shown(session: Session, view: View, daemon: Daemon, out: Output) -> End:
    """Lead, and show it where there is a terminal."""
    live = Live(
        get_renderable=lambda: view,
        console=out.notes,
        refresh_per_second=_PICTURES_Hz,
        transient=True,
    )
    with stop_on_signals() as stop_requested, _hang_up() as hung_up, _watched(view, daemon):
        if not out.notes.is_terminal:
            return session.lead(lambda: stop_requested() or hung_up())
        with live:
            return session.lead(lambda: stop_requested() or hung_up())


@contextmanager
def _hang_up() -> Iterator[Callable[[], bool]]:
    """Yield what tells whether the terminal was closed, which would end the process at once."""
    gone: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        gone.append(number)

    before = signal.signal(signal.SIGHUP, note)
    try:
        yield lambda: bool(gone)
    finally:
        signal.signal(signal.SIGHUP, before)


@contextmanager
def _watched(view: View, daemon: Daemon) -> Iterator[None]:
    """Give the view the daemon's status several times a second, asked for beside the stream."""
    over = threading.Event()

    def watch() -> None:
        while not over.wait(_STATUS_S):
            try:
                view.status = daemon.get("/status")
            except CommandError:
                continue  # the stream itself tells when nobody answers any more

    thread = threading.Thread(target=watch, name="status", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def stream_address(status: dict[str, Any], wish: Wish) -> tuple[str, int]:
    """Return where set-points go; raises BadInputError where the daemon takes none."""
    if wish.via is not None:
        address = Address.parse("--via", wish.via)
        return address.host, address.port
    told = status["parts"].get("stream", {}).get("address")
    if told is None:
        raise BadInputError(
            f"{status['robot']}: its daemon takes no set-point stream; allowed: one that was "
            "started with --stream HOST:PORT"
        )
    host, _, port = told.rpartition(":")
    if host in _EVERYWHERE:
        host = "127.0.0.1" if wish.url is None else str(urlsplit(wish.url).hostname)
    return host, int(port)


def _program_of(description: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return the program that follows the stream: the platform's, or the single cables'."""
    programs = description.get("programs", [])
    if "pose" in programs:
        return "pose", {"stream": True}
    if "follow" in programs:
        return "follow", {}
    raise WorkFailedError("the daemon does not know its robot yet; `cdpr status` says why")


def _tell(session: Session, end: End, daemon: Daemon, out: Output) -> None:
    """Say how it ended and what was confirmed; raises WorkFailedError where it failed."""
    figures, status = session.figures(), daemon.get("/status")
    for one in session.confirmations:
        x, y = (1e3 * value for value in one.pose_m)
        where = f": platform {x:+.2f} {y:+.2f} mm" if math.isfinite(x) else ""
        out.say(f"confirmed {one.number} at {one.time_s:.2f} s{where}")
    trip = figures["round_trip_ms"]
    told = f"; round trip {trip['p50']:.1f} ms, {trip['p99']:.1f} ms at most in 99 of 100"
    out.say(
        f"{figures['sent']} set-points sent, {figures['answered']} answered"
        f"{told if figures['answered'] else ''}"
    )
    if end.failed:
        reason = f" ({status['reason']})" if status["reason"] else ""
        raise WorkFailedError(f"{end.text}{reason}; {status['state']}, {status['program']}")
    out.say(f"{end.text}; {status['state']}, {status['program']}")
    out.result(
        {
            "ok": True,
            "robot": status["robot"],
            "scale": session.scale,
            "ended": end.text,
            "state": status["state"],
            "program": status["program"],
            **figures,
        }
    )
