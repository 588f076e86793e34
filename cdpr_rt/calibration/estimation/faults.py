"""Faults of observations: a cable slack or slipped, another drum than in the file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera.camera_model import CameraModel
from cdpr_rt.calibration.estimation.fit import Fit, fit
from cdpr_rt.calibration.estimation.parameters import DRUM, CableGeometry
from cdpr_rt.calibration.estimation.residuals import length_std_m
from cdpr_rt.calibration.readings.observations import Observations

FaultKind = Literal[
    "slack", "outlier", "jump", "drum", "elongation", "image", "marker", "camera", "lens", "size"
]
_OUTLIER, _JUMP = 25.0, 40.0
"""Least reduction of the sum of squared residuals by leaving it out, to first order."""
_LEAST_GAIN = 16.0
"""Least reduction over the variance of what is left (F-test)."""
_MOST_FAULTS = 16
_ALIKE, _MAYBE = 0.8, 0.2
_ENDS = 2
"""Poses at both ends where a jump cannot be told from an outlier."""
_FAR = 3.0
_UNSURE = ": lengths alone do not tell"


@dataclass(frozen=True)
class Fault:
    """Something that does not belong to the robot that was assumed."""

    kind: FaultKind
    cable: int
    """Counted from 0; -1 for all."""
    pose: int
    """Likewise; -1 where it is about all poses."""
    size: float
    """In m, of a drum, elongation and what is of the camera relative."""
    text: str
    alike: tuple[int, ...] = ()
    """Other cables of which it might as well be, by lengths alone."""

    def as_json(self) -> dict[str, object]:
        """Return it for JSON, cables and poses counted from 1."""
        return {
            "kind": self.kind,
            "cable": self.cable + 1 or None,
            "or_cables": [cable + 1 for cable in self.alike],
            "pose": self.pose + 1 or None,
            "size": self.size,
            "text": self.text,
        }


def without_slack(
    geometry: CableGeometry, seen: Observations, slack_N: FloatArray
) -> tuple[Observations, list[Fault]]:
    """Return observations without the lengths of cables that hung slack, by their tensions."""
    slack = seen.used & (seen.tension_N < slack_N)
    faults = [
        Fault(
            "slack", int(i), int(j), float(seen.tension_N[j, i]),
            f"{geometry.cable_name(i)} was slack at pose {j + 1} ({seen.tension_N[j, i]:.1f} N); "
            "its length there is left out",
        )
        for j, i in np.argwhere(slack)
    ]  # fmt: skip
    return replace(seen, used=seen.used & ~slack), faults


def fit_without_faults(
    geometry: CableGeometry,
    seen: Observations,
    slack_N: FloatArray,
    camera: CameraModel | None = None,
) -> tuple[Fit, list[Fault]]:
    """Return the fit of what belongs together, and what was left out of it, in words.

    The length that contradicts all others most is left out, or where all later ones of its cable
    are off alike given an offset of its own, until none contradicts them.
    """
    seen, faults = without_slack(geometry, seen, slack_N)
    found = fit(geometry, seen, camera=camera)
    gains: list[float] = []
    left_out: list[Fault] = []
    while len(left_out) < _MOST_FAULTS and (fault := _worst(found)) is not None:
        fault, without = _left_out(geometry, found, fault)
        gains.append(found.total_cost - without.total_cost)
        left_out.append(fault)
        found = without
    # what stood out before others were left out may not stand out any more
    least = _LEAST_GAIN * max(found.variance_factor, 1.0)
    sure = [fault for fault, gain in zip(left_out, gains, strict=True) if gain > least]
    if len(sure) < len(left_out):
        found = _only_without(geometry, seen, sure, found)
    some = [fault for fault in sure if fault.kind != "jump" or _is_off(fault, found)]
    if len(some) < len(sure):
        sure, found = some, _only_without(geometry, seen, some, found)
    faults += [_with_size(fault, found) for fault in sure]
    return found, faults + parameter_faults(found)


def _left_out(geometry: CableGeometry, found: Fit, fault: Fault) -> tuple[Fault, Fit]:
    """Return the fit without a fault; of a jump that cable's which then leaves least.

    Poses can take much of a jump: which cable it is, shows only once they are fitted anew.
    """
    seen = replace(found.seen, start=found.poses)
    cables = (fault.cable, *fault.alike) if fault.kind == "jump" else (fault.cable,)
    tried = [replace(fault, cable=cable) for cable in cables]
    fits = [
        fit(geometry, _without(seen, one), start=found.geometry, camera=found.camera)
        for one in tried
    ]
    costs = np.array([one.total_cost for one in fits])
    best = int(costs.argmin())
    if fault.kind != "jump":
        return fault, fits[0]
    near = costs < costs[best] + _LEAST_GAIN * max(fits[best].variance_factor, 1.0)
    alike = tuple(cables[k] for k in np.flatnonzero(near) if k != best)
    return replace(tried[best], alike=alike), fits[best]


def _without(seen: Observations, fault: Fault) -> Observations:
    if fault.kind == "jump":
        return replace(seen, jumps=(*seen.jumps, (fault.cable, fault.pose)))
    used = seen.used.copy()
    used[fault.pose, fault.cable] = False
    return replace(seen, used=used)


def _only_without(
    geometry: CableGeometry, seen: Observations, faults: list[Fault], found: Fit
) -> Fit:
    """Return the fit without these faults, from another one on."""
    seen = replace(seen, start=found.poses)
    for fault in faults:
        seen = _without(seen, fault)
    return fit(geometry, seen, start=found.geometry, camera=found.camera)


def _is_off(fault: Fault, found: Fit) -> bool:
    """Return whether a jump still has a size: one found later may have been all of it."""
    k = found.seen.jumps.index((fault.cable, fault.pose))
    variance = found.covariance[found.geometry.size + k, found.geometry.size + k]
    return bool(found.jumps_m[k] ** 2 > _FAR**2 * variance)


def _with_size(fault: Fault, found: Fit) -> Fault:
    """Return the jump with its size by the fit that knows it."""
    if fault.kind != "jump":
        return fault
    size = float(found.jumps_m[found.seen.jumps.index((fault.cable, fault.pose))])
    who = found.geometry.cables_text(fault.cable, fault.alike, _UNSURE)
    text = (
        f"{who} is {1e3 * size:+.1f} mm off from pose {fault.pose + 1} on: "
        "its encoder, coupling or drum slipped between that pose and the one before"
    )
    return replace(fault, size=size, text=text)


def _worst(found: Fit) -> Fault | None:
    """Return what contradicts all else most, None where nothing does."""
    n, seen = found.geometry.n, found.seen
    residual, hat, weight = _hats(found)
    redundancy = 1.0 - np.array([np.diag(h) for h in hat]).T
    told = seen.used & (redundancy > 0.05)
    if not told.any():
        return None
    single = np.where(told, residual**2 / np.where(told, redundancy, 1.0), 0.0)
    j, i = np.unravel_index(int(single.argmax()), single.shape)
    # a jump is compared with all lengths of its cable, as the robust loss has them count
    root = np.sqrt(found.weights)
    off, by = residual * root, weight * root
    gains = np.array([_jump_gains(off[:, c], hat[c], by[:, c]) for c in range(n)])
    cable, pose = (int(x) for x in np.unravel_index(int(gains.argmax()), gains.shape))
    jump = float(gains[cable, pose])
    if (
        jump > max(_JUMP, float(single[j, i] * found.weights[j, i]))
        and (cable, pose) not in seen.jumps
    ):
        return Fault("jump", cable, pose, 0.0, "", _alike(gains[:, pose], cable, _MAYBE))
    if single[j, i] < _OUTLIER:
        return None
    size = float(residual[j, i] / weight[j, i] / redundancy[j, i])
    what = "slack or caught somewhere" if size > 0.0 else "longer than it was paid out"
    alike = _alike(single[j], int(i))
    who = found.geometry.cables_text(int(i), alike, _UNSURE)
    text = (
        f"{who} at pose {j + 1} is {1e3 * size:+.1f} mm off what all "
        f"others say: {what}; its length there is left out"
    )
    return Fault("outlier", int(i), int(j), size, text, alike)


def _alike(gains: FloatArray, best: int, share: float = _ALIKE) -> tuple[int, ...]:
    """Return the cables that explain it nearly as well as the best one."""
    near = np.flatnonzero(gains > share * gains[best])
    return tuple(int(cable) for cable in near if cable != best)


def _hats(found: Fit) -> tuple[FloatArray, list[FloatArray], FloatArray]:
    """Return residuals (N, n), for each cable which share each explains of each, and weights.

    For rows j, k of one cable p_j Σ p_k^T + δ_jk x_j C_j^-1 x_j^T, where p are the derivatives by
    the parameters less what the poses take of them.
    """
    n, at = found.geometry.n, found.at
    root = np.sqrt(found.weights)[..., None]
    by_pose = at.by_pose[:, :n] * root
    taken = by_pose @ found.pose_covariance
    own = (taken * by_pose).sum(axis=2)
    left = -(taken @ np.swapaxes(found.across, 1, 2))
    left[..., : at.by_parameter.shape[2]] += at.by_parameter[:, :n] * root
    covariance = found.covariance / found.inflation
    hats = [left[:, i] @ covariance @ left[:, i].T + np.diag(own[:, i]) for i in range(n)]
    weight = found.seen.used / length_std_m(found.geometry, found.seen)
    return at.residual[:, :n], hats, weight


def _jump_gains(residual: FloatArray, hat: FloatArray, weight: FloatArray) -> FloatArray:
    """Return what an offset from each pose on would take off the sum of squares, (N,)."""
    count = residual.size
    left = (np.eye(count) - hat) * np.outer(weight, weight)
    both = np.cumsum(np.cumsum(left[::-1, ::-1], axis=0), axis=1)[::-1, ::-1]
    square = np.diag(both)
    score = np.cumsum((weight * residual)[::-1])[::-1]
    told = square > 1e-3 * (weight**2).max(initial=1e-30)
    told[: _ENDS + 1] = told[count - _ENDS :] = False
    return np.asarray(np.where(told, score**2 / np.where(told, square, 1.0), 0.0))


def parameter_faults(found: Fit) -> list[Fault]:
    """Return parameters that are further off the file than anyone's tape, drum or cable."""
    geometry, known = found.geometry, found.geometry.knowledge
    faults = []
    if "drum" in geometry.identified:
        place = geometry.rows.index(DRUM)
        std = found.std[: geometry.n * len(geometry.rows)][place :: len(geometry.rows)]
        for i, error in enumerate(geometry.cable[:, DRUM]):
            if abs(error) > _FAR * known.drum:
                text = (
                    f"{geometry.cable_name(i)}: a turn of its motor pays out {100 * error:+.2f} % "
                    f"(± {100 * std[i]:.2f} %, 1 sigma) of what the file says: check "
                    "drum_radius_m and gear_ratio of its winch"
                )
                faults.append(Fault("drum", i, -1, float(error), text))
    if geometry.shared and abs(geometry.elongation) > _FAR * known.elongation:
        text = (
            f"the cables yield by {100 * geometry.elongation:+.0f} % of what the file says: check "
            "elongation_percent_per_N of the cable"
        )
        faults.append(Fault("elongation", -1, -1, geometry.elongation, text))
    return faults
