"""Cables and platform as the live view draws them, read back by an independent decoder."""

import math
import struct

import numpy as np
import pytest
from foxglove.messages import Timestamp

from cdpr_rt.service.view.cable_scene import CableScene

EXITS, ANCHORS = [[-2.0, 3.0], [2.0, 3.0], [0.0, 0.0]], [[-0.1, 0.0], [0.1, 0.0], [0.0, -0.1]]
LIMITS = {"tension_min_N": [20.0] * 3, "tension_max_N": [120.0] * 3, "slack_N": [3.0] * 3}
DESCRIPTION = {"platform": {"exit_points_m": EXITS, "anchor_points_m": ANCHORS}, "limits": LIMITS}


def doubles(point: list[float]) -> bytes:
    """Return a point as protobuf holds it: a tag and eight bytes each, zeros left out."""
    tagged = zip((b"\x09", b"\x11", b"\x19"), point, strict=True)
    return b"".join(tag + struct.pack("<d", value) for tag, value in tagged if value)


def colour(r: float, g: float, b: float) -> bytes:
    return doubles([r, g, b]) + b"\x21" + struct.pack("<d", 1.0)


def test_cables_lead_to_the_turned_platform_and_are_coloured_by_tension() -> None:
    half = math.sqrt(0.5)
    pose = np.array([0.5, 1.5, 0.0, half, 0.0, 0.0, half])  # turned by a quarter
    tension = np.array([20.0, 120.0, 1.0])
    scene = CableScene(DESCRIPTION).update(pose, tension, Timestamp(sec=1, nsec=0)).encode()
    for exit_point in EXITS:
        assert doubles([*exit_point, 0.0]) in scene
    coordinates = {
        struct.unpack_from("<d", scene, k + 1)[0]
        for k in range(len(scene) - 9)
        if scene[k : k + 1] == b"\x11"
    }
    # the first anchor, to the left, is below the middle now
    assert any(value == pytest.approx(1.4, abs=1e-12) for value in coordinates)
    for shade in (colour(0.0, 0.0, 1.0), colour(1.0, 0.0, 0.0), colour(0.6, 0.6, 0.6)):
        assert shade in scene


def test_limits_without_room_between_them_still_have_colours() -> None:
    limits = {**LIMITS, "tension_min_N": [50.0] * 3, "tension_max_N": [50.0] * 3}
    view = CableScene({**DESCRIPTION, "limits": limits})
    pose, tension = np.array([0.5, 1.5, 0.0, 1.0, 0.0, 0.0, 0.0]), np.array([49.0, 50.0, 51.0])
    scene = view.update(pose, tension, Timestamp(sec=1, nsec=0)).encode()
    assert colour(0.0, 0.0, 1.0) in scene and colour(1.0, 0.0, 0.0) in scene


def test_robots_without_a_platform_have_no_scene() -> None:
    with pytest.raises((KeyError, TypeError)):
        CableScene({"platform": None})
