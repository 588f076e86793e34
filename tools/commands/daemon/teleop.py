"""`cdpr teleop ROBOT`: a hand leads a robot through its daemon; and what belongs to that."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from cdpr_tools.commands.daemon import teleop_experiment
from cdpr_tools.commands.options import JsonOption, KeyFileOption, SocketOption, UrlOption
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output
from cdpr_tools.teleop.gamepad import EvdevFinder, Gamepad, stick_map
from cdpr_tools.teleop.input_device import Directions, InputDevice, parse_scale
from cdpr_tools.teleop.keyboard import Keyboard
from cdpr_tools.teleop.script import ScriptDevice, read_script

_LEAD = "robot"


class _RobotOrCommand(TyperGroup):
    """`cdpr teleop planar-3` means `cdpr teleop robot planar-3`; others go by their names."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the command in front that is meant where none is named."""
        if args and args[0] not in self.commands and args[0] not in self.get_help_option_names(ctx):
            args = [_LEAD, *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    name="teleop",
    cls=_RobotOrCommand,
    help="Lead a robot by hand: `cdpr teleop ROBOT` means `cdpr teleop robot ROBOT`.",
    no_args_is_help=True,
)


class Device(StrEnum):
    """What the hand holds."""

    GAMEPAD = "gamepad"
    KEYBOARD = "keyboard"
    SCRIPT = "script"


app.add_typer(teleop_experiment.app)


@app.callback()
def _group() -> None:
    """Lead a robot by hand: `cdpr teleop ROBOT` means `cdpr teleop robot ROBOT`."""


_Device = Annotated[Device, typer.Option("--device", help="Input device.")]
_Scale = Annotated[
    str,
    typer.Option(metavar="ROBOT:HAND", help="Robot motion over hand motion; or a number."),
]
_Script = Annotated[
    Path | None, typer.Option(help="For --device script: lines of seconds, x and y in mm, ...")
]
_Via = Annotated[
    str | None,
    typer.Option(
        metavar="HOST:PORT", help="Send the stream there instead, as through a tunnel or a proxy."
    ),
]
_Input = Annotated[
    Path | None, typer.Option("--input", help="The gamepad's node; the first that fits otherwise.")
]
_Axes = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y[,Z]", help="Axes that move; - turns one round. Left stick, directional pad."
    ),
]
_TurnAxes = Annotated[
    str | None,
    typer.Option(
        metavar="AXIS[,...]", help="Axes that turn the platform. Right stick, directional pad."
    ),
]
_DeadMan = Annotated[str, typer.Option(help="Button that is held while the stick leads.")]
_Confirm = Annotated[str, typer.Option(help="Button that confirms a target.")]
_DeadZone = Annotated[
    float, typer.Option(min=0.0, max=0.9, help="Dead zone of the stick, as a share of its travel.")
]
_HandSpeed = Annotated[
    float, typer.Option(min=0.1, max=1000.0, help="Hand speed at full deflection, mm/s.")
]


@app.command(_LEAD)
def robot(
    robot: Annotated[str, typer.Argument(help="The robot that a daemon runs.")],
    device: _Device = Device.KEYBOARD,
    scale: _Scale = "1:1",
    script: _Script = None,
    via: _Via = None,
    input_path: _Input = None,
    axes: _Axes = None,
    turn_axes: _TurnAxes = None,
    dead_man: _DeadMan = "BTN_TR",
    confirm: _Confirm = "BTN_SOUTH",
    dead_zone: _DeadZone = 0.1,
    hand_speed: _HandSpeed = 50.0,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Lead a robot that has power by hand, through its daemon's set-point stream.

    The robot follows while this command runs and holds when it ends, however that happens.
    """
    from cdpr_tools.teleop.teleoperation import TeleopSettings, teleoperate  # noqa: PLC0415  # slow to load

    factor = parse_scale(scale)
    lines = () if script is None else read_script(script, factor)
    if (device is Device.SCRIPT) != (script is not None):
        raise BadInputError("--script: allowed: together with --device script, and needed there")

    def open_device(directions: Directions) -> InputDevice:
        """Open the device, once all else is in order."""
        if device is Device.SCRIPT:
            return ScriptDevice(lines)
        if device is Device.KEYBOARD:
            return Keyboard(factor, directions=directions)
        used = stick_map(
            directions, axes, turn_axes, dead_man, confirm, dead_zone, 1e-3 * hand_speed
        )
        return Gamepad(EvdevFinder(input_path, used), used, factor)

    teleoperate(
        TeleopSettings(robot, open_device, factor, via, socket, url, key_file), Output(as_json)
    )
