"""Find markers and boards in images: corners, intrinsics, and faults of an image."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.camera import DICTIONARIES, CameraIntrinsics
from cdpr_profiles.reader import closest
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.errors import ControlError, InvalidRequestError

# Corners of markers to a few hundredths of a pixel, as intersections of curves fitted to the four
# edges. A detector uses only the few pixels around a corner, and is off by tenths of a pixel. An
# edge has a hundred pixels. Along it, the points are found at which the grey level is half-way
# between ink and paper. A parabola is fitted to them, because a lens bends edges, and
# neighbouring parabolas are intersected.

_POINTS = 48
"""Number of profiles along each edge."""
_STEPS = 25
"""Number of points across it."""
_ENDS = 0.07
"""Share of an edge, at each end, that is disturbed by the neighbouring edge."""
_REACH = 0.42, 1.8, 7.0
"""Length of a profile across an edge: share of a square of the marker, least and most px."""
_LEAST_CONTRAST = 15.0
"""Smallest difference of grey levels between ink and paper."""
_MOST_OFF_px = 0.8
_LEAST_POINTS = 12
_PASSES, _FITS = 2, 4


@dataclass(frozen=True)
class EdgeFit:
    """Corners of k markers and how well their edges fit."""

    corners_px: FloatArray
    """(k, 4, 2)."""
    good: BoolArray
    """Whether all four edges were visible, (k,)."""
    width_px: FloatArray
    """Width of the widest edge of each marker, (k,): the step from ink to paper over its steepest
    slope."""


def fit_corners(pixels: NDArray[np.uint8], corners: FloatArray, squares: int) -> EdgeFit:
    """Refine the `corners` (k, 4, 2) of markers that are `squares` wide, including the border."""
    good: BoolArray = np.ones(len(corners), np.bool_)
    width = np.zeros(len(corners))
    for _ in range(_PASSES):
        if not len(corners):
            break
        start, end = corners, np.roll(corners, -1, axis=1)
        along = end - start
        length = np.maximum(np.linalg.norm(along, axis=2), 1e-6)
        along = along / length[..., None]
        across = np.stack(
            [along[..., 1], -along[..., 0]], axis=2
        )  # outward, because the corners go clockwise
        share, least, most = _REACH
        reach = np.clip(share * length.min(axis=1) / squares, least, most)
        s = np.linspace(_ENDS, 1.0 - _ENDS, _POINTS)
        d = np.linspace(-1.0, 1.0, _STEPS)
        at = start[:, :, None] + (length[..., None] * s)[..., None] * along[:, :, None]
        offset = reach[:, None] * d
        grid = at[:, :, :, None] + offset[:, None, None, :, None] * across[:, :, None, None]
        profile = _sampled(pixels, grid)
        where, valid, slope = _crossings(profile, offset)
        shape, fits = _parabolas(s - 0.5, where, valid)
        good = np.asarray(fits.all(axis=1))
        width = slope.max(axis=1)
        met = _intersections(start, along, across, length, shape)
        corners = np.where(good[:, None, None], met, corners)
    return EdgeFit(corners, good, width)


def _sampled(pixels: NDArray[np.uint8], grid: FloatArray) -> FloatArray:
    """Return interpolated grey levels at positions (..., 2) in the image."""
    flat = grid.astype(np.float32).reshape(-1, _POINTS * _STEPS, 2)
    # in several parts: OpenCV takes no more than 32767 columns or rows
    levels = [
        cv2.remap(pixels.astype(np.float32), part[..., 0], part[..., 1], cv2.INTER_LINEAR,
                  borderMode=cv2.BORDER_REPLICATE)
        for part in np.array_split(flat, 1 + len(flat) // 30000)
    ]  # fmt: skip
    return np.concatenate(levels).astype(float).reshape(grid.shape[:-1])


def _crossings(profile: FloatArray, offset: FloatArray) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Return where profiles (k, 4, points, steps) cross half-way, whether they do, and widths."""
    quarter = _STEPS // 4
    ink = profile[..., :quarter].mean(axis=-1)
    paper = profile[..., -quarter:].mean(axis=-1)
    half = 0.5 * (ink + paper)
    above = profile >= half[..., None]
    first = np.argmax(above, axis=-1).clip(1, _STEPS - 1)
    before = np.take_along_axis(profile, first[..., None] - 1, -1)[..., 0]
    after = np.take_along_axis(profile, first[..., None], -1)[..., 0]
    rise = np.where(after > before, after - before, 1.0)
    step = (offset[:, -1] - offset[:, 0]) / (_STEPS - 1)
    low = np.take_along_axis(
        np.broadcast_to(offset[:, None, None], profile.shape), first[..., None] - 1, -1
    )[..., 0]
    where = low + step[:, None, None] * (half - before) / rise
    contrast = paper - ink
    valid = (contrast > _LEAST_CONTRAST) & (after > before) & ~above[..., 0] & above[..., -1]
    steepest = np.abs(np.diff(profile, axis=-1)).max(axis=-1) / step[:, None, None]
    each = np.where(valid, contrast / np.maximum(steepest, 1e-6), np.nan)
    filled = np.where(valid.any(axis=2, keepdims=True), each, np.inf)
    return where, valid, np.nanmedian(filled, axis=2)


