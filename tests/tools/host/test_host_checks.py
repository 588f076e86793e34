"""What `cdpr doctor` says of machines that differ from this one."""

from __future__ import annotations

import socket
import struct
from pathlib import Path

import pytest

from cdpr_tools.host import host_checks
from cdpr_tools.host.host_checks import (
    CanInterface,
    HostFinding,
    can_interface,
    list_interfaces,
    look_around,
    parse_link,
    preemption,
)

LOOPBACK = 772  # ARPHRD_LOOPBACK
CAN = 280
UP = 1


def attribute(kind: int, data: bytes) -> bytes:
    return struct.pack("=HH", 4 + len(data), kind) + data + bytes(-len(data) % 4)


def link(state: int | None, flags: int = UP, kind: bytes = b"can", queue: int = 10) -> bytes:
    """Return an RTM_NEWLINK message as linux/if_link.h and linux/can/netlink.h lay it out."""
    own = b""
    if state is not None:
        bit_timing = struct.pack("=8I", 500_000, 875, 125, 6, 7, 2, 1, 5)
        own = attribute(1, bit_timing) + attribute(4, struct.pack("=I", state))
    info = attribute(1, kind + b"\0") + (attribute(2 | 0x8000, own) if own else b"")
    head = struct.pack("=BxHiII", socket.AF_UNSPEC, CAN, 7, flags, 0)
    named = attribute(3, b"can0\0") + attribute(13, struct.pack("=I", queue))
    return head + named + attribute(18 | 0x8000, info)


def judged(message: bytes) -> HostFinding:
    interface = parse_link(message)
    assert interface is not None
    return can_interface(interface)


@pytest.mark.parametrize(
    ("message", "level", "words"),
    [
        (link(0, queue=1000), "ok", "error-active, queue of 1000 frames, 500 kbit/s"),
        (link(0), "note", "ip link set can0 txqueuelen 1000"),
        (link(1, queue=1000), "note", "termination"),
        (link(2, queue=1000), "note", "error-passive"),
        (link(3, queue=1000), "problem", "ip link set can0 type can restart"),
        (link(4, flags=0), "note", "ip link set can0 up type can bitrate"),
        (link(None, kind=b"vcan", queue=1000), "ok", "up, queue of 1000 frames"),
        (link(None, flags=0, kind=b"vcan"), "note", "ip link set can0 up"),
    ],
)
def test_a_can_interface_is_judged_by_what_the_kernel_tells(
    message: bytes, level: str, words: str
) -> None:
    finding = judged(message)
    assert (finding.what, finding.level) == ("CAN can0", level)
    assert words in f"{finding.found} {finding.remedy}"


def test_the_kernel_answers_in_the_same_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every machine has a loopback; only its type tells it from a CAN interface."""
    assert all(interface.name != "lo" for interface in list_interfaces())
    monkeypatch.setattr(host_checks, "_ARPHRD_CAN", LOOPBACK)
    (loopback,) = list_interfaces()
    queue = int(Path("/sys/class/net/lo/tx_queue_len").read_text())
    is_up = bool(int(Path("/sys/class/net/lo/flags").read_text(), 16) & UP)
    assert loopback == CanInterface("lo", is_up, True, queue, "up" if is_up else "down")


def test_what_is_cut_or_mangled_is_read_as_far_as_it_goes() -> None:
    whole = link(0)
    for end in range(16, len(whole)):
        parse_link(whole[:end])
        mangled = bytearray(whole)
        mangled[end] ^= 0xFF
        parse_link(bytes(mangled))


@pytest.mark.parametrize(
    ("version", "realtime", "command_line", "kind"),
    [
        ("#1 SMP PREEMPT_DYNAMIC Debian 6.1", "", "ro quiet", "PREEMPT_DYNAMIC"),
        ("#1 SMP PREEMPT_DYNAMIC", "", "preempt=full ro", "PREEMPT_DYNAMIC, mode full"),
        ("#1 SMP PREEMPT_RT Debian 6.1.1-1", "1", "", "PREEMPT_RT"),
        ("#1 SMP PREEMPT RT", "1", "", "PREEMPT_RT"),
        ("#1 SMP PREEMPT Tue", "", "", "PREEMPT"),
        ("#1 SMP Debian 5.10", "", "", "no preemption inside the kernel"),
    ],
)
def test_the_kinds_of_preemption(version: str, realtime: str, command_line: str, kind: str) -> None:
    assert preemption(version, realtime, command_line) == kind


@pytest.mark.parametrize(
    ("what", "files", "level", "remedy"),
    [
        ("clock source", {"current_clocksource": "tsc"}, "ok", ""),
        ("clock source", {"current_clocksource": "hpet"}, "note", "firmware"),
        (
            "clock source",
            {"current_clocksource": "acpi_pm", "available_clocksource": "tsc acpi_pm"},
            "note",
            "echo tsc",
        ),
        ("isolated processors", {"isolated": "2-3"}, "ok", ""),
        ("CPU governor", {"cpu0/cpufreq/scaling_governor": "powersave"}, "note", "performance"),
        ("CPU governor", {"cpu0/cpufreq/scaling_governor": "performance"}, "ok", ""),
    ],
)
def test_machines_of_another_kind(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    what: str,
    files: dict[str, str],
    level: str,
    remedy: str,
) -> None:
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text + "\n")
    monkeypatch.setattr(host_checks, "_CPUS", tmp_path)
    monkeypatch.setattr(host_checks, "_CLOCKS", tmp_path)
    found = next(finding for finding in look_around() if finding.what == what)
    assert found.level == level
    assert remedy in found.remedy
    assert bool(found.remedy) == (level != "ok")
