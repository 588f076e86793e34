"""Prediction of a platform's motion after one of its cables breaks: swing and travel.

Computed in time, as no place of equilibrium tells it: motors give way to what is above their
torque, and the winches that are left then let the platform down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.winch_speed_loop import (
    DRUM_TENSION_SHARE,
    BANDWIDTH_rad_s,
    FASTEST_IN_m_s,
    HANGING_LOAD_1_s,
    UNKNOWN_POSE_m_s,
)
from cdpr_rt.robots.cable_loss.fall_kernel import PARAMETERS, WINCHES, fall
from cdpr_rt.robots.kinematics.cable_kernel import ARC, CABLE_ROWS, FREE, run_cables
from cdpr_rt.robots.kinematics.pose import Pose
from cdpr_rt.robots.platform.body_kernel import body_of
from cdpr_rt.robots.platform.design.loop_plant import CABLE_DAMPING_s
from cdpr_rt.robots.platform_model import platform_model_of
from cdpr_rt.robots.resonance import highest_rad_s
from cdpr_rt.robots.rigid_body import free_directions, in_space, inertia_kg_m2, is_point
from cdpr_rt.robots.robot_arrays import limits_of
from cdpr_rt.robots.statics import statics_of

SWING_S = 1.0
"""Time from the break that counts as the swing; afterwards the platform is lowered."""
_LONGEST_S = 30.0
_NOTICED_LATE, _NOTICING_S, _NOTICED_S = 1.5, 0.015, 0.25
"""Time until the break is detected: a factor on the time in which the rotor exceeds its speed
limit, the delay of filters and buses, and the most, which is for cables of next to no tension."""
_MISLED_SHARE = 0.25
"""Force of the misled control over the span of tensions, where its proportional part saturates."""
_FRICTIONS = (0.0, 0.03, 0.06)
"""Friction of the winches over the motors' rated torques; each is simulated."""
_NEAREST_m = 1e-3
_STEP_rad = 0.2
"""Phase of the fastest oscillation, of rotors and platform or a foot on the ground, in a step."""
_GROUND_FRICTION = 0.2
"""Less than most floors have, so that the platform slides further."""
_GROUND_DAMPING = 0.25
"""Over the critical one: what strikes the ground bounces."""


@dataclass(frozen=True)
class Swing:
    """Motion of a platform that was at rest at a position when a cable broke."""

    cable: int
    position_m: tuple[float, ...]
    swing_m: float
    """Largest distance of the origin from there within `SWING_S`."""
    turn_rad: float
    """Largest angle from its orientation within `SWING_S`."""
    away_m: float
    """Largest distance from there until it lies still, on the ground."""
    aside_m: float
    """Largest horizontal distance from there until it lies still."""


def corner_swings(robot: Robot) -> list[list[Swing]]:
    """Return for each cable what the platform does at each corner of the box of targets.

    In the orientation of home; where a corner is no target, at the target nearest to it on a grid.
    Empty lists where there is none. The robot has to have a platform.
    """
    loss, statics = CableLoss(robot), statics_of(robot)
    points = statics.points()
    targets = points[statics.is_target(points)]
    box = zip(statics.platform.workspace_min_m, statics.platform.workspace_max_m, strict=True)
    places = {_nearest(targets, corner): None for corner in product(*box) if len(targets)}
    return [[loss.swing(i, place) for place in places] for i in range(len(robot.axes))]


