"""Poses that a robot reaches on a straight line: Tremblay (thesis), section 3.4.4, eq. (3.38)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.jit import jit
from cdpr_rt.model.cable_kernel import (
    ANCHOR,
    AXIS,
    CABLE_ROWS,
    FREE,
    RADIUS,
    TINY,
    WEIGHT,
    hang,
    run_cables,
)
from cdpr_rt.model.contact_kernel import (
    BASE,
    MOST_LOOKS,
    START,
    STEP,
    TURN,
    TURNED,
    WAY_ROWS,
    Scene,
    first_contact,
    place_on,
    size_of,
)
from cdpr_rt.model.null_space import (
    MOST_NULL_DIRECTIONS,
    WrenchSets,
    circuit_margin,
    null_space,
    other_wrench,
)
from cdpr_rt.model.platform_model import PlatformModel

# Kernels that prove for how much of a straight line cables hold a platform. At a position on the
# way, let tensions t carry a wrench with a margin m to their bounds. Further along by a share s,
# the wrench matrix is W + E, and t + δ carries the wrench if δ = -W⁺E (t + δ). With the derivative
# D of W by the share, and a bound of the remainder, |E - s D| of each column at most first s +
# second s²/2, no entry of δ is larger than m, and so t + δ within bounds, while l s + k s²/2 <= m
# (1 - a s - b s²/2), that is s up to 2 m / (g + √(g² + 2 h m)) with g = l + m a, h = k + m b. Here
# l, a are the largest row sums of |W⁺D| with tensions and without, and k, b those of |W⁺| times the
# bound of the remainder. The margin is that of the worst wrench, so one such s is valid for all
# wrenches. W⁺ = W'(W W')⁻¹ does not depend on the units of its rows. If cables have weight, the
# wrench also changes: by half the weight of the length by which each free part changes. A
# first-order bound of this change is added to E (t + δ). See `contact_kernel` for the arrays of a
# way.

LEAST_N: Final = 1e-3
"""A line ends if the margin falls below this."""
_MOST_LOOKS = 2000
_SHARE_OF_LENGTH = 0.25
"""Share by which a cable's length may change from one check to the next."""
_CLOSER = 1.0 / (1.0 - _SHARE_OF_LENGTH)
"""Factor by which 1/length of a cable may grow from one check to the next."""
_FORCE, _MOMENT = 0, 1


@jit
def held_until(
    geometry: FloatArray, chosen: IntArray, sets: WrenchSets, way: FloatArray, until: float
) -> tuple[float, int]:
    """Return the share of the way, at most `until`, up to which tensions carry all wrenches.

    Also returns the number of positions checked. `geometry` is that about the centre of the
    wrenches, `chosen` (d,) are the controlled directions.
    """
    centre, wrenches, generators, scale, bounds = sets
    d, n = scale.size, geometry.shape[1]
    cables, W, D = np.empty((CABLE_ROWS, n)), np.empty((d, n)), np.empty((6, n))
    space, scaled, side = np.zeros((n + 1, n)), np.empty((d, n + 1)), max(n, 8)
    scratch, inverse, unit = np.zeros((4, side, side)), np.zeros((6, n)), np.zeros(d)
    carrying, left = np.zeros((wrenches.shape[0], n)), np.zeros((2, 2, 2))
    pose, twist, turns = np.empty((4, 3)), np.empty((2, 3)), np.empty((4, 3))
    whole, shifted = np.zeros(6), wrenches.shape[0] - generators
    share, looks = 0.0, 0
    while share < until:
        place_on(way, share, turns, pose, twist)
        looks += 1
        _about(pose, twist, centre)
        run_cables(geometry, pose, cables)
        whole[:] = 0.0
        hang(geometry, pose, cables, whole)
        for k in range(d):
            for i in range(n):
                W[k, i] = -cables[chosen[k], i]
        if null_space(W, wrenches[0], scale, bounds, scaled, space, scratch) < d:
            break
        for k in range(d):
            unit[:] = 0.0
            unit[k] = -1.0
            other_wrench(unit, scale, scaled, scratch, inverse[chosen[k]])
        for j in range(wrenches.shape[0]):
            for i in range(n):
                carrying[j, i] = 0.0
                for k in range(d):
                    acting = wrenches[j, k] + (whole[chosen[k]] if j < shifted else 0.0)
                    carrying[j, i] -= inverse[chosen[k], i] * acting
        margin = circuit_margin(space, n - d, bounds, carrying, generators, LEAST_N)
        if not margin >= LEAST_N or looks > _MOST_LOOKS:
            break
        reach = _write_changes(geometry, centre, pose, twist, way, cables, bounds, D, left)
        share += min(reach, _kept_for(margin, inverse, D, left, bounds))
    return min(share, until), looks


