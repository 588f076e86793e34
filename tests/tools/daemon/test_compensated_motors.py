"""The daemon compensates cogging and friction of commissioned motors."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.core.states import LoopState
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.lockstep_robot import LockstepRobot
from tests.slower_robot import slower_robot
from tests.tools.daemon.loop_rig import opened
from tests.tools.motor_profiles import cogging_Nm, leave_profiles
from tests.tools.robot_rig import robot_file, simulated

pytestmark = pytest.mark.long

SPEED_m_s = 0.01
"""22 deg/s at the motors."""
_Compensated = tuple[LockstepRobot, np.ndarray, tuple[float, float]]
PERIOD_S = 2e-3
FADE_IN_CYCLES = 100
MOST_Nm = 0.25
"""An upper bound of cogging plus friction of these motors."""
WORSE = """
seed = 3
[cables]
friction_share = 0.04
[winding]
run_out_m = 5e-5
gear_stiffness_Nm_rad = 5e3
[[motor.cogging]]
order = 4
amplitude_Nm = 0.09
phase_deg = 200.0
[[motor.cogging]]
order = 24
amplitude_Nm = 0.02
phase_deg = -40.0
[motor.friction]
coulomb_Nm = 0.13
direction_asymmetry = 0.3
angle_share = 0.06
[motor.ripple]
sixth = 0.01
twelfth = 0.005
[motor.encoder]
eccentricity_rad = 3e-4
interpolation_error = 0.04
"""
"""A plant with large effects, also ones outside the profile, and with cable friction."""


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plant") / "plant.toml"
    path.write_text(WORSE)
    return path


def _motors(path: Path) -> list[Plant]:
    return RobotPlant.load_file(path).motor_plants(3)


@pytest.fixture(scope="module")
def planar(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return slower_robot(tmp_path_factory.mktemp("planar"), "planar-3", PERIOD_S)


@pytest.fixture(scope="module")
def learnt(plant: Path, planar: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return leave_profiles(load_robot(planar), _motors(plant), tmp_path_factory.mktemp("learnt"))


def _wandering_mm(robot: LockstepRobot) -> tuple[float, float]:
    """Return the deviation from uniform motion and the mean error of the estimated position.

    The deviation is the root mean square of the true position about its mean.
    """
    robot.carry_out("pose", position_m=[0.0, 1.5])
    robot.run(1.0)
    robot.program("pose", position_m=[0.2, 1.5], speed_m_s=SPEED_m_s)
    robot.run(1.0)
    off, mistaken = [], []
    for _ in range(500):
        robot.turn(5)
        here = robot.truth()["position_m"][:2]
        off.append(here - robot.row["pose_setpoint"][:2])
        mistaken.append(here - robot.row["pose"][:2])
    errors = np.array(off) - np.mean(off, axis=0)
    wandering = 1e3 * float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))
    return wandering, 1e3 * float(np.linalg.norm(np.mean(mistaken, axis=0)))


@pytest.fixture(scope="module")
def compensated(plant: Path, planar: Path, learnt: Path) -> Iterator[_Compensated]:
    with LockstepRobot(planar, plant=plant, commissioned=learnt) as robot:
        robot.enable()
        robot.program("tighten")
        robot.finish()
        begun = robot.rows()
        yield robot, begun, _wandering_mm(robot)


def test_compensation_fades_in_after_the_index_is_known(
    compensated: _Compensated,
) -> None:
    _, begun, _ = compensated
    known, torque = begun["index_known"], np.abs(begun["compensation_Nm"])
    assert not known[0].any()
    assert known[-1].all()  # tightening searches for the indices
    for axis in range(3):
        first = int(np.argmax(known[:, axis]))
        assert torque[:first, axis].max() == 0.0
        fading = torque[first : first + FADE_IN_CYCLES, axis]
        assert (fading <= MOST_Nm / FADE_IN_CYCLES * np.arange(1, fading.size + 1)).all()
    assert torque.max() > 0.04


def test_each_motor_is_compensated_at_its_angle(compensated: _Compensated, plant: Path) -> None:
    robot, _, _ = compensated
    robot.program("pose", position_m=[-0.2, 1.7], speed_m_s=0.05)
    robot.run(0.5)
    rows = robot.run(3.0)
    angle = rows["position_rad"] - rows["index_rad"]
    for axis, motor in enumerate(_motors(plant)):
        cogging = cogging_Nm(motor, angle[:, axis])
        assert np.ptp(cogging) > 0.04  # it turns far enough for the comparison
        friction = rows["compensation_Nm"][:, axis] - cogging
        assert np.ptp(friction) < 0.25 * np.ptp(cogging)
        assert 0.8 < np.abs(friction).mean() / motor.friction.coulomb_Nm < 1.3


def test_compensation_smooths_motion_and_improves_the_known_position(
    compensated: _Compensated, plant: Path, planar: Path
) -> None:
    with LockstepRobot(planar, plant=plant, learns=False) as robot:
        robot.enable()
        robot.carry_out("tighten")
        without_mm, mistaken_mm = _wandering_mm(robot)
    with_mm, still_mistaken_mm = compensated[2]
    assert without_mm > 1.5 * with_mm, (without_mm, with_mm)
    # cogging is part of the torques at which cable lengths were determined
    assert mistaken_mm > 1.5 * still_mistaken_mm, (mistaken_mm, still_mistaken_mm)
    assert still_mistaken_mm < 0.1


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """Yield two commissioned motors without load."""
    folder = tmp_path_factory.mktemp("pair")
    path = robot_file(folder, [("can0", 1), ("can0", 2)], period_s=PERIOD_S)
    leave_profiles(load_robot(path), [Plant()] * 2, folder)
    text = path.read_text()
    for i in range(2):
        key = f'node_id = {i + 1}\ncommissioned = "axis-{i + 1}"'
        text = text.replace(f"node_id = {i + 1}", key)
    path.write_text(text)
    with simulated(path) as url:
        yield path, url


def test_a_restarted_drive_must_find_its_index_again(pair: tuple[Path, str]) -> None:
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


def test_the_profile_of_another_drive_prevents_the_start(
    pair: tuple[Path, str],
) -> None:
    path, url = pair
    stored = path.parent / "axis-2" / "cogging-profile.json"
    stored.write_text(stored.read_text().replace('"serial": 2', '"serial": 7'))
    with opened(path, url) as rig:
        assert rig.state is LoopState.UNCONFIGURED
        reason = rig.status["reason"]
        assert "axis axis 2: " in reason
        assert "serial = 7, but this axis has 2" in reason
