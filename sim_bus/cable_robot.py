"""One simulated cable robot: the physics that its drives share."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim_bus import servo
from sim_bus.motor import sample_of
from sim_bus.motor_state import LOAD_KINDS, MOTOR_DTYPE, MotorArray, Transmission
from sim_bus.platform import MOST_CABLES, MOST_FEET, PLATFORM_DTYPE, PlatformArray
from sim_bus.robot_motion import run_together
from sim_bus.robot_plant import RobotPlant

_LONGEST_STEP_S = 1e-3
_SAME_TIME_S = 1e-12
_EVEN_m = 1e-6
FloatArray = NDArray[np.float64]
MotorSample = tuple[int, int, int, int, float, float, float, float, float, float]
"""A `motor.Sample` as the kernels return it."""
MotorCommand = Callable[[], tuple[int, float]]
"""Returns a kind of control, named in `servo`, and its target, as a power stage is set now."""


@dataclass(frozen=True)
class RobotShape:
    """What the robot's profile says of it; points are (n, 2) in a plane or (n, 3), m."""

    exit_points_m: ArrayLike
    anchor_points_m: ArrayLike
    """In the platform's frame."""
    mass_kg: float
    home_m: Sequence[float]
    """Where the platform's origin is at power-up, unless the plant says otherwise."""
    weights_N_m: Sequence[float]
    """Of each cable."""
    feet_m: ArrayLike | None = None
    """What the platform stands on, in its frame; the corners of a box around its anchor points
    where left out."""


class CableRobot:
    """Motors, cables and platform; each drive asks it to advance and reads its own motor.

    Whoever asks first for an instant advances all, under what each power stage is set to then.
    """

    def __init__(
        self, shape: RobotShape, plant: RobotPlant, transmissions: Sequence[Transmission]
    ) -> None:
        self.n = n = len(transmissions)
        self.motors: MotorArray = np.zeros(n, MOTOR_DTYPE)
        """Taken over by `adopt`, one record each."""
        self.kinds: NDArray[np.int64] = np.full(n, servo.OFF, np.int64)
        self.targets: FloatArray = np.zeros(n)
        self._flags: NDArray[np.int64] = np.zeros(n, np.int64)
        self._plant = plant
        self._chance = np.random.default_rng([plant.seed, 1])
        self._transmissions = list(transmissions)
        self._weights = list(shape.weights_N_m)
        self.platform = self._build_platform(shape)
        # have it compiled now, before the clock runs
        run_together(self.motors, self.platform, 0.0, self.kinds, self.targets, self._flags)
        self.commands: list[MotorCommand] = [_switched_off] * n
        """What tells how each power stage is set."""

    def adopt(self, i: int, motor: MotorArray, command: MotorCommand) -> MotorArray:
        """Connect motor `i`, a record of shape (1,), to its cable; return the record to use."""
        self.commands[i] = command
        self.motors[i] = motor[0]
        here = self.motors[i : i + 1]
        plant, transmission = self._plant.cables, self._transmissions[i]
        error = float(self._chance.normal(0.0, plant.drum_radius_sigma))
        if plant.drum_radius_errors:
            error += plant.drum_radius_errors[i]
        gain = transmission.cable_m_per_rad * (1.0 + error)
        here["load_kind"] = LOAD_KINDS.index("platform")
        here["cable_gain"] = gain
        here["rigidity"] = transmission.cable_stiffness_N * (1.0 + plant.stiffness_error)
        here["weight"] = self._weights[i] if plant.sag else 0.0
        here["damping_time"] = plant.damping_s
        here["winch_friction"] = plant.winch_friction_Nm
        here["friction_share"] = plant.friction_share * abs(gain)
        winding = self._plant.winding
        here["drum_gain"] = 1.0 / transmission.gear_ratio
        here["run_out"] = winding.run_out_m
        here["run_out_phase"] = self._chance.uniform(0.0, 2.0 * math.pi)
        here["lag"] = winding.carriage_error * winding.pitch_m / (2.0 * math.pi)
        here["carriage_offset"] = winding.carriage_offset_m
        here["carriage_distance"] = winding.carriage_distance_m
        here["angle_start"] = here["angle"]
        here["cable_start"] = self.distance_m(i) + self._plant.start.slack_m
        return here

    def step(self, i: int, until: float) -> MotorSample:
        """Advance all to `until`, return the `motor.Sample` of motor `i`."""
        now = float(self.motors["time"][i])
        if until - now > _SAME_TIME_S:
            for k, command in enumerate(self.commands):
                self.kinds[k], self.targets[k] = command()
        while until - now > _SAME_TIME_S:
            now = min(until, now + _LONGEST_STEP_S) if until - now > 1.5e-3 else until
            run_together(self.motors, self.platform, now, self.kinds, self.targets, self._flags)
        flags, self._flags[i] = int(self._flags[i]), 0
        return sample_of(self.motors[i : i + 1], flags)

    def members(self) -> list[RobotMember]:
        """Return each motor's part in the robot."""
        return [RobotMember(self, i) for i in range(self.n)]

    @property
    def position_m(self) -> FloatArray:
        """True position of the platform's origin, (3,)."""
        p = self.platform[0]
        return np.asarray(p["position"] - p["rotation"] @ p["com"])

    @property
    def rotation(self) -> FloatArray:
        """True rotation from the platform's frame to the room, (3, 3)."""
        return np.array(self.platform[0]["rotation"])

    @property
    def tension_N(self) -> FloatArray:
        """True tension of each cable at its winch, (n,)."""
        return np.array(self.motors["tension"])

    def cut(self, i: int) -> None:
        """Cut cable `i` for good."""
        self.motors["rigidity"][i] = 1e-9
        self.motors["weight"][i] = 0.0

    def slip(self, i: int, metres: float) -> None:
        """Let so much of cable `i` slip through its fastening on the drum."""
        self.motors["cable_start"][i] += metres

    def distance_m(self, i: int) -> float:
        """Return the distance from exit to anchor point of cable `i`, m."""
        p = self.platform[0]
        anchor = p["position"] + p["rotation"] @ p["anchor"][i]
        return float(np.linalg.norm(p["exit"][i] - anchor))

    def _build_platform(self, shape: RobotShape) -> PlatformArray:
        plant, n = self._plant, self.n
        exits = _points(shape.exit_points_m, n, "exit points")
        anchors = _points(shape.anchor_points_m, n, "anchor points")
        planar = np.shape(shape.exit_points_m)[1] == 2
        exits = self._moved(
            exits, plant.geometry.exit_errors_m, plant.geometry.exit_sigma_m, planar
        )
        anchors = self._moved(
            anchors, plant.geometry.anchor_errors_m, plant.geometry.anchor_sigma_m, planar
        )
        platform: PlatformArray = np.zeros(1, PLATFORM_DTYPE)
        p: Any = platform[0]
        com = p["com"] = _vector(plant.platform.centre_of_mass_m or (0.0, 0.0))
        p["cables"], p["planar"] = n, planar
        p["mass"] = shape.mass_kg * (1.0 + plant.platform.mass_error)
        reach = plant.platform.radius_of_gyration_m or _plate_radius(anchors)
        p["reach"], p["air"] = reach, plant.platform.air_Ns_m
        p["inertia"] = p["mass"] * reach**2 * np.eye(3)
        p["inverse_inertia"] = np.linalg.inv(p["inertia"])
        p["gravity"] = (0.0, -9.80665, 0.0) if planar else (0.0, 0.0, -9.80665)
        p["exit"][:n] = exits
        p["anchor"][:n] = anchors - com
        longest = float(np.linalg.norm(p["anchor"][:n], axis=1).max())
        p["mobility"] = (1.0 + (longest / reach) ** 2) / p["mass"]
        angle = math.radians(plant.start.angle_deg)
        cosine, sine = math.cos(angle), math.sin(angle)
        p["rotation"] = ((cosine, -sine, 0.0), (sine, cosine, 0.0), (0.0, 0.0, 1.0))
        start = plant.start.position_m or shape.home_m
        p["position"] = _vector(start) + p["rotation"] @ com
        self._put_floor(
            p, _corners(anchors) if shape.feet_m is None else _points(shape.feet_m, None, "feet")
        )
        return platform

    def _put_floor(self, p: Any, feet: FloatArray) -> None:
        floor = self._plant.floor
        p["feet"] = len(feet)
        p["foot"][: len(feet)] = feet - p["com"]
        up = -p["gravity"] / np.linalg.norm(p["gravity"])
        heights = (p["position"] + p["foot"][: len(feet)] @ p["rotation"].T) @ up
        carried_by = np.count_nonzero(heights < heights.min() + _EVEN_m)
        weight = p["mass"] * np.linalg.norm(p["gravity"])
        sunk = weight / (carried_by * floor.stiffness_N_m)
        p["floor"] = heights.min() + sunk if floor.height_m is None else floor.height_m
        if not floor.present:
            p["floor"] = -math.inf
        p["floor_stiffness"], p["floor_damping"] = floor.stiffness_N_m, floor.damping_Ns_m
        p["floor_friction"] = floor.friction

    def _moved(
        self, points: FloatArray, errors: Sequence[Sequence[float]], sigma: float, planar: bool
    ) -> FloatArray:
        chance = self._chance.normal(0.0, sigma, points.shape)
        if planar:
            chance[:, 2] = 0.0
        known = _points(errors, len(points), "errors") if errors else np.zeros_like(points)
        return points + known + chance


