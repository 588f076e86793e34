"""A program that does what it must not, on simulated drives: what the supervisor makes of it."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_rt.controllers.base import Idle
from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.runtime import procedures
from cdpr_rt.runtime.cycle_row import Row
from cdpr_rt.runtime.loop import ControlLoop
from cdpr_rt.runtime.shared_block import RowReader, SharedBlock
from cdpr_rt.runtime.states import LoopState, Reaction
from cdpr_rt.supervisor import Limit
from drivers.cia402 import STATE_TABLE, State
from profiles import load_robot
from tests.tools.robot_rig import robot_file, simulated
from tools.daemon.loop_process import loop_parts
from tools.daemon.machine import RobotMachine
from tools.daemon.settings import RunSettings

PERIOD_S = 2e-3
LIMITS = """
[limits]
torque_Nm = 1.5
torque_rate_Nm_s = 100.0
speed_rad_s = [50.0, 40.0]
following_error_rad = 1.5
cable_length_max_m = 1.02
[limits.reactions]
following_error = "torque off"
"""
Deed = Callable[[int, AxisFeedback, Setpoint, FloatArray], None]


class Wild:
    """A program that does whatever a test wants; axis 0 is left at rest."""

    name = "wild"
    needs_lease = False
    at_rest = True
    pose = pose_setpoint = None
    stream_age_s = math.nan

    def __init__(self) -> None:
        self.controller = Idle(2)
        self.deed: Deed = lambda _k, _feedback, _setpoint, _torque: None
        self._cycles = 0

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, _torque: FloatArray) -> None:
        self._cycles = 0
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = 0.0

    def check(self, _wanted: Mapping[str, Any]) -> None:
        """Anything goes."""

    def command(self, _wanted: Mapping[str, Any]) -> None:
        """Nothing is wanted."""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        torque_Nm[:] = 0.0
        setpoint.position_rad[:] = feedback.position_rad
        self.deed(self._cycles, feedback, setpoint, torque_Nm)
        self._cycles += 1

    def stop(self) -> None:
        """It stands still whenever it is told to."""
        self.deed = lambda _k, _feedback, _setpoint, _torque: None

    def progress(self) -> dict[str, Any]:
        return {}


class Rig:
    """The daemon's loop in the test's own process, on two drives in lockstep."""

    def __init__(self, path: Path, url: str) -> None:
        robot = load_robot(path)
        self.block = SharedBlock.create(2, 20.0, 1.0 / PERIOD_S)
        self.block.counters["lease_ns"] = time.monotonic_ns() + 10**12
        settings = RunSettings(
            robot=str(path), name="rig", buses=(url,), socket=path.with_suffix(".sock")
        )
        self.machine = RobotMachine(robot, settings)
        self.wild = Wild()
        parts = loop_parts(robot, self.block)
        parts = dataclasses.replace(parts, programs={**parts.programs, "wild": self.wild})
        self.loop = ControlLoop(self.block, self.machine, parts)
        self._rows = RowReader(self.block)

    def turn_until(self, done: Callable[[], bool], turns: int = 4000) -> None:
        for _ in range(turns):
            if done():
                return
            self.loop.turn()
        raise AssertionError(f"not within {turns} turns: {self.block.status()}")

    def order(self, **what: Any) -> dict[str, Any]:
        """Post a command and turn until it is answered."""
        number = self.block.post_command({"client": "test", **what})
        answers: list[dict[str, Any]] = []

        def answered() -> bool:
            answer = self.block.take_reply()
            if answer is not None and answer["to"] == number:
                answers.append(answer)
            return bool(answers)

        self.turn_until(answered)
        return answers[0]

    def run(self, deed: Deed) -> Row:
        """Enable with the wild program doing `deed`; return the rows until it is over."""
        self.wild.deed = deed
        answer = self.order(do="enable", program="wild")
        assert answer["ok"], answer
        self._rows.read()
        self.turn_until(lambda: self.loop.life.state is LoopState.FAULT)
        return self._rows.read()

    @property
    def status(self) -> dict[str, Any]:
        self.loop.turn()
        return self.block.status()


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    folder = tmp_path_factory.mktemp("robot")
    path = robot_file(folder, [("can0", 1), ("can0", 2)], period_s=PERIOD_S)
    path.write_text(path.read_text() + LIMITS)
    with simulated(path) as url:
        made = Rig(path, url)
        loop = made.loop
        loop.begin(procedures.start_up(loop))
        made.turn_until(lambda: loop.life.state is LoopState.READY)
        yield made
        loop.request_stop()
        made.turn_until(lambda: loop.ended)


@pytest.fixture
def ready(rig: Rig) -> Iterator[Rig]:
    yield rig
    if rig.loop.life.state is LoopState.FAULT:
        assert rig.order(do="acknowledge")["ok"]
    assert rig.loop.life.state is LoopState.READY


def push(torque_Nm: float) -> Deed:
    def deed(_k: int, _feedback: AxisFeedback, _setpoint: Setpoint, torque: FloatArray) -> None:
        torque[1] = torque_Nm

    return deed


def states(row: Row) -> list[State]:
    return [State(int(STATE_TABLE[int(word) & 0x7F])) for word in row["statusword"]]


def test_drives_are_told_the_robots_torque_and_heartbeat(ready: Rig) -> None:
    network = ready.machine._networks["can0"]
    for node in (1, 2):
        assert network.read_int(node, 0x6072) == 500  # 1.5 Nm of 3 Nm
        assert network.read_int(node, 0x1016, 1) == 127 << 16 | 175


def test_a_motor_that_runs_away_is_stopped_by_its_drive(ready: Rig) -> None:
    rows = ready.run(push(1.0))
    told = ready.status
    assert told["reason"].startswith("axis 1: speed ")
    assert told["reason"].endswith("2292 deg/s allowed")
    assert told["reason_limit"]["limit"] == "speed"
    assert told["reason_limit"]["value"] > told["reason_limit"]["allowed"] == pytest.approx(40.0)
    tripped = int(np.flatnonzero(rows["limit"] == Limit.SPEED)[0])
    assert rows["reaction"][tripped] == Reaction.QUICK_STOP
    assert rows["limit_axis"][tripped] == 1
    # no torque from this cycle on; both drives brake by themselves, then have no power
    assert not rows["torque_sent_Nm"][tripped:].any()
    after = [states(row) for row in rows[tripped + 1 :]]
    assert [State.QUICK_STOP] * 2 in after[:3]
    assert after[-1] == [State.SWITCH_ON_DISABLED] * 2
    speed = np.diff(rows["position_rad"][-3:, 1]) / PERIOD_S
    assert np.abs(speed).max() < 5.0


def test_torque_is_clamped_in_value_and_rate(ready: Rig) -> None:
    rows = ready.run(push(9.0))
    clamped = rows[rows["reaction"] == Reaction.CLAMP]
    assert set(clamped["limit"]) <= {Limit.TORQUE, Limit.TORQUE_RATE}
    assert (rows["torque_asked_Nm"][: clamped.size, 1] == 9.0).all()
    assert np.abs(rows["torque_sent_Nm"]).max() <= 1.5
    # 0.2 Nm a cycle, and what the drive's unit of 3 mNm makes of it
    assert np.diff(clamped["torque_sent_Nm"][:, 1]).max() <= 0.2 + 3e-3


@pytest.mark.parametrize("what", [math.nan, math.inf, -math.inf])
def test_a_torque_that_is_no_number_reaches_no_drive(ready: Rig, what: float) -> None:
    rows = ready.run(push(what))
    tripped = int(np.flatnonzero(rows["limit"] == Limit.NOT_FINITE)[0])
    assert rows["reaction"][tripped] == Reaction.QUICK_STOP
    assert not rows["torque_sent_Nm"].any()
    assert "a finite number is required" in ready.status["reason"]


@pytest.mark.parametrize("what", [1.6, -1.6, math.nan])
def test_the_robots_own_reaction_is_what_happens(ready: Rig, what: float) -> None:
    def jump(_k: int, feedback: AxisFeedback, setpoint: Setpoint, _torque: FloatArray) -> None:
        setpoint.position_rad[1] = feedback.position_rad[1] + what

    rows = ready.run(jump)
    tripped = int(np.flatnonzero(rows["limit"] == Limit.FOLLOWING_ERROR)[0])
    assert rows["reaction"][tripped] == Reaction.TORQUE_OFF
    assert ready.status["reason_limit"]["reaction"] == "torque off"
    # without a quick stop between
    after = [states(row) for row in rows[tripped + 1 :]]
    assert not any(State.QUICK_STOP in each for each in after)
    assert after[-1] == [State.SWITCH_ON_DISABLED] * 2


def test_a_cable_beyond_its_length_is_held_and_may_come_back(ready: Rig) -> None:
    estimator = ready.loop.parts.estimator
    position = ready.loop.machine.device.feedback.position_rad  # type: ignore[union-attr]
    estimator.set_lengths(position, np.array([1.0, 1.0]))
    try:
        moving = {"velocity_rad_s": [0.0, 4.0], "timeout_s": 2.0}
        assert ready.order(do="enable", program="jog", wanted=moving)["ok"]
        assert ready.loop.program.name == "jog"
        ready.turn_until(lambda: ready.loop.program.name == "hold", 500)
        told = ready.status
        assert (told["state"], told["program"]) == ("active", "hold")
        assert told["reason"].startswith("axis 1: cable length 1.02")
        assert told["reason"].endswith("1.020 m allowed")
        for _ in range(200):
            ready.loop.turn()
        length_m = estimator.estimate.cable_length_m[1]
        assert 1.02 < length_m < 1.05  # it brakes at 1 m/s2
        back = {"velocity_rad_s": [0.0, -4.0]}
        assert ready.order(do="program", program="jog", wanted=back)["ok"]
        ready.turn_until(lambda: estimator.estimate.cable_length_m[1] < length_m - 5e-3, 240)
        assert ready.loop.program.name == "jog"
    finally:
        estimator.forget_lengths()
        assert ready.order(do="disable")["ok"]
