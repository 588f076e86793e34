"""The platform moves as in MuJoCo, with tendons of the same stiffness."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_sim_bus.robot.cable_robot import CableRobot
from tests.sim_bus.robot.body_lab import body, free_length_m, run

STEP_S = 5e-5


def mujoco_model(robot: CableRobot) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return MuJoCo's model and data of the same planar robot with locked winches."""
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
def test_planar_motion_agrees_with_mujoco(
    name: str, cut: tuple[int, ...], velocity: tuple[float, float], seconds: float
) -> None:
    robot = body(locked=True, pretension_N=15.0)
    for i in cut:
        robot.cut(i)
    robot.platform["velocity"][0, :2] = velocity
    start = robot.position_m[:2].copy()
    model, data = mujoco_model(robot)
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


ROOM_EXITS_m = [(x, y, z) for z in (0.0, 3.0) for x in (-2.5, 2.5) for y in (-2.0, 2.0)]
ROOM_ANCHORS_m = [(x, y, z) for z in (0.3, -0.3) for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
INERTIA = (0.30, 0.35, 0.09, 0.01, -0.02, 0.005)
COM_m = (0.01, -0.02, 0.03)


def in_space(cut: tuple[int, ...], turned: tuple[float, float, float]) -> CableRobot:
    """Return a robot with eight locked winches whose centre of mass is off the body's origin."""
    robot = body(
        exits=ROOM_EXITS_m, anchors=ROOM_ANCHORS_m, home=(0.1, -0.2, 1.4), locked=True,
        mass_kg=10.0, shape={"inertia_kg_m2": INERTIA, "centre_of_mass_m": COM_m},
        start={"rotation_deg": turned},
    )  # fmt: skip
    for i in cut:
        robot.cut(i)
    return robot


def mujoco_model_in_space(robot: CableRobot) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return MuJoCo's model and data of the same body on a free joint, with a tendon per cable."""
    p, free = robot.platform[0], free_length_m(robot)
    world, sites, tendons = [], [], []
    for i in range(robot.n):
        stiffness = robot.motors["rigidity"][i] / free[i]
        world.append(f'<site name="a{i}" pos="{" ".join(map(str, ROOM_EXITS_m[i]))}"/>')
        sites.append(f'<site name="b{i}" pos="{" ".join(map(str, ROOM_ANCHORS_m[i]))}"/>')
        tendons.append(
            f'<spatial stiffness="{stiffness}" springlength="0 {free[i]}">'
            f'<site site="a{i}"/><site site="b{i}"/></spatial>'
        )
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco><option timestep="{STEP_S}" gravity="0 0 -9.80665" integrator="RK4"/>
    <worldbody>{"".join(world)}
      <body><freejoint/>
        <inertial pos="{" ".join(map(str, COM_m))}" mass="{p["mass"]}"
          fullinertia="{" ".join(map(str, INERTIA))}"/>
        {"".join(sites)}
      </body></worldbody><tendon>{"".join(tendons)}</tendon></mujoco>""")
    data = mujoco.MjData(model)
    turned = Rotation.from_matrix(robot.rotation)
    data.qpos[:3] = robot.position_m
    data.qpos[3:] = turned.as_quat(scalar_first=True)
    # a free joint has its velocity in the room's frame and its angular velocity in the body's
    data.qvel[:3] = p["velocity"] - np.cross(p["spin"], turned.apply(COM_m))
    data.qvel[3:] = turned.inv().apply(p["spin"])
    return model, data


@pytest.mark.parametrize(
    ("name", "cut", "turned_deg", "spin", "seconds"),
    [
        ("from rest, rings on eight cables", (), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.3),
        ("turned and spinning on eight", (), (10.0, -15.0, 20.0), (0.6, -0.4, 1.0), 0.3),
        ("from rest, swings on four", (0, 1, 2, 3), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0),
        ("spinning, three are cut", (1, 4, 6), (20.0, 10.0, -30.0), (1.0, 2.0, -1.5), 0.5),
        ("thrown, no cable left", tuple(range(8)), (30.0, 0.0, 60.0), (3.0, 5.0, -4.0), 0.6),
    ],
)
def test_spatial_motion_agrees_with_mujoco(
    name: str,
    cut: tuple[int, ...],
    turned_deg: tuple[float, float, float],
    spin: tuple[float, float, float],
    seconds: float,
) -> None:
    robot = in_space(cut, turned_deg)
    p = robot.platform[0]
    p["spin"], p["velocity"] = spin, 0.1 * np.array(spin)
    start, begun = robot.position_m, Rotation.from_matrix(robot.rotation)
    model, data = mujoco_model_in_space(robot)
    apart, way, askew, turn = 0.0, 0.0, 0.0, 0.0
    for k in range(round(seconds * 1e3)):
        run(robot, 1e-3, begin_s=k * 1e-3)
        while data.time < (k + 1) * 1e-3 - STEP_S / 2.0:
            mujoco.mj_step(model, data)
        apart = max(apart, float(np.linalg.norm(robot.position_m - data.qpos[:3])))
        way = max(way, float(np.linalg.norm(data.qpos[:3] - start)))
        theirs = Rotation.from_quat(data.qpos[3:], scalar_first=True)
        ours = Rotation.from_matrix(robot.rotation)
        askew = max(askew, float((theirs.inv() * ours).magnitude()))
        turn = max(turn, float((begun.inv() * theirs).magnitude()))
    assert way > 1e-3, f"{name}: it moves"
    assert turn > 1e-3, f"{name}: it turns"
    assert apart < 0.002 * way, f"{name}: {apart * 1e3:.3f} mm apart on {way * 1e3:.1f} mm"
    assert askew < 0.005 * turn, f"{name}: {askew:.2g} rad apart on {turn:.2g} rad"