@jit
def _about(pose: FloatArray, twist: FloatArray, centre: FloatArray) -> None:
    """Convert pose and twist from the platform's origin to the point `centre` of it."""
    x, y, z = (
        pose[1, 0] * centre[0] + pose[1, 1] * centre[1] + pose[1, 2] * centre[2],
        pose[2, 0] * centre[0] + pose[2, 1] * centre[1] + pose[2, 2] * centre[2],
        pose[3, 0] * centre[0] + pose[3, 1] * centre[1] + pose[3, 2] * centre[2],
    )
    pose[0, 0], pose[0, 1], pose[0, 2] = pose[0, 0] + x, pose[0, 1] + y, pose[0, 2] + z
    twist[0, 0] += twist[1, 1] * z - twist[1, 2] * y
    twist[0, 1] += twist[1, 2] * x - twist[1, 0] * z
    twist[0, 2] += twist[1, 0] * y - twist[1, 1] * x


@jit
def _write_changes(
    geometry: FloatArray,
    centre: FloatArray,
    pose: FloatArray,
    twist: FloatArray,
    way: FloatArray,
    cables: FloatArray,
    bounds: FloatArray,
    D: FloatArray,
    left: FloatArray,
) -> float:
    """Write the derivative `D` (6, n) of W, and bounds of the remainder; return their range.

    The bounds `left` (2, 2, 2) are sums over the cables. The first index is for forces and moments,
    the second for first and second order. The third is for the bound as it is, and for its product
    with the highest tension, which includes the change of the cables' weight. If the anchor has
    speed v and acceleration h, and the free part length l, the direction u changes at a rate of
    v/l, which itself changes at h/l + 3 v²/l² at most. For a pulley whose axis is at distance e
    from the anchor, only the first-order bound v/l + v/e is used.
    """
    step, turn = size_of(way[STEP]), size_of(way[TURN])
    left[:] = 0.0
    reach = math.inf
    for i in range(geometry.shape[1]):
        bx, by, bz = geometry[ANCHOR, i], geometry[ANCHOR + 1, i], geometry[ANCHOR + 2, i]
        arm = size_of(geometry[ANCHOR : ANCHOR + 3, i])
        whole = math.sqrt((bx + centre[0]) ** 2 + (by + centre[1]) ** 2 + (bz + centre[2]) ** 2)
        speed, bend, free = step + turn * whole, turn * turn * whole, cables[FREE, i]
        radius, first, second = geometry[RADIUS, i], 0.0, 0.0
        half = 0.5 * size_of(geometry[WEIGHT : WEIGHT + 3, i])
        longer = half * speed * (1.0 + 2.0 * radius / (free + TINY))
        left[_FORCE, 0, 1] += longer
        left[_MOMENT, 0, 1] += arm * (longer + turn * half * free * _CLOSER)
        if radius > 0.0:
            least = min(free, _beside(geometry, pose, i))
            reach = min(reach, _SHARE_OF_LENGTH * least / (speed * (1.0 + 2.0 * radius / free)))
            first = 2.0 * _CLOSER * speed / (least + TINY)
            for k in range(6):
                D[k, i] = 0.0
            first_moment, second_moment = arm * (turn + first), 0.0
        else:
            reach = min(reach, _SHARE_OF_LENGTH * free / (speed + TINY))
            speed = min(speed, _write_derivative(geometry, pose, twist, cables, i, D) + bend)
            rate = _CLOSER * speed / free
            second = _CLOSER * bend / free + 3.0 * rate * rate
            first_moment, second_moment = 0.0, arm * (turn * turn + 2.0 * turn * rate + second)
        for k in range(2):
            tension = bounds[1, i] if k else 1.0
            left[_FORCE, 0, k] += first * tension
            left[_FORCE, 1, k] += second * tension
            left[_MOMENT, 0, k] += first_moment * tension
            left[_MOMENT, 1, k] += second_moment * tension
    return reach


