"""Synthetic recordings of trials with known figures."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_tools.trials.directions import Directions
from cdpr_tools.trials.recorded import Recorded

PERIOD_S = 1e-3
FIRST = 500
PLANE = Directions.of(load_robot("planar-3").platform)
SPACE = Directions(
    ("x", "y", "z", "rx", "ry", "rz"),
    Rotation.from_rotvec([0.1, -0.2, 0.3]).as_matrix(),
    np.array([-1.0, -0.8, 1.0]),
    np.array([1.0, 0.8, 2.0]),
    0.3,
    np.array([0.5] * 3 + [1.5] * 3),
    np.array([2.0] * 3 + [6.0] * 3),
)
POINT = Directions(
    ("x", "y", "z"),
    np.eye(3),
    SPACE.low_m,
    SPACE.high_m,
    0.0,
    SPACE.speed[:3],
    SPACE.acceleration[:3],
)


def recorded(
    true: np.ndarray,
    setpoint: np.ndarray,
    marks: Sequence[dict[str, Any]],
    directions: Directions = PLANE,
    **truth: np.ndarray,
) -> Recorded:
    """Return cycles with the platform at places `true` (c, d). Marks count rows from 0."""
    count = len(true)
    made = object.__new__(Recorded)
    made.folder, made.first, made.directions = Path("made-up"), FIRST, directions
    rotations, wanted = (_rotations(places, directions) for places in (true, setpoint))
    made.cycles = {
        "cycle": FIRST + np.arange(count),
        "time_s": (FIRST + np.arange(count)) * PERIOD_S,
        "pose_setpoint": np.hstack([_positions(setpoint, directions), wanted.as_quat()])[
            :, [0, 1, 2, 6, 3, 4, 5]
        ],
        "torque_sent_Nm": np.zeros((count, 3)),
    }
    given = {"tension_N": np.full((count, 3), 50.0), "torque_Nm": np.ones((count, 3)), **truth}
    fields: list[Any] = [("position_m", "f8", (3,)), ("velocity_m_s", "f8", (3,))]
    fields += [("rotation", "f8", (3, 3)), *((name, "f8", (3,)) for name in given)]
    made.truth = np.zeros(count, fields)
    made.truth["position_m"] = _positions(true, directions)
    made.truth["rotation"] = rotations.as_matrix()
    for name, values in given.items():
        made.truth[name] = values
    made.marks = [{**mark, "cycle": FIRST + mark.get("row", 0)} for mark in marks]
    return made


def _positions(places: np.ndarray, directions: Directions) -> np.ndarray:
    return np.pad(places[:, : directions.k], ((0, 0), (0, 3 - directions.k)))


def _rotations(places: np.ndarray, directions: Directions) -> Rotation:
    """Return rotations (c, 3, 3) from rotation vectors in places (c, d) relative to home."""
    vectors = places[:, directions.k :] if directions.turns else np.zeros((len(places), 3))
    return Rotation.from_rotvec(vectors) * Rotation.from_matrix(directions.home_rotation)
