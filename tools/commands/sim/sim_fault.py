"""`cdpr sim fault`: what goes wrong on a simulated robot while it runs."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, NamedTuple

import typer

from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import BusError, SdoError
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import ProfileError, Robot, RobotAxis, Winch, load_winch_or_robot
from cdpr_profiles.eds.dictionary import load_dictionary
from cdpr_profiles.robot import robot_of_winch
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.errors import BadInputError, WorkFailedError, raised_as

_OBJECT = 0x2F00


class InjectedFault(StrEnum):
    """What can be brought about in any axis."""

    CUT_CABLE = "cut-cable"
    SLIP = "slip"
    ENCODER_JUMP = "encoder-jump"
    DRIVE_FAULT = "drive-fault"
    SILENCE = "silence"
    CELL_OFF = "cell-off"


class _FaultInjection(NamedTuple):
    sub: int
    usual: int
    least: int
    most: int
    unit: str


_INJECTIONS = {
    InjectedFault.CUT_CABLE: _FaultInjection(12, 1, 1, 1, ""),
    InjectedFault.SLIP: _FaultInjection(13, 100, 1, 0xFFFF, "mm"),
    InjectedFault.ENCODER_JUMP: _FaultInjection(11, 500, -(2**31), 2**31 - 1, "counts"),
    InjectedFault.DRIVE_FAULT: _FaultInjection(1, 0x7305, 1, 0xFFFF, ""),
    InjectedFault.SILENCE: _FaultInjection(6, 0xFFFF, 1, 0xFFFF, "ms"),
    InjectedFault.CELL_OFF: _FaultInjection(14, 40, -(2**15), 2**15 - 1, "N"),
}


app = typer.Typer()


@app.command()
def fault(
    machine: Annotated[
        str,
        typer.Argument(
            help="Winch or robot that is simulated, or the name of its daemon.",
            metavar="WINCH|ROBOT",
        ),
    ],
    what: Annotated[
        str,  # a choice would be listed as its type as well, broken anywhere in a narrow terminal
        typer.Argument(
            help=f"What goes wrong, at once: {', '.join(InjectedFault)}.",
            metavar="FAULT",
        ),
    ],
    value: Annotated[
        str | None,
        typer.Argument(
            help="How much: mm to slip (100 by default), counts to jump (500), error code of the "
            "drive (0x7305), ms of silence (65535: for good, by default), N that a load cell shows "
            "too much (40).",
            metavar="VALUE",
        ),
    ] = None,
    *,
    bus: Annotated[
        list[str] | None,
        typer.Option(help="The simulator's buses; those of the robot's daemon where left out."),
    ] = None,
    axis: Annotated[str, typer.Option(help="Axis by its name, or by its number from 1.")] = "1",
) -> None:
    """Have something go wrong on a simulated robot that runs: a cable, an encoder, a drive.

    It writes object 2F00h, which no real drive has, beside whoever runs the robot.
    """
    profile, daemon = _profile(machine, by_daemon=not bus)
    robot = robot_of_winch(profile) if isinstance(profile, Winch) else profile
    chosen = _axis(robot, axis)
    if what not in _INJECTIONS:
        raise BadInputError(f"FAULT {what!r}; allowed: {', '.join(InjectedFault)}")
    injection = _INJECTIONS[InjectedFault(what)]
    amount = _amount(what, injection, value)
    if what == InjectedFault.CELL_OFF and robot.tension_sensors is None:
        raise BadInputError(
            f"{what}: {robot.name} has no load cells, its tensions are estimated from torques; "
            "allowed: for a robot whose file names tension_sensors"
        )
    url = robot_urls(robot, bus or _buses_of_daemon(daemon))[chosen.bus]
    winch = chosen.winch
    with raised_as(BadInputError, BusError):
        network = CanNetwork(
            url, PacedClock(), [winch.node_id], robot.master_node_id, robot.master_heartbeat_s
        )
    try:
        network.add_node(winch.node_id, load_dictionary(winch.drive.eds, winch.node_id))
        network.write(winch.node_id, _OBJECT, injection.sub, amount)
    except SdoError as error:
        raise WorkFailedError(f"axis {chosen.name!r}: {error}") from error
    finally:
        network.close()
    typer.echo(f"{chosen.name}: {what}{_amount_text(what, amount, injection)}")


def _profile(machine: str, *, by_daemon: bool) -> tuple[Winch | Robot, str]:
    """Return the machine of a profile or of a daemon of this name, and its daemon's name."""
    try:
        profile = load_winch_or_robot(machine)
    except ProfileError:
        # loaded here: a simulator without a daemon needs no client
        from cdpr_tools.client.client import answers, open_daemon  # noqa: PLC0415

        if not by_daemon or machine.endswith(".toml") or not answers(machine, None):
            raise
        with open_daemon(machine, None, None, None) as daemon:
            return load_winch_or_robot(daemon.get("/description")["reference"]), machine
    return profile, profile.profile


def _buses_of_daemon(robot: str) -> list[str]:
    """Return the buses of the daemon that runs the robot, as options give them.

    Raises NoDaemonError where none does.
    """
    # loaded here: a simulator without a daemon needs no client
    from cdpr_tools.client.client import open_daemon  # noqa: PLC0415

    with open_daemon(robot, None, None, None) as daemon:
        buses = daemon.get("/status")["buses"]
    return [f"{name}={bus['url']}" for name, bus in buses.items()]


def _amount_text(what: str, amount: int, injection: _FaultInjection) -> str:
    if what == InjectedFault.CUT_CABLE:
        return ""
    return f" {amount:#06x}" if what == InjectedFault.DRIVE_FAULT else f" {amount} {injection.unit}"


def _amount(what: str, injection: _FaultInjection, text: str | None) -> int:
    try:
        amount = injection.usual if text is None else int(text, 0)
    except ValueError:
        amount = injection.least - 1
    if not injection.least <= amount <= injection.most:
        raise BadInputError(
            f"{what} {text}: allowed: whole numbers {injection.least} to {injection.most}"
        )
    return amount


def _axis(robot: Robot, text: str) -> RobotAxis:
    names = [axis.name for axis in robot.axes]
    if text in names:
        return robot.axes[names.index(text)]
    if text.isdecimal() and 0 < int(text) <= len(names):
        return robot.axes[int(text) - 1]
    raise BadInputError(f"--axis {text}: allowed: 1 to {len(names)}, or {', '.join(names)}")
