"""The soak finds nothing where all is well, and finds what leaks or gets lost."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cdpr_drivers.bus.batch import SingleFrameBatch
from cdpr_drivers.robot.session import Session
from cdpr_profiles import load_robot
from cdpr_tools.bench import soak as soak_bench
from cdpr_tools.bench.soak import Process, Soak, growth
from cdpr_tools.composition.session import open_robot
from tests.tools.robot_rig import OUT, ROOT, Simulator, robot_file, unique

pytestmark = pytest.mark.long

SHORT = ("--hours", "0.006", "--rate", "250")


def test_some_bus_time_leaks_nothing_and_loses_nothing():
    """Eight drives, less than a minute: the command itself, as for 24 hours."""
    done = subprocess.run(
        [sys.executable, "-m", "cdpr_tools.cli", "bench", "soak", *SHORT, "--json"],
        capture_output=True,
        check=False,
        text=True,
        timeout=280,
        cwd=ROOT,
    )
    told = json.loads(done.stdout.splitlines()[-1])
    assert (done.returncode, told["ok"], told["leaks"]) == (0, True, []), told
    assert told["bus_hours"] == pytest.approx(0.006, rel=1e-3)
    assert told["cycles"] >= 5_400
    assert told["drives"] == 8
    assert (told["lost_frames"], told["missed_answers"]) == (0, 0)
    for bus in told["buses"].values():
        # SYNC, 4 RPDOs and 4 TPDOs in each cycle, 10 heartbeats a second from each of 4 drives
        assert bus["frames_counted"] == pytest.approx(9 * told["cycles"] + 40 * 21.6, rel=0.01)
        assert bus["overruns"] == 0
        assert abs(bus["frames_counted"] - bus["frames_expected"]) <= bus["tolerance"]


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    """Two drives on two buses, enabled; legs of half a second."""
    monkeypatch.setattr(soak_bench, "_LEG_S", 1.5)
    path = robot_file(tmp_path, [("a", 1), ("b", 1)])
    simulator = Simulator(str(path), "--bus", f"simbus:{unique()}")
    name = simulator.ready["buses"]["a"]["bus"].removesuffix("-a")
    try:
        with open_robot(load_robot(path), [name], OUT) as opened:
            opened.simulator_pid = simulator.process.pid
            opened.enable()
            yield opened
            opened.disable()
    finally:
        simulator.close()


def test_a_limit_on_the_clock_ends_it_with_the_leg(session: Session):
    soak = Soak(session)
    soak.run(3600.0, lambda _: None, most_wall_s=0.1)
    assert soak.wall_s > 0.1
    assert 1.0 < soak.bus_s < 100.0


def soaked(session: Session, seconds: float, each_leg: Any = lambda _: None) -> dict[str, Any]:
    Soak(session).run(9.0, lambda _: None)
    soak = Soak(session)
    soak.run(seconds, each_leg)
    return soak.figures()


def test_memory_and_files_that_are_kept_are_found(session: Session):
    memory: list[bytearray] = []
    files: list[int] = []

    def leak(_: float) -> None:
        memory.append(bytearray(os.urandom(1 << 20)) * 32)
        files.append(os.dup(0))

    figures = soaked(session, 6.0, leak)
    for descriptor in files:
        os.close(descriptor)
    assert (figures["ok"], figures["leaks"]) == (False, ["master"])
    assert figures["memory_growth_KiB"]["master"] > soak_bench.MEMORY_LIMIT_KiB
    assert figures["open_files_growth"] == {"master": 2, "simulator": 0}


class _Leaky:
    """A port that forgets every tenth command."""

    def __init__(self, port: Any) -> None:
        self._port = port
        self._sent = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._port, name)

    def send(self, frame: Any) -> int:
        command = int.from_bytes(bytes(frame[:2]), "little") & 0x780 == 0x200
        self._sent += command
        return 16 if command and self._sent % 10 == 0 else int(self._port.send(frame))


def test_commands_that_never_reach_the_bus_are_found(session: Session):
    group = session.device.groups[1]
    leaky = SingleFrameBatch(_Leaky(group._port), group._layout.rpdos)
    group._commands, commands = leaky, group._commands
    figures = soaked(session, 3.0)
    group._commands = commands
    assert not figures["ok"]
    assert figures["buses"]["a"]["lost"] == 0
    gap = figures["buses"]["b"]["frames_expected"] - figures["buses"]["b"]["frames_counted"]
    assert gap == pytest.approx(300, abs=10)
    assert figures["lost_frames"] == pytest.approx(300, abs=10)


def test_growth_is_what_stays():
    sizes = [(100, 9), (900, 12), (130, 10), (150, 9)]
    assert growth([Process(*size) for size in sizes]) == Process(30, 0)
    assert growth([Process(100 + k, 9 + k) for k in range(10)]) == Process(5, 5)
