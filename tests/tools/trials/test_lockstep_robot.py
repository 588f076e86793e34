"""A robot's loop in the test process, with time, right to move, stream and truth in bus time."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cdpr_rt.core.states import LoopState
from cdpr_rt.robot import Error, Refused
from cdpr_rt.service.stream_packet import Standing, StreamSession
from cdpr_tools.lockstep_robot import LockstepRobot, StreamSender
from cdpr_tools.recordings.truth import read_pose_log

HEIGHT = 1.5


@pytest.fixture(scope="module")
def robot() -> Iterator[LockstepRobot]:
    with LockstepRobot("planar-3") as opened:
        opened.enable()
        opened.carry_out("tighten", 60.0)
        opened.carry_out("pose", position_m=[0.0, HEIGHT])
        yield opened


@pytest.fixture(scope="module")
def frames_of_jog() -> dict[str, bytes]:
    """Keep the frames of the first robot for comparison."""
    return {}


@pytest.fixture(autouse=True)
def _held_right(robot: LockstepRobot) -> Iterator[None]:
    yield
    if robot.right.token is None:
        robot.run(4.0)  # the previous holder has lost the right by silence
        robot.right.take("trial")


def test_time_advances_with_the_cycles(robot):
    before_s = robot.now_s
    rows = robot.run(0.25)
    assert rows.size == 250
    assert robot.now_s - before_s == pytest.approx(0.25)
    assert rows["time_s"][-1] == pytest.approx(robot.now_s)
    assert robot.row["cycle"] == robot.cycle


def test_truth_is_recorded_at_the_last_sync(robot):
    robot.program("pose", position_m=[0.0, HEIGHT + 0.1])
    robot.turn(400)
    record = robot.truth()
    assert record["sync_index"] == robot.cycle - 1 + robot.machine.sync_offset
    assert record["velocity_m_s"][1] > 0.1
    turned = robot.row["position_rad"] - record["motor_rad"]
    log = read_pose_log(robot.truth_log)
    assert log[-1] == record
    rows = robot.run(0.1)
    true = read_pose_log(robot.truth_log)["motor_rad"][-rows.size :]
    # the encoder is noisy and half a millisecond late
    off = rows["position_rad"] - true
    np.testing.assert_allclose(off, np.tile(off.mean(axis=0), (100, 1)), atol=4e-3)
    np.testing.assert_allclose(turned, off.mean(axis=0), atol=4e-3)
    robot.finish()


def test_a_fall_after_the_death_of_the_controller_is_logged():
    with LockstepRobot("planar-3") as dying:
        dying.enable()
        dying.carry_out("tighten", 60.0)
        dying.carry_out("pose", position_m=[0.0, HEIGHT])
        syncs, now_s = read_pose_log(dying.truth_log).size, dying.truth()["time_s"]
        dying.die(2.0)
        assert read_pose_log(dying.truth_log).size == syncs
        after = read_pose_log(dying.truth_log, without_sync=True)[-80:]
    after = after[after["time_s"] > now_s]
    assert after["time_s"][-1] == pytest.approx(now_s + 2.0, abs=0.1)
    height, fastest = after["position_m"][:, 1], after["velocity_m_s"][:, 1].min()
    assert height[0] == pytest.approx(HEIGHT, abs=0.01)
    assert height[-1] == pytest.approx(1.3, abs=1e-3)  # on the stand
    assert fastest < -0.3


def test_a_rejected_command_raises_an_error_and_changes_nothing(robot):
    with pytest.raises(Refused, match="workspace"):
        robot.program("pose", position_m=[9.0, HEIGHT])
    assert robot.state is LoopState.ACTIVE
    with pytest.raises(Error, match=r"the impossible: not complete after 0\.1 s: active"):
        robot.until(lambda: False, 0.1, "the impossible")


def test_releasing_the_right_to_move_holds_the_motion(robot):
    robot.program("pose", position_m=[0.3, HEIGHT])
    robot.right.drop()
    robot.run(0.01)
    assert robot.loop.engine.program.name == "hold"
    with pytest.raises(Refused, match="nobody holds the right"):
        robot.program("pose", position_m=[0.0, HEIGHT])


def test_the_right_to_move_expires_in_bus_time(robot):
    robot.program("pose", position_m=[0.0, HEIGHT + 0.2], speed_m_s=0.001)
    robot.right.fall_silent()
    robot.run(1.0)
    assert robot.loop.engine.program.name == "pose"
    robot.run(1.5)
    assert robot.loop.engine.program.name == "hold"


def test_packets_of_a_stream_are_processed_as_in_the_daemon(robot):
    robot.carry_out("pose", position_m=[0.0, HEIGHT])
    robot.program("pose", stream=True)
    hand = robot.stream.sender()
    stranger = StreamSender(StreamSession(7, bytes(32)))
    answers = []
    for step in range(50):
        place = (0.0, 0.002 * step, 0.0)
        answers.append(hand.answer_of(robot.stream.take(hand.packet(robot.now_s, place))))
        assert robot.stream.take(b"nonsense") is None
        robot.turn(20)
    assert {answer.standing for answer in answers} == {Standing.ACCEPTED}
    assert answers[-1].pose[1] > HEIGHT + 0.05
    packet = stranger.packet(robot.now_s, (0.0, 0.0, 0.0))
    assert robot.stream.take(packet, ("127.0.0.1", 9)) is None
    robot.run(1.5)
    assert robot.truth()["position_m"][1] == pytest.approx(HEIGHT + 0.098, abs=5e-3)
    assert robot.truth()["velocity_m_s"][1] == pytest.approx(0.0, abs=5e-3)


@pytest.mark.parametrize("at_once", [1, 20])
def test_cycles_in_one_call_send_the_same_frames_as_single_ones(
    at_once: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, frames_of_jog: dict[str, bytes]
) -> None:
    monkeypatch.setenv("CDPR_SIM_FRAME_LOG", str(tmp_path / "frames.log"))
    with LockstepRobot("bench-8") as robot:
        robot.enable("jog", velocity_rad_s=[1.0] * 8, timeout_s=0.2)
        for _ in range(100 // at_once):
            robot.turn(at_once)
        robot.inject(axis=5, sub=1, value=0x2310)
        for _ in range(300 // at_once):
            robot.turn(at_once)
        assert robot.state is LoopState.FAULT
    (log,) = tmp_path.glob("frames*.log")
    assert frames_of_jog.setdefault("", log.read_bytes()) == log.read_bytes()


def test_a_right_that_has_expired_can_be_taken_after_a_new_boot() -> None:
    with LockstepRobot("bench-2") as opened:
        opened.run(3.0)
        opened.right.fall_silent()
        opened.simulator.inject("drive-reboot", 1)
        opened.run(0.5)
        opened.command("acknowledge")  # cycles are counted from zero again
        opened.turn(2100)
        opened.right.take("another")
