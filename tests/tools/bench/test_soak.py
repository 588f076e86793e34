"""The soak test reports leaks and lost frames, and nothing otherwise."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from cdpr_profiles import load_robot
from cdpr_tools.bench import soak as soak_bench
from cdpr_tools.bench.harness import Figures
from cdpr_tools.bench.soak import Process, Soak, growth
from cdpr_tools.composition.session import Session, open_robot
from tests.tools.robot_rig import OUT, ROOT, Simulator, robot_file, unique

pytestmark = pytest.mark.long

SHORT = ("--hours", "0.003", "--rate", "250")


def test_a_short_soak_finds_no_leak_and_no_loss():
    """The command runs with eight drives for less than a minute, as it would for 24 hours."""
    done = subprocess.run(
        [sys.executable, "-m", "cdpr_tools.cli", "bench", "soak", *SHORT, "--json"],
        capture_output=True,
        check=False,
        text=True,
        timeout=280,
        cwd=ROOT,
    )
    told = json.loads(done.stdout.splitlines()[-1])
    assert (done.returncode, told["ok"]) == (0, True), told
    assert told["bus_hours"] == pytest.approx(0.003, rel=1e-3)
    assert told["cycles"] >= 2_700
    assert told["lost_frames"] == 0
    for bus in told["rows"].values():
        # SYNC, 4 RPDOs and 4 TPDOs per cycle, and 10 heartbeats per second from each of 4 drives
        assert bus["frames_counted"] == pytest.approx(9 * told["cycles"] + 40 * 10.8, rel=0.01)
        assert bus["overruns"] == 0
        assert abs(bus["frames_counted"] - bus["frames_expected"]) <= bus["tolerance"]


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    """Yield a session of two enabled drives on two buses, with legs of half a second."""
    monkeypatch.setattr(soak_bench, "LEG_S", 1.5)
    path = robot_file(tmp_path, [("a", 1), ("b", 1)])
    simulator = Simulator(str(path), "--bus", f"simbus:{unique()}")
    name = simulator.ready["buses"]["a"]["bus"].removesuffix("-a")
    try:
        with open_robot(load_robot(path), [name], OUT) as opened:
            opened.enable()
            yield opened
            opened.disable()
    finally:
        simulator.close()


def soaked(session: Session, seconds: float, each_leg: Any = lambda _: None) -> Figures:
    Soak(session).run(9.0, lambda _: None)
    soak = Soak(session)
    soak.run(seconds, each_leg)
    return soak.figures("soak")


def test_leaked_memory_and_files_are_found(session: Session):
    memory: list[bytearray] = []
    files: list[int] = []

    def leak(_: float) -> None:
        memory.append(bytearray(os.urandom(1 << 20)) * 32)
        files.append(os.dup(0))

    figures = soaked(session, 6.0, leak)
    for descriptor in files:
        os.close(descriptor)
    assert "more memory and 2 more open files" in figures.error
    assert figures.more["memory_growth_KiB"] > soak_bench.MEMORY_LIMIT_KiB
    assert figures.more["open_files_growth"] == 2


def test_lost_commands_are_found(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    port = session.device.groups[1].network.reader.port
    send, commands = port.send, count(1)

    def send_nine_of_ten(frame: Any) -> int:
        command = int.from_bytes(bytes(frame[:2]), "little") & 0x780 == 0x200
        return 16 if command and next(commands) % 10 == 0 else send(frame)

    with monkeypatch.context() as patched:
        patched.setattr(port, "send", send_nine_of_ten)
        figures = soaked(session, 3.0)
    assert figures.rows["bus a"]["lost"] == 0
    gap = figures.rows["bus b"]["frames_expected"] - figures.rows["bus b"]["frames_counted"]
    assert gap == pytest.approx(300, abs=10)
    assert "frames were lost" in figures.error
    assert figures.more["lost_frames"] == pytest.approx(300, abs=10)


def test_growth_is_the_difference_of_the_minima_of_both_halves():
    sizes = [(100, 9), (900, 12), (130, 10), (150, 9)]
    assert growth([Process(*size) for size in sizes]) == Process(30, 0)
    assert growth([Process(100 + k, 9 + k) for k in range(10)]) == Process(5, 5)
