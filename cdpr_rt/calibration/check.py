"""Check with a few poses whether a calibrated robot has changed, and find the changed cable.

The calibrated geometry gives the poses from lengths and, if available, from a camera or scanner.
Changes of single cables, each linearised, explain the remaining residuals:

    r + P_⊥ (A θ + N ξ) ≈ 0

P_⊥ removes the part that changes of the poses explain. A has the derivatives by a cable's exit
point, length or drum. N has those by the platform's pose at home, at which the lengths begin to
count. The search first takes the change that lowers the sum of squares most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.fit import fit
from cdpr_rt.calibration.parameters import DRUM, EXIT, OFFSET, CableGeometry
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.calibration.residuals import Linearised, length_std_m, linearise
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.model.cable_kernel import CABLE_ROWS as KERNEL_ROWS
from cdpr_rt.model.cable_kernel import run_poses

_HOME_m, _HOME_rad = 0.002, 0.004
"""Standard deviation of the platform's pose at home if nothing has changed."""
_GAIN = 30.0
"""Smallest reduction of the sum of squared residuals by a change, in units of their variance."""
_EACH_PARAMETER = 6.0
"""Additional reduction required for each parameter of the change."""
_LEAST_NOISE = 0.1
"""Smallest estimated variance of readings, relative to the assumed one."""
_ALIKE = 0.8
_MOST_CHANGES = 3
_LARGEST = {"exit": 0.1, "length": 0.1, "drum": 0.03, "slip": 0.1}
"""Prior standard deviation of a change of each kind, m; relative for a drum."""
_MISFIT = 9.0
_NO_SPARE_LENGTH = (
    "lengths alone cannot check a robot with as many cables as degrees of freedom, because any "
    "lengths agree with some pose; check it with a camera or --scanner"
)
_ADVICE = {
    "exit": "check its pulley, the mount of the pulley, and its rail",
    "length": "check whether its cable slipped on the drum or at the platform, or its "
    "encoder slipped",
    "drum": "check its drum, its belt and the winding of its cable",
    "slip": "it slipped during this check: tighten at home and check again",
}


@dataclass(frozen=True)
class DetectedChange:
    """A change of the robot since it was calibrated."""

    kind: str
    """exit, length, drum, or slip: a change of length that begins at one pose of the check."""
    cable: int
    """Index of the cable, counted from 0."""
    size: FloatArray
    """(k,) m; relative for a drum."""
    std: FloatArray
    effect_m: float
    """Largest error, over the poses, that the change causes in positions computed from lengths."""
    who: str
    """The cable as text, with the other cables that may have changed instead."""
    alike: tuple[int, ...] = ()
    """Other cables for which a change of this kind fits nearly equally."""
    pose: int = 0
    """The first pose after a slip, counted from 0 (home)."""

    @property
    def text(self) -> str:
        """The change, its size, and advice, as text."""
        who = self.who
        many = ", ".join(f"{1e3 * x:+.1f}" for x in self.size)
        sure = f"± {3e3 * float(self.std.max()):.1f} mm (3 sigma)"
        what = {
            "exit": f"the exit point of {who} has moved by ({many}) {sure}",
            "length": f"{who} is {many} {sure} longer than assumed",
            "slip": f"{who} is {many} {sure} longer than assumed from pose {self.pose} on",
            "drum": f"a turn of the motor of {who} pays out {100 * float(self.size[0]):+.2f} ± "
            f"{300 * float(self.std[0]):.2f} % (3 sigma) relative to the calibration",
        }[self.kind]
        effect = f"positions are off by up to {1e3 * self.effect_m:.1f} mm"
        return f"{what}; {effect}: {_ADVICE[self.kind]}"

    def as_json(self) -> dict[str, object]:
        """Return the change as JSON, with cables counted from 1."""
        return {
            "kind": self.kind,
            "cable": self.cable + 1,
            "or_cables": [other + 1 for other in self.alike],
            "size": self.size.tolist(),
            "std": self.std.tolist(),
            "effect_mm": 1e3 * self.effect_m,
            "text": self.text,
            **({"from_pose": self.pose} if self.kind == "slip" else {}),
        }