@jit
def _write_derivative(
    geometry: FloatArray,
    pose: FloatArray,
    twist: FloatArray,
    cables: FloatArray,
    i: int,
    D: FloatArray,
) -> float:
    """Write the column of `D` for a cable without a pulley; return the speed of its anchor."""
    bx, by, bz = geometry[ANCHOR, i], geometry[ANCHOR + 1, i], geometry[ANCHOR + 2, i]
    wx, wy, wz = twist[1, 0], twist[1, 1], twist[1, 2]
    rx = pose[1, 0] * bx + pose[1, 1] * by + pose[1, 2] * bz
    ry = pose[2, 0] * bx + pose[2, 1] * by + pose[2, 2] * bz
    rz = pose[3, 0] * bx + pose[3, 1] * by + pose[3, 2] * bz
    mx, my, mz = wy * rz - wz * ry, wz * rx - wx * rz, wx * ry - wy * rx
    ux, uy, uz, free = cables[0, i], cables[1, i], cables[2, i], cables[FREE, i]
    cx, cy, cz = twist[0, 0] + mx, twist[0, 1] + my, twist[0, 2] + mz
    speed = math.sqrt(cx * cx + cy * cy + cz * cz)
    along = ux * cx + uy * cy + uz * cz
    cx, cy, cz = (cx - along * ux) / free, (cy - along * uy) / free, (cz - along * uz) / free
    D[0, i], D[1, i], D[2, i] = -cx, -cy, -cz
    D[3, i] = -(my * uz - mz * uy + ry * cz - rz * cy)
    D[4, i] = -(mz * ux - mx * uz + rz * cx - rx * cz)
    D[5, i] = -(mx * uy - my * ux + rx * cy - ry * cx)
    return speed


@jit
def _beside(geometry: FloatArray, pose: FloatArray, i: int) -> float:
    """Return the distance of an anchor point from the swivel axis of its pulley."""
    square, along = 0.0, 0.0
    for k in range(3):
        x = pose[0, k] - geometry[k, i]
        for j in range(3):
            x += pose[1 + k, j] * geometry[ANCHOR + j, i]
        square += x * x
        along += x * geometry[AXIS + k, i]
    return math.sqrt(max(square - along * along, 0.0))


@jit
def _kept_for(
    margin: float, inverse: FloatArray, D: FloatArray, left: FloatArray, bounds: FloatArray
) -> float:
    """Return the further share of the way for which tensions stay within bounds.

    `inverse` (6, n) is W⁺ transposed, 0 for directions that are not controlled.
    """
    n = D.shape[1]
    a, b = 0.0, 0.0
    share = math.inf
    for turn in range(2):
        for i in range(n):
            force = math.sqrt(inverse[0, i] ** 2 + inverse[1, i] ** 2 + inverse[2, i] ** 2)
            moment = math.sqrt(inverse[3, i] ** 2 + inverse[4, i] ** 2 + inverse[5, i] ** 2)
            total, spread, middle = 0.0, 0.0, 0.0
            for j in range(n):
                entry = 0.0
                for k in range(6):
                    entry += inverse[k, i] * D[k, j]
                total += abs(entry)
                spread += abs(entry) * 0.5 * (bounds[1, j] - bounds[0, j])
                middle += entry * 0.5 * (bounds[1, j] + bounds[0, j])
            if turn == 0:
                a = max(a, total + force * left[_FORCE, 0, 0] + moment * left[_MOMENT, 0, 0])
                b = max(b, force * left[_FORCE, 1, 0] + moment * left[_MOMENT, 1, 0])
                continue
            g = spread + abs(middle) + margin * a
            g += force * left[_FORCE, 0, 1] + moment * left[_MOMENT, 0, 1]
            h = force * left[_FORCE, 1, 1] + moment * left[_MOMENT, 1, 1] + margin * b
            share = min(share, 2.0 * margin / (g + math.sqrt(g * g + 2.0 * h * margin) + TINY))
    return share


