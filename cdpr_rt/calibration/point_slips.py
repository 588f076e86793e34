"""Slips in manually measured points, found by comparison with lengths at the same poses.

Without points, lengths and prior geometry give the position of the platform's point at pose j as

    p_j = x_j + A_j (θ - θ_0) + e_j,    θ ~ N(θ_L, C),

linearised at θ_0. Measured points q then have residuals y = q - x - A (θ_L - θ_0) of covariance

    S = A C A^T + Cov(e) + σ².

A slip either replaces the points q by q', or adds free columns to y. The slip with the least y^T
S^-1 y, plus 2 for each free parameter (Akaike), explains the points. A point that contradicts all
others has the same constant cost for every slip, so that no single point decides. Wrong drums and
exit points of the robot's file are tried in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product
from typing import Final

import numpy as np
from scipy.stats import chi2

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration.camera_geometry import cross_matrices
from cdpr_rt.calibration.fit import Fit, JUMP_STD_m, locate
from cdpr_rt.calibration.marker_map import best_fit
from cdpr_rt.calibration.parameters import DRUM, CableGeometry
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.calibration.residuals import linearise

_AXES = "xyz"
_UNITS: Final = {10.0: "cm", 1000.0: "m", 25.4: "inches", 0.1: "tenths of a mm"}
"""Size in mm of each unit that may have been used instead of mm."""
_POINT_COST: Final = 25.0
"""Cost of a point that contradicts all others, in squared standard deviations."""
_MOST_BAD: Final = 0.25
"""Share of the points that may contradict all others."""
_GAIN: Final = 12.0
"""Smallest cost by which a slip must fit better than no slip."""
_SCALE_GAIN: Final = 5.0
"""The same for a slip of the scale alone, which the drums of any robot determine."""
MARGIN: Final = 9.0
"""Smallest cost by which one explanation must fit better than another."""
_ODD: Final = 1e-3
"""Probability below which points contradict the lengths."""
_MISFIT: Final = 9.0
"""Ratio of the sum of squares to its expectation above which no slip explains the points."""
_LEAST, _MOST = 2, 80
"""Smallest and largest number of points that are examined for a common slip."""
_GROSS: Final = 300.0
"""If a slip reduces the cost by more than this, no other explanation is considered."""
_SHIFTS: Final = (1, -1, 2, -2)
_FAR_m2: Final = 0.04
_BEST: Final = 5
_ROUNDS: Final = 3
_SCALE, _SHIFT_m, _TURN_rad = 0.1, 1.0, 0.5
"""Standard deviations of the size of slips."""
_UNKNOWN_m2: Final = 100.0
_SINGULAR, _ROUNDING = 1e-10, 1e-9
_DRUM, _EXIT_m, _ELONGATION = 0.05, 0.1, 3.0
"""Standard deviations of drums, exit points and elongation if the file is wrong."""
_NEAR, _NEAR_SHARE = 4.0, 0.05
"""Largest distance that remains if a slip explains a single point: in standard deviations, and as a
share of the point's error."""
_HOME_SHARE: Final = 0.5
"""Ratio of the standard deviation of home to the tolerance of the platform's position there."""


@dataclass(frozen=True)
class SlipVerdict:
    """Fault of the measured points as a whole."""

    text: str = ""
    """The slip or contradiction, and the action to take; empty for none."""
    undecided: bool = False
    """Whether the robot may be the cause instead."""
    off: float = 0.0
    """Size of the slip: relative for the scale, otherwise in m."""
    explained: bool = True
    """Whether points agree with lengths after the correction."""
    cost: float = 0.0
    """Cost of the best explanation."""
    sure: bool = False
    """Whether the slip fully explains a gross contradiction that no other reading can explain."""