@dataclass(frozen=True)
class RobotMember:
    """One motor's part in the robot, for the drive that it belongs to."""

    robot: CableRobot
    number: int

    def adopt(self, motor: MotorArray, command: MotorCommand) -> MotorArray:
        """See `CableRobot.adopt`."""
        return self.robot.adopt(self.number, motor, command)

    def step(self, until: float) -> MotorSample:
        """See `CableRobot.step`."""
        return self.robot.step(self.number, until)

    def cut(self) -> None:
        """See `CableRobot.cut`."""
        self.robot.cut(self.number)

    def slip(self, metres: float) -> None:
        """See `CableRobot.slip`."""
        self.robot.slip(self.number, metres)


def _switched_off() -> tuple[int, float]:
    return servo.OFF, 0.0


def _points(values: ArrayLike, n: int | None, what: str) -> FloatArray:
    points = np.asarray(values, float)
    most = MOST_CABLES if n is not None else MOST_FEET
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not 0 < len(points) <= most:
        raise ValueError(f"{what}: {points.shape}; allowed: (n, 2) or (n, 3), n up to {most}")
    if n is not None and len(points) != n:
        raise ValueError(f"{what}: {len(points)}; allowed: one for each of {n} axes")
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))


def _corners(points: FloatArray) -> FloatArray:
    low, high = points.min(axis=0), points.max(axis=0)
    corners = [np.where(pick, high, low) for pick in np.ndindex(2, 2, 2)]
    return np.unique(corners, axis=0)


def _vector(values: Sequence[float]) -> FloatArray:
    return np.pad(np.asarray(values, float), (0, 3 - len(values)))


def _plate_radius(anchors: FloatArray) -> float:
    """Return the radius of gyration of a plate about its centre, from its corners' distance."""
    spread = float(np.sqrt(np.mean(np.sum((anchors - anchors.mean(axis=0)) ** 2, axis=1))))
    return max(0.01, spread / 2.0)
