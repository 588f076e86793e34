"""A step computed in advance gives the same bytes, whatever happens before it is taken."""

import numpy as np
import pytest

from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.cable_robot import CableRobot
from tests.sim_bus.robot.body_lab import body

STEP_S = 1e-3
STEPS = 60


def moved(seed: int, *, prepared: bool) -> tuple[bytes, list[object]]:
    """Return the state and the samples of a robot that is disturbed at random steps."""
    robot, chance = body(smooth=False), np.random.default_rng(seed)
    torque_Nm = [0.0] * robot.n
    for i in range(robot.n):
        robot.commands[i] = lambda i=i: (servo.TORQUE, torque_Nm[i])
    samples: list[object] = []
    now_s = 0.0
    for _ in range(STEPS):
        if prepared:
            robot.prepare(now_s + STEP_S)
        disturb(robot, int(chance.integers(12)), torque_Nm, chance)
        now_s += STEP_S if chance.integers(5) else 0.4 * STEP_S
        samples += [robot.step(i, now_s) for i in range(robot.n)]
    return robot.motors.tobytes() + robot.platform.tobytes(), samples


def disturb(
    robot: CableRobot, what: int, torque_Nm: list[float], chance: np.random.Generator
) -> None:
    i = int(chance.integers(robot.n))
    if what == 0:
        torque_Nm[i] = -3.0 * float(chance.random())
    elif what == 1:
        robot.slip(i, 1e-3)
    elif what == 2:
        robot.motors["zero"][i] += 5


@pytest.mark.parametrize("seed", range(4))
def test_steps_computed_in_advance_change_no_byte(seed: int) -> None:
    assert moved(seed, prepared=True) == moved(seed, prepared=False)


def test_preparing_a_step_changes_nothing_visible() -> None:
    robot = body()
    before = robot.motors.tobytes() + robot.platform.tobytes()
    robot.prepare(STEP_S)
    assert robot.motors.tobytes() + robot.platform.tobytes() == before