@dataclass(frozen=True)
class Points:
    """Measured points, one per row, in the order of their poses; nan if not measured."""

    pose: IntArray
    place_m: FloatArray
    """Measured coordinates, (M, k)."""
    std_m: FloatArray
    """Standard deviations of these, (M, k)."""

    @classmethod
    def of(cls, seen: Observations, coordinates: int) -> Points:
        """Return the measured positions of observations, a selection if there are very many."""
        known = np.isfinite(seen.position_std_m[:, :coordinates])
        pose = np.flatnonzero(known.any(axis=1))
        if len(pose) > _MOST:
            pose = pose[np.linspace(0, len(pose) - 1, _MOST).astype(int)]
        place = np.where(known, seen.position_m[:, :coordinates], np.nan)
        return cls(pose, place[pose], seen.position_std_m[pose, :coordinates])


@dataclass(frozen=True)
class _Slip:
    """A slip: the corrected points, and the columns that are free."""

    name: str
    points: Points
    cost: float
    """Cost of choosing this slip among similar ones."""
    columns: FloatArray | None = None
    """The free columns (M, k, c), each scaled by its standard deviation."""


@dataclass(frozen=True)
class _Score:
    """Agreement of points and lengths after a slip has been corrected."""

    cost: float
    squares: float
    """y^T S^-1 y of the points that agree."""
    count: int
    """Number of coordinates of the points that agree."""
    bad: int
    """Number of points that contradict all others."""
    y: FloatArray
    """Differences of the points from the positions by lengths, (M k,)."""
    A: FloatArray
    """Derivatives of these by the parameters, (M k, P)."""
    W: FloatArray
    """S^-1; 0 for coordinates that are unknown or contradict all others."""
    free: FloatArray
    """Sizes of the free columns, (c,)."""

    @property
    def odd(self) -> bool:
        """Whether points contradict the lengths, or some points contradict all others."""
        return self.bad > 0 or float(chi2.sf(self.squares, max(self.count, 1))) < _ODD

    @property
    def misfit(self) -> bool:
        """Whether the points do not fit at all."""
        return self.squares > _MISFIT * max(self.count, 1)