@dataclass(frozen=True)
class Check:
    """Result of checking a calibration at a few poses."""

    poses: int
    residual_m: float
    """Root mean square of the residuals of lengths, at the poses computed from them."""
    misfit: float
    """Mean square of the residuals that the changes do not explain, over their variance."""
    changes: tuple[DetectedChange, ...]
    wanted_m: float

    @property
    def effect_m(self) -> float:
        """Error of positions due to all changes together."""
        return sum(change.effect_m for change in self.changes)

    @property
    def moved(self) -> bool:
        """Whether the robot has changed by more than is acceptable."""
        return self.effect_m > self.wanted_m or self.misfit > _MISFIT

    def verdict(self) -> list[str]:
        """Return the result as lines of text."""
        off = f"lengths at {self.poses} poses disagree by {1e3 * self.residual_m:.2f} mm rms"
        if not self.moved:
            small = [f"harmless so far: {change.text}" for change in self.changes]
            return [f"UNCHANGED: {off}", *small]
        lines = [f"MOVED: {change.text}" for change in self.changes]
        if self.misfit > _MISFIT:
            lines.append(
                "MOVED: single cables do not explain it; check the frame and several cables"
            )
        return [off, *lines]


def require_spare_length(geometry: CableGeometry) -> None:
    """Raise InvalidRequestError if lengths alone cannot check the robot."""
    directions = sum(i < 6 for i in geometry.free)
    if geometry.n + geometry.balance_readings <= directions:
        raise InvalidRequestError(_NO_SPARE_LENGTH)


def check_geometry(geometry: CableGeometry, seen: Observations, wanted_m: float) -> Check:
    """Return whether readings agree with a geometry; the first reading is at home.

    `wanted_m` is the error of positions above which a change matters.
    """
    whole = replace(geometry, identified=("exit", "offset", "drum"))
    there = fit(replace(geometry, identified=()), seen, robust=False)
    at = linearise(whole, seen, there.poses, np.zeros(len(seen.jumps)))
    system = _System(whole, at, there.poses)
    changes: list[DetectedChange] = []
    columns: list[IntArray] = []
    while len(changes) < _MOST_CHANGES and (found := system.best(columns)) is not None:
        kind, cable, pose, alike, own = found
        columns.append(own)
        who = geometry.cables_text(cable, alike)
        changes.append(DetectedChange(kind, cable, np.zeros(0), np.zeros(0), 0.0, who, alike, pose))
    changes = system.sized(changes, columns)
    off_m = there.length_residual_m * length_std_m(geometry, seen)
    rms = float(np.sqrt((off_m**2).sum() / max(int(seen.used.sum()), 1)))
    return Check(seen.poses, rms, system.misfit(columns), tuple(changes), wanted_m)


