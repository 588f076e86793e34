"""Distances of segments and boxes, compared with MuJoCo and plain minimisation."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cdpr_rt.model.contact_kernel import (
    box_depth,
    box_to_box,
    segment_depth,
    segment_to_box,
    segment_to_segment,
)
from cdpr_rt.model.pose import Pose

THIN_m = 1e-6
seeds = st.integers(0, 2**32 - 1)
many = settings(max_examples=150)


class Scene:
    """Two bodies of MuJoCo at any pose."""

    def __init__(self, *kinds: str) -> None:
        bodies = "".join(
            f'<body><freejoint/><geom type="{kind}" size="1 1 1"/></body>' for kind in kinds
        )
        self.model = mujoco.MjModel.from_xml_string(
            f"<mujoco><worldbody>{bodies}</worldbody></mujoco>"
        )
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def put(self, k: int, middle: np.ndarray, Q: np.ndarray, size: list[float]) -> None:
        self.model.geom_size[k, : len(size)] = size
        self.model.geom_rbound[k] = 100.0
        self.data.geom_xpos[k], self.data.geom_xmat[k] = middle, Q.ravel()

    def put_segment(self, k: int, p: np.ndarray, q: np.ndarray) -> None:
        """Put a thin capsule, or box, there."""
        u = (q - p) / np.linalg.norm(q - p)
        Q = Rotation.align_vectors([u], [[0.0, 0.0, 1.0]])[0].as_matrix()
        half = 0.5 * float(np.linalg.norm(q - p))
        is_box = self.model.geom_type[k] == mujoco.mjtGeom.mjGEOM_BOX
        self.put(k, 0.5 * (p + q), Q, [THIN_m, THIN_m, half] if is_box else [THIN_m, half])

    def distance(self) -> float:
        return float(mujoco.mj_geomDistance(self.model, self.data, 0, 1, 100.0, None))


TWO_SEGMENTS, TWO_BOXES = Scene("capsule", "capsule"), Scene("box", "box")
"""A thin box represents a segment beside a box: MuJoCo's distance of a capsule is not exact."""


@many
@given(seeds, st.sampled_from(["any", "crossing", "parallel", "short"]))
def test_the_distance_of_segments_equals_mujocos(seed: int, kind: str) -> None:
    rng, near = np.random.default_rng(seed), np.empty((2, 3))
    p, q, r, s = rng.uniform(-3.0, 3.0, (4, 3))
    if kind == "crossing":
        middle = p + rng.uniform() * (q - p) + rng.normal(0.0, 0.01, 3)
        s = middle + (middle - r)
    elif kind == "parallel":
        s = r + rng.uniform(0.1, 2.0) * (q - p) + rng.normal(0.0, 1e-9, 3)
    elif kind == "short":
        q = p + rng.normal(0.0, 1e-3, 3)
    found = segment_to_segment(p, q, r, s, near)
    TWO_SEGMENTS.put_segment(0, p, q)
    TWO_SEGMENTS.put_segment(1, r, s)
    assert found == pytest.approx(TWO_SEGMENTS.distance(), abs=1e-5)
    assert np.linalg.norm(near[1] - near[0]) == pytest.approx(found, abs=1e-12)
    for x, (start, end) in zip(near, ((p, q), (r, s)), strict=True):
        share = (x - start) @ (end - start) / ((end - start) @ (end - start))
        assert -1e-9 <= share <= 1 + 1e-9 and np.allclose(start + share * (end - start), x)


@many
@given(seeds, st.booleans())
def test_the_distance_of_segment_and_box_equals_mujocos(seed: int, axial: bool) -> None:
    rng, near = np.random.default_rng(seed), np.empty((2, 3))
    p, q = rng.uniform(-3.0, 3.0, (2, 3))
    if axial:
        q[:2] = p[:2]
    low = rng.uniform(-1.5, 0.5, 3)
    box = np.array([low, low + rng.uniform(0.1, 2.0, 3)])
    TWO_BOXES.put_segment(0, p, q)
    TWO_BOXES.put(1, box.mean(axis=0), np.eye(3), list(0.5 * (box[1] - box[0])))
    found = segment_to_box(p, q, box, near)
    assert found == pytest.approx(max(TWO_BOXES.distance(), 0.0), abs=2e-5)
    assert np.allclose(np.clip(near[0], *box), near[1])


@many
@given(seeds)
def test_the_distance_of_boxes_equals_mujocos(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = []
    for _ in range(2):
        low = rng.uniform(-1.0, 0.0, 3)
        boxes.append(np.array([low, low + rng.uniform(0.1, 1.0, 3)]))
    pose = Pose(rng.uniform(-2.0, 2.0, 3), Rotation.random(random_state=seed % 2**31).as_matrix())
    placed = pose.p + pose.Q @ boxes[0].mean(axis=0)
    TWO_BOXES.put(0, placed, pose.Q, list(0.5 * (boxes[0][1] - boxes[0][0])))
    TWO_BOXES.put(1, boxes[1].mean(axis=0), np.eye(3), list(0.5 * (boxes[1][1] - boxes[1][0])))
    found = box_to_box(pose.array, *boxes, np.empty((8, 3)), np.empty((2, 3)))
    assert found == pytest.approx(max(TWO_BOXES.distance(), 0.0), abs=2e-5)


@many
@given(seeds)
def test_the_depth_of_a_segment_in_a_box_is_that_of_its_deepest_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(-2.0, 2.0, (2, 3))
    box = np.sort(rng.uniform(-1.0, 1.0, (2, 3)), axis=0)
    points = p + np.linspace(0.0, 1.0, 4001)[:, None] * (q - p)
    deepest = float(np.minimum(points - box[0], box[1] - points).min(axis=1).max())
    assert segment_depth(p, q, box) == pytest.approx(deepest, abs=2e-3)
    assert segment_depth(p, q, box) >= deepest - 1e-9


@many
@given(seeds)
def test_the_depth_of_boxes_is_the_shortest_translation_along_a_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    box, other = np.sort(rng.uniform(-1.0, 1.0, (2, 2, 3)), axis=1)
    Q = Rotation.random(random_state=seed).as_matrix()
    pose = np.vstack([rng.uniform(-1.0, 1.0, 3), Q])
    sides = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    corners = np.array(
        [[b[s, k] for k, s in enumerate(side)] for b in (box, other) for side in sides]
    )
    here, there = pose[0] + corners[:8] @ Q.T, corners[8:]
    overlaps = [
        min((here @ n).max() - (there @ n).min(), (there @ n).max() - (here @ n).min())
        for n in (*np.eye(3), *Q.T)
    ]
    assert box_depth(pose, box, other) == pytest.approx(min(overlaps), abs=1e-9)
