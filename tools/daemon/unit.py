"""A systemd unit for the daemon of one robot."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from cdpr_drivers.bus import BusUrl
from cdpr_profiles import Robot
from cdpr_rt.programs.platform.lower import lowering_s
from cdpr_rt.robots.robot_arrays import can_lower

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
