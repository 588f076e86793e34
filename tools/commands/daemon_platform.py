"""`cdpr tighten|lower|pause|resume`: a platform from its stand into motion, and back onto it."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated, Any

import typer

from tools.commands.options import JsonOption
from tools.daemon.client import (
    Daemon,
    KeyFileOption,
    RobotOption,
    SocketOption,
    UrlOption,
    open_daemon,
)
from tools.daemon.motion import await_end, finish
from tools.errors import BadInputError
from tools.output import Output
from tools.signals import stop_on_signals


class Source(StrEnum):
    """From what the cables' lengths follow."""

    HOME = "home"
    LAST = "last"
    LENGTHS = "lengths"


def register(parent: typer.Typer) -> None:
    """Add the commands."""
    for command in (tighten, lower, pause, resume):
        parent.command()(command)


def tighten(
    source: Annotated[
        Source | None,
        typer.Option(
            "--from",
            help="Lengths of the cables: the platform stands at home, those of the last stop, or "
            "those that the daemon knows; home where it knows none.",
        ),
    ] = None,
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Take up the slack of a platform's cables and learn where it is; it is held then."""
    wanted = {} if source is None else {"from": source.value}
    with open_daemon(robot, socket, url, key_file) as daemon:
        _carry_out(daemon, Output(as_json), "tighten", wanted)


def lower(
    blind: Annotated[
        bool,
        typer.Option("--blind", help="Every winch just lets its cable out, wherever that leads."),
    ] = False,
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Let the platform down onto its stand; the power stays on, the cables are loose."""
    wanted = {"blind": True} if blind else {}
    with open_daemon(robot, socket, url, key_file) as daemon:
        _carry_out(daemon, Output(as_json), "lower", wanted)


def pause(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Stop the platform and hold it there; `resume` goes on."""
    out = Output(as_json)
    with open_daemon(robot, socket, url, key_file) as daemon:
        _require_platform(daemon, "pause")
        daemon.post("/hold")
        finish(daemon, out, stopped=False)


def resume(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Go on to the position that the platform had not reached when it was paused."""
    with open_daemon(robot, socket, url, key_file) as daemon:
        _carry_out(daemon, Output(as_json), "pose", {"resume": True})


def _require_platform(daemon: Daemon, what: str) -> None:
    programs = daemon.get("/description").get("programs", [])
    if "lower" not in programs:
        raise BadInputError(f"{what}: only for robots whose platform is moved as a whole")


def _carry_out(daemon: Daemon, out: Output, program: str, wanted: dict[str, Any]) -> None:
    """Have a program run to its end, then hold."""
    _require_platform(daemon, program)
    with stop_on_signals() as stop_requested, daemon.control() as control:
        control.post("/program", {"program": program, "wanted": wanted})
        await_end(control, program, stop_requested, math.inf)
        control.hold()
    finish(daemon, out, stop_requested())
