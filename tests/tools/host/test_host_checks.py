"""`cdpr doctor` on machines that differ from this one."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from cdpr_tools.host import host_checks
from cdpr_tools.host.host_checks import (
    can_interface,
    list_interfaces,
    look_around,
    preemption,
)


def link(state: str | None, flags: str = "UP", kind: str = "can", queue: int = 10) -> str:
    """Return the output of `ip -details -json link show` for a CAN interface and a loopback."""
    own = {"state": state, "bittiming": {"bitrate": 500_000, "sample_point": "0.875"}}
    info = {"info_kind": kind} | ({} if state is None else {"info_data": own})
    can = {"ifname": "can0", "flags": ["NOARP", flags], "txqlen": queue, "link_type": "can"}
    loopback = {"ifname": "lo", "flags": ["UP"], "txqlen": 1000, "link_type": "loopback"}
    return json.dumps([loopback, {**can, "linkinfo": info}])


@pytest.mark.parametrize(
    ("shown", "level", "words"),
    [
        (link("ERROR-ACTIVE", queue=1000), "ok", "error-active, queue of 1000 frames, 500 kbit/s"),
        (link("ERROR-ACTIVE"), "note", "ip link set can0 txqueuelen 1000"),
        (link("ERROR-WARNING", queue=1000), "note", "termination"),
        (link("ERROR-PASSIVE", queue=1000), "note", "error-passive"),
        (link("BUS-OFF", queue=1000), "problem", "ip link set can0 type can restart"),
        (link("STOPPED", flags=""), "note", "ip link set can0 up type can bitrate"),
        (link(None, kind="vcan", queue=1000), "ok", "up, queue of 1000 frames"),
        (link(None, flags="", kind="vcan"), "note", "ip link set can0 up"),
    ],
)
def test_a_can_interface_is_checked_by_the_output_of_ip(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shown: str, level: str, words: str
) -> None:
    program = tmp_path / "ip"
    program.write_text(f"#!/bin/sh\ncat <<'END'\n{shown}\nEND\n")
    program.chmod(0o700)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    (found,) = map(can_interface, list_interfaces())
    assert (found.what, found.level) == ("CAN can0", level)
    assert words in f"{found.found} {found.remedy}"


def test_doctor_asks_to_install_ip_if_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    assert list_interfaces() == []
    (found,) = (one for one in look_around() if one.what == "SocketCAN")
    assert found.level == "note"
    assert "iproute2" in found.remedy or "modprobe" in found.remedy  # kernel without CAN


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
def test_kinds_of_preemption_are_recognised(
    version: str, realtime: str, command_line: str, kind: str
) -> None:
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
def test_problems_of_other_machines_are_reported_with_a_remedy(
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


def test_folders_that_cannot_be_written_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("XDG_STATE_HOME", "XDG_RUNTIME_DIR"):
        monkeypatch.setenv(name, "/proc/nowhere")
    found = {one.what: one for one in look_around()}
    assert found["compiled kernels"].level == "ok"
    for what in ("state, recordings", "sockets"):
        assert found[what].level == "note"
        assert "/proc/nowhere/cdpr-rt" in found[what].found and found[what].remedy
