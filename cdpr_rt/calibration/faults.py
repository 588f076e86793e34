"""Faults of a calibration: wrong lengths, points, drums, images and markers, and their causes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Final, Literal

import numpy as np
from scipy.stats import chi2

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration import point_slips
from cdpr_rt.calibration.camera_model import SIZE, CameraKnowledge, CameraModel
from cdpr_rt.calibration.camera_start import CameraStart
from cdpr_rt.calibration.fit import Fit, fit
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.calibration.marker_map_fit import MapFit, misfits, warnings
from cdpr_rt.calibration.parameters import DRUM, CableGeometry
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.calibration.residuals import length_std_m

FaultKind = Literal[
    "slack", "outlier", "jump", "point", "points",
    "drum", "elongation", "image", "marker", "camera", "lens", "size", "hand_eye", "place",
]  # fmt: skip
_OUTLIER, _JUMP = 25.0, 40.0
"""Smallest first-order reduction of the sum of squared residuals if a reading is left out."""
_LEAST_GAIN = 16.0
"""Smallest ratio of that reduction to the variance of the remaining residuals (F-test)."""
_MOST_FAULTS = 16
_ALIKE, _MAYBE = 0.8, 0.2
_LEAST_REDUNDANCY = 0.05
"""Smallest redundancy of a reading; below it, the other readings cannot show that it is wrong."""
_ENDS = 2
"""Number of poses at both ends at which a jump looks like an outlier."""
_FAR = 3.0
_UNSURE = ": lengths alone cannot show which"


@dataclass(frozen=True)
class Fault:
    """A reading or given value that contradicts the model of the robot."""

    kind: FaultKind
    cable: int
    """Index of the cable, counted from 0; -1 for all."""
    pose: int
    """Index of the pose, counted from 0; -1 for all."""
    size: float
    """Size of the fault, m; relative for drum, elongation and values of the camera."""
    text: str
    alike: tuple[int, ...] = ()
    """Other cables that might have the fault, because lengths alone cannot tell them apart."""

    def as_json(self) -> dict[str, object]:
        """Return the fault as JSON, with cables and poses counted from 1."""
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
    """Return observations without the lengths of cables that the tensions show to be slack."""
    slack = seen.used & (seen.tension_N < slack_N)
    faults = [
        Fault(
            "slack", int(i), int(j), float(seen.tension_N[j, i]),
            f"{geometry.cable_name(i)} was slack at pose {seen.number(int(j))} "
            f"({seen.tension_N[j, i]:.1f} N); its length there is left out",
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
    """Return the fit of all consistent readings, and the readings that were left out, as text.

    The length or measured point that contradicts the others most is left out, until all agree. If
    all later lengths of a cable are wrong by the same amount, they get a separate offset instead.
    """
    seen, faults = without_slack(geometry, seen, slack_N)
    found = fit(geometry, seen, camera=camera)
    gains: list[float] = []
    left_out: list[Fault] = []
    while len(left_out) < _MOST_FAULTS and (tried := _worst(found)):
        fault, without = _left_out(geometry, found, tried)
        gains.append(found.total_cost - without.total_cost)
        left_out.append(fault)
        found = without
    # outliers may fit after other readings have been left out
    least = _LEAST_GAIN * max(found.variance_factor, 1.0)
    sure = [fault for fault, gain in zip(left_out, gains, strict=True) if gain > least]
    if len(sure) < len(left_out):
        found = _only_without(geometry, seen, sure, found)
    some = [fault for fault in sure if fault.kind != "jump" or _is_off(fault, found)]
    if len(some) < len(sure):
        sure, found = some, _only_without(geometry, seen, some, found)
    faults += [_with_size(fault, found, seen) for fault in sure]
    return found, faults + parameter_faults(found)


def without_slipped_points(
    geometry: CableGeometry, seen: Observations, slack_N: FloatArray
) -> tuple[Observations, list[Fault]]:
    """Return observations without measured points if these have a common slip, and its text.

    In that case the points contradict the lengths and the robot's file. Leaving out single points
    would reject points that may be right.
    """
    if not np.isfinite(seen.position_std_m).any():
        return seen, []
    blind, before = fit_without_faults(geometry, seen.unmeasured(), slack_N)
    verdict = point_slips.slipped(geometry, blind, seen)
    if not verdict.text and verdict.explained:
        return seen, []
    causes = [verdict.text] if verdict.text else []
    if not verdict.sure:
        readings, rival = _wrong_lengths(geometry, seen, slack_N, before)
        if rival.explained and (not causes or rival.cost < verdict.cost - point_slips.MARGIN):
            return seen, []
        if rival.explained and rival.cost < verdict.cost + point_slips.MARGIN:
            causes += [one.text.partition(":")[0] for one in readings[:2]]
    if len(causes) == 1 and not verdict.undecided:
        text = f"{causes[0]}: correct the points, and fit again"
    elif causes:
        text = (
            "undecided: measured points contradict lengths and the robot's file: "
            f"{', or '.join(causes)}; to find out which, measure one distance between two "
            "poses in another way"
        )
    else:
        text = (
            "undecided: measured points contradict lengths and the robot's file, and no "
            "single slip or wrong value explains this: measure some points again"
        )
    fault = Fault("points", -1, -1, verdict.off, text)
    return replace(seen.unmeasured(), markers=seen.markers), [fault]


def _wrong_lengths(
    geometry: CableGeometry, seen: Observations, slack_N: FloatArray, before: list[Fault]
) -> tuple[list[Fault], point_slips.SlipVerdict]:
    """Return lengths that only the points contradict, and whether these explain the points."""
    joint, faults = fit_without_faults(geometry, seen, slack_N)
    known = {(one.kind, one.cable, one.pose) for one in before}
    readings = [
        one
        for one in faults
        if one.kind in ("jump", "outlier") and (one.kind, one.cable, one.pose) not in known
    ]
    if not readings:
        return [], point_slips.SlipVerdict(explained=False)
    start = replace(joint.seen, start=joint.poses).unmeasured()
    others = fit(geometry, start, start=joint.geometry)
    return readings, point_slips.cost_of_readings(geometry, others, seen, len(readings))


def without_points(seen: Observations, faults: Iterable[Fault]) -> Observations:
    """Return observations without the measured points that are among the faults."""
    for fault in faults:
        if fault.kind == "point":
            seen = _without(seen, fault)
    return seen


def _left_out(geometry: CableGeometry, found: Fit, tried: list[Fault]) -> tuple[Fault, Fit]:
    """Return the fault whose removal reduces the residuals most, and the fit without it.

    Poses can absorb much of a jump. A pose that few readings determine can absorb much of a wrong
    length or point. Only fitting the poses again shows which fault it is.
    """
    seen = replace(found.seen, start=found.poses)
    fits = [
        fit(geometry, _without(seen, one), start=found.geometry, camera=found.camera)
        for one in tried
    ]
    if len(tried) == 1:
        return tried[0], fits[0]
    costs = np.array([one.total_cost for one in fits])
    best = int(costs.argmin())
    near = costs < costs[best] + _LEAST_GAIN * max(fits[best].variance_factor, 1.0)
    if tried[0].kind == "point" and near[0]:
        best = 0
    alike = tuple(tried[k].cable for k in np.flatnonzero(near) if k != best)
    return replace(tried[best], alike=alike), fits[best]


def _without(seen: Observations, fault: Fault) -> Observations:
    if fault.kind == "jump":
        return replace(seen, jumps=(*seen.jumps, (fault.cable, fault.pose)))
    if fault.kind == "point":
        std_m = seen.position_std_m.copy()
        std_m[fault.pose] = np.inf
        return replace(seen, position_std_m=std_m)
    used = seen.used.copy()
    used[fault.pose, fault.cable] = False
    return replace(seen, used=used)


def _only_without(
    geometry: CableGeometry, seen: Observations, faults: list[Fault], found: Fit
) -> Fit:
    """Return the fit without these faults, starting from another fit."""
    seen = replace(seen, start=found.poses)
    for fault in faults:
        seen = _without(seen, fault)
    return fit(geometry, seen, start=found.geometry, camera=found.camera)


def _is_off(fault: Fault, found: Fit) -> bool:
    """Return whether a jump is still significant: one that was found later may explain it."""
    k = found.seen.jumps.index((fault.cable, fault.pose))
    variance = found.covariance[found.geometry.size + k, found.geometry.size + k]
    return bool(found.jumps_m[k] ** 2 > _FAR**2 * variance)


def _with_size(fault: Fault, found: Fit, seen: Observations) -> Fault:
    """Return a jump or point of `seen` with its size according to the final fit."""
    if fault.kind == "point":
        return _with_distance(fault, found, seen)
    if fault.kind != "jump":
        return fault
    size = float(found.jumps_m[found.seen.jumps.index((fault.cable, fault.pose))])
    who = found.geometry.cables_text(fault.cable, fault.alike, _UNSURE)
    text = (
        f"{who} is {1e3 * size:+.1f} mm off from pose {seen.number(fault.pose)} on: its encoder, "
        "coupling or drum slipped just before that pose"
    )
    return replace(fault, size=size, text=text)


def _with_distance(fault: Fault, found: Fit, seen: Observations) -> Fault:
    """Return a wrong point with its distance and possible explanations."""
    j, k = fault.pose, found.geometry.coordinates
    there = (found.poses[j, 0] + found.poses[j, 1:] @ seen.target_m)[:k]
    std_m = seen.position_std_m[j, :k]
    measured = np.where(np.isfinite(std_m), seen.position_m[j, :k], np.nan)
    size = float(np.sqrt(np.nansum((measured - there) ** 2)))
    text = (
        f"pose {seen.number(j)}: the measured point is {1e3 * size:.1f} mm from the position that "
        "all other readings give"
    )
    if slip := point_slips.row_slip(measured, there, float(std_m.min())):
        text += f"; it fits if {slip}"
    if fault.alike:
        cables = " or ".join(found.geometry.cable_name(cable) for cable in fault.alike)
        text += f", or {cables} was slack or caught there: it is not known which"
    return replace(fault, size=size, text=f"{text}; it is left out")


def _worst(found: Fit) -> list[Fault]:
    """Return the candidates for the reading that contradicts the others most, or an empty list."""
    n, seen = found.geometry.n, found.seen
    residual, hat, weight = _hats(found)
    redundancy = 1.0 - np.array([np.diag(h) for h in hat]).T
    redundant = seen.used & (redundancy > _LEAST_REDUNDANCY)
    single = np.where(redundant, residual**2 / np.where(redundant, redundancy, 1.0), 0.0)
    points = _point_gains(found)
    # compare a jump with all lengths of its cable, weighted as by the robust loss
    weights = found.weights[:, :n]
    root = np.sqrt(weights)
    off, by = residual * root, weight * root
    gains = np.array([_jump_gains(off[:, c], hat[c], by[:, c]) for c in range(n)])
    cable, pose = (int(x) for x in np.unravel_index(int(gains.argmax()), gains.shape))
    j, i = (int(x) for x in np.unravel_index(int(single.argmax()), single.shape))
    weighted = (
        single[j, i] * weights[j, i],
        (points * found.weights[:, found.at.points.start]).max(),
    )
    if gains[cable, pose] > max(_JUMP, *weighted) and (cable, pose) not in seen.jumps:
        alike = _alike(gains[:, pose], cable, _MAYBE)
        return [Fault("jump", c, pose, 0.0, "") for c in (cable, *alike)]
    if points.max() > single[j, i]:
        j = int(points.argmax())
        i = int(single[j].argmax())
    if max(points[j], single[j, i]) < _OUTLIER:
        return []
    size = float(residual[j, i] / weight[j, i] / redundancy[j, i]) if redundant[j, i] else 0.0
    what = "slack or caught" if size > 0.0 else "longer than it was paid out"
    alike = _alike(single[j], i)
    who = found.geometry.cables_text(i, alike, _UNSURE)
    text = (
        f"{who} at pose {seen.number(j)} is {1e3 * size:+.1f} mm off the length that the others "
        f"give: {what}; its length there is left out"
    )
    tried = [Fault("point", -1, j, 0.0, "")] if points[j] > _MAYBE * single[j, i] else []
    if single[j, i] > _MAYBE * points[j]:
        tried.append(Fault("outlier", i, j, size, text, alike))
    return tried


def _point_gains(found: Fit) -> FloatArray:
    """Return the reduction of the sum of squares if each measured point is left out, (N,).

    For each coordinate except the first, 2 is subtracted, so that the values can be compared with
    those of a single length.
    """
    at, rows = found.at, found.at.points
    by_pose = at.by_pose[:, rows] * np.sqrt(found.weights[:, rows])[..., None]
    left, covariance = found.left[:, rows], found.covariance / found.inflation
    hat = left @ covariance @ np.swapaxes(left, 1, 2)
    hat += found.taken[:, rows] @ np.swapaxes(by_pose, 1, 2)
    spare, axes = np.linalg.eigh(np.eye(3) - hat)
    along = np.einsum("jab,ja->jb", axes, at.residual[:, rows])
    gains = np.where(
        spare > _LEAST_REDUNDANCY, along**2 / np.maximum(spare, _LEAST_REDUNDANCY), 0.0
    ).sum(axis=1)
    known = np.isfinite(found.seen.position_std_m).sum(axis=1)
    return np.asarray(np.maximum(gains - 2.0 * np.maximum(known - 1, 0), 0.0))


def _alike(gains: FloatArray, best: int, share: float = _ALIKE) -> tuple[int, ...]:
    """Return the cables that explain the residuals nearly as well as the best one."""
    near = np.flatnonzero(gains > share * gains[best])
    return tuple(int(cable) for cable in near if cable != best)


def _hats(found: Fit) -> tuple[FloatArray, list[FloatArray], FloatArray]:
    """Return residuals (N, n), the hat matrix of each cable's residuals, and weights.

    For rows j, k of one cable the hat matrix is p_j Σ p_k^T + δ_jk x_j C_j^-1 x_j^T. Here p are the
    derivatives by the parameters, reduced by the elimination of the poses.
    """
    n, at = found.geometry.n, found.at
    by_pose = at.by_pose[:, :n] * np.sqrt(found.weights[:, :n])[..., None]
    own, left = (found.taken[:, :n] * by_pose).sum(axis=2), found.left[:, :n]
    covariance = found.covariance / found.inflation
    hats = [left[:, i] @ covariance @ left[:, i].T + np.diag(own[:, i]) for i in range(n)]
    weight = found.seen.used / length_std_m(found.geometry, found.seen)
    return at.residual[:, :n], hats, weight


def _jump_gains(residual: FloatArray, hat: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the reduction of the sum of squares by an offset that begins at each pose, (N,)."""
    count = residual.size
    left = (np.eye(count) - hat) * np.outer(weight, weight)
    both = np.cumsum(np.cumsum(left[::-1, ::-1], axis=0), axis=1)[::-1, ::-1]
    square = np.diag(both)
    score = np.cumsum((weight * residual)[::-1])[::-1]
    enough = square > 1e-3 * (weight**2).max(initial=1e-30)
    enough[: _ENDS + 1] = enough[count - _ENDS :] = False
    return np.asarray(np.where(enough, score**2 / np.where(enough, square, 1.0), 0.0))


