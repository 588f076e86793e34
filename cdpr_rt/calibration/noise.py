"""Noise of readings, estimated from the data before the search for faults.

If the assumed standard deviations are right, the residuals of a fit, divided by the root of their
redundancy, have these standard deviations. Their robust scale (median) corrects the assumption, and
the fit is repeated. Lengths, positions and rotations have one scale each.

While the platform moves, errors of successive readings are correlated, because errors of the model
are similar at neighbouring positions. With the autocorrelation ρ_k of residuals, 1 + 2 Σ ρ_k
readings count as one. Lengths and measured points may also have different clocks. If the points are
late by τ, the fit uses lengths l(t + τ). τ is found from the residuals r and the rates J of lengths
(Gauss-Newton).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.ndimage import median_filter
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.fit import Fit, fit, locate
from cdpr_rt.calibration.parameters import DRUM, CableGeometry, Knowledge
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.calibration.residuals import length_std_m

MOST_READINGS = 250
"""Number of readings of a moving platform that a fit uses."""
_ROUNDS = 6
_NORMAL_MEDIAN = 0.6745
_LEAST_REDUNDANCY = 0.1
"""Smallest redundancy of a residual that is used for a scale."""
_LEAST_RESIDUALS = 20
"""Smallest number of residuals for a scale."""
_LARGER, _SAME = 1.3, 1.1
"""Scale above which the noise of a platform at rest is larger than assumed; scale below which a
change is negligible."""
_LEAST_RHO, _WINDOW = 0.05, 20
_GAP = 2.5
"""A gap between readings is longer than this multiple of the median interval."""
_GLITCH, _BESIDE, _LEAST_m, _LEAST_rad = 6.0, 9, 0.003, 0.02
"""A point is a glitch if it jumps by more than this many standard deviations, and by more than the
least distance or angle. The second value is the number of neighbours in time to compare with.
"""
_OFFSET_STD_s, _SMALL_s = 0.05, 5e-5
_LOOSE_DRUM, _FAR = 0.1, 3.0
"""Initial standard deviation of drums; multiple of the assumed one above which drums are wrong."""
_AIM_SHARE, _COPY_SHARE = 0.25, 0.1
"""Standard deviation of the platform's rotation about its target, as a share of the largest target;
and the share of this deviation below which targets are copies of measured rotations.
"""

WithoutFaults = Callable[[CableGeometry, Observations], tuple[Fit, int]]
"""Function that returns a fit without faulty readings, and the number of these."""


@dataclass(frozen=True)
class NoiseSeen:
    """Readings as the fit uses them, and their estimated noise."""

    geometry: CableGeometry
    """Geometry, with the standard deviation of lengths estimated from the data."""
    seen: Observations
    """Readings without time offset, with standard deviations of points estimated from the data."""
    assumed_length_m: float
    offset_s: float = 0.0
    """Delay of points relative to the lengths of the same reading."""
    offset_std_s: float = 0.0
    """Standard deviation of the delay; 0 if it was not fitted."""
    glitches: int = 0
    """Number of readings whose measured point or rotation jumps for a moment, and is left out."""

    def lines(self) -> list[str]:
        """Return the noise as lines of text; empty if it is as assumed."""
        known, seen, lines = self.geometry.knowledge, self.seen, []
        if known.length_m > _SAME * self.assumed_length_m or seen.time_s is not None:
            lines.append(
                f"noise of the lengths, estimated from the data: {1e3 * known.length_m:.2f} mm "
                f"(standard deviation; {1e3 * self.assumed_length_m:.2f} mm was assumed)"
            )
        if seen.every > 1 or seen.time_s is not None:
            used = "all readings are" if seen.every == 1 else f"one reading in {seen.every} is"
            lines.append(f"{used} used, {seen.poses} in all")
        if known.alike > 1.0:
            lines.append(
                f"errors of successive readings are similar: {known.alike:.1f} readings count as "
                "one"
            )
        if seen.time_s is None:
            return lines
        measured = np.isfinite(seen.position_std_m)
        if measured.any():
            std_mm = 1e3 * float(np.median(seen.position_std_m[measured]))
            lines.append(f"noise of the measured points: {std_mm:.2f} mm (standard deviation)")
        if self.glitches:
            lines.append(
                f"{self.glitches} measured points or rotations jump for a moment and are left out"
            )
        if self.offset_std_s:
            lines.append(
                f"time offset: measured points are {1e3 * self.offset_s:+.1f} ms (± "
                f"{3e3 * self.offset_std_s:.1f} ms, 3 sigma) later than the lengths with the same "
                "number; it is corrected"
            )
        return lines

    def as_json(self) -> dict[str, object]:
        """Return the noise as JSON."""
        known, moving = self.geometry.knowledge, self.seen.time_s is not None
        return {
            "length_std_mm": 1e3 * known.length_m,
            "length_std_assumed_mm": 1e3 * self.assumed_length_m,
            "readings_alike": known.alike,
            "one_reading_in": self.seen.every,
            "glitches": self.glitches,
            "time_offset_ms": 1e3 * self.offset_s if moving else None,
            "time_offset_std_ms": 1e3 * self.offset_std_s if moving else None,
        }


def noise_seen(
    geometry: CableGeometry, seen: Observations, without_faults: WithoutFaults
) -> NoiseSeen:
    """Return readings with their estimated noise.

    For a platform at rest, only the noise of lengths is estimated. It is only increased, and only
    if faults of single readings do not explain the residuals. If there are very many readings, only
    every second, third, ... one is used.
    """
    every = -(-seen.poses // MOST_READINGS)
    known, moves = geometry.knowledge, seen.time_s is not None
    if moves:
        geometry = replace(geometry, knowledge=_with_aim(geometry, seen))
        seen, glitches = _without_glitches(geometry, seen)
        return replace(_by_data(geometry, seen, every, without_faults), glitches=glitches)
    some = _thinned(seen, every)
    if known.length_known or _scale(fit(geometry, some), _lengths(geometry)) <= _LARGER:
        return NoiseSeen(geometry, some, known.length_m)
    if _scale(without_faults(geometry, some)[0], _lengths(geometry)) <= _LARGER:
        return NoiseSeen(geometry, some, known.length_m)
    return _by_data(geometry, seen, every, without_faults)


def _with_aim(geometry: CableGeometry, seen: Observations) -> Knowledge:
    """Return the knowledge with the standard deviation of rotations about their targets."""
    known, turns = geometry.knowledge, len(geometry.free) > geometry.coordinates
    if geometry.balance_rows or not turns:
        return known
    aim_rad = _AIM_SHARE * geometry.model.angle_rad
    measured = np.isfinite(seen.rotation_std_rad).any(axis=1)
    if measured.sum() >= _LEAST_RESIDUALS:
        turn = seen.rotation[measured] @ np.swapaxes(seen.target_rotation[measured], 1, 2)
        cosine = np.clip(0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0), -1.0, 1.0)
        seen_rad = float(np.median(np.arccos(cosine))) / _NORMAL_MEDIAN
        # targets that are copies of the measured rotations show nothing
        aim_rad = seen_rad if seen_rad > _COPY_SHARE * aim_rad else aim_rad
    return replace(known, aim_rad=aim_rad or math.inf)


def _lengths(geometry: CableGeometry) -> slice:
    return slice(0, geometry.n)


def _scale(found: Fit, rows: slice) -> float:
    """Return the robust scale of residuals in some rows; 1 if there are too few."""
    at, information = found.at, found.covariance / found.inflation
    own = (found.taken[:, rows] * at.by_pose[:, rows]).sum(axis=2)
    own *= np.sqrt(found.weights[:, rows])
    left = found.left[:, rows]
    spare = 1.0 - own - np.einsum("jap,pq,jaq->ja", left, information, left, optimize=True)
    usable = (spare > _LEAST_REDUNDANCY) & (np.abs(at.by_pose[:, rows]).max(axis=2) > 0.0)
    if usable.sum() < _LEAST_RESIDUALS:
        return 1.0
    off = np.abs(at.residual[:, rows][usable]) / np.sqrt(spare[usable])
    return math.sqrt(found.geometry.knowledge.alike) * float(np.median(off)) / _NORMAL_MEDIAN


# Noise that is larger than assumed, and noise while the platform moves.


def _by_data(
    geometry: CableGeometry, whole: Observations, every: int, without_faults: WithoutFaults
) -> NoiseSeen:
    """Return one reading in `every`, with the noise from the residuals and without time offset."""
    seen, first = _thinned(whole, every), geometry.knowledge.length_m
    points = seen.position_std_m, seen.rotation_std_rad
    offset_s = offset_std_s = 0.0
    timed = whole.time_s is not None and int(seen.measured.sum()) >= _LEAST_RESIDUALS
    # wrong drums in the file would look like noise, and this noise would bind the fit to the file
    geometry = _with_drums(geometry, _LOOSE_DRUM)
    for _ in range(_ROUNDS):
        found = fit(geometry, seen)
        geometry, seen, same = _rescaled(found, seen, first, points)
        step_s = 0.0
        if timed:
            step_s, offset_std_s = _time_step(found, whole, every, offset_s)
            offset_s += step_s
            seen = replace(seen, length_m=_lengths_at(whole, offset_s)[::every])
        if same and abs(step_s) < _SMALL_s:
            break
    geometry = _with_drums(geometry, _contradictory_drums(found))
    geometry = replace(geometry, knowledge=replace(geometry.knowledge, alike=_alike(found)))
    for _ in range(_ROUNDS):
        found, faults = without_faults(geometry, seen)
        geometry, seen, same = _rescaled(found, seen, first, points)
        if not faults or same:
            break
    return NoiseSeen(geometry, seen, first, offset_s, offset_std_s)


def _without_glitches(geometry: CableGeometry, seen: Observations) -> tuple[Observations, int]:
    """Return readings without points that jump for a moment, and the number of these.

    Such a point is much farther from the position that lengths give than its neighbours in time.
    Errors of the geometry affect the neighbours too. A frozen or displaced camera is not a glitch.
    """
    there = locate(geometry, seen).poses
    off = np.zeros((seen.poses, 6))
    off[:, :3] = there[:, 0] + there[:, 1:] @ seen.target_m - seen.position_m
    # the rotation from lengths may be uncertain, so measured rotations are compared with each other
    off[:, 3:] = Rotation.from_matrix(seen.rotation).as_rotvec()
    known = np.isfinite(np.column_stack([seen.position_std_m, seen.rotation_std_rad]))
    wrong = np.zeros((seen.poses, 2), bool)
    for kind, columns in enumerate((slice(0, 3), slice(3, 6))):
        usable = known[:, columns].any(axis=1)
        if usable.sum() < _LEAST_RESIDUALS:
            continue
        part = np.where(known[usable, columns], off[usable, columns], 0.0)
        beside = median_filter(part, size=(_BESIDE, 1), mode="nearest")
        away = np.linalg.norm(part - beside, axis=1)
        far = _GLITCH * np.median(away) / _NORMAL_MEDIAN + (_LEAST_rad if kind else _LEAST_m)
        wrong[usable, kind] = away > far
    nowhere = np.where(wrong[:, :1], np.inf, seen.position_std_m)
    unturned = np.where(wrong[:, 1:], np.inf, seen.rotation_std_rad)
    seen = replace(seen, position_std_m=nowhere, rotation_std_rad=unturned)
    return seen, int(wrong.any(axis=1).sum())


def _with_drums(geometry: CableGeometry, std: float | None) -> CableGeometry:
    known = replace(geometry.knowledge, loose_drum=std)
    return replace(geometry, knowledge=known)


def _contradictory_drums(found: Fit) -> float | None:
    """Return the root mean square error of the file's drums if it is far too large, else None."""
    if "drum" not in found.geometry.identified:
        return None
    off = found.geometry.cable[:, DRUM]
    if np.abs(off).max() < _FAR * found.geometry.knowledge.drum:
        return None
    return float(np.sqrt((off**2).mean()))


