"""What a map of markers costs and how near the truth it is, beside OpenCV's own corners."""

from __future__ import annotations

import time
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.devices.camera import CameraIntrinsics, MarkerSheets
from cdpr_rt.arrays import rms
from cdpr_rt.calibration.markers.images.detection import MarkerDetector
from cdpr_rt.calibration.markers.map_fit import MapFit, fit_map
from cdpr_rt.calibration.markers.marker_map import MarkerMap, best_fit, difference
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_sim_bus.camera.camera_plant import CameraPlant
from cdpr_sim_bus.camera.random_poses import Box, random_poses
from cdpr_sim_bus.camera.scene import Sheet
from cdpr_sim_bus.camera.sim_camera import SimCamera
from cdpr_tools.bench.timing import verdict
from cdpr_tools.output import Output

TARGET_S = 20.0
_BOX = Box((-0.5, -0.4, 1.4), (0.2, 0.6, 1.75), 15.0)
_SIZE_m = 0.15
_Images = list[NDArray[np.uint8]]


def measure(count: int, seed: int, out: Output) -> dict[str, Any]:
    """Return figures of maps from `count` images of 42 markers, of 1.3 megapixels."""
    plant = CameraPlant(seed=seed)
    camera, lens = SimCamera(plant), plant.lens
    images: _Images = []
    with out.progress(f"rendering {count} images", float(count)) as advance:
        for state in random_poses(_BOX, count, seed):
            images.append(camera.grab(state))
            advance(float(len(images)))
    intrinsics = CameraIntrinsics.model_validate(lens, from_attributes=True)
    sheets = MarkerSheets(size_m=_SIZE_m)
    results: dict[str, Any] = {"images": count, "seed": seed}
    reference: int | None = None  # the same for both, as errors are told in its frame
    for name, detect in (("ours", _ours), ("opencv", _opencv)):
        out.note(f"map from the corners of {name}")
        start = time.process_time()
        sightings = detect(images)
        seen = time.process_time()
        fit = fit_map(sightings, intrinsics, sheets, reference)
        done = time.process_time()
        reference = fit.map.reference
        sigma_m = fit.bundle.shape_sigma_m
        results[name] = {
            "detection_s": round(seen - start, 2),
            "fit_s": round(done - seen, 2),
            "corner_sigma_px": round(fit.bundle.sigma_px, 4),
            "told_mm": round(1e3 * rms(sigma_m[np.isfinite(sigma_m).all(axis=1)]), 3),
            **_errors(fit, camera),
        }
    ours = results["ours"]
    results["reached"] = {"time": ours["detection_s"] + ours["fit_s"] <= TARGET_S}
    return results


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as a table, beside those of OpenCV's corners."""
    ours, theirs = figures["ours"], figures["opencv"]
    lines = [f"{figures['images']} images{'ours':>30}{'OpenCV corners':>20}{'ratio':>9}"]
    for text, key, unit, digits in (
        ("detection, processor time", "detection_s", "s", 2),
        ("map, processor time", "fit_s", "s", 2),
        ("corners fit to", "corner_sigma_px", "px", 3),
        ("largest error along the plane", "xy_max_mm", "mm", 2),
        ("largest error across it", "z_max_mm", "mm", 2),
        ("error where it fits best, rms", "shape_rms_mm", "mm", 2),
        ("what the map says of that", "told_mm", "mm", 2),
    ):
        a, b = ours[key], theirs[key]
        ratio = f"{b / a:9.1f}" if a else ""
        lines.append(f"{text:32}{a:8.{digits}f} {unit:3}{b:13.{digits}f} {unit:3}{ratio}")
    time_verdict = verdict(figures["reached"]["time"])
    return [*lines, f"detection and map wanted within {TARGET_S:g} s: {time_verdict}"]


def _ours(images: _Images) -> list[Sighting]:
    detector = MarkerDetector("4X4_100")
    return [detector.detect(image, f"{k}") for k, image in enumerate(images)]


def _opencv(images: _Images) -> list[Sighting]:
    """Return what OpenCV's detector finds with its own refinement of corners."""
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    detector: Any = cv2.aruco.ArucoDetector(dictionary, settings)
    found = []
    for k, image in enumerate(images):
        corners, ids, _ = detector.detectMarkers(image)
        numbers = [] if ids is None else [int(i) for i in ids.ravel()]
        at = {i: np.reshape(c, (4, 2)).astype(float) for i, c in zip(numbers, corners, strict=True)}
        found.append(Sighting(f"{k}", at))
    return found


def _middle(sheet: Sheet) -> NDArray[np.float64]:
    """Return the middle of a marker's corners, which are off its paper's where it bends."""
    height = 0.5 * sheet.bend_1_m * (_SIZE_m / 2.0) ** 2
    return np.asarray(sheet.position_m + height * sheet.rotation[:, 2])


def _errors(fit: MapFit, camera: SimCamera) -> dict[str, float]:
    """Return how far a map is off, in the frame of its reference and in the one that fits best.

    The truth is that of the plant, as large as the sheets are told to be: what the printer made of
    their scale no image shows.
    """
    sheets = {int(sheet.name): sheet for sheet in camera.sheets}
    map_ = fit.map
    scale = 1.0 + camera.plant.printing.scale_error
    there = [marker for marker, placed in zip(map_.ids, map_.placed, strict=True) if placed]
    truth = MarkerMap(
        tuple(there),
        map_.reference,
        np.full(len(there), _SIZE_m),
        np.array([_middle(sheets[marker]) / scale for marker in there]),
        np.array([sheets[marker].rotation for marker in there]),
        *((), np.zeros((0, 3)), np.zeros((0, 3, 3))),
    )
    off = difference(map_, truth)
    along = np.abs(off.corner_error_m)
    points = map_.position_m[map_.placed]
    turn, shift = best_fit(points, truth.position_m)
    left = points @ turn.T + shift - truth.position_m
    return {
        "markers": len(there),
        "xy_max_mm": round(1e3 * float(along[..., :2].max()), 3),
        "z_max_mm": round(1e3 * float(along[..., 2].max()), 3),
        "shape_rms_mm": round(1e3 * rms(left), 3),
    }
