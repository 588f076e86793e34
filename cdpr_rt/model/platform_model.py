"""Model of a robot's platform from its file: kinematics, tensions, workspace."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.supervisor import Limits
from cdpr_rt.model import rigid_body
from cdpr_rt.model.cable_kernel import ANCHOR, RADIUS
from cdpr_rt.model.interference import Interference, in_words
from cdpr_rt.model.kinematics import CableKinematics
from cdpr_rt.model.own_distribution import OwnDistribution, TensionDistribution
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.pose_tracking import poses_of_coordinates
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.model.tension_distribution import (
    TensionOutcome,
    TensionSolver,
)
from cdpr_rt.model.workspace import CableWorkspace, wrenches_in_motion

RESERVE, _MARGIN_SHARE = 0.12, 0.4
"""Share of the span of tensions that is reserved for effects that planning omits: control,
friction, swinging; and the upper bound of this reserve, as a share of the margin in the middle of
the box.
"""
_LEAST_ARM_m = 1e-3
_FLAT_m = 1e-6


@dataclass(frozen=True)
class PlatformModel:
    """Kinematics, tension distribution and workspace of one platform; made by `platform_model`.

    A position (d,) has one entry for each controlled direction: coordinates of the origin, m, the
    last one against gravity, and the rotation vector from the orientation at home, rad. Positions
    (..., k) without a rotation vector have home's orientation.
    """

    platform: Platform
    kinematics: CableKinematics
    about_centre_of_mass: CableKinematics
    """Kinematics with the centre of mass as the platform's origin."""
    low_N: FloatArray
    high_N: FloatArray
    """Bounds of the tensions, (n,)."""
    reserve_N: float
    """Distance from both bounds that is reserved for the control."""
    torque_limited_N: FloatArray
    """Upper bounds of the tensions, (n,), that motors can hold while rotors accelerate."""

    @property
    def positions(self) -> int:
        """Number of coordinates of the origin, k."""
        return len(self.platform.home_m)

    @property
    def size(self) -> int:
        """Number of controlled directions, d."""
        return len(self.kinematics.directions)

    @cached_property
    def home(self) -> FloatArray:
        """The position at home, (d,)."""
        return np.concatenate([self.platform.home_m, np.zeros(self.size - self.positions)])

    @cached_property
    def home_pose(self) -> Pose:
        """The pose at home."""
        return _home_pose(self.platform)

    @cached_property
    def corners(self) -> FloatArray:
        """Corners (8, 3) of the body, or of the box around the anchors, in the platform's frame."""
        anchors, body = self.kinematics.geometry[ANCHOR:RADIUS].T, self.platform.body
        ends = np.array([anchors.min(axis=0), anchors.max(axis=0)])
        if body is not None:
            ends = np.array([rigid_body.in_space(body.min_m), rigid_body.in_space(body.max_m)])
        return np.array([ends[pick, range(3)] for pick in itertools.product((0, 1), repeat=3)])

    @cached_property
    def tips_at(self) -> float:
        """Horizontal pull, as a share of the weight, at which the platform tips over on its stand.

        It is half the least width of the body, or of the box around the anchor points, over its
        height; inf for no height. The platform stands on its lower face, its centre of mass is in
        the middle, and the cables pull at the upper face.
        """
        extent = np.ptp(self.corners @ self.home_pose.array[1:].T, axis=0)[: self.positions]
        width, height = float(extent[:-1].min()), float(extent[-1])
        return 0.5 * width / height if height > _FLAT_m else np.inf

    @property
    def speed(self) -> FloatArray:
        """The highest speeds, (d,), in m/s and rad/s."""
        return self._each(self.platform.speed_m_s, self.platform.angular_speed_rad_s)

    @property
    def acceleration(self) -> FloatArray:
        """The highest accelerations, (d,), in m/s2 and rad/s2."""
        platform = self.platform
        return self._each(platform.acceleration_m_s2, platform.angular_acceleration_rad_s2)

    @property
    def jerk(self) -> FloatArray:
        """The highest jerks of paths, (d,), in m/s3 and rad/s3."""
        return self._each(self.platform.jerk_m_s3, self.platform.angular_jerk_rad_s3)

    @property
    def angle_rad(self) -> float:
        """Largest angle by which targets may be turned from home's orientation."""
        return self.platform.workspace_angle_rad

    @property
    def wrench_scale(self) -> FloatArray:
        """Scale that makes forces and moments comparable, (d,): 1, and an arm in m for moments."""
        return self._each(1.0, _arm_m(self.platform))

    def weight(self) -> FloatArray:
        """Return the wrench of gravity on the platform at home's orientation, (d,)."""
        wrench, up = np.zeros(6), self.positions - 1
        wrench[up] = -self.platform.mass_kg * rigid_body.G_m_s2
        centre = rigid_body.in_space(self.platform.centre_of_mass_m)
        wrench[3:] = np.cross(self.home_pose.Q @ centre, wrench[:3])
        return wrench[list(self.kinematics.directions)]

    def workspace(
        self, acceleration_m_s2: float | None = None, reserve_N: float | None = None
    ) -> CableWorkspace:
        """Return the workspace in which the platform can accelerate in all directions together.

        Acceleration and reserve default to those of the robot's file and of the control. Tensions
        are between their lower bounds and `torque_limited_N`. If targets may be turned, the same
        share of the angular acceleration is included, with the inertia at home's orientation.
        """
        platform = self.platform
        wanted = platform.acceleration_m_s2 if acceleration_m_s2 is None else acceleration_m_s2
        turning = None
        if platform.workspace_angle_rad > 0.0:
            share = wanted / platform.acceleration_m_s2
            Q = self.home_pose.Q
            about_room = Q @ rigid_body.inertia_kg_m2(platform) @ Q.T
            turning = share * platform.angular_acceleration_rad_s2 * about_room
        directions = self.kinematics.directions
        weight, motions = wrenches_in_motion(
            platform.mass_kg, wanted, self.positions - 1, directions, turning
        )
        return CableWorkspace(
            self.about_centre_of_mass,
            weight,
            self.low_N,
            self.torque_limited_N,
            self.wrench_scale,
            self.reserve_N if reserve_N is None else reserve_N,
            rigid_body.in_space(platform.centre_of_mass_m),
            motions,
        )

    @cached_property
    def interference(self) -> Interference:
        """Contact checks among cables, platform and obstacles."""
        platform = self.platform
        body = None
        if platform.body is not None:
            body = np.array([platform.body.min_m, platform.body.max_m])
        return Interference(
            self.kinematics,
            self.home_pose.array,
            platform.clearance_m,
            body,
            [np.array([box.min_m, box.max_m]) for box in platform.obstacles],
            platform.is_planar,
        )

    def contact_on_way(self, positions: FloatArray, looks: int) -> str:
        """Return the contact on straight lines between successive positions (m, d) as text, or "".

        A pair that `looks` checks of a part of the way do not prove clear counts as in contact.
        """
        contact = self.interference.first_contact(positions, looks)
        return "" if contact is None else in_words(contact.things, contact.distance_m)

    def least_tensions(self, low_N: FloatArray, high_N: FloatArray) -> TensionSolver:
        """Return the distribution with the least squared deviation from the lower bounds (n,)."""
        return TensionSolver("minimum-deviation", low_N, high_N, self.wrench_scale, low_N)

    def planned_tensions(
        self, poses: FloatArray, others: FloatArray, own: TensionDistribution | None = None
    ) -> tuple[FloatArray, BoolArray]:
        """Return the tensions (m, n) that the distribution plans, and whether they are feasible.

        `others` (m, d) are the wrenches about the centre of mass at poses (m, 4, 3), without those
        of the tensions and of the cables' weight. Tensions keep the reserve and the limits of the
        motors' torque. The distribution is `own` if given, and the built-in method of the file
        otherwise. Raises TensionDistributionError.
        """
        low, high = self.low_N + self.reserve_N, self.torque_limited_N - self.reserve_N
        method = self.platform.tension_method
        wanted = low if method == "minimum-deviation" else None
        distribution = TensionSolver(method, low, high, self.wrench_scale, wanted)
        checked = None if own is None else OwnDistribution(own, low, high, self.wrench_scale)
        workspace = self.workspace(0.0, 0.0)
        others = others + workspace.hanging_wrenches(poses)
        tensions, carried = np.zeros((len(poses), self.kinematics.n)), np.zeros(len(poses), bool)
        for i, W in enumerate(workspace.wrench_matrices(poses)):
            outcome = distribution.solve(W, others[i], tensions[i])
            carried[i] = outcome is TensionOutcome.FEASIBLE
            if carried[i] and checked is not None:
                checked.solve(W, others[i], tensions[i].copy(), tensions[i])
        return tensions, carried

    def pose(self, position: FloatArray) -> Pose:
        """Return the pose at a position (d,) or (k,)."""
        array = self.poses(np.asarray(position, float)[None])[0]
        return Pose(array[0], array[1:])

    def poses(self, positions: FloatArray) -> FloatArray:
        """Return the arrays of the poses (m, 4, 3) at positions (m, d) or (m, k)."""
        given = np.asarray(positions, float)
        q = np.zeros((len(given), self.size))
        q[:, : given.shape[1]] = given
        poses, scratch = np.zeros((len(q), 4, 3)), np.zeros((4, 3))
        directions = np.array(self.kinematics.directions)
        poses_of_coordinates(q, directions, self.home_pose.array, scratch, poses)
        return poses

    def _each(self, linear: float, angular: float) -> FloatArray:
        return np.array([linear if i < 3 else angular for i in self.kinematics.directions])