def parameter_faults(found: Fit) -> list[Fault]:
    """Return parameters whose change exceeds the tolerance of tape, drum or cable."""
    geometry, known = found.geometry, found.geometry.knowledge
    faults = []
    if "drum" in geometry.identified:
        place = geometry.rows.index(DRUM)
        std = found.std[: geometry.n * len(geometry.rows)][place :: len(geometry.rows)]
        for i, error in enumerate(geometry.cable[:, DRUM]):
            if abs(error) > _FAR * known.drum:
                text = (
                    f"{geometry.cable_name(i)}: a turn of its motor pays out {100 * error:+.2f} % "
                    f"(± {300 * std[i]:.2f} %, 3 sigma) relative to the file: check drum_radius_m "
                    "and gear_ratio of its winch"
                )
                faults.append(Fault("drum", i, -1, float(error), text))
    if geometry.shared and abs(geometry.elongation) > _FAR * known.elongation:
        text = (
            f"the elongation of the cables differs by {100 * geometry.elongation:+.0f} % "
            "from the file: check "
            "elongation_percent_per_N of the cable"
        )
        faults.append(Fault("elongation", -1, -1, geometry.elongation, text))
    return faults


# Faults of images and markers, and which readings are right if camera and cables disagree.

UNDECIDED = "undecided: "
"""Start of the text about a contradiction that the readings cannot resolve."""
_OFF = 3.0
"""Deviation of sizes, drums or lens, in standard deviations, above which the cause is searched
for."""
_LOOSE_SIZE, _LOOSE_DRUM, _LOOSE_FOCAL = 0.1, 0.05, 0.05
_LOOSE_LENS = (20.0, 20.0, 0.1, 0.1, 0.005, 0.005, 0.1)
"""Standard deviations of lens parameters that are set free: fx, fy, cx, cy in px, then k1, k2, p1,
p2, k3."""
_COUNTS: Final[dict[FaultKind, int]] = {"size": 1, "drum": 0, "lens": 9}
"""Causes, and the number of parameters that each sets free; 0 means one per cable."""
_CHANCE, _CHANCE_BESIDE_LENS = 1e-3, 1e-5
"""Probability of rejecting a correct hand-eye transform. It is lower if the lens is also wrong,
because the lens then explains most of the camera's displacement."""
_AT_ONCE = 3
"""Smallest number of jumps at the same pose that a moved camera may explain."""
_SURE = 9.0
"""Reduction of the sum of squares by which one explanation must be better than others."""


