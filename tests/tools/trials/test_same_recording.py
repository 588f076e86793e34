"""The recording of a robot in lockstep does not depend on the wall clock."""

import time
from pathlib import Path

import pytest
from mcap.reader import make_reader

from cdpr_tools.lockstep_robot import LockstepRobot
from tests.slower_robot import slower_robot

pytestmark = pytest.mark.long

COMPARED = ("/cycle", "/description", "/events", "/status")


def recorded(folder: Path, *, pause_s: float) -> dict[str, list[bytes]]:
    """Tighten the cables with pauses in wall-clock time. Return messages by topic."""
    robot_file = slower_robot(folder.parent, "planar-3")
    with LockstepRobot(robot_file, record=folder) as robot:
        robot.enable()
        for name in ("hold", "tighten") * 3:
            robot.program(name)
            time.sleep(pause_s)
        for _ in range(3):
            robot.run(0.3)
            time.sleep(pause_s)
            assert robot.recorder is not None
            robot.recorder.remark("a mark", cycle=robot.cycle)
    (path,) = robot.recordings()
    messages: dict[str, list[bytes]] = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            messages.setdefault(channel.topic, []).append(message.data)
    return messages


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, list[bytes]]]:
    folder = tmp_path_factory.mktemp("same")
    return [recorded(folder / str(pause_s), pause_s=pause_s) for pause_s in (0.0, 0.6)]


@pytest.mark.parametrize("topic", COMPARED)
def test_messages_do_not_depend_on_pauses(runs, topic):
    quick, slow = runs
    assert quick[topic] == slow[topic] and quick[topic]


def test_wall_clock_times_are_recorded_separately(runs):
    quick, slow = runs
    assert quick.keys() == slow.keys() == {*COMPARED, "/timing"}
    assert len(quick["/timing"]) == len(slow["/timing"]) == len(quick["/cycle"])
    assert quick["/timing"] != slow["/timing"]
