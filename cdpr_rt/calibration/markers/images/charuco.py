"""Intrinsics of a camera from images of a ChArUco board, and what such images still lack."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.devices.camera import CameraIntrinsics
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.images.detection import MarkerDetector
from cdpr_rt.calibration.markers.images.dictionaries import dictionary_shown, opencv_dictionary
from cdpr_rt.errors import ControlError, InvalidRequestError

_LEAST_CORNERS, _LEAST_VIEWS, _ENOUGH_VIEWS = 8, 5, 15
_LOOKED_AT = 3
"""Images, for why there is no board in any."""
_CELLS = 4
_ENOUGH_CELLS = 0.8
_TILT_deg, _TILTED_VIEWS = 25.0, 5
_DISTANCE_RATIO = 1.5
_BAD_VIEW = 3.0
"""Root mean square of a view over the median of all, from which on it is left out
where it is above _GOOD_rms_px as well."""
_GOOD_FOCAL_SIGMA = 1e-3
_GOOD_rms_px = 0.5


class CalibrationError(ControlError):
    """Intrinsics cannot be had from these images; the message says what is missing."""


@dataclass(frozen=True)
class Board:
    """A ChArUco board: squares counted along its width and height."""

    columns: int = 9
    rows: int = 6
    square_m: float = 0.028
    marker_m: float = 0.02
    dictionary: str = "5X5_100"

    def made(self) -> Any:
        """Return OpenCV's; raises InvalidRequestError."""
        dictionary = opencv_dictionary(self.dictionary)
        if not 0.0 < self.marker_m < self.square_m:
            raise InvalidRequestError(
                f"board with markers of {1e3 * self.marker_m:g} mm in squares of "
                f"{1e3 * self.square_m:g} mm; allowed: smaller markers"
            )
        try:
            return cv2.aruco.CharucoBoard(
                (self.columns, self.rows),
                self.square_m,
                self.marker_m,
                dictionary,
            )
        except cv2.error:
            raise InvalidRequestError(
                f"board of {self.columns} x {self.rows} squares: {self.dictionary} has too few "
                "markers for it, or it is too small"
            ) from None


@dataclass(frozen=True)
class IntrinsicsFit:
    """Intrinsics, how good they are, and what further images should show."""

    intrinsics: CameraIntrinsics
    used: tuple[str, ...]
    """Names of the images."""
    left_out: tuple[str, ...]
    """Images that were left out, with reasons."""
    missing: tuple[str, ...]
    """Views that are missing, in words; the intrinsics are good where there are none."""


def fit_intrinsics(images: Sequence[tuple[str, NDArray[np.uint8]]], board: Board) -> IntrinsicsFit:
    """Return the intrinsics that images (name, grey levels) of a board determine.

    Raises CalibrationError where they are too few, InvalidRequestError where they differ in size.
    """
    sizes = {pixels.shape for _, pixels in images}
    if len(sizes) > 1:
        raise InvalidRequestError(f"images differ in size: {sorted(sizes)}; allowed: one camera's")
    views, left_out = _views(images, board)
    if len(views) < _LEAST_VIEWS:
        why = f"; left out: {'; '.join(left_out[:3])}" if left_out else ""
        cause = "" if views else "".join(f"; {text}" for text in _why_none(images, board))
        raise CalibrationError(
            f"{len(views)} images show the board; {_LEAST_VIEWS} are the least, "
            f"{_ENOUGH_VIEWS} enough{cause}{why}"
        )
    height, width = images[0][1].shape
    found = _solved(views, (width, height))
    rms = found[-1].ravel()
    good = rms <= max(_BAD_VIEW * float(np.median(rms)), _GOOD_rms_px)
    if not good.all() and good.sum() >= _LEAST_VIEWS:
        left_out += [
            f"{name}: fits to {error:.2f} px only, others to {np.median(rms):.2f}"
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
    return IntrinsicsFit(intrinsics, tuple(v[0] for v in views), tuple(left_out), tuple(missing))


_View = tuple[str, FloatArray, FloatArray]


def _views(
    images: Sequence[tuple[str, NDArray[np.uint8]]], board: Board
) -> tuple[list[_View], list[str]]:
    """Return (name, corners on the board, corners in the image) of images that show it."""
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
    """Return why no image shows the board, as far as the first images tell; often nothing."""
    detector = MarkerDetector(board.dictionary)
    sights = [detector.detect(pixels, name, mirrors=True) for name, pixels in images[:_LOOKED_AT]]
    read = max((one.corners_px for one in sights), key=len, default={})
    mirrored = max((one.mirrored for one in sights), key=len, default=())
    if len(mirrored) > len(read):
        return [f"{len(mirrored)} markers read as mirror images: is the board, or the image, so?"]
    if len(read) >= _LEAST_CORNERS // 2:
        return [
            f"{len(read)} markers of {board.dictionary} are read, but no board of {board.columns} "
            f"columns and {board.rows} rows has them so: were they exchanged?"
        ]
    shown = {dictionary_shown(pixels) for _, pixels in images[:_LOOKED_AT]}
    return [f"markers of {name} are read, none of {board.dictionary}" for name in shown if name]


def _solved(views: Sequence[_View], size: tuple[int, int]) -> Any:
    """Return total rms, matrix, distortion, turns, shifts, deviations and rms of each view."""
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
    """Return what the images do not show, for lack of which some parameters are weak."""
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
                f"no image has the board in its {name} corner: distortion is a guess there"
            )
    if filled.mean() < _ENOUGH_CELLS and not any("corner" in line for line in missing):
        missing.append(f"the board was seen in {100.0 * filled.mean():.0f} % of the image only")
    normals = [cv2.Rodrigues(turn)[0][:, 2] for turn in turns]
    tilt = [math.degrees(math.acos(min(1.0, abs(normal[2])))) for normal in normals]
    if sum(angle > _TILT_deg for angle in tilt) < _TILTED_VIEWS:
        missing.append(
            f"hardly any image has the board tilted by more than {_TILT_deg:.0f} deg (most: "
            f"{max(tilt):.0f} deg): focal length and distance cannot be told apart"
        )
    away = [float(np.linalg.norm(shift)) for shift in shifts]
    if max(away) < _DISTANCE_RATIO * min(away):
        missing.append(
            f"all images from {min(away):.2f} to {max(away):.2f} m: take some from "
            "nearer or further"
        )
    rms, sigmas = intrinsics.rms_px or 0.0, intrinsics.sigmas or (0.0,) * 9
    if rms > _GOOD_rms_px:
        missing.append(f"corners fit to {rms:.2f} px only: is the board flat and the image sharp?")
    if sigmas[0] > _GOOD_FOCAL_SIGMA * intrinsics.focal_px[0]:
        share = 100.0 * sigmas[0] / intrinsics.focal_px[0]
        missing.append(f"the focal length is known to {share:.2f} % (1 sigma) only")
    return missing