class _System:
    """Residuals after elimination of the poses, and the columns of all possible changes."""

    def __init__(self, geometry: CableGeometry, at: Linearised, poses: FloatArray) -> None:
        self._geometry, self._at = geometry, at
        inverse = np.linalg.pinv(at.by_pose)
        free = np.eye(at.residual.shape[1]) - at.by_pose @ inverse
        count, rows, size = at.by_parameter.shape
        self._residual = np.einsum("jab,jb->ja", free, at.residual).ravel()
        self._freedom = int((at.by_pose != 0.0).any(axis=2).sum()) - inverse.shape[1] * count
        if self._freedom <= 0:
            raise InvalidRequestError(_NO_SPARE_LENGTH)
        q = len(geometry.rows)
        self._own = {
            ("exit", i, 0): np.array(
                [i * q + k for k, r in enumerate(geometry.rows) if r < EXIT.stop]
            )
            for i in range(geometry.n)
        }
        for kind, row in (("length", OFFSET), ("drum", DRUM)):
            place = geometry.rows.index(row)
            self._own |= {(kind, i, 0): np.array([i * q + place]) for i in range(geometry.n)}
        slips: list[FloatArray] = []
        place = geometry.rows.index(OFFSET)
        for i, pose in product(range(geometry.n), range(1, count)):
            self._own["slip", i, pose] = np.array([size + len(slips)])
            after = np.arange(count)[:, None] >= pose
            slips.append(np.where(after, at.by_parameter[:, :, i * q + place], 0.0))
        self._by_parameter = np.concatenate([at.by_parameter, np.stack(slips, axis=2)], axis=2)
        self._columns = (free @ self._by_parameter).reshape(count * rows, -1)
        self._prior = np.zeros(self._columns.shape[1])
        for (kind, _, _), own in self._own.items():
            self._prior[own] = _LARGEST[kind] ** -2.0
        self._nuisance, self._known = self._of_home(poses[0])

    def _of_home(self, home: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the derivatives of lengths by the pose at home, and its standard deviations."""
        geometry = self._geometry
        cables = np.empty((1, KERNEL_ROWS, geometry.n))
        run_poses(geometry.kernel_geometry(), home[None], cables)
        chosen = [i for i in geometry.free if i < 6]
        offsets = np.concatenate([self._own["length", i, 0] for i in range(geometry.n)])
        known = np.where(np.array(chosen) < 3, _HOME_m, _HOME_rad)
        return self._columns[:, offsets] @ cables[0, chosen].T * known, known

    def _solve(self, columns: Sequence[IntArray]) -> tuple[FloatArray, FloatArray, float]:
        """Return changes, their covariance, and the remaining sum of squares."""
        own = np.concatenate(columns) if columns else np.zeros(0, int)
        A = np.hstack([self._columns[:, own], self._nuisance])
        prior = np.append(self._prior[own], np.ones(self._nuisance.shape[1]))
        normal = A.T @ A + np.diag(prior)
        inverse = np.linalg.pinv(normal, hermitian=True)
        x = -inverse @ (A.T @ self._residual)
        left = self._residual + A @ x
        cost = float(left @ left + (prior * x) @ x)
        return x[: len(own)], inverse[: len(own), : len(own)], cost

    def misfit(self, columns: Sequence[IntArray]) -> float:
        """Return the mean square of the residuals that remain after these changes."""
        used = sum(len(own) for own in columns)
        return self._solve(columns)[2] / float(max(self._freedom - used, 1))

    def _noise(self, columns: Sequence[IntArray]) -> float:
        """Return the variance of the remaining residuals, at most that assumed for readings."""
        return min(max(self.misfit(columns), _LEAST_NOISE), 1.0)

    def best(
        self, columns: Sequence[IntArray]
    ) -> tuple[str, int, int, tuple[int, ...], IntArray] | None:
        """Return the further change that explains most of the residuals; None if uncertain."""
        before = self._solve(columns)[2]
        gains = {}
        for key, own in self._own.items():
            tried = [*columns, own]
            gain = (before - self._solve(tried)[2]) / self._noise(tried)
            gains[key] = gain - _EACH_PARAMETER * len(own)
        kind, cable, pose = max(gains, key=lambda key: gains[key])
        if gains[kind, cable, pose] < _GAIN:
            return None
        alike = tuple(
            other
            for (same, other, at), gain in gains.items()
            if (same, at) == (kind, pose)
            and other != cable
            and gain > _ALIKE * gains[kind, cable, pose]
        )
        return kind, cable, pose, alike, self._own[kind, cable, pose]

    def sized(
        self, changes: list[DetectedChange], columns: Sequence[IntArray]
    ) -> list[DetectedChange]:
        """Return the changes with their sizes from a joint fit."""
        x, covariance, _ = self._solve(columns)
        std = np.sqrt(np.diag(covariance))
        out, first = [], 0
        for change, own in zip(changes, columns, strict=True):
            part = slice(first, first + len(own))
            first += len(own)
            effect = self._effect_m(own, x[part])
            out.append(replace(change, size=x[part], std=std[part], effect_m=effect))
        return out

    def _effect_m(self, own: IntArray, size: FloatArray) -> float:
        """Return the largest error that a change causes in positions computed from lengths."""
        at = self._at
        # if a platform turns freely, the balance of moments determines the angle, not the lengths
        rows = self._geometry.n + self._geometry.balance_rows
        x = at.by_pose[:, :rows]
        moved = np.einsum("jra,a->jr", self._by_parameter[:, :rows, own], size)
        step = np.einsum("jdr,jr->jd", np.linalg.pinv(x), moved)
        return float(np.linalg.norm(step[:, : self._geometry.coordinates], axis=1).max())
