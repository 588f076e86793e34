"""A robot's cables and platform as Foxglove draws them in its 3D panel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove.messages import (
    Color,
    LinePrimitive,
    LinePrimitiveLineType,
    Point3,
    SceneEntity,
    SceneUpdate,
    Timestamp,
)
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray

_LOOSE, _PLATFORM = Color(r=0.6, g=0.6, b=0.6, a=1.0), Color(r=0.82, g=0.35, b=0.1, a=1.0)
_PIXELS = 3.0
_LOW_N, _HIGH_N = 0.0, 100.0


class CableScene:
    """The lines of one robot's cables, from exit to anchor points, and of its platform's edges.

    A cable is coloured by its tension: blue at the least that is allowed, over green, to red at the
    most; grey where it is loose or not known.
    """

    def __init__(self, description: dict[str, Any]) -> None:
        """Raise KeyError, TypeError or ValueError where the description has no platform."""
        platform, limits = description["platform"], description.get("limits", {})
        self._exits = _in_space(platform["exit_points_m"])
        self._anchors = _in_space(platform["anchor_points_m"])
        n = len(self._exits)
        self._low = _bounds(limits.get("tension_min_N"), n, _LOW_N)
        self._high = _bounds(limits.get("tension_max_N"), n, _HIGH_N)
        self._slack = _bounds(limits.get("slack_N"), n, 0.0)

    def update(self, pose: FloatArray, tension_N: FloatArray, stamp: Timestamp) -> SceneUpdate:
        """Return the scene with the platform at `pose` (7,) and these tensions (n,)."""
        anchors = pose[:3] + Rotation.from_quat(np.roll(pose[3:], -1)).apply(self._anchors)
        cables = [
            _line([a, b], self._colour(k, float(tension_N[k])))
            for k, (a, b) in enumerate(zip(self._exits, anchors, strict=True))
        ]
        edges = [
            _line([anchors[i], anchors[j]], _PLATFORM)
            for i in range(len(anchors))
            for j in range(i)
        ]
        entity = SceneEntity(timestamp=stamp, frame_id="base", id="robot", lines=[*cables, *edges])
        return SceneUpdate(entities=[entity])

    def _colour(self, cable: int, tension_N: float) -> Color:
        if not tension_N > self._slack[cable]:
            return _LOOSE
        low, high = self._low[cable], self._high[cable]
        # limits that leave no room between them still tell too little from too much
        share = (
            float(np.interp(tension_N, (low, high), (0.0, 1.0)))
            if low < high
            else (float(tension_N > high))
        )
        green = 1.0 - abs(2.0 * share - 1.0)
        return Color(r=max(2.0 * share - 1.0, 0.0), g=green, b=max(1.0 - 2.0 * share, 0.0), a=1.0)


def _in_space(points: Sequence[Sequence[float]]) -> FloatArray:
    """Return points (n, 3); those in a plane lie at z = 0."""
    flat = np.array(points, float)
    return np.pad(flat, ((0, 0), (0, 3 - flat.shape[1])))


def _bounds(values: Sequence[float | None] | None, n: int, otherwise: float) -> list[float]:
    given = list(values or [None] * n)
    return [otherwise if value is None else float(value) for value in given]


def _line(points: Sequence[FloatArray], color: Color) -> LinePrimitive:
    return LinePrimitive(
        type=LinePrimitiveLineType.LineStrip,
        thickness=_PIXELS,
        scale_invariant=True,
        points=[Point3(x=float(x), y=float(y), z=float(z)) for x, y, z in points],
        color=color,
    )