def _thinned(seen: Observations, every: int) -> Observations:
    """Return one reading in `every`, the first included."""
    return replace(seen.some(np.arange(0, seen.poses, every)), every=every)


def _rescaled(
    found: Fit, seen: Observations, least_m: float, points: tuple[FloatArray, FloatArray]
) -> tuple[CableGeometry, Observations, bool]:
    """Return geometry and readings with the noise from the residuals, and whether it is unchanged.

    `least_m` is the least noise of lengths. `points` are the given standard deviations of positions
    and rotations, which are reduced only if they are guesses.
    """
    geometry, knowledge, at = found.geometry, found.geometry.knowledge, found.at.points
    lengths = 1.0 if knowledge.length_known else _scale(found, _lengths(geometry))
    length_m = max(lengths * knowledge.length_m, least_m)
    positions, turns = _scale(found, at), _scale(found, slice(at.stop, at.stop + 3))
    # before the search for faults every reading is used, so that the file does not bind the fit
    alike = knowledge.alike if knowledge.loose_drum == _LOOSE_DRUM else _alike(found)
    given_m, given_rad = points
    if seen.time_s is None:  # manually measured points are few, and may all be wrong
        positions = turns = 1.0
    position_m, rotation_rad = positions * seen.position_std_m, turns * seen.rotation_std_rad
    if seen.time_s is None or not seen.std_guessed:
        position_m = np.maximum(position_m, given_m)
        rotation_rad = np.maximum(rotation_rad, given_rad)
    changes = [length_m / knowledge.length_m, alike / knowledge.alike]
    changes += [
        float(np.nanmax(now[np.isfinite(now)] / before[np.isfinite(now)], initial=1.0))
        for now, before in (
            (position_m, seen.position_std_m), (rotation_rad, seen.rotation_std_rad),
        )
    ]  # fmt: skip
    file = replace(
        geometry.with_values(np.zeros(geometry.size)),
        knowledge=replace(knowledge, length_m=length_m, alike=alike),
    )
    other = replace(seen, position_std_m=position_m, rotation_std_rad=rotation_rad)
    return file, other, max(abs(math.log(one)) for one in changes) < math.log(_SAME)


