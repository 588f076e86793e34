"""`cdpr sim fault`: inject faults into a simulated robot while it runs."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import ProfileError, Robot, RobotAxis, Winch, load_winch_or_robot
from cdpr_profiles.errors import printable
from cdpr_profiles.robot import robot_of_winch
from cdpr_sim_bus.cia402.faults import FAULTS, MEND
from cdpr_tools.command_group import ROBOT_VARIABLE
from cdpr_tools.commands.options import argument, option
from cdpr_tools.composition.fault_injection import fault_access, named_fault
from cdpr_tools.errors import BadInputError

LIST = "list"
_USUAL = ", ".join(
    f"{fault.usual} {fault.unit} ({name})" for name, fault in FAULTS.items() if fault.unit
)

if TYPE_CHECKING:
    FaultWord = str
else:
    FaultWord = StrEnum("FaultWord", [(word, word) for word in (*FAULTS, MEND, LIST)])

app = typer.Typer()


@app.command()
def fault(
    machine: Annotated[
        str,
        argument(
            "Robot or winch that is simulated, or the name of its daemon.",
            metavar="ROBOT|WINCH",
            envvar=ROBOT_VARIABLE,
        ),
    ],
    what: Annotated[
        FaultWord,
        argument(
            f"Fault to inject immediately: {', '.join(FAULTS)}; {MEND}: repair everything; "
            f"{LIST}: show what is broken.",
            metavar="FAULT",
        ),
    ],
    value: Annotated[
        str | None, argument(f"Size of the fault, by default {_USUAL}.", metavar="VALUE")
    ] = None,
    *,
    bus: Annotated[
        list[str] | None, option("The simulator's buses; default: those of the robot's daemon.")
    ] = None,
    axis: Annotated[
        str | None,
        option("Axis by its name, or by its number from 1. Default: 1; mend and list: all axes."),
    ] = None,
) -> None:
    """Break a running simulated robot: a cable, an encoder, a drive; or mend it.

    The command orders it from the simulator, beside the frames of the bus, while the robot's
    master keeps running. On a virtual CAN interface it writes object 2F00h of the simulated drives.
    No controller reads what is broken from the simulator.
    """
    profile, daemon = _profile(machine, by_daemon=not bus)
    robot = robot_of_winch(profile) if isinstance(profile, Winch) else profile
    shows = what in (MEND, LIST)
    axes = robot.axes if shows and axis is None else (_axis(robot, axis or "1"),)
    if value in [one.name for one in robot.axes]:
        raise BadInputError(f"{what} {value}: choose the axis with: --axis '{value}'")
    urls = robot_urls(robot, bus or _buses_of_daemon(daemon))
    if shows and value is not None:
        raise BadInputError(f"{what} {value}: {what} takes no value")
    clears = "`cdpr drive reset`" if isinstance(profile, Winch) else "`cdpr ack`"
    lines = []
    for one in axes:
        with fault_access(robot, one, urls[one.bus]) as access:
            if not shows:
                known = named_fault(what)
                text = known.text(access.inject(what, value))
                lines.append(text if known.of_robot else f"{one.name}: {text}")
                continue
            found, code = access.injected(), access.fault_code()
            if what == MEND:
                access.inject(MEND, None)
        if found:
            lines.append(f"{one.name}: {'mended: ' * (what == MEND)}{', '.join(found)}")
        if code:
            lines.append(f"{one.name}: the drive is in fault {code:#06x}; {clears} clears it")
    for line in lines or ["nothing is broken"]:
        typer.echo(printable(line))


def _profile(machine: str, *, by_daemon: bool) -> tuple[Winch | Robot, str]:
    """Return the machine of the profile or daemon with this name, and the daemon's name."""
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
    """Return the buses of the daemon that runs the robot, in the form of options.

    Raises NoDaemonError if there is no such daemon.
    """
    # loaded here: a simulator without a daemon needs no client
    from cdpr_tools.client.client import open_daemon  # noqa: PLC0415

    with open_daemon(robot, None, None, None) as daemon:
        buses = daemon.get("/status")["buses"]
    return [f"{name}={bus['url']}" for name, bus in buses.items()]


def _axis(robot: Robot, text: str) -> RobotAxis:
    names = [axis.name for axis in robot.axes]
    if text in names:
        return robot.axes[names.index(text)]
    if text.isdecimal() and 0 < int(text) <= len(names):
        return robot.axes[int(text) - 1]
    raise BadInputError(f"--axis {text}: allowed: 1 to {len(names)}, or {', '.join(names)}")
