"""The log of all frames is readable by tools for candump's format."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cdpr_drivers.decode.candump import LogEntry, read_log
from cdpr_sim_bus.frame import EFF_FLAG, RTR_FLAG, FrameListener, FrameLog, pack_frame

StartBus = Callable[..., Any]
SYNC = pack_frame(0x080)


def logged(path: Path) -> list[LogEntry]:
    with path.open() as file:
        return list(read_log(path.name, file))


def told(path: Path) -> list[tuple[float, str, int, bytes]]:
    return [
        (one.frame.time_s, one.channel, one.frame.can_id, one.frame.data) for one in logged(path)
    ]


def test_all_frames_are_logged_with_bus_time_in_bus_order(
    tmp_path: Path, start_bus: StartBus, stub_node: type
) -> None:
    path = tmp_path / "frames.log"
    answers = (pack_frame(0x182, b"\xab\x01"), pack_frame(0x181, b""))
    node = stub_node(1, sync_period_s=0.01, answers=answers, timers=(0.0, 0.025))
    log = FrameLog(path)
    bus = start_bus(node, log.listener("can3"))
    member = bus.join()
    member.lead()
    for k in range(3):
        member.send(0x200 + k, bytes([k]))
        member.sync()
    member.send(0x1ABCDE00 | EFF_FLAG, b"12345678")
    member.send(0x321 | RTR_FLAG, b"")
    member.send(0x700, bytes(8))
    status = member.status()
    assert status["nodes"] == [1]
    bus.hub.stop()
    bus.thread.join(60.0)
    log.close()
    cycle = [(0x080, b""), (0x181, b""), (0x182, b"\xab\x01")]
    wanted = [(0.0, 0x701, b"\x05")]
    for k in range(3):
        wanted.append((0.01 * k, 0x200 + k, bytes([k])))
        # a timer that expires before the SYNC sends before it
        wanted += [(0.03, 0x701, b"\x05")] * (k == 2)
        wanted += [(round(0.01 * (k + 1), 6), *one) for one in cycle]
    wanted += [(0.03, 0x1ABCDE00, b"12345678"), (0.03, 0x321, b""), (0.03, 0x700, bytes(8))]
    assert told(path) == [(at, "can3", *rest) for at, *rest in wanted]
    assert len(wanted) == status["frames"]
    extended, remote = (one.frame for one in logged(path)[-3:-1])
    assert extended.extended and remote.remote


def play(path: Path, *order: int) -> bytes:
    """Log two buses, polled in this order at each instant. Return the file's content."""
    log = FrameLog(path)
    ears = [log.listener("left"), log.listener("right")]
    for k in range(5000):
        for number in order:
            ears[number].advance(0.001 * k)
            ears[number].receive(pack_frame(0x100 + k % 7, bytes([number])), 0.001 * k)
    for listener in ears:
        listener.close()
    return path.read_bytes()


def test_the_polling_order_of_buses_does_not_change_the_log(tmp_path: Path) -> None:
    one = play(tmp_path / "one.log", 0, 1)
    assert play(tmp_path / "other.log", 1, 0) == one
    channels = [frame.channel for frame in logged(tmp_path / "other.log")]
    assert channels == ["left", "right"] * 5000


def test_a_bus_whose_time_stands_does_not_fill_the_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cdpr_sim_bus.frame._MOST_WAITING", 8192)
    log = FrameLog(tmp_path / "frames.log")
    speaks, stands = log.listener("left"), log.listener("right")
    for k in range(20_000):
        speaks.receive(SYNC, 0.001 * k)
    assert isinstance(stands, FrameListener) and len(speaks.take(float("inf"))) < 8192
    log.close()


def test_two_simulators_write_to_different_files(tmp_path: Path) -> None:
    path = tmp_path / "frames.log"
    path.write_text("(0000000001.000000) can0 080#\n")
    log = FrameLog(path)
    with pytest.raises(OSError, match="another simulator is writing to it"):
        FrameLog(path)
    log.listener("can0").receive(SYNC, 0.5)
    log.close()
    assert path.read_text() == "(0000000000.500000) can0 080#\n"
    FrameLog(path).close()
    assert path.read_text() == ""


def test_a_recording_of_a_real_bus_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "frames.log"
    path.write_text("(1764335419.123456) can0 080#\n")
    with pytest.raises(OSError, match="is not a log of a simulator"):
        FrameLog(path)
    assert path.read_text() == "(1764335419.123456) can0 080#\n"


def test_a_full_disk_ends_the_log_but_not_the_bus(capsys: pytest.CaptureFixture[str]) -> None:
    log = FrameLog(Path("/dev/full"))
    listener = log.listener("can0")
    for k in range(10_000):
        listener.receive(SYNC, 0.001 * k)
    listener.close()
    assert capsys.readouterr().err == "frame log /dev/full: No space left on device; it ends here\n"


def test_the_environment_or_an_option_names_the_log_file(tmp_path: Path) -> None:
    path = tmp_path / "frames.log"
    script = """
from cdpr_tools.composition.simulator import OwnSimulator
for name in ("first", "second"):
    OwnSimulator("winch-mpp0923d", f"simbus:frame-log-{name}").stop()
"""
    environment = {"CDPR_SIM_FRAME_LOG": str(path), "PATH": "/usr/bin:/bin"}
    subprocess.run([sys.executable, "-c", script], env=environment, check=True, cwd=tmp_path)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["frames-2.log", "frames.log"]
    done = subprocess.run(
        [sys.executable, "-m", "cdpr_tools.cli", "sim", "up", "winch-mpp0923d",
         "--bus", "simbus:fl-x", "--frame-log", str(tmp_path / "nowhere" / "frames.log")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2 and "nowhere/frames.log: No such file" in done.stderr
    assert "Traceback" not in done.stderr and json.dumps(done.stdout) == '""'