class _ByLengths:
    """Poses from lengths alone, linearised at a geometry."""

    def __init__(self, file: CableGeometry, found: Fit, first_m: FloatArray) -> None:
        """Take the file, a fit without any points, and the first pose's target (3,)."""
        at, jumps_m, seen = found.geometry, found.jumps_m, found.seen
        blind = seen.unmeasured()
        there = locate(at, blind.without_jumps(jumps_m)).poses
        rows = linearise(at, blind, there, jumps_m)
        noise = 1.0 / math.sqrt(max(found.variance_factor, 1.0))
        r, Jp, Jx = (part * noise for part in (rows.residual, rows.by_parameter, rows.by_pose))
        across = np.swapaxes(Jx, 1, 2)
        H = across @ Jx
        own = np.linalg.pinv(H, rcond=_SINGULAR, hermitian=True)
        taken = own @ across
        by_pose = -(taken @ Jp)
        left, off = Jp + Jx @ by_pose, r - (Jx @ (taken @ r[..., None]))[..., 0]
        known = np.concatenate([file.known_std(), np.full(len(jumps_m), JUMP_STD_m)])
        values = np.concatenate([at.values() - file.values(), jumps_m])
        information = np.diag(known**-2.0) + np.einsum("jrp,jrq->pq", left, left)
        gradient = np.einsum("jrp,jr->p", left, off) + values / known**2
        arm = there[:, 1:] @ seen.target_m
        along = np.broadcast_to(np.eye(3), (len(there), 3, 3))
        twist = np.concatenate([along, -cross_matrices(arm)], axis=2)
        k = file.coordinates
        B = twist[:, :k][:, :, list(file.free)]
        self.known, self.values = known, values
        self.C = np.linalg.inv(information)
        self.change = -self.C @ gradient
        self.place_m = (there[:, 0] + arm)[:, :k]
        self.A = B @ by_pose
        self.own = B @ own @ np.swapaxes(B, 1, 2)
        determined = np.linalg.eigvalsh(H)
        self.own[determined[:, 0] <= _SINGULAR * determined[:, -1]] += _UNKNOWN_m2 * np.eye(k)
        self._stands_at_home(file, first_m[:k], there[0, 0, :k])

    def _stands_at_home(
        self, file: CableGeometry, first_m: FloatArray, there_m: FloatArray
    ) -> None:
        """Include the position of the first pose, home, with the accuracy of the robot's file."""
        platform, k = file.model.platform, file.coordinates
        S = self.A[0] @ self.C @ self.A[0].T + self.own[0]
        S += (_HOME_SHARE * platform.home_tolerance_m) ** 2 * np.eye(k)
        gain = self.C @ self.A[0].T @ np.linalg.inv(S)
        off = first_m - there_m - self.A[0] @ self.change
        self.change = self.change + gain @ off
        self.C = self.C - gain @ self.A[0] @ self.C

    def score(self, slip: _Slip) -> _Score:
        """Return the agreement of points and lengths after a slip has been corrected."""
        points = slip.points
        count, k = points.place_m.shape
        size = count * k
        known = np.isfinite(points.place_m).ravel()
        A = self.A[points.pose].reshape(size, -1)
        y = np.where(known, (points.place_m - self.place_m[points.pose]).ravel(), 0.0)
        y = y - np.where(known, A @ self.change, 0.0)
        columns = np.zeros((size, 0))
        if slip.columns is not None:
            columns = slip.columns.reshape(size, -1)
        common = A @ self.C @ A.T + columns @ columns.T
        for row, pose in enumerate(points.pose):
            common[row * k : (row + 1) * k, row * k : (row + 1) * k] += self.own[pose]
        noise = np.where(known, points.std_m.ravel() ** 2, 0.0)
        W = _inverse(common, noise, known)
        used, bad = known.copy(), 0
        while bad < int(_MOST_BAD * count):
            worst, gain = _worst_row(W, y, k)
            if gain < _POINT_COST:
                break
            used[worst * k : (worst + 1) * k] = False
            bad += 1
            W = _inverse(common, noise, used)
        squares = float(y @ W @ y)
        cost = squares + _POINT_COST * bad + slip.cost + 2.0 * columns.shape[1]
        return _Score(cost, squares, int(used.sum()), bad, y, A, W, columns.T @ W @ y)

    def found(self, score: _Score) -> FloatArray:
        """Return the parameters (P,) that fit lengths and points best."""
        return np.asarray(self.values + self.change + self.C @ (score.A.T @ (score.W @ score.y)))

    def cost_of_file(self, score: _Score, directions: FloatArray, most: float) -> float:
        """Return the cost if the file has errors `most` in directions (P, c) of parameters."""
        inverse = directions / self.known[:, None] ** 2
        by_points = score.A @ self.C @ inverse
        first = (self.values + self.change) @ inverse + by_points.T @ score.W @ score.y
        # information from the prior and lengths, and from points
        second = directions.T @ inverse - inverse.T @ self.C @ inverse
        second = second + by_points.T @ score.W @ by_points + np.eye(len(first)) / most**2
        gain = first @ np.linalg.solve(second, first)
        return float(score.cost - gain + 2.0 * directions.shape[1])


def _inverse(common: FloatArray, noise: FloatArray, used: BoolArray) -> FloatArray:
    """Return S^-1 of the used coordinates, 0 for the others."""
    W = np.zeros_like(common)
    at = np.ix_(used, used)
    W[at] = np.linalg.inv((common + np.diag(noise))[at])
    return W


def _worst_row(W: FloatArray, y: FloatArray, k: int) -> tuple[int, float]:
    """Return the row that contradicts the others most, and the reduction of cost without it."""
    pulled = (W @ y).reshape(-1, k)
    blocks = np.einsum("iaib->iab", W.reshape(len(pulled), k, len(pulled), k))
    left = np.linalg.pinv(blocks, rcond=_ROUNDING, hermitian=True)
    gains = np.einsum("ia,iab,ib->i", pulled, left, pulled)
    gains -= 2.0 * (np.diagonal(blocks, axis1=1, axis2=2) > 0.0).sum(axis=1) - 2.0
    worst = int(gains.argmax())
    return worst, float(gains[worst])