def _nearest(points: FloatArray, place: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(points[np.linalg.norm(points - place, axis=1).argmin()].tolist())


class CableLoss:
    """Predicts what a robot's platform does when a cable breaks; the robot has to have one.

    - At rest, tensions are the least that keep the control's reserve from their lower bounds.
    - Until the loss is noticed, each motor pulls on as before. The pose that the control computes
      follows the cable as it runs in, and the platform is pulled the other way, with a quarter of
      the span of tensions. With the broken cable's tension t, its rotor's mass m at the cable and
      the highest speed v of the limits, that lasts 1.5 m v/t + 15 ms, 0.25 s at most.
    - Then the winches let it down as the program `lower` does where the pose is not known.
    - Cables are elastic, and damp as their profiles say, by 2 ms of their stiffness at most. Where
      their weight counts, half of it is on the platform, and winches hold what hangs from them;
      they do not sag. Winches rub with 0, 3 or 6 % of the motor's rated torque, whichever gets a
      figure the largest: what rubs may keep the platform or turn it over.
    - The ground is level, as high as the platform stands at home, or where that is lower, as it
      is when the cable breaks: nothing begins in the ground, whose spring would fling it.
    """

    def __init__(self, robot: Robot) -> None:
        """Take a robot."""
        self._model = model = platform_model_of(robot)
        limits, n, self._axes = limits_of(robot), len(robot.axes), robot.axes
        self._period_s = robot.sync_period_s
        winches, motors = zip(*((axis.winch, axis.winch.motor) for axis in robot.axes), strict=True)
        per_rad = np.array([abs(winch.cable_m_per_motor_rad) for winch in winches])
        self._rated_N = np.array([motor.rated_torque_Nm for motor in motors]) / per_rad
        self._fastest_m_s = np.broadcast_to(limits.speed_rad_s, (n,)) * per_rad
        self._EA_N = np.array([winch.cable.stiffness_N for winch in winches])
        # steps are short enough for no more
        damping_s = [min(winch.cable.damping_s, CABLE_DAMPING_s) for winch in winches]
        self._damping_s = np.array(damping_s)
        self._winches = np.zeros(n, WINCHES)
        rotor_kg = np.array([motor.rotor_inertia_kg_m2 for motor in motors]) / per_rad**2
        self._winches["rotor_kg"] = rotor_kg
        self._winches["gain_N_s_m"] = BANDWIDTH_rad_s * rotor_kg
        self._winches["low_N"] = DRUM_TENSION_SHARE * model.low_N
        self._winches["high_N"] = np.minimum(model.high_N, limits.torque_Nm / per_rad)
        self._resting = model.least_tensions(model.low_N + model.reserve_N, model.high_N)
        self._weight_only = model.least_tensions(np.zeros(n), model.high_N)
        self._body, self._free = body_of(model.platform), np.zeros(6)
        self._free[list(free_directions(model.platform))] = 1.0
        self._feet = np.unique(model.corners, axis=0)
        self._ground_m = self._lowest_m(model.home_pose)

    def swing(self, cable: int, position_m: tuple[float, ...]) -> Swing:
        """Return what the platform does at a position when a cable, counted from 0, breaks."""
        start = self._model.pose(np.array(position_m))
        up, first = self._model.positions - 1, slice(math.ceil(SWING_S / self._period_s))
        largest = np.zeros(4)
        for friction in _FRICTIONS:
            path = self.path(cable, start, friction)
            moved = path[:, 0] - start.p
            away = np.linalg.norm(moved, axis=1)
            aside = np.linalg.norm(np.delete(moved, up, axis=1), axis=1)
            cosine = (np.einsum("kij,ij->k", path[first, 1:], start.Q) - 1.0) / 2.0
            turn = math.acos(min(max(float(cosine.min()), -1.0), 1.0))
            largest = np.maximum(largest, (away[first].max(), turn, away.max(), aside.max()))
        return Swing(cable, tuple(position_m), *largest.tolist())

    def path(self, cable: int, start: Pose, friction: float = 0.0) -> FloatArray:
        """Return the poses (c, 4, 3) of all cycles from when a cable breaks until it lies still.

        At most those of 30 s. The platform is at rest at `start`; winches rub with `friction`
        times the motor's rated torque.
        """
        model, winches = self._model, self._winches
        W, tension_N = np.zeros((model.size, len(winches))), np.zeros(len(winches))
        model.kinematics.wrench_matrix(start, W)
        hanging, rise_N = model.kinematics.hanging(start)
        self._resting.solve(W, model.weight() + hanging, tension_N)
        winches["held_N"] = tension_N + rise_N
        self._weight_only.solve(W, model.weight() + hanging, tension_N)
        winches["weight_N"] = tension_N + rise_N
        cables = np.empty((CABLE_ROWS, len(winches)))
        run_cables(model.kinematics.geometry, start.array, cables)
        winches["stiffness_N_m"] = self._EA_N / np.maximum(cables[FREE] + cables[ARC], _NEAREST_m)
        winches["damping_N_s_m"] = self._damping_s * winches["stiffness_N_m"]
        winches["friction_N"] = friction * self._rated_N
        path = np.empty((math.ceil(_LONGEST_S / self._period_s), 4, 3))
        cycles = fall(
            self._parameters(cable, start), winches, self._body, self._free,
            model.kinematics.geometry, self._feet, start.array, path,
        )  # fmt: skip
        return path[:cycles]

    def _parameters(self, cable: int, start: Pose) -> NDArray[np.void]:
        model, platform, period_s = self._model, self._model.platform, self._period_s
        quickest_rad_s = highest_rad_s(model, self._axes, start.p[: model.positions])
        steps = math.ceil(period_s * quickest_rad_s / _STEP_rad)
        per_kg = 1.0 / platform.mass_kg
        if not is_point(platform):
            arms_m = np.linalg.norm(self._feet - in_space(platform.centre_of_mass_m), axis=1)
            per_kg += float(arms_m.max() ** 2 / np.linalg.eigvalsh(inertia_kg_m2(platform))[0])
        foot_N_m = (_STEP_rad * steps / period_s) ** 2 / (per_kg * len(self._feet))
        p = np.zeros(1, PARAMETERS)
        p["period_s"], p["steps"], p["cut"] = period_s, steps, cable
        p["held_cycles"] = math.ceil(self._noticed_s(cable) / period_s)
        p["misled_N"] = _MISLED_SHARE * (model.high_N - model.low_N)[cable]
        p["paying_out_m_s"], p["fastest_in_m_s"] = UNKNOWN_POSE_m_s, FASTEST_IN_m_s
        p["integral_rate_1_s"] = HANGING_LOAD_1_s
        p["up"], p["ground_m"] = model.positions - 1, min(self._ground_m, self._lowest_m(start))
        p["foot_N_m"], p["friction"] = foot_N_m, _GROUND_FRICTION
        p["foot_N_s_m"] = 2.0 * _GROUND_DAMPING * math.sqrt(foot_N_m / per_kg)
        return p

    def _lowest_m(self, pose: Pose) -> float:
        standing = pose.p + self._feet @ pose.Q.T
        return float(standing[:, self._model.positions - 1].min())

    def _noticed_s(self, cable: int) -> float:
        """Return for how long the loss of a cable is not noticed."""
        winch = self._winches[cable]
        momentum = winch["rotor_kg"] * self._fastest_m_s[cable]
        slack = winch["held_N"] * (_NOTICED_S - _NOTICING_S) < _NOTICED_LATE * momentum
        return _NOTICED_S if slack else _NOTICED_LATE * momentum / winch["held_N"] + _NOTICING_S
