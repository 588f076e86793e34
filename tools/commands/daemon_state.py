"""`cdpr status|check|enable|disable|hold|ack|stop`: a daemon's state, and changes of it."""

from __future__ import annotations

import time
from typing import Annotated, Any

import typer
from rich.live import Live
from rich.text import Text

from tools.commands.options import JsonOption, YesOption
from tools.consent import require_consent
from tools.daemon.client import (
    Daemon,
    KeyFileOption,
    NoDaemonError,
    RobotOption,
    SocketOption,
    UrlOption,
    open_daemon,
)
from tools.daemon.status_text import status_text
from tools.errors import WorkFailedError
from tools.output import Output
from tools.signals import stop_on_signals

_WATCH_S = 0.2
_END_S = 90.0


def register(parent: typer.Typer) -> None:
    """Add the commands."""
    for command in (status, check, enable, disable, hold, ack, stop):
        parent.command()(command)


def status(
    watch: Annotated[bool, typer.Option("--watch", help="Go on showing it until Ctrl-C.")] = False,
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say how a daemon and its robot are; changes nothing."""
    out = Output(as_json)
    with open_daemon(robot, socket, url, key_file) as daemon:
        told = daemon.get("/status")
        if watch:
            told = _watch(daemon, out, told)
        else:
            for part in status_text(told).renderables:
                out.text.print(part, soft_wrap=True)
    out.result({"ok": told["state"] not in ("fault", "dead"), **told})


def _watch(daemon: Daemon, out: Output, told: dict[str, Any]) -> dict[str, Any]:
    """Show the status over and over; a service that is started anew meanwhile is waited for."""
    with (
        stop_on_signals() as stop_requested,
        Live(status_text(told), console=out.text, auto_refresh=False) as view,
    ):
        while not stop_requested():
            time.sleep(_WATCH_S)
            try:
                told = daemon.get("/status")
            except NoDaemonError as error:
                view.update(Text(str(error), style="red"), refresh=True)
            else:
                view.update(status_text(told), refresh=True)
    return told


def check(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Boot the drives anew and check the bus without power; ready afterwards."""
    out = Output(as_json)
    with open_daemon(robot, socket, url, key_file) as daemon:
        if daemon.get("/status")["state"] in ("unconfigured", "inactive"):
            daemon.post("/configure")
        _tell(out, daemon.post("/check"))


def enable(
    program: Annotated[str, typer.Option(help="What runs from the first moment on.")] = "hold",
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Give the drives power; they hold where they are."""
    out = Output(as_json)
    with open_daemon(robot, socket, url, key_file) as daemon:
        _confirm(daemon.get("/status"), yes)
        with daemon.control() as control:
            _tell(out, control.post("/enable", {"program": program}))


def disable(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Stop the motion under control, then take the power off."""
    with open_daemon(robot, socket, url, key_file) as daemon:
        _tell(Output(as_json), daemon.post("/disable"))


def hold(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Stop the motion and stay there, whoever moves; the power stays on."""
    with open_daemon(robot, socket, url, key_file) as daemon:
        _tell(Output(as_json), daemon.post("/hold"))


def ack(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Acknowledge a fault whose cause is gone; nothing gets power by it."""
    with open_daemon(robot, socket, url, key_file) as daemon:
        _tell(Output(as_json), daemon.post("/acknowledge"))


def stop(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """End the daemon: the motion stops under control, the power goes off."""
    out = Output(as_json)
    with open_daemon(robot, socket, url, key_file) as daemon:
        daemon.post("/shutdown")
        deadline = time.monotonic() + _END_S
        while time.monotonic() < deadline:
            try:
                daemon.get("/status")
            except NoDaemonError:
                out.say("stopped")
                out.result({"ok": True})
                return
            time.sleep(_WATCH_S)
    raise WorkFailedError(f"the daemon still runs {_END_S:g} s after it was told to end")


def _tell(out: Output, answer: dict[str, Any]) -> None:
    out.say(answer["state"] + (f": {answer['text']}" if answer["text"] else ""))
    out.result({"ok": True, **answer})


def _confirm(told: dict[str, Any], yes: bool) -> None:
    """Ask before motors on a real bus get power."""
    urls = [str(bus.get("url", "")) for bus in told.get("buses", {}).values()]
    real = [url for url in urls if not url.startswith("simbus:")]
    if real or not urls:
        where = " and ".join(real) or "its buses"
        require_consent(f"{told['robot']} on {where}: the drives get power.", yes)