def slipped(file: CableGeometry, blind: Fit, seen: Observations) -> SlipVerdict:
    """Return the common fault of the points of `seen`; `blind` is the fit without any points.

    `file` is the geometry of the robot's file.
    """
    points = Points.of(seen, file.coordinates)
    if len(points.pose) < _LEAST:
        return SlipVerdict()
    verdict, said = SlipVerdict(), "none yet"
    for _ in range(_ROUNDS):  # each round linearises at the result of the one before
        verdict, values = _judged(file, _ByLengths(file, blind, seen.start[0, 0]), points)
        if verdict.text == said:
            break
        said, size = verdict.text, file.size
        at = blind.geometry.with_values(file.values() + values[:size])
        blind = replace(blind, geometry=at, jumps_m=values[size:])
    return verdict


def cost_of_readings(
    file: CableGeometry, blind: Fit, seen: Observations, faults: int
) -> SlipVerdict:
    """Return the verdict that `faults` wrong lengths, not used in `blind`, explain the points."""
    points = Points.of(seen, file.coordinates)
    score = _ByLengths(file, blind, seen.start[0, 0]).score(_Slip("", points, 0.0))
    return SlipVerdict(explained=not score.misfit, cost=score.cost + _POINT_COST * faults)


def _judged(
    file: CableGeometry, model: _ByLengths, points: Points
) -> tuple[SlipVerdict, FloatArray]:
    """Return the verdict, and the parameters (P,) that fit best with it."""
    null = model.score(_Slip("", points, 0.0))
    slips = [(one, model.score(one)) for one in _slips(points, model, null)]
    best, score = min(slips, key=lambda one: one[1].cost)
    robot = _of_robot(file, model, null)
    of_robot = min(robot)[0] if robot else math.inf
    least = _SCALE_GAIN - 2.0 if best.name == "scale" else _GAIN
    if score.cost + least > null.cost:
        explained = not null.misfit or of_robot < null.cost - _GAIN
        return SlipVerdict(explained=explained, cost=null.cost), model.found(null)
    if of_robot < score.cost - MARGIN:
        return SlipVerdict(cost=of_robot), model.found(null)
    if score.misfit:
        return SlipVerdict(explained=False, cost=score.cost), model.found(null)
    text, off = _text(best, points, score)
    alike = [what for cost, what in sorted(robot) if cost < score.cost + MARGIN]
    if alike:
        text = f"{text}, or {', or '.join(alike[:2])}"
    sure = not score.odd and null.cost > score.cost + _GROSS
    return SlipVerdict(text, bool(alike), off, True, score.cost, sure), model.found(score)


def _of_robot(file: CableGeometry, model: _ByLengths, null: _Score) -> list[tuple[float, str]]:
    """Return cost and text of each fault of the robot's file that may be the cause instead."""
    size, rows, k = len(model.known), file.rows, file.coordinates
    each = np.eye(size)
    tried: list[tuple[str, FloatArray, float]] = []
    if DRUM in rows:
        drums = [i * len(rows) + rows.index(DRUM) for i in range(file.n)]
        tried += [
            (f"the drum of {file.cable_name(i)} differs from the file", each[:, [drum]], _DRUM)
            for i, drum in enumerate(drums)
        ]
        alike = each[:, drums].sum(axis=1, keepdims=True)
        tried.append(("all drums pay out more or less than in the file", alike, _DRUM))
    if 0 in rows:
        tried += [
            (f"the exit point of {file.cable_name(i)} differs from the file",
             each[:, i * len(rows) : i * len(rows) + k], _EXIT_m)
            for i in range(file.n)
        ]  # fmt: skip
    if file.shared:
        yielding = each[:, [file.size - 1]]
        tried.append(("the elongation of the cables differs from the file", yielding, _ELONGATION))
    return [(model.cost_of_file(null, directions, most), name) for name, directions, most in tried]


