"""`cdpr teleop ROBOT`: from the daemon's address until the robot holds again."""

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
from cdpr_rt.service.stream_packet import StreamSession
from cdpr_tools.client.client import Daemon, open_daemon
from cdpr_tools.daemon.settings import Address, is_loopback
from cdpr_tools.errors import BadInputError, CommandError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.signals import stop_on_signals
from cdpr_tools.teleop.input_device import Directions, End, InputDevice
from cdpr_tools.teleop.session import TeleopSession
from cdpr_tools.teleop.view import View

_STATUS_S: Final = 0.1
_ANSWER_S: Final = 10.0
_UNHEARD_S: Final = 1.0
_UNMOVED_m: Final = 1e-4
_PICTURES_Hz: Final = 10.0
_ABOUT: Final = {"angle": 2, "rx": 0, "ry": 1, "rz": 2}
_EVERYWHERE: Final = frozenset({"0.0.0.0", "::", ""})


@dataclass(frozen=True)
class TeleopSettings:
    """The options of `cdpr teleop`."""

    robot: str
    open_device: Callable[[Directions], InputDevice]
    """Opens the input device for a robot with these directions."""
    scale: float
    via: str | None
    """HOST:PORT of the stream; None for the daemon's own."""
    socket: Path | None
    url: str | None
    key_file: Path | None


def teleoperate(settings: TeleopSettings, out: Output) -> None:
    """Run a teleoperation until it ends; then the robot holds.

    Raises BadInputError, and WorkFailedError if anything but the user ended it.
    """
    name = Path(settings.robot).stem
    known = settings.url is None and settings.socket is None
    at = (name if known else None, settings.socket, settings.url, settings.key_file)
    with open_daemon(*at, answer_s=_ANSWER_S) as daemon:
        status = daemon.get("/status")
        description = daemon.get("/description")
        if name not in (status["robot"], description.get("robot"), description.get("reference")):
            raise BadInputError(f"{settings.robot}: {daemon.where} runs {status['robot']}")
        host, port = stream_address(status, settings)
        program, arguments = _program_of(description)
        directions = directions_of(description)
        with (
            _ended_by_signals() as ended,
            closing(settings.open_device(directions)) as device,
            daemon.control() as token,
            _stream(host, port, daemon, token) as stream,
        ):
            daemon.post("/program", {"program": program, "wanted": arguments}, token)
            number = description["programs"].index(program)
            session = TeleopSession(stream, device, settings.scale, number, directions[0])
            view = View(session, description, status["reason"])
            out.note(f"controlling {name} over {host}:{port}; {device.hint}")
            try:
                end = _shown(session, view, daemon, out, ended)
                if session.silent_s > _UNHEARD_S:  # the next answer may take as long
                    out.note(f"{end.text}; asking the robot to hold")
                with suppress(CommandError) if end.failed else nullcontext():  # `end` says why
                    daemon.post("/hold")
            except BaseException:
                with suppress(CommandError):
                    daemon.post("/hold")
                raise
            finally:
                _tell_figures(session, out)
        _tell(session, end, daemon, status["reason"], view.held_back, out)


def _stream(host: str, port: int, daemon: Daemon, token: str) -> StreamClient:
    given = daemon.post("/stream", token=token)
    session = StreamSession(int(given["session"]), bytes.fromhex(given["key"]))
    try:
        return StreamClient(host, port, session)
    except (OSError, UnicodeError) as error:
        why = getattr(error, "strerror", None) or "is not a host name"
        raise BadInputError(f"set-points to {host}:{port}: {why}") from None


def _shown(
    session: TeleopSession, view: View, daemon: Daemon, out: Output, ended: Callable[[], bool]
) -> End:
    """Run the session, with a view if there is a terminal."""
    if not out.notes.is_terminal:
        with _watched(view, daemon):
            return session.teleoperate(ended)
    live = Live(
        get_renderable=lambda: view,
        console=out.notes,
        refresh_per_second=_PICTURES_Hz,
        transient=True,
    )
    with _watched(view, daemon):
        live.start()
        try:
            return session.teleoperate(ended)
        finally:
            with suppress(OSError):  # the terminal is gone
                live.stop()


