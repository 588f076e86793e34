"""`cdpr doctor`: what this machine can and cannot do for the controller, and how to mend it."""

from __future__ import annotations

import os
import platform
import resource
import socket
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from tools.errors import FAILED
from tools.output import Output

_MEMLOCK_BYTES = 512 << 20


@dataclass(frozen=True)
class Finding:
    """One thing looked at: `level` is ok, note (works, but) or problem (will not work)."""

    what: str
    level: str
    found: str
    remedy: str = ""


def _simbus() -> Finding:
    try:
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET).close()
    except OSError as error:
        return Finding("embedded bus", "problem", error.strerror or "", "run on Linux")
    return Finding("embedded bus", "ok", "packet sockets are there")


def _socketcan() -> Finding:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as error:
        remedy = "load the modules: modprobe can_raw vcan; simbus: works without"
        return Finding("SocketCAN", "note", error.strerror or "not available", remedy)
    ports = [p.parent.name for p in Path("/sys/class/net").glob("*/type") if _is_can(p)]
    return Finding("SocketCAN", "ok", "interfaces: " + (", ".join(ports) or "none yet"))


def _is_can(type_file: Path) -> bool:
    try:
        return type_file.read_text().strip() == "280"  # ARPHRD_CAN
    except OSError:
        return False


def _scheduling() -> Finding:
    soft, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    if os.geteuid() == 0 or soft > 0:
        return Finding("real-time scheduling", "ok", "SCHED_FIFO is allowed")
    remedy = "add '@realtime - rtprio 90' to /etc/security/limits.d and join that group"
    return Finding("real-time scheduling", "note", "SCHED_FIFO is not allowed", remedy)


def _memory() -> Finding:
    soft, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if os.geteuid() == 0 or soft == resource.RLIM_INFINITY or soft >= _MEMLOCK_BYTES:
        return Finding("locked memory", "ok", "enough may be locked")
    remedy = "add '@realtime - memlock unlimited' to /etc/security/limits.d"
    return Finding("locked memory", "note", f"only {soft >> 10} KiB may be locked", remedy)


def _kernel() -> Finding:
    release = platform.release()
    realtime = Path("/sys/kernel/realtime")
    if realtime.exists() and realtime.read_text().strip() == "1":
        return Finding("kernel", "ok", f"{release}, PREEMPT_RT")
    remedy = "for a real robot, install the distribution's PREEMPT_RT kernel"
    return Finding("kernel", "note", f"{release}, not PREEMPT_RT", remedy)


def _governor() -> Finding:
    files = sorted(Path("/sys/devices/system/cpu").glob("cpu[0-9]*/cpufreq/scaling_governor"))
    kinds = {file.read_text().strip() for file in files}
    if kinds <= {"performance"}:
        return Finding("CPU governor", "ok", "performance" if kinds else "fixed frequency")
    remedy = "cpupower frequency-set -g performance"
    return Finding("CPU governor", "note", ", ".join(sorted(kinds)), remedy)


def _cores() -> Finding:
    count = len(os.sched_getaffinity(0))
    level = "ok" if count >= 2 else "note"
    return Finding("processors", level, f"{count} usable", "" if count >= 2 else "two are better")


_CHECKS: tuple[Callable[[], Finding], ...] = (
    _simbus,
    _socketcan,
    _cores,
    _scheduling,
    _memory,
    _kernel,
    _governor,
)


def register(parent: typer.Typer) -> None:
    """Add the command."""
    parent.command()(doctor)


def doctor(as_json: Annotated[bool, typer.Option("--json", help="One JSON line.")] = False) -> None:
    """Look at this machine and say what to mend before a robot runs on it."""
    out = Output(as_json)
    findings = [check() for check in _CHECKS]
    for f in findings:
        out.say(f"{f.level:8}{f.what:22}{f.found}")
        if f.remedy:
            out.say(f"{'':8}{'':22}-> {f.remedy}")
    ok = all(f.level != "problem" for f in findings)
    out.result({"ok": ok, "findings": [asdict(f) for f in findings]})
    if not ok:
        raise typer.Exit(FAILED)