def platform_model(
    platform: Platform,
    low_N: FloatArray,
    high_N: FloatArray,
    torque_limited_N: FloatArray | None = None,
) -> PlatformModel:
    """Return the model of a platform with these bounds (n,) of the tensions.

    `torque_limited_N` (n,) defaults to `high_N`.
    """
    low, high = np.array(low_N, float), np.array(high_N, float)
    kinematics = cable_kinematics(platform)
    about_centre_of_mass = cable_kinematics(platform, np.array(platform.centre_of_mass_m))
    left = high if torque_limited_N is None else np.array(torque_limited_N)
    without = PlatformModel(platform, kinematics, about_centre_of_mass, low, high, 0.0, left)
    box = np.array([platform.workspace_min_m, platform.workspace_max_m])
    middle = without.poses(box.mean(axis=0)[None])
    margin_N = float(without.workspace(0.0).capacity_margins(middle)[0])
    reserve_N = min(RESERVE * float((high - low).min()), max(_MARGIN_SHARE * margin_N, 0.0))
    return replace(without, reserve_N=reserve_N)


def cable_kinematics(platform: Platform, centre_m: FloatArray | float = 0.0) -> CableKinematics:
    """Return the kinematics of a platform about a point of it, its origin if omitted."""
    return CableKinematics(
        np.array(platform.exit_points_m),
        np.array(platform.anchor_points_m) - centre_m,
        rigid_body.directions_of(platform),
        pulley_radius_m=np.array(platform.pulley_radius_m),
        swivel_axes=np.array([rigid_body.in_space(axis) for axis in platform.pulley_axes]),
        weights_N_m=np.array(platform.cable_weights_N_m),
        home=_home_pose(platform),
    )