def map_faults(found: MapFit, sightings: Sequence[Sighting]) -> list[Fault]:
    """Return the faults of images and single markers, found by the images alone."""
    faults = [
        Fault("image", -1, j, 0.0, f"image of {one.name}: {one.problem}; it is not used")
        for j, one in enumerate(sightings)
        if one.problem is not None
    ]
    texts = [*misfits(found.bundle), *warnings(sightings, found.dropped)]
    return faults + [Fault("marker", -1, -1, 0.0, text) for text in texts]


def hand_eye_fault(
    found: Fit, given: CameraKnowledge, others: Sequence[Fault] = ()
) -> Fault | None:
    """Return a fault if the camera's pose contradicts the hand-eye file, else None.

    `found` is a fit without that file, `others` are other faults of given values. The difference d
    from the given pose has the covariance P + C, the sum of the covariances of the given pose and
    of the fit. The given pose is wrong if the largest coordinate of d, or d^T (P + C)^-1 d, is
    improbably large.
    """
    camera = found.fitted_camera
    first = found.geometry.size + found.jumps_m.size
    covariance = found.uncertainty[first : first + SIZE, first : first + SIZE]
    covariance = covariance + np.diag(given.hand_eye_std**2)
    moved = camera.with_hand_eye(given.position_m, given.rotation, given.hand_eye_std)
    off = moved.off_known()[:SIZE]
    times = float((np.abs(off) / np.sqrt(np.diag(covariance))).max())
    square = float(off @ np.linalg.solve(covariance, off))
    chance = _CHANCE_BESIDE_LENS if any(one.kind == "lens" for one in others) else _CHANCE
    if times**2 < chi2.isf(chance, 1) and square < chi2.isf(chance, SIZE):
        return None
    off_mm, off_deg = 1e3 * np.linalg.norm(off[:3]), np.degrees(np.linalg.norm(off[3:]))
    most = 3.0 * np.sqrt(np.diag(covariance))
    return Fault(
        "hand_eye", -1, -1, float(np.linalg.norm(off[:3])),
        f"the camera sits {off_mm:.1f} mm and {off_deg:.2f} deg from its given place on "
        f"the platform (hand_eye; {1e3 * most[:3].max():.1f} mm and "
        f"{np.degrees(most[3:].max()):.2f} deg are expected at most, 3 sigma): that place is not "
        "used; measure it again, or leave it out",
    )  # fmt: skip


