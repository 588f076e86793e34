"""`cdpr service-unit`: a systemd unit that runs a robot's daemon."""

from __future__ import annotations

import os
import pwd
import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.main import get_command

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.robot.robot_buses import robot_urls, starts_own_simulator
from cdpr_profiles import Robot, load_robot
from cdpr_rt.programs.platform.lower import lowering_s
from cdpr_rt.robots.robot_arrays import can_lower
from cdpr_tools.commands.daemon import run

_SOCKETS = Path("/run/cdpr-rt")
_ASIDE = ("robot", "yes", "as_json")
_OF_THE_SIMULATOR = "camera"
"""An option that the daemon's own processes do not know."""


app = typer.Typer()


@app.command(
    "service-unit",
    context_settings={"ignore_unknown_options": True, "allow_extra_args": True},
)
def print_unit(
    context: typer.Context,
    robot: Annotated[str, typer.Argument(metavar="ROBOT|WINCH", help="As for `cdpr run`.")],
    user: Annotated[
        str | None, typer.Option(help="Who runs it; by default you, or `cdpr` where that is root.")
    ] = None,
) -> None:
    """Print a systemd unit that runs the robot's daemon; takes the options of `cdpr run` as well.

    Paths in it become absolute. What is wrong with the robot or the options is said now, not by
    the service at its start.
    """
    profile = load_robot(robot)
    with get_command(run.app).make_context("cdpr run", [robot, *context.args]) as read:
        asked = dict(read.params)
    if asked["unix"] is None:
        asked["unix"] = _SOCKETS / f"{profile.profile}.sock"
    apart = (*_ASIDE, _OF_THE_SIMULATOR)
    run.settings_for(profile, **{k: v for k, v in asked.items() if k not in apart})
    buses = asked["bus"] or []
    urls = [] if starts_own_simulator(buses) else list(robot_urls(profile, buses).values())
    if user is None:
        user = "cdpr" if os.geteuid() == 0 else pwd.getpwuid(os.geteuid()).pw_name
    typer.echo(service_unit(profile, urls, list(_words(asked)), user), nl=False)


def _words(asked: dict[str, Any]) -> Iterator[str]:
    """Yield what was asked for as options again, its paths absolute."""
    for parameter in get_command(run.app).params:
        value = asked.get(parameter.name)
        if parameter.name in _ASIDE or value is None or value is False:
            continue
        option = parameter.opts[0]
        if value is True:
            yield option
            continue
        for one in value if isinstance(value, list | tuple) else [value]:
            yield from (option, _absolute(parameter.name, one))


def _absolute(name: str, value: Any) -> str:
    is_file = isinstance(value, Path) or (name == "safety_io" and Path(value).is_file())
    return str(Path(value).absolute()) if is_file else str(value)


_STOP_S = 60.0
"""What the launcher takes to end the loop and the recording, besides a lowering."""

_UNIT = """\
# Written by `cdpr service-unit`. The robot comes up ready, without power: enabling is a separate
# act, after a restart as well.
[Unit]
Description=Control loop of {robot}
After=network.target{devices}
{wants}StartLimitIntervalSec=300
StartLimitBurst=5

[Service]
Type=notify
NotifyAccess=main
ExecStart={command}
User={user}
# the launcher ends the loop first, the recording last
KillMode=mixed
TimeoutStartSec=300
TimeoutStopSec={stop_s:.0f}
# bad input does not mend itself by another start
Restart=on-failure
RestartSec=2
RestartPreventExitStatus=2
# fed only while the loop turns; the launcher still ends both processes in order
WatchdogSec=5
WatchdogSignal=SIGTERM

# real time
LimitRTPRIO=90
LimitMEMLOCK=infinity
OOMScoreAdjust=-500

# where it may write
RuntimeDirectory=cdpr-rt
RuntimeDirectoryMode=0700
RuntimeDirectoryPreserve=yes
StateDirectory=cdpr-rt
CacheDirectory=cdpr-rt
Environment=XDG_STATE_HOME=/var/lib
Environment=NUMBA_CACHE_DIR=/var/cache/cdpr-rt
UMask=0077
ProtectSystem=strict
ProtectHome=read-only
PrivateTmp=yes

# what it has no need of; kernels are compiled at run time, so memory may become executable
NoNewPrivileges=yes
CapabilityBoundingSet=
LockPersonality=yes
ProtectControlGroups=yes
ProtectHostname=yes
ProtectKernelLogs=yes
ProtectKernelModules=yes
ProtectKernelTunables=yes
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_CAN AF_NETLINK
RestrictNamespaces=yes
RestrictSUIDSGID=yes
SystemCallArchitectures=native
SystemCallErrorNumber=EPERM
SystemCallFilter=@system-service

[Install]
WantedBy=multi-user.target
"""


def service_unit(robot: Robot, urls: Sequence[BusUrl], options: Sequence[str], user: str) -> str:
    """Return the text of a unit that runs `robot` on `urls` with these options of `cdpr run`."""
    devices = [
        f"sys-subsystem-net-devices-{url.channel}.device"
        for url in urls
        if url.interface == "socketcan"
    ]
    lowers = robot.platform if can_lower(robot) else None
    words = [_program(), "run", robot.reference, "--yes", *options]
    return _UNIT.format(
        robot=_one_line(robot.name),
        devices="".join(f" {device}" for device in devices),
        wants=f"Wants={' '.join(devices)}\n" if devices else "",
        command=" ".join(_quoted(word) for word in words),
        user=user,
        stop_s=_STOP_S + (0.0 if lowers is None else lowering_s(lowers)),
    )


def _program() -> str:
    beside = Path(sys.executable).with_name("cdpr")
    return str(beside) if os.access(beside, os.X_OK) else shutil.which("cdpr") or str(beside)


def _one_line(text: str) -> str:
    return " ".join(text.split()).replace("%", "%%")


def _quoted(word: str) -> str:
    """Return one word of a command line as systemd reads it (systemd.service(5), COMMAND LINES)."""
    word = word.replace("%", "%%").replace("$", "$$")
    if word and not set(word) & set(" \t\n\"'\\;"):
        return word
    escaped = word.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
