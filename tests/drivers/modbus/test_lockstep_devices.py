"""The answers of simulated Modbus devices in lockstep depend only on bus time.

The bus is a stand-in that this process leads. It updates the physics board in steps of 1 ms, as
simulated drives do. The devices are real processes on real lines. Some are stopped (SIGSTOP) for a
while during a request.
"""

from __future__ import annotations

import math
import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cdpr_drivers.modbus.safety_io import SafetyIo, SafetyIoError
from cdpr_drivers.modbus.tension import TensionSampler
from cdpr_drivers.robot.rail import ModbusRailAxis, MoveConditions, move
from cdpr_profiles.places import SHIPPED
from cdpr_profiles.rail import load_rail
from cdpr_profiles.tension_sensor import load_tension_sensors
from cdpr_rt.core.clock import LockstepClock
from cdpr_sim_bus.physics_board import BoardAxis, PhysicsBoard, SafetyIoFault
from tests.drivers.modbus.load_cell_rig import LoadCellRig
from tests.drivers.modbus.safety_rig import (
    SafetyIoProcess,
    board_file,
    patient_profile,
    ready,
    start,
)

STEP_S = 1e-3
HELD_UP_S = 0.6  # much longer than any timeout of the lines


class BoardBus:
    """Bus time that advances in steps and updates the board at each."""

    def __init__(self, board: PhysicsBoard, tension_N: Callable[[float], float]) -> None:
        self.now_s, self.next_s, self.gone = 0.0, math.inf, False
        self._axes = [board.axis(i) for i in range(board.axes)]
        self._tension_N = tension_N
        self._steps = 0
        self.seen: list[tuple[int, bool, bool]] = []
        """Step, power and brake of the first axis at each change."""
        self._publish()

    def go(self, until_s: float) -> bool:
        while (self._steps + 1) * STEP_S <= until_s + 1e-9:
            self._steps += 1
            self.now_s = self._steps * STEP_S
            self._publish()
        self.now_s = max(self.now_s, until_s)
        return False

    def _publish(self) -> None:
        for axis in self._axes:
            axis.publish(self.now_s, self._tension_N(self.now_s), 0.0, 0.0, False)
        first: BoardAxis = self._axes[0]
        state = first.allows_power(self.now_s), first.releases_brake(self.now_s)
        if not self.seen or self.seen[-1][1:] != state:
            self.seen.append((self._steps, *state))


@contextmanager
def held_up(process: subprocess.Popen[bytes] | subprocess.Popen[str]) -> Iterator[None]:
    """Stop a process for a while, starting now."""
    os.kill(process.pid, signal.SIGSTOP)
    going_on = threading.Timer(HELD_UP_S, os.kill, (process.pid, signal.SIGCONT))
    going_on.start()
    try:
        yield
    finally:
        going_on.join()


def pulled(time_s: float) -> float:
    """Return a tension that always changes."""
    return 40.0 + 30.0 * math.sin(9.0 * time_s) + 5.0 * math.sin(120.0 * time_s)


def readings(folder: Path, *, disturbed: bool) -> list[tuple[float, ...]]:
    """Return the readings of three cells in each of 400 cycles."""
    folder.mkdir()
    whole = load_tension_sensors("rtu-load-cells-8")
    profile = whole.model_copy(update={"sensors": whole.sensors[:3]})
    told: list[tuple[float, ...]] = []
    with LoadCellRig("rtu-load-cells-8", folder, 8, lockstep=True) as rig:
        bus = BoardBus(rig.board, pulled)
        clock = LockstepClock([bus])
        with TensionSampler(profile, rig.port, clock) as sampler:
            for cycle in range(400):
                if disturbed and cycle in (50, 333):
                    with held_up(rig.process):
                        clock.sleep(2 * profile.period_s)
                elif cycle in (50, 333):
                    clock.sleep(2 * profile.period_s)
                clock.sleep_until(bus.now_s + 2 * STEP_S)
                sampler.exchange.update()
                feedback = sampler.exchange.feedback
                told.append((*feedback.tension_N, *feedback.time_s, *feedback.age_s))
            assert sampler.errors == ["", "", ""]
    return told


def test_delays_of_the_load_cell_process_do_not_change_readings(tmp_path: Path) -> None:
    calm = readings(tmp_path / "calm", disturbed=False)
    assert readings(tmp_path / "disturbed", disturbed=True) == calm
    # each reading is that at the time of its request, filtered with 15 Hz
    asked = {row[3]: row[0] for row in calm if math.isfinite(row[3])}
    assert len(asked) > 15
    smooth = [tension - 40.0 - 30.0 * math.sin(9.0 * (t - 0.021)) for t, tension in asked.items()]
    assert max(map(abs, smooth[2:])) < 6.0
    # it arrives after its transmission time
    ages = [row[6] for row in calm if math.isfinite(row[6])]
    assert min(ages) > 19 * 11 / 115200


def test_a_silent_or_truncated_cell_becomes_stale_in_bus_time(tmp_path: Path) -> None:
    profile = load_tension_sensors("rtu-load-cell-1")
    with LoadCellRig("rtu-load-cell-1", tmp_path, 1, lockstep=True) as rig:
        clock = LockstepClock([BoardBus(rig.board, pulled)])
        with TensionSampler(profile, rig.port, clock) as sampler:
            sampler.await_readings(1.0)
            for fault, said in (("silent", "no answer"), ("truncated", "cut off after 8 of 11")):
                rig.tell(f"{fault} 1")
                clock.sleep(profile.stale_after_s + 3 * profile.period_s)
                sampler.exchange.update()
                assert "stale" in sampler.exchange.reason()
                assert said in sampler.errors[0]
                rig.tell("mend 1")
                clock.sleep(2 * profile.period_s)
                sampler.exchange.update()
                assert sampler.exchange.reason() == ""


