"""Checks whether this machine suits a control loop; each finding has its remedy."""

from __future__ import annotations

import gzip
import json
import os
import platform
import re
import resource
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdpr_profiles.user_folders import can_write, state_folder, temporary_folder
from cdpr_tools.daemon.paths import runtime_folder

_MEMLOCK_BYTES = 512 << 20
_CPUS = Path("/sys/devices/system/cpu")
_CLOCKS = Path("/sys/devices/system/clocksource/clocksource0")
# a cycle of 16 axes with its acyclic traffic and heartbeats, times two
_QUEUE_FRAMES = 128
_GOOD_CLOCKS = ("tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter")
_IP_S = 10.0
_LIMITS_FILE = "/etc/security/limits.d/realtime.conf"


@dataclass(frozen=True)
class HostFinding:
    """One check: `level` is ok, note (works with a drawback) or problem (will not work)."""

    what: str
    level: str
    found: str
    remedy: str = ""


def look_around() -> Iterator[HostFinding]:
    """Yield all findings; changes nothing."""
    for check in _CHECKS:
        yield check()
    yield from _folders()
    for interface in list_interfaces():
        yield can_interface(interface)


def _simbus() -> HostFinding:
    try:
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET).close()
    except OSError as error:
        return HostFinding("embedded bus", "problem", error.strerror or "", "run on Linux")
    return HostFinding("embedded bus", "ok", "packet sockets are available")


def _socketcan() -> HostFinding:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as error:
        remedy = "load the modules: modprobe can_raw vcan; simbus: works without"
        return HostFinding("SocketCAN", "note", error.strerror or "not available", remedy)
    if shutil.which("ip") is None:
        remedy = "install iproute2, which shows the CAN interfaces"
        return HostFinding("SocketCAN", "note", "interfaces unknown: no command `ip`", remedy)
    names = ", ".join(interface.name for interface in list_interfaces())
    return HostFinding("SocketCAN", "ok", f"interfaces: {names or 'none yet'}")


def can_interface(interface: CanInterface) -> HostFinding:
    """Check one CAN interface: its link, its transmit queue, and the state of its controller."""
    name = interface.name
    what = f"CAN {name}"
    found = f"{interface.state}, queue of {interface.queue_frames} frames"
    if interface.bitrate_bit_s:
        found += f", {interface.bitrate_bit_s / 1000:g} kbit/s"
    if interface.state == "bus-off":
        remedy = f"repair the wiring, then: ip link set {name} type can restart"
        return HostFinding(what, "problem", found, remedy)
    if not interface.is_up:
        kind = "" if interface.is_virtual else " type can bitrate 1000000 restart-ms 100"
        return HostFinding(what, "note", found, f"ip link set {name} up{kind}")
    if interface.state not in ("error-active", "up"):
        remedy = "check cable, termination, bit rate and the power of the other nodes"
        return HostFinding(what, "note", found, remedy)
    if interface.queue_frames < _QUEUE_FRAMES:
        remedy = f"a burst of commands may not fit: ip link set {name} txqueuelen 1000"
        return HostFinding(what, "note", found, remedy)
    return HostFinding(what, "ok", found)


def _folders() -> Iterator[HostFinding]:
    # imported here: the other checks do not need numba
    from cdpr_rt.jit import machine_code_folder  # noqa: PLC0415

    kept = machine_code_folder()
    what, remedy = "compiled kernels", "set NUMBA_CACHE_DIR to a permanent folder of yours"
    if kept is None:
        yield HostFinding(what, "note", "not kept: compiled again at each start", remedy)
    elif kept.is_relative_to(temporary_folder()):
        yield HostFinding(what, "note", f"kept only until the next restart: {kept}", remedy)
    else:
        yield HostFinding(what, "ok", f"kept in {kept}")
    for what, folder, remedy in (
        ("state, recordings", state_folder(), "set XDG_STATE_HOME to a folder of yours"),
        ("sockets", runtime_folder(), "set XDG_RUNTIME_DIR, or give --socket to each command"),
    ):
        if can_write(folder):
            yield HostFinding(what, "ok", f"in {folder}")
        else:
            yield HostFinding(what, "note", f"{folder} cannot be written", remedy)


def _serial_ports() -> HostFinding:
    ports = [p for kind in ("ttyACM*", "ttyUSB*") for p in sorted(Path("/dev").glob(kind))]
    closed = [str(p) for p in ports if not os.access(p, os.R_OK | os.W_OK)]
    if closed:
        remedy = f"join their group: usermod -aG {_group_of(Path(closed[0]))} $USER"
        return HostFinding("serial adapters", "note", f"no permission: {', '.join(closed)}", remedy)
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
    remedy = "the loop needs a core for itself: use a machine with two or more"
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
    """Try SCHED_FIFO briefly, because a control group may forbid what the limits allow."""
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
        return HostFinding("locked memory", "ok", "enough memory may be locked")
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
    """Return the kernel's preemption, from its version, /sys/kernel/realtime and /proc/cmdline.

    If the command line sets the mode of a kernel that can change it, the result includes it.
    """
    named = re.search(r"\bPREEMPT\w*", version)
    if realtime == "1":
        return "PREEMPT_RT"
    mode = re.search(r"\bpreempt=(\w+)", command_line)
    kind = named[0] if named else "no preemption inside the kernel"
    return f"{kind}, mode {mode[1]}" if mode else kind


def _preemption_built_in(release: str) -> str:
    """Return the default mode of a kernel that can change it; empty if unknown."""
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
        return HostFinding("clock source", "ok", used or "unknown")
    found = f"{used}: reading the clock is slow"
    available = _text(_CLOCKS / "available_clocksource").split()
    better = next((clock for clock in available if clock in _GOOD_CLOCKS), "")
    if better:
        return HostFinding(
            "clock source", "note", found, f"echo {better} > {_CLOCKS}/current_clocksource"
        )
    remedy = "dmesg shows why the kernel rejected tsc; a firmware update may help"
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
        return HostFinding("isolated processors", "ok", "none, and too few cores to isolate one")
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


@dataclass(frozen=True)
class CanInterface:
    """One CAN interface; `state` is the controller's if it reports one, else up or down."""

    name: str
    is_up: bool
    is_virtual: bool
    queue_frames: int
    state: str
    bitrate_bit_s: int = 0

    @classmethod
    def of(cls, link: Mapping[str, Any]) -> CanInterface:
        """Return the interface from an entry of `ip -details -json link`."""
        info = link.get("linkinfo", {})
        data, is_up = info.get("info_data", {}), "UP" in link["flags"]
        state = str(data.get("state", "up")).lower() if is_up else "down"
        bitrate = data.get("bittiming", {}).get("bitrate", 0)
        is_virtual = info.get("info_kind") != "can"
        return cls(link["ifname"], is_up, is_virtual, link.get("txqlen", 0), state, bitrate)


def list_interfaces() -> list[CanInterface]:
    """Return the CAN interfaces that `ip` shows; none if the machine lacks this command."""
    command = ("ip", "-details", "-json", "link", "show")
    try:
        done = subprocess.run(command, capture_output=True, timeout=_IP_S, check=True)
        links = json.loads(done.stdout)
    except (OSError, subprocess.SubprocessError, ValueError):
        return []
    return [CanInterface.of(link) for link in links if link.get("link_type") == "can"]