def _slips(points: Points, model: _ByLengths, null: _Score) -> Iterator[_Slip]:
    """Yield the slips to try: scale and origin, and the others if lengths contradict `null`."""
    place = np.nan_to_num(points.place_m)
    count, k = place.shape
    shift = _SHIFT_m * np.tile(np.eye(k), (count, 1, 1))
    turn = _TURN_rad * _turned(place)
    scale = _SCALE * place[..., None]
    yield _Slip("scale", points, 0.0, scale)
    yield _Slip("shift", points, 0.0, shift)
    if not null.odd:
        return
    yield _Slip("scale and shift", points, 0.0, np.concatenate([scale, shift], axis=2))
    yield _Slip("turn", points, 0.0, np.concatenate([shift, turn], axis=2))
    for axis in range(k):
        one = shift[..., [axis]]
        along = np.concatenate([one * scale[:, [axis]] / _SHIFT_m, one], axis=2)
        yield _Slip(f"scale {_AXES[axis]}", points, 2.0 * math.log(k), along)
    if (near := _turned_near(points, model)) is not None:
        yield _Slip("turn", near, 4.0, np.concatenate([shift, turn], axis=2))
    for mm, unit in _UNITS.items():
        scaled = replace(points, place_m=mm * points.place_m, std_m=max(mm, 1.0) * points.std_m)
        yield _Slip(f"unit {unit}", scaled, 2.0 * math.log(len(_UNITS)))
    for name, order, sign in _axes(k):
        other = replace(
            points, place_m=points.place_m[:, order] * sign, std_m=points.std_m[:, order]
        )
        cost = 2.0 * math.log(2**k * math.factorial(k))
        yield _Slip(f"axes {name}", other, cost)
        yield _Slip(f"axes {name} and shift", other, cost, shift)
    yield from _other_orders(points, model)


def _turned(place_m: FloatArray) -> FloatArray:
    """Return the derivatives (M, k, t) of points by small rotations about the axes."""
    if place_m.shape[1] == 2:
        return np.stack([-place_m[:, 1], place_m[:, 0]], axis=1)[..., None]
    return np.stack([np.cross(axis, place_m) for axis in np.eye(3)], axis=2)


def _turned_near(points: Points, model: _ByLengths) -> Points | None:
    """Return the points rotated and moved to the positions from lengths; None if too few."""
    k = points.place_m.shape[1]
    whole = np.isfinite(points.place_m).all(axis=1)
    if whole.sum() < k:
        return None
    there = points.place_m[whole]
    here = (model.place_m + model.A @ model.change)[points.pose[whole]]
    turn, shift = best_fit(there, here)
    return replace(points, place_m=points.place_m @ turn.T + shift)


def _axes(k: int) -> Iterator[tuple[str, list[int], FloatArray]]:
    """Yield the ways to exchange and reverse axes: as text, order and signs."""
    for order, sign in product(permutations(range(k)), product((1.0, -1.0), repeat=k)):
        if order == tuple(range(k)) and min(sign) > 0.0:
            continue
        name = ", ".join(
            ("-" if s < 0.0 else "") + _AXES[a] for a, s in zip(order, sign, strict=True)
        )
        yield name, list(order), np.array(sign)


def _other_orders(points: Points, model: _ByLengths) -> Iterator[_Slip]:
    """Yield points assigned to other poses than in their file."""
    yield _Slip("order reversed", replace(points, pose=points.pose[::-1].copy()), 2.0)
    count, there = len(points.pose), model.place_m + model.A @ model.change
    shifted = []
    for what, by, start in product(("numbers", "lines"), _SHIFTS, range(count)):
        kept = _renumbered(points, by, start, what == "lines", len(model.place_m))
        if len(kept.pose) < max(2, count - abs(by)):
            continue
        first = points.pose[start] + 1 if start else 0
        shifted.append((_apart_m2(kept, there), f"{what} {by} {first}", kept))
    for _, name, kept in sorted(shifted, key=lambda one: one[0])[:_BEST]:
        lost = _POINT_COST * (count - len(kept.pose))
        yield _Slip(name, kept, lost + 2.0 * math.log(2 * len(_SHIFTS) * count))
    yield from _exchanged(points, there)


def _apart_m2(points: Points, there_m: FloatArray) -> float:
    """Return how far the points, moved as a whole, are from positions from lengths (N, k)."""
    off = points.place_m - there_m[points.pose]
    off -= np.nansum(off, axis=0) / np.isfinite(off).sum(axis=0).clip(min=1)
    return float(np.nansum(off**2, axis=1).clip(max=_FAR_m2).sum())


