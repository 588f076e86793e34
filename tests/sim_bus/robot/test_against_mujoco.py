"""The platform against a stranger's physics: MuJoCo, tendons of the same stiffness."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from body_lab import body, free_length_m, run

from sim_bus.cable_robot import CableRobot

STEP_S = 5e-5


def stranger(robot: CableRobot) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the same planar robot, its winches locked, for MuJoCo."""
    p, free = robot.platform[0], free_length_m(robot)
    sites, world, tendons = [], [], []
    for i in range(robot.n):
        ax, ay, _ = p["exit"][i]
        bx, by, _ = p["anchor"][i]
        stiffness = robot.motors["rigidity"][i] / free[i]
        damping = robot.motors["damping_time"][i] * stiffness
        world.append(f'<site name="a{i}" pos="{ax} {ay} 0"/>')
        sites.append(f'<site name="b{i}" pos="{bx} {by} 0"/>')
        tendons.append(
            f'<spatial stiffness="{stiffness}" damping="{damping}" springlength="0 {free[i]}">'
            f'<site site="a{i}"/><site site="b{i}"/></spatial>'
        )
    x, y, _ = p["position"]
    inertia = p["inertia"][2, 2]
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco><option timestep="{STEP_S}" gravity="0 -9.80665 0" integrator="RK4"/>
    <worldbody>{"".join(world)}
      <body pos="{x} {y} 0">
        <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
        <joint type="hinge" axis="0 0 1"/>
        <inertial pos="0 0 0" mass="{p["mass"]}" diaginertia="{inertia} {inertia} {inertia}"/>
        {"".join(sites)}
      </body></worldbody><tendon>{"".join(tendons)}</tendon></mujoco>""")
    data = mujoco.MjData(model)
    data.qvel[:] = (*p["velocity"][:2], p["spin"][2])
    return model, data


@pytest.mark.parametrize(
    ("name", "cut", "velocity", "seconds"),
    [
        ("swings on two cables", (2,), (0.8, 0.0), 1.5),
        ("swings on one cable", (0, 2), (0.0, 0.0), 0.7),
        ("released: rings on taut cables", (), (0.1, 0.2), 0.15),
    ],
)
def test_agrees_with_a_stranger(
    name: str, cut: tuple[int, ...], velocity: tuple[float, float], seconds: float
) -> None:
    robot = body(locked=True, pretension_N=15.0)
    for i in cut:
        robot.cut(i)
    robot.platform["velocity"][0, :2] = velocity
    start = robot.position_m[:2].copy()
    model, data = stranger(robot)
    apart, way = 0.0, 0.0
    for k in range(round(seconds * 1e3)):
        run(robot, 1e-3, begin_s=k * 1e-3)
        while data.time < (k + 1) * 1e-3 - STEP_S / 2.0:
            mujoco.mj_step(model, data)
        theirs = start + data.qpos[:2]
        apart = max(apart, float(np.linalg.norm(robot.position_m[:2] - theirs)))
        way = max(way, float(np.linalg.norm(theirs - start)))
    assert way > 1e-3, f"{name}: it moves"
    assert apart < 0.01 * way, f"{name}: {apart * 1e3:.2f} mm apart on {way * 1e3:.0f} mm"
    turned = np.arctan2(robot.rotation[1, 0], robot.rotation[0, 0])
    assert turned == pytest.approx(data.qpos[2], abs=0.02)