def platform_model_of(robot: Robot, limits: Limits | None = None) -> PlatformModel:
    """Return the model of a robot's platform within `limits`, those of its file if omitted.

    The robot has to have a platform.
    """
    assert robot.platform is not None
    limits, n = limits or limits_of(robot), len(robot.axes)
    low, high = (
        np.broadcast_to(bound, (n,)).astype(float)
        for bound in (limits.tension_min_N, limits.tension_max_N)
    )
    return platform_model(robot.platform, low, high, _torque_limited_N(robot, limits, high))


def _torque_limited_N(robot: Robot, limits: Limits, high_N: FloatArray) -> FloatArray:
    """Return the upper bounds (n,) of tensions that motors can hold while rotors accelerate.

    t = (τ - J a/r)/r with rotor inertia J, cable per radian r, and the largest acceleration a of an
    anchor point. This bound applies at the winch. If cables have weight, the tension in the middle
    is lower by half the weight of the cable with its anchor at the lowest position.
    """
    platform = robot.platform
    assert platform is not None  # callers check that there is one
    torque_Nm = np.asarray(limits.torque_Nm)
    per_rad = np.array([abs(axis.winch.cable_m_per_motor_rad) for axis in robot.axes])
    rotor = np.array([axis.winch.motor.rotor_inertia_kg_m2 for axis in robot.axes])
    k, d = len(platform.home_m), len(rigid_body.directions_of(platform))
    fastest = np.sqrt(k) * platform.acceleration_m_s2
    if d > k:
        fastest += _arm_m(platform) * np.sqrt(d - k) * platform.angular_acceleration_rad_s2
    left = (torque_Nm - rotor * fastest / per_rad) / per_rad
    return np.asarray(np.minimum(high_N, left) - _largest_rise_N(platform))


def _largest_rise_N(platform: Platform) -> FloatArray:
    """Return the largest excess of tensions at the winches over those in the middle, (n,).

    It is half the weight of each cable, with the anchor at its lowest position, times the sine of
    its slope: half the weight per length times the height of the exit above the anchor.
    """
    reach = max(float(np.linalg.norm(anchor)) for anchor in platform.anchor_points_m)
    exits_m = np.array([point[-1] for point in platform.exit_points_m])
    height_m = exits_m - (min(platform.workspace_min_m[-1], platform.home_m[-1]) - reach)
    return np.asarray(0.5 * np.array(platform.cable_weights_N_m) * np.maximum(height_m, 0.0))


def _arm_m(platform: Platform) -> float:
    return max(float(np.linalg.norm(platform.anchor_points_m, axis=1).max()), _LEAST_ARM_m)


def _home_pose(platform: Platform) -> Pose:
    return Pose(rigid_body.in_space(platform.home_m), rigid_body.home_rotation(platform))
