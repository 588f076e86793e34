"""What a calibration with a camera costs from images to its verdict, and how good it is."""

from __future__ import annotations

import time
from typing import Any, Final

from cdpr_profiles import load_robot
from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.estimation.parameters import CableGeometry, Knowledge
from cdpr_rt.calibration.markers.images.detection import MarkerDetector
from cdpr_rt.calibration.readings.camera_data import Images
from cdpr_sim_bus.camera.camera_plant import CameraPlant
from cdpr_sim_bus.camera.sim_camera import SimCamera
from cdpr_sim_bus.physics_board import PlatformState
from cdpr_tools.calibrate.ablation import accuracy_of, box_targets
from cdpr_tools.calibrate.synthetic_readings import ErrorBudget, SheetLayout, synthetic_readings
from cdpr_tools.output import Output

TARGET_S: Final = 20.0
_ROBOT, _STILL = "spatial-8", (0.0, 0.0, 0.0)
_ERRORS = ErrorBudget(hand_eye_m=0.0, hand_eye_deg=0.0)  # the simulated camera's mount is as told
_LAYOUT = SheetLayout(size_m=0.15)


def measure(count: int, seed: int, out: Output) -> dict[str, Any]:
    """Return figures of a calibration from `count` images of 42 markers, of 1.3 megapixels."""
    robot = load_robot(_ROBOT)
    geometry = CableGeometry.of(robot, knowledge=Knowledge(exit_m=_ERRORS.exit_m))
    targets = box_targets(geometry.model, count, seed)
    made = synthetic_readings(
        robot, targets, geometry.model.poses(targets), _ERRORS, _LAYOUT, seed, of_data=count
    )
    setup = made.data.camera
    assert setup is not None
    camera = SimCamera(CameraPlant(seed=seed))
    images = []
    with out.progress(f"rendering {count} images", float(count)) as advance:
        for j, pose in enumerate(made.poses[:count]):
            place = tuple(pose[0].tolist()), tuple(pose[1:].ravel().tolist())
            images.append(camera.grab(PlatformState(float(j), *place, _STILL, _STILL)))
            advance(float(j + 1))
    setup = setup.model_copy(update={"hand_eye": None})
    out.note("detection")
    begun = time.process_time()
    detector = MarkerDetector("4X4_100")
    sightings = [detector.detect(one, f"pose {j + 1}") for j, one in enumerate(images)]
    detected = time.process_time()
    out.note("fit, faults and verification")
    seen = made.data.observations(robot, geometry.model)
    outcome = calibrate(robot, geometry, seen, "camera", Images(setup, sightings))
    done = time.process_time()
    # the simulated camera lays its own sheets: the made-up ones count for nothing
    found = outcome.found
    position_mm, turn_deg = accuracy_of(found.geometry, made, found.seen.reference_m)
    return {
        "images": count,
        "markers": len(found.camera.ids) if found.camera else 0,
        "corners": 4 * sum(len(one.corners_px) for one in sightings),
        "detection_s": round(detected - begun, 2),
        "fit_s": round(done - detected, 2),
        "position_mm": round(position_mm, 3),
        "turn_deg": round(turn_deg, 4),
        "target_s": TARGET_S,
        "reached": done - begun <= TARGET_S,
    }
