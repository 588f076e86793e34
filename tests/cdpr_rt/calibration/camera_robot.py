"""A synthetic robot with a camera, small enough for a test."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_profiles import Robot, load_robot
from cdpr_rt.calibration.camera_start import CameraStart, camera_start
from cdpr_rt.calibration.parameters import USUAL, CableGeometry, Knowledge
from cdpr_rt.calibration.readings import Images, Observations
from tests.cdpr_rt.calibration.synthetic_readings import (
    ErrorBudget,
    SheetLayout,
    SyntheticReadings,
    synthetic_readings,
)

KNOWN = Knowledge(exit_m=0.03, length_m=1.5e-4, tension_N=1.0, drum=0.002)
FEW = SheetLayout(rows=3, columns=4, size_m=0.15)


@dataclass(frozen=True)
class CameraRobot:
    """The truth, and the readings and settings of a calibration."""

    robot: Robot
    geometry: CableGeometry
    made: SyntheticReadings
    seen: Observations
    images: Images

    def start(self) -> CameraStart:
        return camera_start(self.geometry, self.seen, self.images.setup, self.images.sightings)


def camera_robot(
    poses: int = 20,
    seed: int = 3,
    errors: ErrorBudget | None = None,
    layout: SheetLayout = FEW,
    *,
    hand_eye_known: bool = True,
    knowledge: Knowledge = KNOWN,
    identified: tuple[str, ...] = USUAL,
) -> CameraRobot:
    """Return readings of spatial-8 at random poses in its box; the first is home."""
    print(f"camera robot of seed {seed}")
    robot = load_robot("spatial-8")
    geometry = CableGeometry.of(robot, identified, knowledge)
    model, platform = geometry.model, geometry.model.platform
    rng = np.random.default_rng(seed)
    targets = np.zeros((poses, 6))
    targets[:, :3] = rng.uniform(platform.workspace_min_m, platform.workspace_max_m, (poses, 3))
    targets[:, 3:] = rng.uniform(-1.0, 1.0, (poses, 3)) * model.angle_rad / np.sqrt(3.0)
    targets[0] = model.home
    made = synthetic_readings(
        robot, targets, model.poses(targets), errors or ErrorBudget(), layout, seed,
        hand_eye_known=hand_eye_known,
    )  # fmt: skip
    assert made.data.camera is not None
    images = Images(made.data.camera, made.data.sightings())
    return CameraRobot(robot, geometry, made, made.data.observations(robot, model), images)
