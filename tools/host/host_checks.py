"""What can be found out about this machine for a control loop, each finding with its remedy."""

from __future__ import annotations

import gzip
import os
import platform
import re
import resource
import socket
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

_MEMLOCK_BYTES = 512 << 20
_CPUS = Path("/sys/devices/system/cpu")
_CLOCKS = Path("/sys/devices/system/clocksource/clocksource0")
# a cycle of 16 axes, its acyclic traffic and heartbeats, with as much again to spare
_QUEUE_FRAMES = 128
_GOOD_CLOCKS = ("tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter")
_LIMITS_FILE = "/etc/security/limits.d/realtime.conf"


@dataclass(frozen=True)
class HostFinding:
    """One thing looked at: `level` is ok, note (works, but) or problem (will not work)."""

    what: str
    level: str
    found: str
    remedy: str = ""


def look_around() -> Iterator[HostFinding]:
    """Yield everything that can be found out without changing anything."""
    for check in _CHECKS:
        yield check()
    for interface in list_interfaces():
        yield can_interface(interface)


def _simbus() -> HostFinding:
    try:
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET).close()
    except OSError as error:
        return HostFinding("embedded bus", "problem", error.strerror or "", "run on Linux")
    return HostFinding("embedded bus", "ok", "packet sockets are there")


def _socketcan() -> HostFinding:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as error:
        remedy = "load the modules: modprobe can_raw vcan; simbus: works without"
        return HostFinding("SocketCAN", "note", error.strerror or "not available", remedy)
    names = ", ".join(interface.name for interface in list_interfaces())
    return HostFinding("SocketCAN", "ok", f"interfaces: {names or 'none yet'}")


def can_interface(interface: CanInterface) -> HostFinding:
    """Judge one CAN interface: is it up, does its queue hold a cycle, how is its controller."""
    name = interface.name
    what = f"CAN {name}"
    found = f"{interface.state}, queue of {interface.queue_frames} frames"
    if interface.bitrate_bit_s:
        found += f", {interface.bitrate_bit_s / 1000:g} kbit/s"
    if interface.state == "bus-off":
        remedy = f"mend the wire, then: ip link set {name} type can restart"
        return HostFinding(what, "problem", found, remedy)
    if not interface.is_up:
        kind = "" if interface.is_virtual else " type can bitrate 1000000 restart-ms 100"
        return HostFinding(what, "note", found, f"ip link set {name} up{kind}")
    if interface.state not in ("error-active", "up"):
        remedy = "look at cable, termination, bit rate and the power of the other nodes"
        return HostFinding(what, "note", found, remedy)
    if interface.queue_frames < _QUEUE_FRAMES:
        remedy = f"a burst of commands may not fit: ip link set {name} txqueuelen 1000"
        return HostFinding(what, "note", found, remedy)
    return HostFinding(what, "ok", found)


def _serial_ports() -> HostFinding:
    ports = [p for kind in ("ttyACM*", "ttyUSB*") for p in sorted(Path("/dev").glob(kind))]
    closed = [str(p) for p in ports if not os.access(p, os.R_OK | os.W_OK)]
    if closed:
        remedy = f"join their group: usermod -aG {_group_of(Path(closed[0]))} $USER"
        return HostFinding("serial adapters", "note", f"not for you: {', '.join(closed)}", remedy)
    return HostFinding("serial adapters", "ok", ", ".join(map(str, ports)) or "none plugged in")


def _group_of(path: Path) -> str:
    try:
        return path.group()
    except (KeyError, OSError):
        return "dialout"


def _cores() -> HostFinding:
    count = len(os.sched_getaffinity(0))
    if count >= 2:
        return HostFinding("processors", "ok", f"{count} usable")
    remedy = "the loop wants one to itself: two are better"
    return HostFinding("processors", "note", f"{count} usable", remedy)


def _scheduling() -> HostFinding:
    soft, hard = resource.getrlimit(resource.RLIMIT_RTPRIO)
    if os.geteuid() != 0 and max(soft, hard) <= 0:
        remedy = f"add '@realtime - rtprio 90' to {_LIMITS_FILE}, join that group, log in again"
        return HostFinding("real-time scheduling", "note", "SCHED_FIFO is not allowed", remedy)
    refused = _fifo_refused()
    if refused:
        remedy = "this control group has no real-time share: start it as a systemd service"
        return HostFinding("real-time scheduling", "note", f"SCHED_FIFO: {refused}", remedy)
    return HostFinding("real-time scheduling", "ok", "SCHED_FIFO is allowed")