def _renumbered(points: Points, by: int, start: int, lines: bool, poses: int) -> Points:
    """Return points assigned to other pose numbers, or to other lines, from line `start` on."""
    count = len(points.pose)
    line, pose = np.arange(count), points.pose.copy()
    if lines:
        line[start:] += by
        inside = (line >= 0) & (line < count)
        pose[inside] = points.pose[line[inside]]
    else:
        pose[start:] += by
        inside = (pose >= 0) & (pose < poses)
    # lines before the first shifted one keep their poses
    inside[start:] &= ~np.isin(pose[start:], pose[:start])
    return Points(pose[inside], points.place_m[inside], points.std_m[inside])


def _exchanged(points: Points, there_m: FloatArray) -> Iterator[_Slip]:
    """Yield points with two rows exchanged, or two pairs of rows."""
    count, here, name = len(points.pose), points, "rows"
    for pairs in (1, 2):
        tried = []
        for i, j in combinations(range(count), 2):
            pose = here.pose.copy()
            pose[[i, j]] = pose[[j, i]]
            other = replace(here, pose=pose)
            exchanged = f"{name} {points.pose[i] + 1} and {points.pose[j] + 1}"
            tried.append((_apart_m2(other, there_m), exchanged, other))
        tried.sort(key=lambda one: one[0])
        for _, exchanged, other in tried[: _BEST if pairs == 1 else 1]:
            yield _Slip(exchanged, other, pairs * 2.0 * math.log(count**2 / 2))
        _, name, here = tried[0]
        name += ";"


def row_slip(measured_m: FloatArray, there_m: FloatArray, std_m: float) -> str:
    """Return the mistake that explains a measured point (k,), or ""; nan: not measured."""
    k = len(measured_m)
    tried = {f"it is in {unit}": mm * measured_m for mm, unit in _UNITS.items()}
    for name, order, sign in _axes(k):
        tried[f"it is ({name})"] = measured_m[order] * sign
    most = max(_NEAR * std_m, _NEAR_SHARE * float(np.nanmax(np.abs(measured_m - there_m))))
    off = {text: float(np.nanmax(np.abs(place - there_m))) for text, place in tried.items()}
    best = min(off, key=lambda text: off[text])
    return best if off[best] < most else ""


def _text(slip: _Slip, points: Points, score: _Score) -> tuple[str, float]:
    """Return the slip as text, and its size."""
    what, _, rest = slip.name.partition(" ")
    names, size = ", ".join(_AXES[: points.place_m.shape[1]]), 0.0
    if what == "scale":
        size = float(1.0 / (1.0 - _SCALE * score.free[0]) - 1.0)
        of_axis = f"{rest} of " if rest in tuple(_AXES) else ""
        text = f"the scale of {of_axis}all measured points is {100.0 * size:+.2f} % off"
    elif what == "shift":
        off_m = _SHIFT_m * score.free
        size = float(np.linalg.norm(off_m))
        text = (
            f"all measured points are off by ({', '.join(f'{1e3 * x:.0f}' for x in off_m)}) mm: "
            "their origin differs from that of the robot's file, or another point of the "
            "platform was measured"
        )
    elif what == "turn":
        text = "the axes of all measured points are turned relative to those of the robot's file"
    elif what == "unit":
        text = f"all measured points are in {rest}, not in mm"
    elif what == "axes":
        text = f"all measured points are ({rest.removesuffix(' and shift')}), not ({names})"
    elif what == "order":
        text = "all measured points are in the reverse order of the poses"
    elif what in ("numbers", "lines"):
        by, first = map(int, rest.split())
        which = f"from pose {first} on, measured points" if first else "all measured points"
        unit = "pose number" if what == "numbers" else "line"
        far = f"{abs(by)} {unit}{'s' * (abs(by) > 1)} {'earlier' if by < 0 else 'later'}"
        text = f"{which} belong {far}"
    else:
        text = f"the measured points of poses {rest.replace(';', ', and of')} are exchanged"
    return text + (", and their origin is shifted" if rest.endswith("and shift") else ""), size