@contextmanager
def _ended_by_signals() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether the user requested an end or closed the terminal.

    A closed terminal would otherwise end the process immediately.
    """
    gone: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        gone.append(number)

    before = signal.signal(signal.SIGHUP, note)
    try:
        with stop_on_signals() as stop_requested:
            yield lambda: stop_requested() or bool(gone)
    finally:
        signal.signal(signal.SIGHUP, before)


@contextmanager
def _watched(view: View, daemon: Daemon) -> Iterator[None]:
    """Pass the daemon's status to the view several times a second, read in a separate thread."""
    over = threading.Event()

    def watch() -> None:
        while not over.wait(_STATUS_S):
            try:
                view.tell(daemon.get("/status"))
            except CommandError:
                continue  # the stream itself reports missing answers

    thread = threading.Thread(target=watch, name="status", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join(_STATUS_S)  # do not wait longer for a daemon that does not answer


def stream_address(status: dict[str, Any], settings: TeleopSettings) -> tuple[str, int]:
    """Return the address for set-points; raises BadInputError if the daemon accepts none."""
    if settings.via is not None:
        address = Address.parse("--via", settings.via)
        return address.host, address.port
    bound = status["parts"].get("stream", {}).get("address")
    if bound is None:
        raise BadInputError(
            f"{status['robot']}: its daemon receives no set-point stream: it was started with "
            "--no-stream or --read-only"
        )
    host, _, port = bound.rpartition(":")
    url_host = "127.0.0.1" if settings.url is None else str(urlsplit(settings.url).hostname)
    if is_loopback(host) and not is_loopback(url_host):
        raise BadInputError(
            f"{status['robot']}: its daemon receives set-points only from its own machine; "
            "allowed: --via, or a daemon that was started with --stream HOST:PORT and --key-file"
        )
    return url_host if host in _EVERYWHERE else host, int(port)


def directions_of(description: dict[str, Any]) -> Directions:
    """Return the directions in which the hand leads a robot; without a platform, two cables."""
    platform = description.get("platform") or {"home_m": (0.0, 0.0)}
    names = platform.get("controlled", ())
    return len(platform["home_m"]), tuple(_ABOUT[name] for name in names if name in _ABOUT)


def _program_of(description: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return the program that follows the stream: the platform's, or the single cables'."""
    programs = description.get("programs", [])
    if "pose" in programs:
        return "pose", {"stream": True}
    if "follow" in programs:
        return "follow", {}
    raise WorkFailedError("the daemon is not ready yet; `cdpr status` gives the reason")


def _tell_figures(session: TeleopSession, out: Output) -> None:
    """Report what was confirmed, and what happened to the sent set-points."""
    figures = session.figures()
    trip = figures["round_trip_ms"]
    delay = f"; round trip {trip['p50']:.1f} ms, at most {trip['p99']:.1f} ms for 99 of 100"
    with suppress(OSError):  # the reader is gone
        for one in session.confirmations:
            place = " ".join(f"{1e3 * value:+.2f}" for value in one.pose_m)
            where = f": platform {place} mm" if math.isfinite(one.pose_m[0]) else ""
            out.say(f"confirmed {one.number} at {one.time_s:.2f} s{where}")
        out.say(
            f"{figures['sent']} set-points sent, {figures['answered']} answered"
            f"{delay if figures['answered'] else ''}"
        )


def _tell(
    session: TeleopSession, end: End, daemon: Daemon, before: str, held_back: str, out: Output
) -> None:
    """Report how the session ended.

    Raises WorkFailedError if it failed, or if a limit prevented any motion.

    `before` is the robot's reason before it was led, `held_back` the last limit it has met.
    """
    try:
        status = daemon.get("/status")
    except CommandError as error:
        raise WorkFailedError(f"{end.text}; {error}") from None
    if end.failed:
        reason = status["reason"] if status["reason"] != before else ""
        why = f" ({reason})" if reason else ""
        raise WorkFailedError(f"{end.text}{why}; {status['state']}, {status['program']}")
    if held_back and session.moved_m < _UNMOVED_m:
        raise WorkFailedError(f"{end.text}; the robot did not follow the hand: {held_back}")
    with suppress(OSError):
        if held_back:
            out.say(f"the robot did not follow the hand everywhere: {held_back}")
        out.say(f"{end.text}; {status['state']}, {status['program']}")
        out.result(
            {
                "ok": True,
                "robot": status["robot"],
                "scale": session.scale,
                "ended": end.text,
                "held_back": held_back,
                "state": status["state"],
                "program": status["program"],
                **session.figures(),
            }
        )
