"""Programs of platforms that turn: lines in all directions, rejections, hands, lowering."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ideal_platform import PERIOD_S, PLANE, ROOM, IdealPlatform, home_rotation, rotation_of
from scipy.spatial.transform import Rotation

from cdpr_rt.motion.hand_target import multiply, to_quaternion, to_rotation_vector
from cdpr_rt.motion.pose_stream import CLUTCH
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.lower import LowerProgram, lowering_s
from cdpr_rt.programs.platform_program import PlatformProgram
from cdpr_rt.programs.tighten import index_path

PLATFORMS = {3: (PLANE, 20.0, 200.0), 6: (ROOM, 10.0, 2000.0)}
AWAY = {3: [0.1, 0.05, 0.15], 6: [0.1, -0.05, 0.2, 0.1, -0.05, 0.15]}
"""A target from the middle of the box: coordinates, then the rotation vector."""


@pytest.fixture(scope="module", params=PLATFORMS, ids=["plane", "room"])
def made(request: pytest.FixtureRequest) -> IdealPlatform:
    return IdealPlatform(*PLATFORMS[request.param])


@pytest.fixture
def robot(made: IdealPlatform) -> IdealPlatform:
    made.restart()
    return made


def split(robot: IdealPlatform, way: list[float] | None = None) -> tuple[list[float], list[float]]:
    """Return position and rotation of the target at `way` from the middle of the box."""
    k = robot.model.positions
    target = robot.path[0] + np.array(way or AWAY[robot.model.size])
    return target[:k].tolist(), target[k:].tolist()


def test_all_directions_arrive_together_on_a_straight_line(robot: IdealPlatform) -> None:
    position, rotation = split(robot)
    robot.pose.command({"position_m": position, "rotation_rad": rotation})
    robot.until_rest()
    robot.check_motion()
    path, target = np.array(robot.path), np.array([*position, *rotation])
    assert path[-1] == pytest.approx(target, abs=1e-12)
    share = (path - path[0]) / (target - path[0])
    assert np.ptp(share, axis=1).max() < 1e-6
    assert (np.diff(share, axis=0) > -1e-9).all()
    # one direction comes near its speed limit
    assert (np.abs(robot.paces).max(axis=0) / robot.model.speed).max() > 0.5


@pytest.mark.parametrize("frame", ["room", "platform"])
def test_a_relative_motion_is_along_and_about_the_axes_of_its_frame(
    robot: IdealPlatform, frame: str
) -> None:
    position, rotation = split(robot)
    robot.pose.command({"position_m": position, "rotation_rad": rotation})
    robot.until_rest()
    k, before = robot.model.positions, np.array([*position, *rotation])
    way = np.array([0.03, -0.02, 0.01])[:k]
    angles = [0.02, -0.03, 0.04] if robot.model.size == 6 else [0.04]
    robot.pose.command({"distance_m": way.tolist(), "turn_rad": angles, "frame": frame})
    robot.until_rest()
    from_home = rotation_of(robot.model, before)
    axes = from_home * home_rotation(robot.model) if frame == "platform" else Rotation.identity()
    room = Rotation.from_rotvec(axes.apply([0.0] * (3 - len(angles)) + angles))
    after = robot.path[-1]
    assert after[:k] - before[:k] == pytest.approx(axes.apply([*way, 0.0][:3])[:k], abs=1e-9)
    turned = rotation_of(robot.model, after) * (room * from_home).inv()
    assert turned.magnitude() < 1e-9


def test_relative_motions_add_up_while_the_platform_moves(robot: IdealPlatform) -> None:
    begun, k = robot.path[0], robot.model.positions
    for _ in range(2):
        robot.pose.command({"distance_m": [0.05] * k})
        robot.run(0.05)
    robot.until_rest()
    assert robot.path[-1][:k] - begun[:k] == pytest.approx(np.full(k, 0.1), abs=1e-9)


def test_a_relative_motion_out_of_the_workspace_is_rejected(robot: IdealPlatform) -> None:
    k = robot.model.positions
    with pytest.raises(ProgramError, match=r"distance_m: .*leads to x \d+ mm; allowed: -\d+ to"):
        robot.pose.command({"distance_m": [1.5] + [0.0] * (k - 1)})
    with pytest.raises(ProgramError, match=r"turn_rad: .* deg from the orientation at home"):
        robot.pose.command({"turn_rad": [0.0] * (robot.model.size - k - 1) + [0.5]})
    with pytest.raises(ProgramError, match="position_m: allowed: without distance_m"):
        robot.pose.command({"distance_m": [0.0] * k, "position_m": [0.0] * k})
    with pytest.raises(ProgramError, match="frame: value 'home'; allowed: room, platform"):
        robot.pose.command({"distance_m": [0.0] * k, "frame": "home"})


def test_progress_reports_position_and_rotation(robot: IdealPlatform) -> None:
    position, rotation = split(robot)
    robot.pose.command({"position_m": position, "rotation_rad": rotation})
    robot.run(0.2)
    told = robot.pose.progress()
    assert [*told["target_m"], *told["target_rotation_rad"]] == pytest.approx(
        [*position, *rotation]
    )
    assert [*told["position_m"], *told["rotation_rad"]] == pytest.approx(robot.path[-1])
    interrupted = [*told["interrupted_target_m"], *told["interrupted_target_rotation_rad"]]
    assert interrupted == pytest.approx([*position, *rotation])


def test_omitted_coordinates_keep_their_value(robot: IdealPlatform) -> None:
    position, rotation = split(robot)
    middle, k = robot.path[0], robot.model.positions
    robot.pose.command({"rotation_rad": rotation})
    robot.until_rest()
    assert robot.path[-1] == pytest.approx([*middle[:k], *rotation])
    robot.pose.command({"position_m": position})
    robot.until_rest()
    assert robot.path[-1] == pytest.approx([*position, *rotation])


def test_a_platform_turned_too_far_is_turned_back_to_the_allowed_angle(
    robot: IdealPlatform,
) -> None:
    k, most = robot.model.positions, robot.model.angle_rad
    turned = robot.path[0].copy()
    turned[-1] = 1.1 * most
    robot.restart(turned)
    robot.pose.command({"position_m": turned[:k].tolist()})
    robot.until_rest()
    assert np.linalg.norm(robot.path[-1][k:]) == pytest.approx(most)


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("rotation_rad", "far", r"rotation_rad: value .* deg from the orientation at home; "),
        ("rotation_rad", "nan", r"rotation_rad\[0\]: value nan"),
        ("rotation_rad", "many", "rotation_rad: value .* allowed: a list of [13], one number"),
        ("position_m", "far", r"position_m: value .* 5000 mm; allowed: .* mm, the workspace"),
        ("position_m", "many", "position_m: value .* allowed: a list of [23], one number"),
    ],
)
def test_targets_outside_limits_are_rejected_by_name(
    robot: IdealPlatform, key: str, value: str, told: str
) -> None:
    count = len(split(robot)[key == "rotation_rad"])
    wanted = {"far": [5.0] + [0.0] * 2, "nan": [np.nan] * 3, "many": [0.0] * 9}[value]
    if value == "far" and key == "rotation_rad":
        wanted = [robot.model.angle_rad + 0.01, 0.0, 0.0]
    with pytest.raises(ProgramError, match=told):
        robot.pose.command({key: wanted if value == "many" else wanted[:count]})
    robot.run(0.05)
    assert robot.pose.at_rest
    assert np.ptp(robot.path, axis=0).max() == 0.0


def test_the_allowed_angle_is_reported(robot: IdealPlatform) -> None:
    rotation = np.zeros(len(split(robot)[1]))
    rotation[-1] = -0.5
    allowed = re.escape(f"allowed: up to {np.degrees(robot.model.angle_rad):.4g} deg")
    with pytest.raises(ProgramError, match=f"28.65 deg from the orientation at home; {allowed}"):
        robot.pose.command({"rotation_rad": rotation.tolist()})


def test_a_requested_speed_slows_rotation_by_the_same_share(robot: IdealPlatform) -> None:
    position, rotation = split(robot)
    robot.pose.command({"rotation_rad": rotation, "speed_m_s": 0.05})
    robot.until_rest()
    fastest = np.abs(robot.paces).max(axis=0) / robot.model.speed
    assert fastest.max() == pytest.approx(0.1)
    robot.pose.command({"position_m": position, "speed_m_s": 0.05})
    robot.until_rest()
    assert np.abs(robot.paces).max(axis=0)[0] <= 0.05 * (1 + 1e-9)


def test_resume_continues_to_position_and_rotation(robot: IdealPlatform) -> None:
    position, rotation = split(robot)
    robot.pose.command({"position_m": position, "rotation_rad": rotation})
    robot.run(0.3)
    robot.pose.stop()
    robot.until_rest()
    robot.check_motion()
    share = (robot.path[-1] - robot.path[0]) / (np.array([*position, *rotation]) - robot.path[0])
    assert np.ptp(share) < 1e-6, "it stops on its line"
    robot.pose.start(robot.feedback, robot.setpoint, robot.torque)
    robot.pose.command({"resume": True})
    robot.until_rest()
    assert robot.path[-1] == pytest.approx([*position, *rotation])


# -- motion by a hand


def test_the_platform_turns_as_the_hand_turns(robot: IdealPlatform) -> None:
    model, k = robot.model, robot.model.positions
    start = robot.path[0].copy()
    start[-1] = 0.1
    robot.restart(start)
    robot.pose.command({"stream": True})
    about = np.array([0.3, -0.5, 1.0]) if k == 3 else np.array([0.0, 0.0, 1.0])
    at_first = Rotation.from_rotvec([0.4, 0.2, -0.7])
    angles = np.concatenate([np.linspace(0.0, 0.1, 60), np.full(60, 0.1)])
    for angle in angles:
        robot.hand((0.2, 0.1, 0.3), Rotation.from_rotvec(angle * about) * at_first, scale=4.0)
    robot.check_motion()
    got = rotation_of(model, robot.path[-1])
    wanted = Rotation.from_rotvec(0.1 * about) * rotation_of(model, start)
    assert (got * wanted.inv()).magnitude() < 2e-3
    assert robot.path[-1][:k] == pytest.approx(start[:k], abs=1e-4)


def test_the_scale_applies_to_the_hands_translation_only(robot: IdealPlatform) -> None:
    robot.pose.command({"stream": True})
    k, turn = robot.model.positions, Rotation.from_rotvec([0.0, 0.0, 0.1])
    for share in [*np.linspace(0.0, 1.0, 60), *np.ones(60)]:
        turned = Rotation.from_rotvec(share * turn.as_rotvec())
        robot.hand((0.02 * share, 0.0, 0.0), turned, scale=4.0)
    moved = robot.path[-1] - robot.path[0]
    assert moved[0] == pytest.approx(0.08, abs=1e-3)
    assert np.linalg.norm(moved[k:]) == pytest.approx(0.1, abs=1e-3)


def test_with_the_clutch_the_platform_does_not_follow_the_hand(robot: IdealPlatform) -> None:
    robot.pose.command({"stream": True})
    for angle in np.linspace(0.0, 1.5, 80):
        robot.hand((0.0, 0.0, 0.0), Rotation.from_rotvec([0.0, 0.0, angle]), buttons=CLUTCH)
    for _ in range(30):
        robot.hand((0.0, 0.0, 0.0), Rotation.from_rotvec([0.0, 0.0, 1.5]))
    assert np.ptp(robot.path, axis=0).max() < 1e-7


def test_a_hand_turns_the_platform_no_further_than_the_allowed_angle(robot: IdealPlatform) -> None:
    robot.pose.command({"stream": True})
    for angle in np.linspace(0.0, 1.0, 120):
        robot.hand((0.0, 0.0, 0.0), Rotation.from_rotvec([0.0, 0.0, angle]))
    assert robot.pose.progress()["held_back"] == "at the edge of the workspace"
    robot.run(0.4)
    angles = np.linalg.norm(np.array(robot.path)[:, robot.model.positions :], axis=1)
    assert angles.max() <= robot.model.angle_rad * (1 + 1e-9)
    assert angles[-1] == pytest.approx(robot.model.angle_rad, abs=1e-3)


def test_a_leap_of_the_hands_orientation_does_not_move_the_platform(robot: IdealPlatform) -> None:
    robot.pose.command({"stream": True})
    for angle in np.repeat([0.0, 2.0], 30):
        robot.hand((0.0, 0.0, 0.0), Rotation.from_rotvec([0.0, 0.0, angle]))
    assert np.ptp(robot.path, axis=0).max() < 1e-7


def test_a_hand_does_not_turn_a_platform_on_its_stand(robot: IdealPlatform) -> None:
    robot.restart(robot.model.home)
    robot.pose.command({"stream": True})
    for angle in np.linspace(0.0, 0.2, 40):
        robot.hand((0.0, 0.0, 0.0), Rotation.from_rotvec([0.0, 0.0, angle]))
    assert np.ptp(robot.path, axis=0).max() < 1e-9


wild = st.tuples(
    st.lists(st.floats(-1.0, 1.0, width=32), min_size=3, max_size=3),
    st.lists(st.floats(-2.0, 2.0, width=32), min_size=3, max_size=3),
    st.sampled_from((0.5, 1.0, 8.0)),
    st.sampled_from((0, 0, 0, CLUTCH)),
    st.integers(1, 120),
)


@settings(max_examples=6)
@given(st.lists(wild, min_size=5, max_size=12))
def test_no_hand_motion_causes_a_step_or_leaves_the_workspace(
    made: IdealPlatform, hand: list[tuple[list[float], list[float], float, int, int]]
) -> None:
    made.restart()
    made.pose.command({"stream": True})
    for at, turned, scale, buttons, cycles in hand:
        rotation = Rotation.from_rotvec(turned)
        made.hand(at, rotation, scale=scale, buttons=buttons, cycles=cycles)
    made.run(1.2)  # silence is tolerated for half a second
    made.check_motion()
    platform, k = made.model.platform, made.model.positions
    path = np.array(made.path)
    assert (path[:, :k] >= np.array(platform.workspace_min_m) - 1e-9).all()
    assert (path[:, :k] <= np.array(platform.workspace_max_m) + 1e-9).all()
    # directions brake separately, so that the angle may exceed its limit a little
    assert np.linalg.norm(path[:, k:], axis=1).max() <= 1.1 * platform.workspace_angle_rad
    assert made.control.velocity == pytest.approx(np.zeros(made.model.size), abs=1e-6)


# -- other programs


def test_lowering_turns_the_platform_back(robot: IdealPlatform) -> None:
    n, (position, rotation) = robot.torque.size, split(robot)
    robot.restart(np.array([*position, *rotation]))
    lower = LowerProgram(robot.parts, np.full(n, 100.0), np.full(n, 0.026))
    robot.switch(lower, {})
    most_s = lowering_s(robot.model.platform)
    for _ in range(round(most_s / PERIOD_S)):
        robot.cycle()
        if not robot.parts.tight:
            break
    assert robot.path[-1] == pytest.approx(robot.model.home, abs=1e-9)
    robot.check_motion()
    assert not lower.progress()["blind"]


def test_holding_brakes_all_directions_on_their_line(robot: IdealPlatform) -> None:
    position, rotation = split(robot)
    robot.pose.command({"position_m": position, "rotation_rad": rotation})
    robot.run(0.25)
    robot.switch(PlatformProgram(robot.parts, robot.torque), {})
    robot.until_rest()
    robot.check_motion()
    share = (robot.path[-1] - robot.path[0]) / (np.array([*position, *rotation]) - robot.path[0])
    assert np.ptp(share) < 1e-6


def test_the_index_path_keeps_the_orientation_at_home(robot: IdealPlatform) -> None:
    model = robot.model
    path = index_path(model, np.full(robot.torque.size, 0.026), lambda _: True)
    assert path
    for there in path:
        assert there.shape == (model.size,)
        assert not there[model.positions :].any()


vectors = st.lists(st.floats(-1.8, 1.8), min_size=3, max_size=3).map(np.array)


@given(vectors, vectors)
def test_quaternion_products_equal_scipys(first: np.ndarray, second: np.ndarray) -> None:
    q, p, product, phi = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(3)
    to_quaternion(first, q)
    to_quaternion(second, p)
    for inverted in (False, True):
        multiply(p, q, inverted, product)
        to_rotation_vector(product, phi)
        before = Rotation.from_rotvec(first)
        wanted = Rotation.from_rotvec(second) * (before.inv() if inverted else before)
        assert (Rotation.from_rotvec(phi) * wanted.inv()).magnitude() < 1e-7
        assert np.linalg.norm(phi) <= np.pi + 1e-12
