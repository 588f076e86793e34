"""A simulated camera: its lens model, images of a scene, and random poses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_sim_bus.camera.render_kernel import draw_sheet
from cdpr_sim_bus.camera.scene import Sheet, build_scene
from cdpr_sim_bus.physics_board import PlatformState
from cdpr_sim_bus.robot.camera_plant import CameraFaultPlant, CameraPlant, LensPlant
from cdpr_sim_bus.robot.platform import rotation_of

FloatArray = NDArray[np.float64]
_ITERATIONS = 25


def distorted(x: FloatArray, y: FloatArray, lens: LensPlant) -> tuple[FloatArray, FloatArray]:
    """Return the distorted direction of X/Z, Y/Z after Brown and Conrady."""
    k1, k2, p1, p2, k3 = lens.distortion
    s = x * x + y * y
    radial = 1.0 + s * (k1 + s * (k2 + s * k3))
    return (
        x * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
        y * radial + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y,
    )


def seen_at(points: FloatArray, lens: LensPlant) -> FloatArray:
    """Return the pixels (n, 2) at which points (n, 3) of the camera's frame appear.

    Returns nan for a point behind the camera, or outside the range of such a lens.
    """
    z = np.where(points[:, 2] > 1e-3, points[:, 2], np.nan)
    x, y = points[:, 0] / z, points[:, 1] / z
    reach = 1.5 * np.hypot(lens.width_px / lens.focal_px[0], lens.height_px / lens.focal_px[1])
    x = np.where(np.hypot(x, y) < reach, x, np.nan)
    u, v = distorted(x, y, lens)
    return np.column_stack(
        [lens.focal_px[0] * u + lens.centre_px[0], lens.focal_px[1] * v + lens.centre_px[1]]
    )


def ray_table(lens: LensPlant) -> FloatArray:
    """Return X/Z and Y/Z of every pixel's centre, (height, width, 2), by fixed-point iteration."""
    u, v = np.meshgrid(
        np.arange(lens.width_px, dtype=float), np.arange(lens.height_px, dtype=float)
    )
    distorted_x = (u - lens.centre_px[0]) / lens.focal_px[0]
    distorted_y = (v - lens.centre_px[1]) / lens.focal_px[1]
    x, y = distorted_x.copy(), distorted_y.copy()
    for _ in range(_ITERATIONS):
        at_x, at_y = distorted(x, y, lens)
        off_x, off_y = distorted_x - at_x, distorted_y - at_y
        x, y = x + off_x, y + off_y
        if max(np.abs(off_x).max(), np.abs(off_y).max()) < 1e-10:
            break
    return np.stack([x, y], axis=2)


_STILL_px = 0.02
"""A smaller motion during exposure and readout counts as none."""
_PLASTIC = np.array([0.8191725134, 0.6710436067, 0.5497004779])
"""Steps of an evenly spread sequence in three dimensions (inverse powers of 1.2207)."""


@dataclass(frozen=True)
class Pose:
    """Pose of a camera in the room, and its motion."""

    position_m: FloatArray
    rotation: FloatArray
    velocity_m_s: FloatArray
    spin_rad_s: FloatArray