def place_faults(start: CameraStart) -> list[Fault]:
    """Return the faults of the known marker poses."""
    before = UNDECIDED if start.contradictory_places else ""
    return [Fault("place", -1, -1, 0.0, before + text) for text in start.place_faults]


def moved_or_slipped(faults: Sequence[Fault]) -> list[Fault]:
    """Return a fault for each pose at which offsets of several cables begin.

    Several cables seldom slip together. A camera that has moved on its platform has the same
    effect: its later poses contradict the lengths, and offsets of some cables explain most of that.
    """
    at = Counter(fault.pose for fault in faults if fault.kind == "jump")
    return [
        Fault(
            "camera", -1, pose, 0.0,
            f"{UNDECIDED}{cables} cables are off from pose {pose + 1} on: either they slipped "
            "together, or the camera moved on its platform; check both, and measure again",
        )
        for pose, cables in at.items()
        if cables >= _AT_ONCE
    ]  # fmt: skip


def free_wrong_values(
    geometry: CableGeometry, found: Fit, first: MapFit
) -> tuple[Fit, list[Fault]]:
    """Return the fit with wrong given values of sheets, drums or lens set free, and their faults.

    If one of these values is wrong, cables and camera contradict each other. Each is set free in
    turn while the others keep their given values, then each pair. The best fit is the explanation.
    It also takes into account exit points measured by tape, known marker poses and measured points.
    If two explanations fit equally well, the cause remains unknown and the fit is unchanged.
    """
    if not _contradiction(geometry, found, first):
        return found, []
    tried = [_tried(geometry, found, (kind,)) for kind in _COUNTS]
    alone = {one.kinds[0]: one.score for one in tried}
    for pair in combinations(_COUNTS, 2):
        both = _tried(geometry, found, pair)
        # otherwise one value of the pair alone explains it equally well
        if both.score <= min(alone[kind] for kind in pair) - _SURE:
            tried.append(both)
    tried.sort(key=lambda one: one.score)
    best = tried[0]
    if found.total_cost < best.score + _SURE:
        return found, []
    alike = [one for one in tried if one.score < best.score + _SURE]
    if len(alike) == 1:
        return _believed(geometry, best)
    causes = [" and ".join(_cause(kind, one.fit)[1] for kind in one.kinds) for one in alike]
    text = "cables and camera contradict each other: " + ", or ".join(causes)
    advice = "; to find out which, measure a black square, and one distance between two poses"
    kind = best.kinds[0]
    return found, [Fault(kind, -1, -1, _cause(kind, best.fit)[0], UNDECIDED + text + advice)]


