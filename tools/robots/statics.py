"""What the cables of a planar robot can hold: its wrench-feasible workspace by tensions."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.exchange import FloatArray
from cdpr_rt.robots.planar_control import RESERVE
from cdpr_rt.robots.planar_kernel import G_m_s2
from cdpr_rt.robots.planar_kinematics import PlanarGeometry
from cdpr_rt.runtime.robot_arrays import limits_of
from profiles import Robot
from profiles.platform import Platform

CABLES = 3
_NEWTON_STEPS = 30
_MARGIN = 0.1
_FINE = 45


@dataclass(frozen=True)
class Box:
    """A rectangle in the robot's plane, m."""

    low_m: tuple[float, float]
    high_m: tuple[float, float]

    def grid(self, columns: int, rows: int) -> FloatArray:
        """Return points (rows, columns, 2) that fill the box, its edges among them."""
        xs = np.linspace(self.low_m[0], self.high_m[0], columns)
        ys = np.linspace(self.low_m[1], self.high_m[1], rows)
        return np.stack(np.meshgrid(xs, ys), axis=-1)


def can_be_computed(robot: Robot) -> bool:
    """Whether the robot is one that this module knows: planar, on three cables."""
    platform = robot.platform
    return platform is not None and platform.is_planar and len(robot.axes) == CABLES