@contextmanager
def safety_lab(folder: Path) -> Iterator[tuple[SafetyIoProcess, BoardBus, LockstepClock]]:
    folder.mkdir()
    with board_file() as path, PhysicsBoard.create(path, 2, lockstep=True) as board:
        bus = BoardBus(board, lambda _: 0.0)
        io_device = SafetyIoProcess(patient_profile(folder), "--board", path)
        bus.seen.clear()
        try:
            yield io_device, bus, LockstepClock([bus])
        finally:
            io_device.close()


def session(folder: Path, *, disturbed: bool) -> list[tuple[int, bool, bool]]:
    """Return when power and brake switched in a session with a safety I/O."""
    with safety_lab(folder) as (io_device, bus, clock), SafetyIo(io_device.profile(), clock) as io:
        io.energise()
        if disturbed:
            with held_up(io_device.process):
                io.release_brakes("winch 1")
                io.await_brakes(True, "winch 1")
        else:
            io.release_brakes("winch 1")
            io.await_brakes(True, "winch 1")
        for _ in range(100):
            clock.sleep_until(clock.now_s + 2 * STEP_S)
            assert (io.alarm(), io.stop_reason()) == ("", "")
        io.close()
        return bus.seen


def test_delays_of_the_safety_io_do_not_change_when_contactor_and_brake_switch(
    tmp_path: Path,
) -> None:
    calm = session(tmp_path / "calm", disturbed=False)
    assert [seen[1:] for seen in calm] == [
        (False, False),
        (True, False),
        (True, True),
        (True, False),
        (False, False),
    ]
    assert session(tmp_path / "disturbed", disturbed=True) == calm


def test_the_watchdog_of_the_device_counts_bus_time(tmp_path: Path) -> None:
    with safety_lab(tmp_path / "lab") as (io_device, bus, clock):
        io = SafetyIo(io_device.profile(), clock).open()
        io.energise()
        fed_s = io.state.at_s
        time.sleep(1.5)  # longer than the watchdog's 1 s, but wall-clock time
        bus.go(fed_s + 0.9)  # without a poll
        assert bus.seen[-1][1]
        bus.go(fed_s + 1.1)
        assert not bus.seen[-1][1]
        dropped_s = bus.seen[-1][0] * STEP_S
        assert fed_s + 1.0 + 0.015 <= dropped_s <= fed_s + 1.0 + 0.015 + 0.1
        clock.sleep(0.1)
        assert "the device's own watchdog" in io.alarm() or "did not stay closed" in io.alarm()
        io.close()


def answer_to_third_party(io_device: SafetyIoProcess) -> bytes:
    """Return the answer to a third party's request for the discrete inputs 0 to 7."""
    with socket.create_connection(("127.0.0.1", io_device.port), 10.0) as third_party:
        third_party.sendall(bytes.fromhex("0001 0000 0006 01 02 0000 0008"))
        return third_party.recv(100)


@pytest.mark.parametrize("fault", [SafetyIoFault.SILENT, SafetyIoFault.TRUNCATED])
def test_a_silent_safety_io_trips_in_bus_time(tmp_path: Path, fault: SafetyIoFault) -> None:
    with safety_lab(tmp_path / "lab") as (io_device, _, clock):
        io = SafetyIo(io_device.profile(), clock).open()
        io.energise()
        io_device.break_(fault)
        assert answer_to_third_party(io_device).endswith(bytes.fromhex("0000 ffff 0002 0000"))
        began_s = clock.now_s
        while not io.stop_reason():
            clock.sleep_until(clock.now_s + STEP_S)
            assert clock.now_s < began_s + 1.0
        assert 0.4 - 0.05 < clock.now_s - began_s < 0.4 + 0.2
        assert "no good poll" in io.stop_reason()
        io_device.break_(SafetyIoFault(0))
        io.close()
        with pytest.raises(SafetyIoError, match="no good poll"):
            io.release_brakes()


def travel(folder: Path, *, disturbed: bool) -> list[tuple[float, float]]:
    """Return times and positions of the carriage in a move of a Modbus rail."""
    folder.mkdir()
    profile = folder / "rail.toml"
    told: list[tuple[float, float]] = []
    with board_file() as path, PhysicsBoard.create(path, 1, lockstep=True) as board:
        bus = BoardBus(board, lambda _: 0.0)
        process = start("rail", "rail-modbus", "--port", "0", "--board", path)
        text = (SHIPPED / "rails" / "rail-modbus.toml").read_text()
        profile.write_text(text.replace("port = 502", f"port = {ready(process)['port']}"))
        rail, clock = load_rail(profile), LockstepClock([bus])
        axis = ModbusRailAxis(rail, clock)
        axis.open()

        def progress(position_m: float) -> None:
            told.append((clock.now_s, position_m))
            if disturbed and len(told) == 20:
                os.kill(process.pid, signal.SIGSTOP)
                threading.Timer(HELD_UP_S, os.kill, (process.pid, signal.SIGCONT)).start()

        conditions = MoveConditions(lambda: "", lambda: "", lambda: False, progress)
        done = move(rail, axis, clock, 0.02, conditions)
        told.append((done.from_m, done.to_m))
        axis.close()
        process.communicate(b"", timeout=120)
    return told


def test_delays_of_the_rail_process_do_not_change_its_motion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    calm = travel(tmp_path / "calm", disturbed=False)
    assert len(calm) > 25
    assert calm[-1] == pytest.approx((0.0, 0.02), abs=1e-4)
    assert travel(tmp_path / "disturbed", disturbed=True) == calm