@dataclass(frozen=True)
class _Cause:
    """Explanation by wrong given values: their `count`, and the fit with these values free."""

    kinds: tuple[FaultKind, ...]
    count: int
    fit: Fit

    @property
    def score(self) -> float:
        """The sum of squares plus 2 for each free parameter (Akaike)."""
        return self.fit.total_cost + 2 * self.count


def _tried(geometry: CableGeometry, found: Fit, kinds: tuple[FaultKind, ...]) -> _Cause:
    """Return an explanation: the fit with these values set free."""
    camera = found.fitted_camera
    seen = replace(found.seen, start=found.poses)
    known: dict[str, Any] = {}
    if "size" in kinds:
        known["size_std"] = _LOOSE_SIZE
    if "lens" in kinds:
        known["lens_std"] = np.array([*_LOOSE_FOCAL * camera.lens[:2], *_LOOSE_LENS])
    if "drum" in kinds:
        geometry = replace(geometry, knowledge=replace(geometry.knowledge, drum=_LOOSE_DRUM))
    count = sum(_COUNTS[kind] or geometry.n for kind in kinds)
    return _Cause(
        kinds, count, fit(geometry, seen, start=found.geometry, camera=_with(camera, **known))
    )


def _believed(geometry: CableGeometry, best: _Cause) -> tuple[Fit, list[Fault]]:
    """Return the fit of the only explanation, and the faults of the wrong values."""
    why = "; this agrees best with exit points and measurements, so it is used"
    found, faults = best.fit, []
    for kind in best.kinds:
        if kind == "drum" and not _all_drums(geometry, found):
            known = replace(found.geometry, knowledge=geometry.knowledge)
            faults += parameter_faults(replace(found, geometry=known))
        else:
            size, text = _cause(kind, found)
            faults.append(Fault(kind, -1, -1, size, text + why))
    return found, faults