def _alike(found: Fit) -> float:
    """Return the number of successive readings that count as one: 1 + 2 Σ ρ_k, for lengths.

    Readings on both sides of a gap are independent.
    """
    seen, n = found.seen, found.geometry.n
    off = found.at.residual[:, :n] * np.sqrt(found.weights[:, :n])
    piece = np.zeros(seen.poses) if seen.time_s is None else _pieces(seen.time_s)
    square, total = float((off**2).mean()), 1.0
    for lag in range(1, max(2, seen.poses // _WINDOW)):
        together = piece[lag:] == piece[:-lag]
        if not together.any() or not square:
            break
        rho = float((off[lag:] * off[:-lag])[together].mean()) / square
        if rho < _LEAST_RHO:
            break
        total += 2.0 * rho
    return total


def _pieces(time_s: FloatArray) -> FloatArray:
    """Return the index of the gapless piece to which each reading belongs, (N,)."""
    between = np.diff(time_s)
    return np.append(0, np.cumsum(between > _GAP * np.median(between)))


def _rates(seen: Observations) -> FloatArray:
    """Return the derivatives of lengths by time, (N, n); 0 for single readings."""
    assert seen.time_s is not None
    rate, piece = np.zeros_like(seen.length_m), _pieces(seen.time_s)
    for one in range(int(piece[-1]) + 1):
        these = piece == one
        if these.sum() > 1:
            rate[these] = np.gradient(seen.length_m[these], seen.time_s[these], axis=0)
    return rate


def _lengths_at(seen: Observations, offset_s: float) -> FloatArray:
    """Return lengths (N, n) that are later by an offset, extrapolated at the ends of a piece."""
    assert seen.time_s is not None
    out, piece = seen.length_m.copy(), _pieces(seen.time_s)
    for one in range(int(piece[-1]) + 1):
        these = piece == one
        if these.sum() > 1:
            lines = make_interp_spline(seen.time_s[these], seen.length_m[these], k=1)
            out[these] = lines(seen.time_s[these] + offset_s)
    return out


def _time_step(found: Fit, whole: Observations, every: int, offset_s: float) -> tuple[float, float]:
    """Return the change of the time offset that minimises the residuals, and its deviation."""
    now = replace(whole, length_m=_lengths_at(whole, offset_s))
    rows, seen = _lengths(found.geometry), found.seen
    root = np.sqrt(found.weights[:, rows])
    by_time = root * _rates(now)[::every] * seen.used / length_std_m(found.geometry, seen)
    by_pose = found.at.by_pose[:, rows] * root[..., None]
    taken = np.einsum("jad,jbd,jb->ja", found.taken[:, rows], by_pose, by_time, optimize=True)
    by_parameter = np.einsum("jap,ja->p", found.left[:, rows], by_time)
    covariance = found.covariance / found.inflation
    information = float((by_time * (by_time - taken)).sum())
    information -= float(by_parameter @ covariance @ by_parameter)
    information = max(information, 0.0) + _OFFSET_STD_s**-2
    gradient = float((by_time * root * found.at.residual[:, rows]).sum())
    gradient += offset_s / _OFFSET_STD_s**2
    return -gradient / information, math.sqrt(found.inflation / information)