def _fifo_refused() -> str:
    """Try it for a moment, as what the limits allow a control group may still forbid."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, *before)
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _throttling() -> HostFinding:
    text = _text(Path("/proc/sys/kernel/sched_rt_runtime_us"))
    period = _text(Path("/proc/sys/kernel/sched_rt_period_us"))
    if not text or not period:
        return HostFinding("real-time throttling", "ok", "not there")
    if int(text) < 0:
        return HostFinding("real-time throttling", "ok", "off")
    share = 100.0 * int(text) / int(period)
    found = f"real-time processes get {share:.3g} % of each {int(period) / 1e6:g} s"
    if share >= 90.0:
        return HostFinding("real-time throttling", "ok", found)
    return HostFinding(
        "real-time throttling", "note", found, "sysctl -w kernel.sched_rt_runtime_us=950000"
    )


def _memory() -> HostFinding:
    _, hard = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if os.geteuid() == 0 or hard == resource.RLIM_INFINITY or hard >= _MEMLOCK_BYTES:
        return HostFinding("locked memory", "ok", "enough may be locked")
    remedy = f"add '@realtime - memlock unlimited' to {_LIMITS_FILE}, log in again"
    return HostFinding("locked memory", "note", f"only {hard >> 10} KiB may be locked", remedy)


def _kernel() -> HostFinding:
    release = platform.release()
    kind = preemption(
        platform.version(), _text(Path("/sys/kernel/realtime")), _text(Path("/proc/cmdline"))
    )
    if kind == "PREEMPT_RT":
        return HostFinding("kernel", "ok", f"{release}, {kind}")
    remedy = "for a real robot, install the distribution's PREEMPT_RT kernel"
    if kind == "PREEMPT_DYNAMIC":
        kind += f", {_preemption_built_in(release) or 'its default mode'}"
        remedy += "; until then, boot with preempt=full"
    return HostFinding("kernel", "note", f"{release}, {kind}, not PREEMPT_RT", remedy)


def preemption(version: str, realtime: str, command_line: str) -> str:
    """Return the kind of preemption by the kernel's version, /sys/kernel/realtime, /proc/cmdline.

    The mode of a kernel that can change it is included where the command line sets one.
    """
    named = re.search(r"\bPREEMPT\w*", version)
    if realtime == "1":
        return "PREEMPT_RT"
    mode = re.search(r"\bpreempt=(\w+)", command_line)
    kind = named[0] if named else "no preemption inside the kernel"
    return f"{kind}, mode {mode[1]}" if mode else kind


def _preemption_built_in(release: str) -> str:
    """Return the default mode of a kernel that can change it; empty if not known."""
    try:
        text = gzip.decompress(Path("/proc/config.gz").read_bytes()).decode()
    except OSError:
        text = _text(Path(f"/boot/config-{release}"))
    mode = re.search(r"^CONFIG_PREEMPT_(NONE|VOLUNTARY|LAZY)=y$", text, re.MULTILINE)
    if mode:
        return f"mode {mode[1].lower()}"
    return "mode full" if "\nCONFIG_PREEMPT=y\n" in text else ""


def _timers() -> HostFinding:
    resolution_s = time.clock_getres(time.CLOCK_MONOTONIC)
    if resolution_s <= 1e-6:
        return HostFinding("timers", "ok", "high resolution")
    remedy = "boot without highres=off and nohz=off; needs CONFIG_HIGH_RES_TIMERS"
    return HostFinding("timers", "problem", f"steps of {1e3 * resolution_s:g} ms", remedy)


def _clock_source() -> HostFinding:
    used = _text(_CLOCKS / "current_clocksource")
    if not used or used in _GOOD_CLOCKS:
        return HostFinding("clock source", "ok", used or "not told")
    found = f"{used}: each look at the clock is slow"
    available = _text(_CLOCKS / "available_clocksource").split()
    better = next((clock for clock in available if clock in _GOOD_CLOCKS), "")
    if better:
        return HostFinding(
            "clock source", "note", found, f"echo {better} > {_CLOCKS}/current_clocksource"
        )
    remedy = "dmesg tells why tsc was given up; a firmware update may mend it"
    return HostFinding("clock source", "note", found, remedy)


def _governor() -> HostFinding:
    files = sorted(_CPUS.glob("cpu[0-9]*/cpufreq/scaling_governor"))
    kinds = {_text(file) for file in files}
    if kinds <= {"performance"}:
        return HostFinding("CPU governor", "ok", "performance" if kinds else "fixed frequency")
    remedy = "cpupower frequency-set -g performance"
    return HostFinding("CPU governor", "note", ", ".join(sorted(kinds)), remedy)


def _isolation() -> HostFinding:
    isolated = _text(_CPUS / "isolated")
    if isolated:
        return HostFinding("isolated processors", "ok", isolated)
    count = os.cpu_count() or 1
    if count < 3:
        return HostFinding("isolated processors", "ok", "none, and none to spare")
    last = count - 1
    remedy = f"boot with isolcpus=managed_irq,domain,{last} nohz_full={last} rcu_nocbs={last}"
    return HostFinding("isolated processors", "note", "none", remedy)


def _text(path: Path) -> str:
    try:
        return path.read_text().strip()
    except OSError:
        return ""


_CHECKS: tuple[Callable[[], HostFinding], ...] = (
    _simbus,
    _socketcan,
    _serial_ports,
    _cores,
    _isolation,
    _governor,
    _scheduling,
    _throttling,
    _memory,
    _kernel,
    _timers,
    _clock_source,
)


# linux/rtnetlink.h, linux/if_link.h, linux/if_arp.h, linux/can/netlink.h
_RTM_NEWLINK, _RTM_GETLINK, _NLMSG_DONE = 16, 18, 3
_REQUEST_DUMP = 0x301
_TXQLEN, _IFNAME, _LINKINFO = 13, 3, 18
_INFO_KIND, _INFO_DATA = 1, 2
_BITTIMING, _STATE = 1, 4
_ARPHRD_CAN, _IFF_UP = 280, 1
_STATES = ("error-active", "error-warning", "error-passive", "bus-off", "stopped", "sleeping")
_NESTED = 0x3FFF  # without the flags of an attribute's type

_MESSAGE = struct.Struct("=IHHII")
_LINK = struct.Struct("=BxHiII")
_ATTRIBUTE = struct.Struct("=HH")
_U32 = struct.Struct("=I")


@dataclass(frozen=True)
class CanInterface:
    """One CAN interface; `state` is down, up where a controller has none to tell, or its own."""

    name: str
    is_up: bool
    is_virtual: bool
    queue_frames: int
    state: str
    bitrate_bit_s: int = 0


def list_interfaces() -> list[CanInterface]:
    """Return the CAN interfaces there are, by rtnetlink; none where the kernel cannot be asked."""
    try:
        with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as kernel:
            size = _MESSAGE.size + _LINK.size
            head = _MESSAGE.pack(size, _RTM_GETLINK, _REQUEST_DUMP, 1, 0)
            kernel.send(head + _LINK.pack(socket.AF_UNSPEC, 0, 0, 0, 0))
            return list(_answers(kernel))
    except OSError:
        return []


def _answers(kernel: socket.socket) -> Iterator[CanInterface]:
    while True:
        data = kernel.recv(1 << 17)
        while len(data) >= _MESSAGE.size:
            size, kind, *_ = _MESSAGE.unpack_from(data)
            if kind != _RTM_NEWLINK:
                return
            interface = parse_link(data[_MESSAGE.size : size])
            if interface is not None:
                yield interface
            data = data[size + -size % 4 :]


def parse_link(data: bytes) -> CanInterface | None:
    """Return what an RTM_NEWLINK message tells, without its header; None unless it is CAN."""
    _, kind, _, flags, _ = _LINK.unpack_from(data)
    if kind != _ARPHRD_CAN:
        return None
    found = _attributes(data[_LINK.size :])
    info = _attributes(found.get(_LINKINFO, b""))
    can_data = _attributes(info.get(_INFO_DATA, b""))
    is_up = bool(flags & _IFF_UP)
    state = "up" if is_up else "down"
    if is_up and _STATE in can_data:
        state = _STATES[min(_number(can_data[_STATE]), len(_STATES) - 1)]
    return CanInterface(
        name=found.get(_IFNAME, b"").rstrip(b"\0").decode(errors="replace"),
        is_up=is_up,
        is_virtual=info.get(_INFO_KIND, b"").rstrip(b"\0") != b"can",
        queue_frames=_number(found.get(_TXQLEN, b"")),
        state=state,
        bitrate_bit_s=_number(can_data.get(_BITTIMING, b"")),
    )


def _number(data: bytes) -> int:
    return int(_U32.unpack_from(data)[0]) if len(data) >= _U32.size else 0


def _attributes(data: bytes) -> dict[int, bytes]:
    found: dict[int, bytes] = {}
    while len(data) >= _ATTRIBUTE.size:
        size, kind = _ATTRIBUTE.unpack_from(data)
        if size < _ATTRIBUTE.size:
            break
        found[kind & _NESTED] = data[_ATTRIBUTE.size : size]
        data = data[size + -size % 4 :]
    return found