# Kernel for how far cables can hold a platform on straight lines without contact.

WHOLE, CONTACT, NOT_HELD = range(3)
"""Why a way ends: at its target, at a contact, or where tensions are not feasible."""


@jit
def reach_all(
    home: FloatArray,
    start: FloatArray,
    ends: FloatArray,
    chosen: IntArray,
    scene: Scene,
    centred: FloatArray,
    sets: WrenchSets,
    shares: FloatArray,
    why: IntArray,
) -> None:
    """Write the share of each straight line on which a platform is held and clear, eq. (3.38).

    Ways lead from the position `start` (d,) to each of `ends` (m, d). All other arguments are those
    of `first_contact` and `held_until`; `centred` is the geometry for `held_until`.
    """
    way = np.zeros((WAY_ROWS, 3))
    for k in range(3):
        way[START, k] = home[0, k]
        for i in range(3):
            way[BASE + i, k] = home[1 + i, k]
    for j in range(ends.shape[0]):
        for k in range(start.size):
            row, column = START, chosen[k]
            if chosen[k] > 2:
                row, column = TURNED, chosen[k] - 3
            way[row, column], way[row + STEP, column] = start[k], ends[j, k] - start[k]
        touches, pair, _, _ = first_contact(scene, way, MOST_LOOKS)
        until = min(touches, 1.0)
        why[j] = WHOLE if pair < 0 else CONTACT
        shares[j], _ = held_until(centred, chosen, sets, way, until)
        if shares[j] < until:
            why[j] = NOT_HELD


SHARE: Final = 0.95
"""μ of eq. (3.38): share of the reached way to use if a way ends before its target."""
_AT_ONCE = 512
_MOST_DRAWN = 20
"""Limit of the number of draws: this many per wanted pose, counting one extra batch of poses."""


@dataclass(frozen=True)
class Reached:
    """Positions (m, d) that the platform reaches, and statistics of all draws."""

    positions: FloatArray
    shares: FloatArray
    """Share of the way to each drawn position that the platform covers, (m,)."""
    drawn: int
    cut_by_contact: int
    cut_by_tensions: int
    outside: int
    """Number of draws left out because they end outside the box of targets or below the stand."""