class SimCamera:
    """Renders images; the noise of each depends only on the plant's seed and the image number."""

    def __init__(self, plant: CameraPlant) -> None:
        """Build the scene; raises SimulatorError."""
        self.plant = plant
        self.taken = 0
        """Images taken so far."""
        self.dark = False
        """Whether the light is off."""
        self.defocus_px = 0.0
        """Blur in addition to the lens'."""
        self.sheets = build_scene(plant)
        self._rays = ray_table(plant.lens)
        steps = np.arange(1, plant.samples + 1)[:, None] * _PLASTIC % 1.0
        steps[:, :2] -= steps[:, :2].mean(axis=0)  # the mean ray of a pixel goes through its centre
        steps[:, 2] = (steps[:, 2] - steps[:, 2].mean()) * plant.sensor.exposure_s
        self._offsets = np.ascontiguousarray(steps)
        self._light = self._light_field()

    def skip_unplugged(self) -> bool:
        """Return whether the camera is unplugged at the next image, which is then skipped."""
        unplugged = bool(self._faults("unplugged"))
        self.taken += unplugged
        return unplugged

    def _faults(self, kind: str) -> list[CameraFaultPlant]:
        """Return the faults of one kind in the next image."""
        return [one for one in self.plant.faults if one.kind == kind and one.holds(self.taken)]

    def camera_pose(self, platform: PlatformState) -> Pose:
        """Return the camera's pose on a platform."""
        mount = self.plant.mount
        turn = np.array(platform.rotation).reshape(3, 3)
        lever = turn @ np.array(mount.position_m)
        spin = np.array(platform.spin_rad_s)
        return Pose(
            np.array(platform.position_m) + lever,
            turn @ rotation_of(np.radians(mount.rotation_deg)),
            np.array(platform.velocity_m_s) + np.cross(spin, lever),
            spin,
        )

    def grab(self, platform: PlatformState) -> NDArray[np.uint8]:
        """Return the next image (height, width), grey levels, from a pose of the platform.

        The middle of its middle row's exposure is at the instant of `platform`.
        """
        pose = self.camera_pose(platform)
        light = self.plant.light
        image: FloatArray = np.full(self._rays.shape[:2], light.floor)
        distance = [np.linalg.norm(one.place(self.taken) - pose.position_m) for one in self.sheets]
        for k in np.argsort(distance)[::-1]:
            self._draw(image, self.sheets[k], pose)
        self._occlude(image, pose)
        image = 1.0 / light.paper_to_black + image * (1.0 - 1.0 / light.paper_to_black)
        blurs = [one.blur_px for one in self._faults("defocus")]
        sigma = float(np.linalg.norm([self.plant.lens.blur_px, self.defocus_px, *blurs]))
        if sigma > 0.0:
            image = np.asarray(cv2.GaussianBlur(image, (0, 0), sigma))
        dark = self.dark or bool(self._faults("dark"))
        self.taken += 1
        return self._exposed(image, 0.01 if dark else 1.0)

    def _draw(self, image: FloatArray, sheet: Sheet, pose: Pose) -> None:
        place, sensor = sheet.place(self.taken), self.plant.sensor
        spin = pose.spin_rad_s
        across = np.array([[0, -spin[2], spin[1]], [spin[2], 0, -spin[0]], [-spin[1], spin[0], 0]])
        outline = (sheet.outline() @ sheet.rotation.T + place - pose.position_m) @ pose.rotation
        seen = seen_at(outline, self.plant.lens)
        if np.isnan(seen).any() or (pose.position_m - place) @ sheet.rotation[:, 2] <= 0.0:
            return
        moved = outline - (pose.velocity_m_s + np.cross(spin, outline @ pose.rotation.T)) @ (
            pose.rotation * self._span_s()
        )
        shift = np.nan_to_num(np.abs(seen_at(moved, self.plant.lens) - seen), nan=1e3)
        reach = float(shift.max())
        height, width = image.shape
        low = np.floor(seen.min(axis=0) - reach - 2.0).astype(int).clip(0, (width, height))
        high = np.ceil(seen.max(axis=0) + reach + 3.0).astype(int).clip(0, (width, height))
        if (high <= low).any():
            return
        to_sheet = sheet.rotation.T
        row_time = sensor.readout_s / height if sensor.shutter == "rolling" else 0.0
        offsets = self._offsets.copy()
        offsets[:, 2] -= 0.5 * height * row_time
        draw_sheet(
            image,
            np.array([*low, *high]),
            self._rays,
            (*sheet.half_m, sheet.bend_1_m),
            sheet.texture,
            np.stack([to_sheet @ (pose.position_m - place), to_sheet @ pose.velocity_m_s]),
            np.stack(
                [
                    to_sheet @ pose.rotation,
                    to_sheet @ across @ pose.rotation,
                    0.5 * to_sheet @ across @ across @ pose.rotation,
                ]
            ),
            offsets,
            row_time,
            reach > _STILL_px,
        )

    def _span_s(self) -> float:
        """Return the time from the first row's start of exposure to the last row's end."""
        sensor = self.plant.sensor
        return sensor.exposure_s + (sensor.readout_s if sensor.shutter == "rolling" else 0.0)

    def _occlude(self, image: FloatArray, pose: Pose) -> None:
        """Cover the parts behind balls, which count as nearer than all sheets."""
        for ball in self.plant.occluders:
            at = (np.array(ball.position_m) - pose.position_m) @ pose.rotation
            seen = seen_at(at[None], self.plant.lens)[0]
            if not np.isnan(seen).any():
                radius = self.plant.lens.focal_px[0] * ball.radius_m / at[2]
                cv2.circle(image, tuple(np.rint(seen).astype(int)), round(radius), 0.1, -1)

    def _light_field(self) -> FloatArray:
        lens, light = self.plant.lens, self.plant.light
        v, u = np.mgrid[-1.0 : 1.0 : lens.height_px * 1j, -1.0 : 1.0 : lens.width_px * 1j]
        fall = 1.0 - light.vignetting * (u * u + v * v) / 2.0
        return np.asarray(light.white * fall * (1.0 + 0.5 * light.gradient * u))

    def _exposed(self, image: FloatArray, share: float) -> NDArray[np.uint8]:
        """Return grey levels with a share of the light, noise and quantisation."""
        sensor = self.plant.sensor
        chance = np.random.default_rng([self.plant.seed, 12, self.taken])
        level = image * self._light * share
        sigma = np.sqrt(sensor.noise**2 + sensor.shot_noise**2 * level / 255.0)
        level = level + sigma * chance.standard_normal(level.shape, dtype=np.float32)
        return np.rint(level).clip(0, 255).astype(np.uint8)


# Random poses in a box, for images without a robot.

_STILL = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Box:
    """Limits of a platform's position, and of its rotation about any axis."""

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    turn_deg: float


def random_poses(box: Box, count: int, seed: int) -> Iterator[PlatformState]:
    """Yield platforms at rest: positions uniform in the box, rotations up to its angle."""
    chance = np.random.default_rng([seed, 13])
    for k in range(count):
        position = chance.uniform(box.low_m, box.high_m)
        axis = chance.standard_normal(3)
        turn = axis / np.linalg.norm(axis) * chance.uniform(0.0, math.radians(box.turn_deg))
        yield PlatformState(
            *(float(k), tuple(position.tolist()), tuple(rotation_of(turn).ravel().tolist())),
            *(_STILL, _STILL),
        )
