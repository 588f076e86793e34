"""`cdpr jog|move|controller`: motion by a daemon, for as long as the command runs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Annotated, Any

import typer

from tools.commands.options import JsonOption
from tools.daemon.client import (
    Control,
    Daemon,
    KeyFileOption,
    RobotOption,
    SocketOption,
    UrlOption,
    axis_values,
    key_values,
    open_daemon,
)
from tools.errors import BadInputError, WorkFailedError
from tools.output import Output
from tools.signals import stop_on_signals

_RENEW_S, _DEADMAN_S = 0.1, 0.6
_SETTLE_S = 2.0
_REST_RAD, _REST_RAD_S = math.radians(0.5), math.radians(2.0)
_STANDING = frozenset({"hold", "idle"})


def register(parent: typer.Typer) -> None:
    """Add the commands."""
    for command in (jog, move, controller):
        parent.command()(command)


def jog(
    axes: Annotated[
        list[str], typer.Argument(help="Speeds in deg/s at the motor.", metavar="AXIS=SPEED...")
    ],
    seconds: Annotated[float, typer.Option(min=0.1, max=3600.0, help="How long.")] = 1.0,
    cable: Annotated[
        bool, typer.Option("--cable", help="Speeds are mm/s of cable, positive pays out.")
    ] = False,
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Turn axes at a speed for a while; they stop when this command does, however it ends."""
    out = Output(as_json)
    with open_daemon(robot, socket, url, key_file) as daemon:
        n, speeds = _given(daemon, axes, "mm/s" if cable else "deg/s")
        factor = 1e-3 if cable else math.radians(1.0)
        values = [factor * speeds.get(axis, 0.0) for axis in range(n)]
        key = "cable_velocity_m_s" if cable else "velocity_rad_s"
        wanted = {key: values, "timeout_s": _DEADMAN_S}
        deadline = time.monotonic() + seconds
        with stop_on_signals() as stop_requested, daemon.control() as control:
            control.post("/program", {"program": "jog", "wanted": wanted})
            while time.monotonic() < deadline and not stop_requested():
                time.sleep(_RENEW_S)
                _require_program(daemon, "jog")
                control.post("/set", {"wanted": wanted})
            control.hold()
        _finish(daemon, out, stop_requested())


def move(
    axes: Annotated[
        list[str], typer.Argument(help="Angles in deg of the motor.", metavar="AXIS=ANGLE...")
    ],
    relative: Annotated[
        bool, typer.Option("--relative", help="By so much from here, instead of to there.")
    ] = False,
    cable: Annotated[
        bool, typer.Option("--cable", help="By mm of cable from here, positive pays out.")
    ] = False,
    speed: Annotated[
        float | None, typer.Option(min=0.01, help="Not faster than this, deg/s at the motor.")
    ] = None,
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Take axes to positions and wait until they are there; Ctrl-C holds them and fails."""
    out = Output(as_json)
    with open_daemon(robot, socket, url, key_file) as daemon:
        n, goals = _given(daemon, axes, "mm" if cable else "deg")
        factor = 1e-3 if cable else math.radians(1.0)
        key = "cable_m" if cable else "distance_rad" if relative else "position_rad"
        values = [factor * goals[axis] if axis in goals else None for axis in range(n)]
        wanted: dict[str, Any] = {key: values}
        if speed is not None:
            wanted["speed_rad_s"] = math.radians(speed)
        with stop_on_signals() as stop_requested, daemon.control() as control:
            control.post("/program", {"program": "pid", "wanted": wanted})
            arrived = _await_end(control, "pid", stop_requested, math.inf)
            control.hold()
        _finish(daemon, out, stop_requested(), arrived=arrived)


def controller(
    name: Annotated[str, typer.Argument(help="Program: hold, idle, sweep, pid, ...")],
    values: Annotated[
        list[str] | None,
        typer.Argument(help="What it is to do, in JSON.", metavar="[KEY=VALUE]..."),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.1, help="No longer than this; until its end otherwise.")
    ] = None,
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Change over to a program and stay with it until it is done; hold follows then.

    `hold` and `idle` run on when the command has ended.
    """
    out = Output(as_json)
    wanted = key_values(values or [])
    with open_daemon(robot, socket, url, key_file) as daemon:
        with stop_on_signals() as stop_requested, daemon.control() as control:
            control.post("/program", {"program": name, "wanted": wanted})
            if name not in _STANDING:
                _await_end(control, name, stop_requested, seconds or math.inf)
                control.hold()
        _finish(daemon, out, stop_requested())


def _given(daemon: Daemon, texts: list[str], unit: str) -> tuple[int, dict[int, float]]:
    """Return how many axes there are and the numbers given for some; raises BadInputError."""
    axes = daemon.get("/status")["axes"]
    values = axis_values(texts, axes, unit)
    for axis, value in values.items():
        if not math.isfinite(value):
            raise BadInputError(f"{axes[axis]['name']}={value:g}: allowed: a finite number")
    return len(axes), values


def _require_program(daemon: Daemon, name: str) -> dict[str, Any]:
    """Return the status; raises WorkFailedError where the program does not run any more."""
    status = daemon.get("/status")
    if status["state"] != "active" or status["program"] != name:
        why = status["reason"] or f"{status['program']} was asked for by somebody else"
        raise WorkFailedError(f"{name} was ended: {why} ({status['state']})")
    return status


def _await_end(
    control: Control, name: str, stop_requested: Callable[[], bool], seconds: float
) -> bool:
    """Keep the right to move until the program is done; whether it was."""
    deadline = time.monotonic() + seconds
    while not stop_requested() and time.monotonic() < deadline:
        time.sleep(_RENEW_S)
        control.renew()
        progress = _require_program(control.daemon, name).get("program_progress", {})
        if progress.get("done") == 1.0 and progress.get("leg") == progress.get("legs"):
            return True
    return False


def _at_rest(axis: dict[str, Any]) -> bool:
    angle, wanted = axis.get("position_rad"), axis.get("setpoint_rad")
    speed = axis.get("velocity_rad_s")
    if angle is None or wanted is None or speed is None:
        return True
    return bool(abs(speed) < _REST_RAD_S and abs(angle - wanted) < _REST_RAD)


def _finish(daemon: Daemon, out: Output, stopped: bool, **figures: Any) -> None:
    """Say where the axes are once they have settled, or after a while where they have not.

    Raises WorkFailedError where the user has stopped it, or the loop has gone to fault.
    """
    deadline = time.monotonic() + _SETTLE_S
    status = daemon.get("/status")
    while not all(map(_at_rest, status["axes"])) and time.monotonic() < deadline:
        time.sleep(_RENEW_S)
        status = daemon.get("/status")
    for axis in status["axes"]:
        angle = axis.get("position_rad")
        shown = "-" if angle is None else f"{math.degrees(angle):.3f} deg"
        out.say(f"{axis['name']}: {shown}")
    out.say(f"{status['state']}, {status['program']}")
    if status["state"] != "active":
        raise WorkFailedError(f"{status['reason'] or 'the power was taken'} ({status['state']})")
    if stopped:
        raise WorkFailedError("stopped on request; the axes hold where they are")
    angles = {axis["name"]: axis.get("position_rad") for axis in status["axes"]}
    told = {"state": status["state"], "program": status["program"], "position_rad": angles}
    out.result({"ok": True, **told, **figures})