def view_of(platform: Platform) -> Box:
    """Return a rectangle around everything that belongs to a planar robot, with some margin."""
    points = np.array(
        [
            *platform.exit_points_m,
            platform.home_m,
            platform.workspace_min_m,
            platform.workspace_max_m,
        ]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    margin = _MARGIN * float((high - low).max())
    return Box(
        (float(low[0]) - margin, float(low[1]) - margin),
        (float(high[0]) + margin, float(high[1]) + margin),
    )


def statics_of(robot: Robot) -> PlanarStatics:
    """Return the statics of a robot that `can_be_computed`, within its limits."""
    platform, limits = robot.platform, limits_of(robot)
    assert platform is not None
    low, high = (
        np.broadcast_to(bound, (CABLES,)).astype(float)
        for bound in (limits.tension_min_N, limits.tension_max_N)
    )
    return PlanarStatics(platform, low, high)


class PlanarStatics:
    """Tensions of a planar robot with three cables, wherever its platform stands.

    After Tremblay (thesis), eqs. (2.13) to (2.19), for whole arrays of positions (..., 2), m.
    Gravity is along -y.
    """

    def __init__(self, platform: Platform, low_N: FloatArray, high_N: FloatArray) -> None:
        """Take the bounds of the tensions, (3,) each."""
        self.platform = platform
        self.geometry = PlanarGeometry(
            np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
        )
        self.low_N, self.high_N = low_N, high_N
        self.box = Box(_pair(platform.workspace_min_m), _pair(platform.workspace_max_m))

    @property
    def controlled(self) -> PlanarStatics:
        """The same within the bounds that the controller plans with: a reserve is left to it."""
        reserve_N = RESERVE * float((self.high_N - self.low_N).min())
        return PlanarStatics(self.platform, self.low_N + reserve_N, self.high_N - reserve_N)

    def reserve_N(self, position_m: FloatArray, acceleration_m_s2: float = 0.0) -> FloatArray:
        """Return how far all tensions can stay from both their bounds, N, (...).

        Below zero by how much some cable must be outside. With an acceleration: the least over its
        both signs along both directions at once. -inf where no tensions hold some direction.
        """
        signs = (-1.0, 1.0) if acceleration_m_s2 else (0.0,)
        worst = np.full(np.shape(position_m)[:-1], np.inf)
        for x, y in itertools.product(signs, signs):
            force = self._force_N(acceleration_m_s2 * np.array([x, y]))
            worst = np.minimum(worst, self._best(position_m, force)[1])
        return worst

    def is_target(self, position_m: FloatArray) -> NDArray[np.bool_]:
        """Return where the platform can be held and accelerated with the controller's reserve."""
        reserve = self.controlled.reserve_N(position_m, self.platform.acceleration_m_s2)
        return np.asarray(reserve >= 0.0)

    def tensions_N(self, position_m: FloatArray) -> FloatArray:
        """Return the tensions (..., 3) at rest that stay furthest from their bounds."""
        return self._best(position_m, self._force_N(np.zeros(2)))[0]

    def least_tensions_N(self, position_m: FloatArray) -> FloatArray:
        """Return the smallest tensions (..., 3) at rest of which none is below its bound."""
        t0, u = self._line(position_m, self._force_N(np.zeros(2)))
        with np.errstate(divide="ignore", invalid="ignore"):
            k = np.where(u > 0, (self.low_N - t0) / u, -np.inf).max(axis=-1)
        return np.asarray(t0 + k[..., None] * u)

    def angle_rad(self, position_m: FloatArray) -> FloatArray:
        """Return by how much the platform turns at rest, (...); nan where it would turn over.

        No cable controls its orientation: it takes the one at which the tensions have no moment.
        """
        p, t = np.asarray(position_m, float), self.tensions_N(position_m)
        angle, step = np.zeros(p.shape[:-1]), 1e-5
        for _ in range(_NEWTON_STEPS):
            moment = self._moment_Nm(p, t, angle)
            slope = (self._moment_Nm(p, t, angle + step) - moment) / step
            with np.errstate(divide="ignore", invalid="ignore"):
                turned = -moment / slope
            angle = angle + np.clip(np.where(np.isfinite(turned), turned, 0.0), -0.2, 0.2)
        slope = (self._moment_Nm(p, t, angle + step) - self._moment_Nm(p, t, angle)) / step
        arm = np.linalg.norm(self.geometry.b, axis=1).max()
        stable = (slope < 0.0) | (arm < 1e-3)  # a point has no orientation
        return np.where(stable & (np.abs(angle) < 0.5 * np.pi), angle, np.nan)

    def largest_box(self, inside: Box) -> Box | None:
        """Return the largest box within `inside` that is all of targets, None where there is none.

        It is as exact as a grid of 45 by 45 points.
        """
        points = inside.grid(_FINE, _FINE)
        good = self.is_target(points)
        best, found = 0, None
        for first in range(_FINE):
            columns = np.ones(_FINE, bool)
            for last in range(first, _FINE):
                columns &= good[last]
                left, right = _longest_run(columns)
                if (right - left) * (last - first) > best:
                    best = (right - left) * (last - first)
                    found = points[first, left], points[last, right]
        return None if found is None else Box(_pair(found[0]), _pair(found[1]))

    def _force_N(self, acceleration_m_s2: FloatArray) -> FloatArray:
        """Return what the cables must exert on the platform, (2,)."""
        return np.asarray(self.platform.mass_kg * (acceleration_m_s2 + np.array([0.0, G_m_s2])))

    def _line(self, position_m: FloatArray, force_N: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return t0 and u, (..., 3) each: all tensions that exert the force are t0 + k·u."""
        cables = self.geometry.a - np.asarray(position_m, float)[..., None, :] - self.geometry.b
        with np.errstate(divide="ignore", invalid="ignore"):
            W = np.swapaxes(cables / np.linalg.norm(cables, axis=-1, keepdims=True), -1, -2)
            x, y = W[..., 0, :], W[..., 1, :]
            u = np.cross(x, y)
            size = np.linalg.norm(u, axis=-1, keepdims=True)
            u = u / size * np.where(u.sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
            # Wᵀ (W Wᵀ)^-1 f, with det(W Wᵀ) = |x × y|^2
            xx, xy, yy = ((a * b).sum(axis=-1) for a, b in ((x, x), (x, y), (y, y)))
            zx, zy = yy * force_N[0] - xy * force_N[1], xx * force_N[1] - xy * force_N[0]
            t0 = (x * zx[..., None] + y * zy[..., None]) / size**2
        return np.where(size > 1e-9, t0, np.nan), u

    def _best(self, position_m: FloatArray, force_N: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the tensions (..., 3) furthest from their bounds, and how far they are (...).

        The distance to each bound is a straight line over k, and the least of six such lines is
        greatest where two of them cross.
        """
        t0, u = self._line(position_m, force_N)
        offset = np.concatenate([t0 - self.low_N, self.high_N - t0], axis=-1)
        slope = np.concatenate([u, -u], axis=-1)
        i, j = np.triu_indices(2 * CABLES, 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            k = (offset[..., j] - offset[..., i]) / (slope[..., i] - slope[..., j])
            room = (offset[..., None, :] + k[..., :, None] * slope[..., None, :]).min(axis=-1)
        room = np.where(np.isfinite(room), room, -np.inf)
        best = room.argmax(axis=-1)[..., None]
        k = np.take_along_axis(k, best, axis=-1)
        with np.errstate(invalid="ignore"):
            tensions = t0 + k * u
        return tensions, np.take_along_axis(room, best, axis=-1)[..., 0]

    def _moment_Nm(self, p: FloatArray, t: FloatArray, angle: FloatArray) -> FloatArray:
        """Return the moment of the tensions about the platform's origin, (...)."""
        c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
        a, b = self.geometry.a, self.geometry.b
        arm = np.stack([c * b[:, 0] - s * b[:, 1], s * b[:, 0] + c * b[:, 1]], axis=-1)
        way = a - p[..., None, :] - arm
        way = way / np.linalg.norm(way, axis=-1, keepdims=True)
        turning = arm[..., 0] * way[..., 1] - arm[..., 1] * way[..., 0]
        return np.asarray((t * turning).sum(axis=-1))


def _longest_run(good: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the first and the last place of the longest run of True, 0 and 0 where there is none.

    Of runs as long as each other, the one nearest to the middle.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]])))
    if not edges.size:
        return 0, 0
    first, last = edges[::2], edges[1::2] - 1
    aside = np.abs(first + last - (good.size - 1)) / (4.0 * good.size)
    best = int((last - first - aside).argmax())
    return int(first[best]), int(last[best])


def _pair(values: FloatArray | tuple[float, ...]) -> tuple[float, float]:
    return float(values[0]), float(values[1])
