"""The first contact on a way, compared with brute force of separate code, and its text."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_profiles import load_robot
from cdpr_profiles.platform import BoxFile
from cdpr_rt.model.interference import Interference
from cdpr_rt.model.kinematics import SPATIAL, CableKinematics
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of
from cdpr_rt.model.pose import Pose
from tests.cdpr_rt.model.brute_force import BruteRobot

PLACES = 500


def model_of(name: str) -> PlatformModel:
    return platform_model_of(load_robot(name))


class MadeUp:
    """A random, crowded robot with pulleys, a body and boxes in the room."""

    def __init__(self, seed: int, parts: str) -> None:
        rng = np.random.default_rng(seed)
        n = int(rng.integers(2, 9))
        u = rng.normal(size=(n, 3))
        a = 3.0 * u / np.linalg.norm(u, axis=1)[:, None]
        size = np.array([0.2, 0.15, 0.3])
        b = rng.choice([-1.0, 1.0], (n, 3)) * size * rng.choice([1.0, 0.7], n)[:, None]
        if parts == "shared":
            b[1::2] = b[0]
        radius = rng.uniform(0.0, 0.08, n) if parts == "pulleys" else np.zeros(n)
        axes = np.cross(u, rng.normal(size=(n, 3)))
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        clearance_m = float(rng.choice([0.005, 0.03]))
        body = np.array([-size, size]) if parts in ("body", "boxes") else None
        boxes: list[np.ndarray] = []
        if parts == "boxes":
            lows = (*rng.uniform(-2.0, 1.0, (2, 3)), a[0] - 0.1)
            boxes = [np.array([low, low + rng.uniform(0.15, 0.8, 3)]) for low in lows]
        home = Pose(np.zeros(3)).plus(np.array([0, 0, 0, *rng.uniform(-1.0, 1.0, 3)]))
        kinematics = CableKinematics(
            a, b, SPATIAL[: min(n, 6)], pulley_radius_m=radius, swivel_axes=axes, home=home
        )
        self.interference = Interference(kinematics, home.array, clearance_m, body, boxes)
        self.brute = BruteRobot(a, b, clearance_m, home.Q, radius, axes, body, tuple(boxes))
        self.way = np.zeros((2, 6))
        self.way[:, :3] = rng.uniform(-1.0, 1.0, (2, 3))
        self.way[:, 3:] = rng.uniform(-1.0, 1.0, (2, 3))
        self.way[:, len(kinematics.directions) :] = 0.0

    def apart(self, shares: np.ndarray) -> dict[tuple[str, str], np.ndarray]:
        q = self.way[0] + shares[:, None] * (self.way[1] - self.way[0])
        return self.brute.clearances(q[:, :3], q[:, 3:])


@settings(max_examples=150)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["eyes", "shared", "pulleys", "body", "boxes"]))
def test_no_place_before_the_first_contact_is_in_contact(seed: int, parts: str) -> None:
    robot = MadeUp(seed, parts)
    d = len(robot.interference._directions)
    found = robot.interference.first_contact(robot.way[:, :d])
    until = 1.0 if found is None else found.share
    before = robot.apart(np.linspace(0.0, until, PLACES))
    allowed = {
        pair: 0.9 * float(d[0]) - 1e-6
        if d[0] < robot.interference.clearance_m + 1e-6
        else robot.interference.clearance_m
        for pair, d in before.items()
    }
    for pair, distance in before.items():
        it_is = found is not None and pair == found.things
        assert distance[: -1 if it_is else None].min() >= allowed[pair] - 1e-8, pair
    if found is None:
        return
    assert np.allclose(found.position, robot.way[0, :d] + until * np.diff(robot.way, axis=0)[0, :d])
    if found.things[0] != "platform":
        assert found.distance_m == pytest.approx(before[found.things][-1], abs=1e-7)
    assert found.distance_m <= robot.interference.clearance_m + 2e-6


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["eyes", "shared", "pulleys", "body", "boxes"]))
def test_the_clearance_of_a_pose_equals_brute_force(seed: int, parts: str) -> None:
    robot = MadeUp(seed, parts)
    q = robot.way
    poses = np.array(
        [Pose(x[:3], robot.brute.home_rotation).plus(np.array([0, 0, 0, *x[3:]])).array for x in q]
    )
    clearance, pair = robot.interference.clearances(poses)
    apart = robot.apart(np.array([0.0, 1.0]))
    for j in range(2):
        things = robot.interference.things(int(pair[j]))
        least = min(float(d[j]) for d in apart.values())
        if things[0] == "platform":
            assert clearance[j] <= least + 1e-9
        else:
            assert clearance[j] == pytest.approx(least, abs=1e-8) == float(apart[things][j])


def test_a_wire_between_samples_is_found() -> None:
    exits, anchors = np.array([[0.0, 0.0, 2.0], [3.0, 0.0, 2.0]]), np.zeros((2, 3))
    wire = np.array([[-0.5, 0.0130, 0.99], [0.5, 0.0132, 1.01]])
    home = Pose(np.zeros(3)).array
    interference = Interference(
        CableKinematics(exits, anchors, (0, 1)), home, 0.001, obstacles=[wire]
    )
    way = np.array([[0.0, -1.0], [0.0, 1.0]])
    sampled = np.repeat(home[None], 33, axis=0)
    sampled[:, 0, 1] = np.linspace(-1.0, 1.0, 33)
    assert interference.clearances(sampled)[0].min() > 0.002
    found = interference.first_contact(way)
    assert found is not None and found.things == ("cable 1", "obstacle 1")
    assert found.position == pytest.approx([0.0, 0.024], abs=5e-4)


def test_the_text_names_both_things_their_distance_and_the_place() -> None:
    model = model_of("spatial-8")
    there = np.array([-0.15, 0.1, 1.5, 0.0, 0.0, 2.0])
    found = model.interference.first_contact(np.array([model.home, there]))
    assert found is not None
    words = "cable 3 and platform come within "
    position, rotation = np.split(found.position, 2)
    place, turned = (
        ", ".join(f"{x:z.1f}" for x in part) for part in (1e3 * position, np.degrees(rotation))
    )
    told = f"at {place} mm turned by {turned} deg: {words}10 mm of each other"
    assert str(found) == told
    further = found.position + 1e-3 * (there - model.home)
    assert model.interference.contact(model.poses(further[None])[0]).startswith(words)
    assert model.interference.contact(model.home_pose.array) == ""


@pytest.mark.parametrize("name", ["planar-3", "planar-4"])
def test_cables_in_a_plane_do_not_interfere(name: str) -> None:
    model = model_of(name)
    assert len(model.interference.pairs) == 0
    assert model.interference.contact(model.home_pose.array) == ""
    clearances, pairs = model.interference.clearances(model.home_pose.array[None])
    assert (clearances[0], pairs[0]) == (np.inf, -1)


@pytest.mark.parametrize("name", ["spatial-8", "suspended-6", "suspended-8", "point-4"])
def test_shipped_robots_are_clear_in_their_box_of_targets(name: str) -> None:
    model = model_of(name)
    platform, rng = model.platform, np.random.default_rng(14)
    positions = np.zeros((400, model.size))
    positions[:, :3] = rng.uniform(platform.workspace_min_m, platform.workspace_max_m, (400, 3))
    turns = rng.normal(size=(400, model.size - 3))
    sizes = np.maximum(np.linalg.norm(turns, axis=1), 1e-9)[:, None]
    positions[:, 3:] = model.angle_rad * turns / sizes
    clearances, _ = model.interference.clearances(model.poses(positions))
    assert clearances.min() >= platform.clearance_m


def test_a_pair_too_close_at_the_start_may_part_but_not_approach() -> None:
    exits = np.array([[-1.0, 0.0, 2.0], [1.0, 0.0, 2.0]])
    anchors = np.array([[-0.1, 0.0, 0.1], [0.1, 0.0, 0.1]])
    kinematics = CableKinematics(exits, anchors, (0, 2))
    stand = np.array([[-0.2, -1.0, -0.5], [0.2, 1.0, -0.01]])
    body = np.array([[-0.1, -0.1, 0.0], [0.1, 0.1, 0.1]])
    home = Pose(np.array([0.0, 0.0, 0.0]))
    interference = Interference(kinematics, home.array, 0.02, body, [stand])
    assert "platform and obstacle 1 come within 10 mm" in interference.contact(home.array)
    assert interference.first_contact(np.array([[0.0, 0.0], [0.0, 0.5]])) is None
    down = interference.first_contact(np.array([[0.0, 0.0], [0.0, -0.1]]))
    assert down is not None and down.position[1] > -0.0011
    aside = interference.first_contact(np.array([[0.0, 0.0], [0.05, 0.0]]))
    assert aside is not None and aside.share == 1.0  # at the same distance, which is too close


@pytest.mark.parametrize("overlap_m", [0.0, 0.004])
def test_a_pair_in_contact_at_the_start_does_not_penetrate_deeper(overlap_m: float) -> None:
    """Also not through a thin sheet, behind which it would be clear again."""
    exits = np.array([[-1.0, 0.0, 2.0], [1.0, 0.0, 2.0]])
    anchors = np.array([[-0.1, 0.0, 0.2], [0.1, 0.0, 0.2]])
    body = np.array([[-0.01, -0.01, 0.0], [0.01, 0.01, 0.005]])
    sheet = np.array([[0.01 - overlap_m, -1.0, -0.2], [0.02 - overlap_m, 1.0, 0.05]])
    home = Pose(np.zeros(3))
    interference = Interference(
        CableKinematics(exits, anchors, (0, 2)), home.array, 0.02, body, [sheet]
    )
    assert interference.first_contact(np.array([[0.0, 0.0], [-0.5, 0.0]])) is None
    found = interference.first_contact(np.array([[0.0, 0.0], [0.5, 0.0]]))
    assert found is not None and found.things == ("platform", "obstacle 1")
    assert found.position[0] < 0.004


def test_a_way_not_proven_clear_is_rejected_with_a_reason() -> None:
    model = model_of("spatial-8")
    there = model.home + np.array([0.1, 0.1, 0.5, 0.1, 0.2, 0.3])
    way = np.array([model.home, there])
    assert model.interference.first_contact(way) is None
    found = model.interference.first_contact(way, 1)
    assert found is not None and not found.known and found.share < 1.0
    assert "or the check takes too long; choose another way, or move in several steps" in str(found)


def test_a_flat_platform_that_turns_is_proved_clear_in_few_steps() -> None:
    """Its body is flat, so that turning sweeps no depth."""
    robot = load_robot("planar-4")
    assert robot.platform is not None
    box = BoxFile(min_m=(-0.1, 0.0), max_m=(0.1, 0.4))
    body = BoxFile(min_m=(-0.2, -0.1), max_m=(0.2, 0.1))
    model = platform_model_of(
        replace(robot, platform=replace(robot.platform, obstacles=(box,), body=body))
    )
    way = np.array([[-0.5, 1.0, 0.1], [0.5, 1.4, -0.1]])
    assert model.interference.first_contact(way, 40) is None
    assert model.interference.contact_ahead(way[0], way[0] + 0.05 * (way[1] - way[0])) < 0


@pytest.mark.parametrize("shared", ["anchor points", "exit points"])
def test_a_long_way_of_cables_that_share_a_point_is_proved_clear_in_few_steps(shared: str) -> None:
    """A camera in a stadium, and a platform on three pairs of cables that share exit points."""
    if shared == "anchor points":
        exits = np.array([(x, y, 30.0) for x in (-50.0, 50.0) for y in (-30.0, 30.0)])
        anchors, directions = np.zeros((4, 3)), SPATIAL[:3]
    else:
        turned = np.radians(np.repeat((90.0, 210.0, 330.0), 2))
        exits = 30.0 * np.column_stack((np.cos(turned), np.sin(turned), np.ones(6)))
        turned += np.radians((-60.0, 60.0) * 3)
        anchors = 6.0 * np.column_stack((np.cos(turned), np.sin(turned), np.zeros(6)))
        directions = SPATIAL
    interference = Interference(
        CableKinematics(exits, anchors, directions), Pose(np.zeros(3)).array, 0.01, None, []
    )
    way = np.zeros((2, len(directions)))
    way[:, :3] = (-5.0, -5.0, 0.0), (5.0, 5.0, 5.0)
    assert interference.first_contact(way, 40) is None
    places = way[0] + np.linspace(0.0, 1.0, 50)[:, None] * (way[1] - way[0])
    poses = np.array([Pose(place[:3]).array for place in places])
    assert interference.clearances(poses)[0].min() > 0.02
