"""`cdpr jog|move|controller`: motion by a daemon, for as long as the command runs."""

from __future__ import annotations

import math
import time
from typing import Annotated, Any

import typer

from tools.commands.options import JsonOption
from tools.daemon.client import (
    Daemon,
    KeyFileOption,
    RobotOption,
    SocketOption,
    UrlOption,
    axis_values,
    key_values,
    open_daemon,
)
from tools.daemon.motion import RENEW_S, await_end, finish, require_program
from tools.errors import BadInputError
from tools.output import Output
from tools.signals import stop_on_signals

_DEADMAN_S = 0.6
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
                time.sleep(RENEW_S)
                require_program(daemon, "jog")
                control.post("/set", {"wanted": wanted})
            control.hold()
        finish(daemon, out, stop_requested())


def move(
    axes: Annotated[
        list[str] | None,
        typer.Argument(help="Angles in deg of the motor.", metavar="[AXIS=ANGLE]..."),
    ] = None,
    to: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="X Y", help="The platform to this position, in mm."),
    ] = None,
    relative: Annotated[
        bool, typer.Option("--relative", help="By so much from here, instead of to there.")
    ] = False,
    cable: Annotated[
        bool, typer.Option("--cable", help="By mm of cable from here, positive pays out.")
    ] = False,
    speed: Annotated[
        float | None,
        typer.Option(min=0.01, help="Not faster: deg/s at the motor, with --to mm/s."),
    ] = None,
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Take axes or the platform to positions and wait until there; Ctrl-C holds and fails."""
    out = Output(as_json)
    with open_daemon(robot, socket, url, key_file) as daemon:
        if to is not None:
            program, wanted = "pose", _to_position(daemon, axes, to, relative, cable, speed)
        else:
            program, wanted = "pid", _to_angles(daemon, axes or [], relative, cable, speed)
        with stop_on_signals() as stop_requested, daemon.control() as control:
            control.post("/program", {"program": program, "wanted": wanted})
            arrived = await_end(control, program, stop_requested, math.inf)
            control.hold()
        finish(daemon, out, stop_requested(), arrived=arrived)


def _to_angles(
    daemon: Daemon, axes: list[str], relative: bool, cable: bool, speed: float | None
) -> dict[str, Any]:
    """Return what the program `pid` is to do; raises BadInputError."""
    if not axes:
        raise BadInputError("nothing to move; allowed: AXIS=ANGLE..., or --to X Y for a platform")
    if "pid" not in daemon.get("/description").get("programs", ["pid"]):
        raise BadInputError(
            f"{axes[0]}: the platform is moved as a whole; allowed: --to X Y, or `cdpr jog` for "
            "a single winch"
        )
    n, goals = _given(daemon, axes, "mm" if cable else "deg")
    factor = 1e-3 if cable else math.radians(1.0)
    key = "cable_m" if cable else "distance_rad" if relative else "position_rad"
    wanted: dict[str, Any] = {
        key: [factor * goals[axis] if axis in goals else None for axis in range(n)]
    }
    if speed is not None:
        wanted["speed_rad_s"] = math.radians(speed)
    return wanted


def _to_position(
    daemon: Daemon,
    axes: list[str] | None,
    to: tuple[float, float],
    relative: bool,
    cable: bool,
    speed: float | None,
) -> dict[str, Any]:
    """Return what the program `pose` is to do; raises BadInputError."""
    if axes or cable:
        raise BadInputError("--to: not together with axes or --cable")
    if not all(map(math.isfinite, to)):
        raise BadInputError(f"--to {to[0]:g} {to[1]:g}: allowed: finite numbers of mm")
    here = [0.0, 0.0]
    if relative:
        progress = daemon.get("/status").get("program_progress") or {}
        here = progress.get("target_m") or progress.get("position_m") or []
        if not here:
            raise BadInputError("--relative: it is not known where the platform is; tighten first")
    wanted: dict[str, Any] = {
        "position_m": [x + 1e-3 * step for x, step in zip(here, to, strict=True)]
    }
    if speed is not None:
        wanted["speed_m_s"] = 1e-3 * speed
    return wanted


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
                await_end(control, name, stop_requested, seconds or math.inf)
                control.hold()
        finish(daemon, out, stop_requested())


def _given(daemon: Daemon, texts: list[str], unit: str) -> tuple[int, dict[int, float]]:
    """Return how many axes there are and the numbers given for some; raises BadInputError."""
    axes = daemon.get("/status")["axes"]
    values = axis_values(texts, axes, unit)
    for axis, value in values.items():
        if not math.isfinite(value):
            raise BadInputError(f"{axes[axis]['name']}={value:g}: allowed: a finite number")
    return len(axes), values
