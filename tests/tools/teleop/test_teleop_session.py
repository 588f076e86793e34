"""A teleoperation session with a real receiver of set-points over real UDP."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from cdpr_rt.core.shared_block import SAMPLES, SharedBlock
from cdpr_rt.core.states import LoopState
from cdpr_rt.loop.right import PublishedRight
from cdpr_rt.motion.pose_stream import CLUTCH, confirmation
from cdpr_rt.service.lease import Lease
from cdpr_rt.service.listening import listen_udp
from cdpr_rt.service.setpoint_stream import SetpointStream
from cdpr_rt.service.stream_client import StreamClient
from cdpr_tools.teleop import session as session_module
from cdpr_tools.teleop.input_device import End, InputDevice, InputSample
from cdpr_tools.teleop.script import ScriptDevice, ScriptLine
from cdpr_tools.teleop.session import TeleopSession

POSE, IDLE = 3, 0
SCALE = 4.0


class Robot:
    """A receiver of set-points whose platform has a constant pose."""

    def __init__(self) -> None:
        self.block = SharedBlock.create(3, 0.1, 1000.0)
        self.lease = Lease(PublishedRight(self.block))
        self.token = self.lease.take("the operator", 10.0)
        self.stream = SetpointStream(self.block, self.lease, listen_udp("127.0.0.1", 0))
        self.stream.start()
        self.run(POSE)

    def run(self, program: int, state: LoopState = LoopState.ACTIVE) -> None:
        row = self.block.rows[0]
        row["state"], row["program"] = state, program
        row["pose"] = row["pose_setpoint"] = (0.1, 1.6, 0.0, 1.0, 0.0, 0.0, 0.0)
        self.block.counters["rows"][0] = 1

    def samples(self) -> np.ndarray:
        """Return the newest samples in order of time."""
        posted = int(self.block.counters["samples"][0])
        first = max(0, posted - SAMPLES)
        return self.block.samples[[k % SAMPLES for k in range(first, posted)]]


@pytest.fixture
def robot() -> Iterator[Robot]:
    one = Robot()
    try:
        yield one
    finally:
        one.stream.stop()


def teleoperate(
    robot: Robot, device: InputDevice, then: Callable[[], None] | None = None
) -> tuple[TeleopSession, End]:
    """Run teleoperation to its end. Call `then` once the hand moves the robot."""
    given = robot.stream.sessions.issue(robot.token)
    with StreamClient(*robot.stream.address, given) as stream:
        session = TeleopSession(stream, device, SCALE, POSE)
        deadline_s = time.monotonic() + 120.0

        def too_late() -> bool:
            return time.monotonic() > deadline_s

        def happen() -> None:
            while not (session.leading or too_late()):
                time.sleep(0.01)
            if then is not None:
                then()

        happening = threading.Thread(target=happen)
        if then is not None:
            happening.start()
        try:
            return session, session.teleoperate(too_late)
        finally:
            if then is not None:
                happening.join()


class Still:
    """A hand at rest."""

    hint = "nothing"

    def __init__(self, trouble: str = "") -> None:
        self.trouble = trouble

    def read(self, now_s: float) -> InputSample:
        return InputSample((0.01, 0.02, 0.0), clutch=False, trouble=self.trouble)

    def close(self) -> None:
        pass


class Unhurried:
    """A hand whose time advances by at most one sample per read, so that delays do not matter."""

    def __init__(self, device: ScriptDevice) -> None:
        self._device = device
        self._before_s, self._now_s = math.nan, 0.0
        self.hint = device.hint

    def read(self, now_s: float) -> InputSample:
        if not math.isnan(self._before_s):
            self._now_s += min(now_s - self._before_s, 1.0 / 60.0)
        self._before_s = now_s
        return self._device.read(self._now_s)

    def close(self) -> None:
        self._device.close()


def test_hand_motion_reaches_the_loop_and_the_answer_returns(robot: Robot) -> None:
    lines = (
        ScriptLine(0.0, (0.0, 0.0, 0.0)),
        ScriptLine(0.2, (0.01, -0.02, 0.0), confirm=True),
        ScriptLine(0.3, (0.01, -0.02, 0.0), (0.0, 0.4, 0.0), clutch=True),
        ScriptLine(0.4, (0.0, 0.0, 0.0), confirm=True),
    )
    session, end = teleoperate(robot, Unhurried(ScriptDevice(lines)))
    assert (end.failed, end.text) == (False, "the script has ended")
    samples = robot.samples()
    assert np.all(samples["scale"] == SCALE)
    numbers = confirmation(samples["buttons"].astype(np.int64))
    assert sorted(set(numbers.tolist())) == [0, 1, 2]
    np.testing.assert_allclose(samples["position_m"][numbers == 1][0], [0.01, -0.02, 0], atol=2e-3)
    turned = 2.0 * np.arctan2(samples["quaternion"][:, 2], samples["quaternion"][:, 0])
    assert turned.max() == pytest.approx(0.4, abs=0.1)
    assert np.abs(np.diff(turned)).max() < 0.3, "steady motion"
    clutch = (samples["buttons"] & CLUTCH) != 0
    assert clutch[0]  # the hand moves nothing until the robot has answered
    assert clutch[numbers == 1][-1] and not clutch[numbers == 1][0] and not clutch[-1]
    figures = session.figures()
    assert [one["number"] for one in figures["confirmations"]] == [1, 2]
    assert figures["confirmations"][0]["pose_m"] == (0.1, 1.6)
    assert 0.0 < figures["round_trip_ms"]["p50"] < 200.0
    assert figures["answered"] > 0.9 * figures["sent"]


def test_a_hand_in_trouble_does_not_move_the_robot(robot: Robot) -> None:
    session, _ = teleoperate(robot, Still("its cable is loose"), lambda: robot.run(IDLE))
    assert session.leading
    assert np.all(robot.samples()["buttons"] & CLUTCH)


def test_the_end_of_the_program_ends_teleoperation(robot: Robot) -> None:
    session, end = teleoperate(robot, Still(), lambda: robot.run(IDLE))
    assert end.failed and end.text == "the robot does not follow the stream any longer"
    assert session.leading


def test_a_fault_ends_teleoperation(robot: Robot) -> None:
    _, end = teleoperate(robot, Still(), lambda: robot.run(POSE, LoopState.FAULT))
    assert end.failed


def test_losing_the_right_to_move_ends_teleoperation(robot: Robot) -> None:
    _, end = teleoperate(robot, Still(), lambda: robot.lease.release(robot.token))
    assert end.failed and end.text.startswith("the right to move has expired")


def test_a_robot_lost_during_a_script_is_reported(robot: Robot) -> None:
    done = ScriptDevice((ScriptLine(0.0, (0.0, 0.0, 0.0)),))
    _, end = teleoperate(robot, done, lambda: robot.run(IDLE))
    assert end.failed and end.text == "the robot does not follow the stream any longer"


def test_silence_of_the_robot_ends_teleoperation(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_module, "_SILENCE_S", 0.3)
    _, end = teleoperate(robot, Still(), robot.stream.stop)
    assert end.failed and end.text == "the robot has not answered for 0.3 s"
    monkeypatch.setattr(session_module, "_GREET_S", 0.2)
    session, end = teleoperate(robot, Still())
    assert end.failed and not session.leading