def _parabolas(s: FloatArray, where: FloatArray, valid: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Return a + b s + c s² through the crossings of each edge, (k, 4, 3), and whether it fits."""
    basis = np.stack([np.ones_like(s), s, s * s], axis=1)
    weight = valid.astype(float)
    shape = np.zeros((*where.shape[:2], 3))
    for _ in range(_FITS):
        normal = np.einsum("kep,pi,pj->keij", weight, basis, basis) + 1e-9 * np.eye(3)
        right = np.einsum("kep,pi,kep->kei", weight, basis, np.where(valid, where, 0.0))
        shape = np.linalg.solve(normal, right[..., None])[..., 0]
        off = where - shape @ basis.T
        masked = np.where(valid, np.abs(off), np.nan)
        empty = ~valid.any(axis=2)
        masked[empty] = 0.0
        spread = np.maximum(1.5 * np.nanmedian(masked, axis=2), 0.03)
        weight = valid / (1.0 + (np.nan_to_num(off) / (2.0 * spread[..., None])) ** 2)
    enough = (weight > 0.5).sum(axis=2) >= _LEAST_POINTS
    return shape, enough & (spread < _MOST_OFF_px)


def _intersections(
    start: FloatArray, along: FloatArray, across: FloatArray, length: FloatArray, shape: FloatArray
) -> FloatArray:
    """Return where each edge (k, 4) meets the one before it, (k, 4, 2), by Newton's method."""
    last = [np.roll(part, 1, axis=1) for part in (start, along, across, length, shape)]
    edges = [(start, along, across, length, shape), tuple(last)]
    place = start.copy()
    for _ in range(4):
        off, slopes = [], []
        for from_, way, out, size, (curve) in edges:
            away = place - from_
            s = (away * way).sum(axis=2) / size - 0.5
            d = (away * out).sum(axis=2)
            a, b, c = curve[..., 0], curve[..., 1], curve[..., 2]
            off.append(d - (a + b * s + c * s * s))
            slopes.append(out - ((b + 2.0 * c * s) / size)[..., None] * way)
        J = np.stack(slopes, axis=2)
        J = J + 1e-9 * np.eye(2)
        place = place - np.linalg.solve(J, np.stack(off, axis=2)[..., None])[..., 0]
    return place


# OpenCV's marker dictionaries by name, and detection of the one that an image shows.

_LEAST_READ = 4
"""Smallest number of ids that proves a dictionary; one or two ids of a large one may be read by
chance."""


def opencv_dictionary(name: str) -> Any:
    """Return OpenCV's dictionary of this name, without DICT_; raises InvalidRequestError."""
    number = getattr(cv2.aruco, f"DICT_{name}", None)
    if number is None:
        near = closest(name.upper().removeprefix("DICT_"), DICTIONARIES)
        hint = f"did you mean {near!r}?" if near else f"allowed: {', '.join(DICTIONARIES)}"
        raise InvalidRequestError(f"dictionary {name!r}; {hint}")
    return cv2.aruco.getPredefinedDictionary(number)


def dictionary_shown(pixels: NDArray[np.uint8]) -> str | None:
    """Return the dictionary with most ids in an image (height, width), the smallest if several tie.

    Returns None if the image shows fewer than four ids of each dictionary.
    """
    read = {name: _count(name, pixels) for name in DICTIONARIES}
    best = max(read, key=lambda name: read[name])  # smaller dictionaries of a kind come first
    return best if read[best] >= _LEAST_READ else None


def _count(name: str, pixels: NDArray[np.uint8]) -> int:
    _, ids, _ = cv2.aruco.ArucoDetector(opencv_dictionary(name)).detectMarkers(pixels)
    return 0 if ids is None else len(np.unique(ids))


_DARK, _FLAT = 30.0, 12.0
"""Brightest grey level and contrast of an image below which nothing is visible."""
_BRIGHT, _BURNT_SHARE = 250, 0.6
_SOFT_SHARE = 0.12
"""Share of its contrast by which the steepest edges of an image must rise between pixels."""
_BLURRED_px = 6.0


class MarkerDetector:
    """Finds the markers of one dictionary with OpenCV, and their corners with `fit_corners`."""

    def __init__(self, dictionary: str) -> None:
        """Raise InvalidRequestError for a dictionary that OpenCV does not have."""
        self._dictionary: Any = opencv_dictionary(dictionary)
        self._squares = self._dictionary.markerSize + 2
        self._detector: Any = cv2.aruco.ArucoDetector(
            self._dictionary, cv2.aruco.DetectorParameters()
        )

    def detect(self, pixels: NDArray[np.uint8], name: str, *, mirrors: bool = False) -> Sighting:
        """Return the markers in an image (height, width); `mirrors` adds mirror images."""
        if problem := _exposure_problem(pixels):
            return Sighting(name, {}, problem=problem)
        ids, corners = self._find(pixels)
        counts = Counter(ids)
        repeated = tuple(sorted(marker for marker, count in counts.items() if count > 1))
        fit = fit_corners(pixels, corners, self._squares)
        sharp: dict[int, FloatArray] = {}
        unsharp = []
        for k, marker in enumerate(ids):
            if marker in repeated:
                continue
            if fit.good[k]:
                sharp[marker] = fit.corners_px[k]
            else:
                unsharp.append(marker)
        width = float(np.median(fit.width_px)) if len(ids) else float("nan")
        return Sighting(
            name,
            sharp,
            repeated,
            tuple(unsharp),
            self._mirrored(pixels, corners) if mirrors else (),
            _sharpness_problem(pixels, len(ids), width),
        )

    def _find(self, pixels: NDArray[np.uint8]) -> tuple[list[int], FloatArray]:
        corners, ids, _ = self._detector.detectMarkers(pixels)
        found = np.array(corners, float).reshape(-1, 4, 2)
        return ([] if ids is None else [int(marker) for marker in ids.ravel()]), found

    def _mirrored(self, pixels: NDArray[np.uint8], read: FloatArray) -> tuple[int, ...]:
        """Return ids found in the mirror image where the image itself has no marker (m, 4, 2).

        A sheet that can be read in both images is not mirrored.
        """
        flipped = np.ascontiguousarray(pixels[:, ::-1])
        ids, corners = self._find(flipped)
        if not ids:
            return ()
        middles = corners.mean(axis=1)
        middles[:, 0] = pixels.shape[1] - 1 - middles[:, 0]
        away = np.linalg.norm(middles[:, None] - read.mean(axis=1), axis=2)
        width = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
        own = away.min(axis=1, initial=np.inf) > 0.5 * width
        good = fit_corners(flipped, corners, self._squares).good & own
        return tuple(sorted({i for i, right in zip(ids, good, strict=True) if right}))


def _exposure_problem(pixels: NDArray[np.uint8]) -> str | None:
    low, high = np.percentile(pixels, (1.0, 99.5))
    if high < _DARK:
        return f"black: almost no pixel is brighter than {high:.0f} of 255"
    if high - low < _FLAT:
        return f"without contrast: grey levels from {low:.0f} to {high:.0f} of 255"
    return None


def _sharpness_problem(pixels: NDArray[np.uint8], found: int, width_px: float) -> str | None:
    if found:
        if width_px > _BLURRED_px:
            return f"blurred: edges are {width_px:.0f} px wide; allowed: {_BLURRED_px:.0f}"
        return None
    if (pixels >= _BRIGHT).mean() > _BURNT_SHARE:
        return "overexposed: most of the image is white"
    smooth = cv2.GaussianBlur(
        pixels.astype(np.float32), (0, 0), 1.0
    )  # so that noise does not count as an edge
    slope = np.hypot(np.diff(smooth, axis=0)[:, :-1], np.diff(smooth, axis=1)[:-1])
    low, high = np.percentile(pixels, (1.0, 99.5))
    if np.percentile(slope, 99.8) < _SOFT_SHARE * (high - low):
        return "blurred: the image has no sharp edge"
    return None


# Intrinsics of a camera from images of a ChArUco board, and the views that are still missing.

_LEAST_CORNERS, _LEAST_VIEWS, _ENOUGH_VIEWS = 8, 5, 15
_LOOKED_AT = 3
"""Number of images examined for the reason why no board was found."""
_CELLS = 4
_ENOUGH_CELLS = 0.8
_TILT_deg, _TILTED_VIEWS = 25.0, 5
_DISTANCE_RATIO = 1.5
_BAD_VIEW = 3.0
"""A view is left out if its root mean square exceeds _GOOD_rms_px and this multiple of the median
of all views."""
_GOOD_FOCAL_SIGMA = 1e-3
_GOOD_rms_px = 0.5


class CalibrationError(ControlError):
    """The images do not determine the intrinsics; the message says what is missing."""


@dataclass(frozen=True)
class Board:
    """A ChArUco board, with numbers of squares along its width and height."""

    columns: int = 9
    rows: int = 6
    square_m: float = 0.028
    marker_m: float = 0.02
    dictionary: str = "5X5_100"

    def made(self) -> Any:
        """Return the board as an OpenCV object; raises InvalidRequestError."""
        dictionary = opencv_dictionary(self.dictionary)
        if not 0.0 < self.marker_m < self.square_m:
            raise InvalidRequestError(
                f"board with markers of {1e3 * self.marker_m:g} mm in squares of "
                f"{1e3 * self.square_m:g} mm; allowed: smaller markers"
            )
        try:
            return cv2.aruco.CharucoBoard(
                (self.columns, self.rows), self.square_m, self.marker_m, dictionary
            )
        except cv2.error:
            raise InvalidRequestError(
                f"board of {self.columns} x {self.rows} squares: the board is too small, or "
                f"{self.dictionary} has too few markers"
            ) from None


@dataclass(frozen=True)
class IntrinsicsFit:
    """Intrinsics, their quality, and the views that further images should show."""

    intrinsics: CameraIntrinsics
    used: tuple[str, ...]
    """Names of the images."""
    left_out: tuple[str, ...]
    """Images that were left out, with reasons."""
    missing: tuple[str, ...]
    """Missing views, as text; empty if the intrinsics are good."""
    corners_px: tuple[FloatArray, ...]
    """Detected corners of each used image, (k, 2)."""
    residuals_px: tuple[FloatArray, ...]
    """Detected minus computed corners, (k, 2)."""


def fit_intrinsics(images: Sequence[tuple[str, NDArray[np.uint8]]], board: Board) -> IntrinsicsFit:
    """Return the intrinsics that images (name, grey levels) of a board determine.

    Raises CalibrationError for too few images, InvalidRequestError for different sizes.
    """
    sizes = {pixels.shape for _, pixels in images}
    if len(sizes) > 1:
        raise InvalidRequestError(f"images differ in size: {sorted(sizes)}; allowed: one camera's")
    views, left_out = _views(images, board)
    if len(views) < _LEAST_VIEWS:
        why = f"; left out: {'; '.join(left_out[:3])}" if left_out else ""
        cause = "" if views else "".join(f"; {text}" for text in _why_none(images, board))
        raise CalibrationError(
            f"{len(views)} images show the board; {_LEAST_VIEWS} are needed, "
            f"{_ENOUGH_VIEWS} recommended{cause}{why}"
        )
    height, width = images[0][1].shape
    found = _solved(views, (width, height))
    rms = found[-1].ravel()
    good = rms <= max(_BAD_VIEW * float(np.median(rms)), _GOOD_rms_px)
    if not good.all() and good.sum() >= _LEAST_VIEWS:
        left_out += [
            f"{name}: fits only to {error:.2f} px, others to {np.median(rms):.2f}"
            for (name, _, _), error, kept in zip(views, rms, good, strict=True)
            if not kept
        ]
        views = [view for view, kept in zip(views, good, strict=True) if kept]
        found = _solved(views, (width, height))
    total, matrix, distortion, turns, shifts, sigmas, _ = found
    intrinsics = CameraIntrinsics(
        width_px=width,
        height_px=height,
        focal_px=(float(matrix[0, 0]), float(matrix[1, 1])),
        centre_px=(float(matrix[0, 2]), float(matrix[1, 2])),
        distortion=tuple(float(k) for k in distortion.ravel()[:5]),
        rms_px=float(total),
        sigmas=tuple(float(one) for one in sigmas.ravel()[:9]),
    )
    missing = _missing(views, turns, shifts, intrinsics)
    seen = tuple(view[2].reshape(-1, 2) for view in views)
    project: Any = cv2.projectPoints
    computed = [
        project(view[1], turn, shift, matrix, distortion)[0].reshape(-1, 2)
        for view, turn, shift in zip(views, turns, shifts, strict=True)
    ]
    return IntrinsicsFit(
        intrinsics,
        tuple(view[0] for view in views),
        tuple(left_out),
        tuple(missing),
        seen,
        tuple(one - other for one, other in zip(seen, computed, strict=True)),
    )


_View = tuple[str, FloatArray, FloatArray]


def _views(
    images: Sequence[tuple[str, NDArray[np.uint8]]], board: Board
) -> tuple[list[_View], list[str]]:
    """Return (name, corners on the board, corners in the image) of images that show the board."""
    made = board.made()
    detector: Any = cv2.aruco.CharucoDetector(made)
    views: list[_View] = []
    left_out = []
    for name, pixels in images:
        corners, ids, _, _ = detector.detectBoard(pixels)
        count = 0 if ids is None else len(ids)
        if count < _LEAST_CORNERS:
            left_out.append(f"{name}: {count} corners of the board; {_LEAST_CORNERS} are needed")
            continue
        on_board, in_image = made.matchImagePoints(corners, ids)
        if (
            np.linalg.matrix_rank(on_board.reshape(-1, 3)[:, :2] - on_board.reshape(-1, 3)[0, :2])
            < 2
        ):
            left_out.append(f"{name}: its corners lie on one line")
            continue
        views.append((name, on_board, in_image))
    return views, left_out


def _why_none(images: Sequence[tuple[str, NDArray[np.uint8]]], board: Board) -> list[str]:
    """Return reasons why no image shows the board, from the first images; often empty."""
    detector = MarkerDetector(board.dictionary)
    sights = [detector.detect(pixels, name, mirrors=True) for name, pixels in images[:_LOOKED_AT]]
    read = max((one.corners_px for one in sights), key=len, default={})
    mirrored = max((one.mirrored for one in sights), key=len, default=())
    if len(mirrored) > len(read):
        return [
            f"{len(mirrored)} markers read as mirror images: is the board or the image mirrored?"
        ]
    if len(read) >= _LEAST_CORNERS // 2:
        return [
            f"{len(read)} markers of {board.dictionary} are read, but no board of {board.columns} "
            f"columns and {board.rows} rows has this arrangement: were columns and rows exchanged?"
        ]
    sets = (dictionary_shown(pixels) for _, pixels in images[:_LOOKED_AT])
    shown = next((name for name in sets if name), None)
    return [f"markers of {shown} are read, none of {board.dictionary}"] if shown else []


def _solved(views: Sequence[_View], size: tuple[int, int]) -> Any:
    """Return OpenCV's calibration result for the views.

    It contains total rms, camera matrix, distortion, rotations, translations, standard deviations,
    and rms of each view.
    """
    solve: Any = cv2.calibrateCameraExtended
    try:
        done = solve([view[1] for view in views], [view[2] for view in views], size, None, None)
    except cv2.error as error:
        raise CalibrationError(f"the images do not determine a camera: {error.err}") from None
    total, matrix, distortion, turns, shifts, sigmas, _, each = done
    return total, matrix, distortion, turns, shifts, sigmas, each


def _missing(
    views: Sequence[_View], turns: Any, shifts: Any, intrinsics: CameraIntrinsics
) -> list[str]:
    """Return the missing views, without which some parameters are poorly determined."""
    missing = []
    if len(views) < _ENOUGH_VIEWS:
        missing.append(f"{len(views)} images; take {_ENOUGH_VIEWS} or more")
    size = np.array([intrinsics.width_px, intrinsics.height_px])
    points = np.concatenate([view[2].reshape(-1, 2) for view in views])
    cells = np.clip((points / size * _CELLS).astype(int), 0, _CELLS - 1)
    filled = np.zeros((_CELLS, _CELLS), bool)
    filled[cells[:, 1], cells[:, 0]] = True
    for name, row, column in (
        *(("upper left", 0, 0), ("upper right", 0, -1)),
        *(("lower left", -1, 0), ("lower right", -1, -1)),
    ):
        if not filled[row, column]:
            missing.append(
                f"no image has the board in its {name} corner: the distortion there is not known"
            )
    if filled.mean() < _ENOUGH_CELLS and not any("corner" in line for line in missing):
        missing.append(f"the board covered only {100.0 * filled.mean():.0f} % of the image")
    normals = [cv2.Rodrigues(turn)[0][:, 2] for turn in turns]
    tilt = [math.degrees(math.acos(min(1.0, abs(normal[2])))) for normal in normals]
    if sum(angle > _TILT_deg for angle in tilt) < _TILTED_VIEWS:
        missing.append(
            f"almost no image has the board tilted by more than {_TILT_deg:.0f} deg (most: "
            f"{max(tilt):.0f} deg): focal length and distance cannot be separated"
        )
    away = [float(np.linalg.norm(shift)) for shift in shifts]
    if max(away) < _DISTANCE_RATIO * min(away):
        missing.append(
            f"all images from {min(away):.2f} to {max(away):.2f} m: take some from nearer "
            "or farther away"
        )
    rms, sigmas = intrinsics.rms_px or 0.0, intrinsics.sigmas or (0.0,) * 9
    if rms > _GOOD_rms_px:
        missing.append(f"corners fit only to {rms:.2f} px: is the board flat and the image sharp?")
    if sigmas[0] > _GOOD_FOCAL_SIGMA * intrinsics.focal_px[0]:
        share = 300.0 * sigmas[0] / intrinsics.focal_px[0]
        missing.append(f"the focal length is uncertain by {share:.2f} % (3 sigma)")
    return missing