def _contradiction(geometry: CableGeometry, found: Fit, first: MapFit) -> bool:
    """Return whether a given value of sheets, drums or lens is far from the fitted one."""
    camera = found.fitted_camera
    free, known = camera.free_lens, camera.knowledge
    off = [abs(camera.size_change) / known.size_std, float(not len(free) and first.lens.wrong) * 9]
    off += (np.abs(camera.lens - known.lens)[free] / known.lens_std[free]).tolist()
    if "drum" in geometry.identified:
        mean = abs(float(found.geometry.cable[:, DRUM].mean()))
        off.append(mean / geometry.knowledge.drum * float(np.sqrt(geometry.n)))
    return max(off) > _OFF


def _all_drums(geometry: CableGeometry, found: Fit) -> bool:
    """Return whether the errors of all drums are similar, not only those of a few."""
    drums = found.geometry.cable[:, DRUM]
    return bool(abs(np.median(drums)) > 0.5 * np.abs(drums).max() > geometry.knowledge.drum)


def _cause(kind: FaultKind, found: Fit) -> tuple[float, str]:
    """Return the relative size of a cause, and the cause as text."""
    camera = found.fitted_camera
    if kind == "size":
        size = camera.size_change
        how = "larger" if size > 0.0 else "smaller"
        return size, f"all sheets are {100.0 * abs(size):.2f} % {how} than stated"
    if kind == "drum":
        alike = float(np.median(found.geometry.cable[:, DRUM]))
        return alike, f"all drums pay out {100.0 * alike:+.2f} % relative to the robot's file"
    focal = float((camera.lens[:2] / camera.knowledge.lens[:2]).mean()) - 1.0
    return focal, (
        f"the intrinsics do not fit the camera as it is now (focal length {100.0 * focal:+.2f} %): "
        "was the lens turned or the resolution changed? `cdpr camera calibrate`"
    )


def _with(camera: CameraModel, **known: Any) -> CameraModel:
    return replace(camera, knowledge=replace(camera.knowledge, **known))
