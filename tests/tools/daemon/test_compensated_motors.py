"""What is known of a robot's motors is cancelled under the daemon's control, once it may be."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.core.states import LoopState
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.trials.lockstep import LockstepRobot
from tests.tools.daemon.loop_rig import opened
from tests.tools.motor_profiles import cogging_Nm, leave_profiles
from tests.tools.robot_rig import robot_file, simulated

SPEED_m_s = 0.01
"""22 deg/s at the motors."""
_Compensated = tuple[LockstepRobot, np.ndarray, tuple[float, float]]
FADE_IN_CYCLES = 200
MOST_Nm = 0.25
"""More than cogging and friction of these motors ever are together."""


@pytest.fixture(scope="module")
def learnt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    plants = RobotPlant().motor_plants(3)
    return leave_profiles(load_robot("planar-3"), plants, tmp_path_factory.mktemp("learnt"))


def _wandering_mm(robot: LockstepRobot) -> tuple[float, float]:
    """Return how far the platform truly leaves an even motion, root mean square about the mean.

    And how far on average it is from where the control takes it to be.
    """
    robot.carry_out("pose", position_m=[0.0, 1.5])
    robot.run(1.0)
    robot.program("pose", position_m=[0.2, 1.5], speed_m_s=SPEED_m_s)
    robot.run(1.0)
    off, mistaken = [], []
    for _ in range(500):
        robot.turn(10)
        here = robot.truth()["position_m"][:2]
        off.append(here - robot.row["pose_setpoint"][:2])
        mistaken.append(here - robot.row["pose"][:2])
    errors = np.array(off) - np.mean(off, axis=0)
    wandering = 1e3 * float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))
    return wandering, 1e3 * float(np.linalg.norm(np.mean(mistaken, axis=0)))


@pytest.fixture(scope="module")
def compensated(learnt: Path) -> Iterator[_Compensated]:
    with LockstepRobot("planar-3", commissioned=learnt) as robot:
        robot.enable()
        robot.program("tighten")
        robot.finish()
        begun = robot.rows()
        yield robot, begun, _wandering_mm(robot)


def test_nothing_is_compensated_before_an_index_is_known_and_then_it_fades_in(
    compensated: _Compensated,
) -> None:
    _, begun, _ = compensated
    known, torque = begun["index_known"], np.abs(begun["compensation_Nm"])
    assert not known[0].any()
    assert known[-1].all()  # tightening looks for them
    for axis in range(3):
        first = int(np.argmax(known[:, axis]))
        assert torque[:first, axis].max() == 0.0
        fading = torque[first : first + FADE_IN_CYCLES, axis]
        assert (fading <= MOST_Nm / FADE_IN_CYCLES * np.arange(1, fading.size + 1)).all()
    assert torque.max() > 0.04


def test_what_is_compensated_is_the_cogging_where_each_motor_is(
    compensated: _Compensated,
) -> None:
    robot, _, _ = compensated
    robot.program("pose", position_m=[-0.2, 1.7], speed_m_s=0.05)
    robot.run(0.5)
    rows = robot.run(3.0)
    angle = rows["position_rad"] - rows["index_rad"]
    for axis, plant in enumerate(RobotPlant().motor_plants(3)):
        cogging = cogging_Nm(plant, angle[:, axis])
        assert np.ptp(cogging) > 0.04  # it turns far enough to tell
        friction = rows["compensation_Nm"][:, axis] - cogging
        assert np.ptp(friction) < 0.25 * np.ptp(cogging)
        assert 0.8 < np.abs(friction).mean() / plant.friction.coulomb_Nm < 1.3


def test_the_platform_moves_more_evenly_and_from_where_it_truly_stood(
    compensated: _Compensated,
) -> None:
    with LockstepRobot("planar-3") as robot:
        robot.enable()
        robot.carry_out("tighten")
        without_mm, mistaken_mm = _wandering_mm(robot)
    with_mm, still_mistaken_mm = compensated[2]
    assert without_mm > 3.0 * with_mm
    # cogging is in the torques under which the cables' lengths were taken
    assert mistaken_mm > 1.5 * still_mistaken_mm
    assert still_mistaken_mm < 0.15  # friction that depends on the angle, creep and gears are left


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """Two motors that have been commissioned, with nothing on them."""
    folder = tmp_path_factory.mktemp("pair")
    path = robot_file(folder, [("can0", 1), ("can0", 2)], period_s=2e-3)
    leave_profiles(load_robot(path), [Plant()] * 2, folder)
    text = path.read_text()
    for i in range(2):
        key = f'node_id = {i + 1}\ncommissioned = "axis-{i}"'
        text = text.replace(f"node_id = {i + 1}", key)
    path.write_text(text)
    with simulated(path) as url:
        yield path, url


def test_a_drive_that_restarted_has_its_index_to_find_again(pair: tuple[Path, str]) -> None:
    jog = {"velocity_rad_s": [8.0, 8.0], "timeout_s": 2.0}
    with opened(*pair) as rig:
        for _ in range(2):
            rig.obeyed("enable", program="jog", wanted=jog)
            rows = rig.run(1.2)
            assert not rows["index_known"][0].any()
            assert not rows["compensation_Nm"][~rows["index_known"]].any()
            assert rows["index_known"][-1].all()
            assert rows["compensation_Nm"][-1].all()
            rig.obeyed("disable")
            for node in (1, 2):
                rig.machine.networks["can0"].reset(node)
            rig.turn_until(lambda: rig.state is LoopState.FAULT and not rig.loop.busy)
            rig.obeyed("acknowledge")


def test_the_profile_of_another_drive_keeps_the_robot_from_starting(
    pair: tuple[Path, str],
) -> None:
    path, url = pair
    stored = path.parent / "axis-1" / "cogging-profile.json"
    stored.write_text(stored.read_text().replace('"serial": 2', '"serial": 7'))
    with opened(path, url) as rig:
        assert rig.state is LoopState.UNCONFIGURED
        reason = rig.status["reason"]
        assert "axis axis 1: " in reason
        assert "serial = 7, this axis has 2: commission it anew" in reason