class Reach:
    """How far straight lines go from a start, with a proof for all places between.

    Along these ways all tensions stay within their bounds for targets, with the control's reserve,
    at full acceleration, and nothing comes into contact. Positions are those of `PlatformModel`.
    Ways are straight in these coordinates, like motions of the program `pose`.
    """

    def __init__(self, model: PlatformModel, start: FloatArray | None = None) -> None:
        """Take the position (d,) from which ways lead; home if none is given.

        Raises GeometryError if the cables cannot hold the platform there, if it is in contact
        there, or if it has more than d + 2 cables.
        """
        self.model = model
        self.start = np.array(model.home if start is None else start, float)
        n, d = model.kinematics.n, model.size
        if n > d + MOST_NULL_DIRECTIONS:
            allowed = f"allowed: up to {d + MOST_NULL_DIRECTIONS} to control {d} directions"
            raise GeometryError(f"{n} cables; {allowed}")
        workspace, there = model.workspace(), model.pose(self.start)
        why_not = workspace.infeasibility(there) or model.interference.contact(there.array)
        if why_not:
            place = ", ".join(f"{x:.3f}" for x in there.p[: model.positions])
            raise GeometryError(f"the start at {place} m: {why_not}")
        directions, geometry = model.kinematics.directions, model.about_centre_of_mass.geometry
        self._arrays = np.array(directions), model.interference.scene, geometry, workspace.sets

    def shares(self, ends: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return how far the way to each of the positions (m, d) is reachable, and why it ends.

        Shares are 0 to 1, (m,). The reason is WHOLE, CONTACT or NOT_HELD.
        """
        shares, why = np.zeros(len(ends)), np.zeros(len(ends), np.int64)
        reach_all(
            self.model.home_pose.array, self.start, np.ascontiguousarray(ends, float),
            *self._arrays, shares, why,
        )  # fmt: skip
        return shares, why

    def draw(
        self, count: int, seed: int, angle_rad: float | None = None, share: float = SHARE
    ) -> Reached:
        """Return `count` reachable positions, drawn at random; the same seed gives the same ones.

        Coordinates are uniform in the box of targets. Rotation vectors from home's orientation are
        uniform up to `angle_rad`, by default the workspace angle. If a way ends before its target,
        the result is the position at `share` of the reached part, eq. (3.38), provided that this is
        in the box. Raises GeometryError if hardly anything is reached.
        """
        rng = np.random.default_rng(seed)
        most = self.model.angle_rad if angle_rad is None else angle_rad
        parts: list[tuple[FloatArray, FloatArray]] = []
        drawn = found = outside = 0
        cut = np.zeros(3, np.int64)
        while found < count:
            if drawn > _MOST_DRAWN * (count + _AT_ONCE):
                raise GeometryError(f"only {found} of {drawn} ways lead to a pose; wanted: {count}")
            ends = self._drawn(rng, min(_AT_ONCE, count - found), most)
            shares, why = self.shares(ends)
            gone = np.where(why == WHOLE, 1.0, share * shares)
            there = self.start + gone[:, None] * (ends - self.start)
            inside = self.are_targets(there)
            drawn, found = drawn + len(ends), found + int(inside.sum())
            outside += len(ends) - int(inside.sum())
            cut += np.bincount(why, minlength=3)
            parts.append((there[inside], gone[inside]))
        positions, gone = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return Reached(positions, gone, drawn, int(cut[CONTACT]), int(cut[NOT_HELD]), outside)

    def _drawn(self, rng: np.random.Generator, m: int, angle_rad: float) -> FloatArray:
        platform, k, d = self.model.platform, self.model.positions, self.model.size
        positions = np.zeros((m, d))
        positions[:, :k] = rng.uniform(platform.workspace_min_m, platform.workspace_max_m, (m, k))
        if d > k:
            turns = rng.normal(size=(m, d - k))
            turns *= (angle_rad / np.linalg.norm(turns, axis=1))[:, None]
            positions[:, k:] = turns * rng.uniform(0.0, 1.0, (m, 1)) ** (1.0 / (d - k))
        return positions

    def are_targets(self, positions: FloatArray) -> BoolArray:
        """Return which of the positions (m, d) are in the box of targets and above the stand."""
        platform, k = self.model.platform, self.model.positions
        low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
        inside = (positions[:, :k] >= low) & (positions[:, :k] <= high)
        return np.asarray(inside.all(axis=1)) & self._clears_stand(positions)

    def _clears_stand(self, positions: FloatArray) -> BoolArray:
        """Return whether the platform is above its stand, if the stand is below its targets.

        The underside is that of the box around the anchor points; turning lowers it.
        """
        model, up = self.model, self.model.positions - 1
        platform = model.platform
        if platform.workspace_min_m[up] < platform.home_m[up]:
            return np.ones(len(positions), bool)
        poses = np.concatenate([model.home_pose.array[None], model.poses(positions)])
        under_m = (poses[:, 0, up, None] + poses[:, 1 + up] @ model.corners.T).min(axis=1)
        return np.asarray(under_m[1:] >= under_m[0] + platform.clearance_m)
