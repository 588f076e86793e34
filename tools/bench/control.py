"""Measure one cycle of a platform's control, and of a plain controller in NumPy and SciPy."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from itertools import cycle

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.errors import GeometryError
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.model.rigid_body import G_m_s2, in_space, inertia_kg_m2
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.platform.cable_control import CableControl
from cdpr_tools.bench.harness import Figures, Target, Work, cost_rows, with_nothing_open
from cdpr_tools.output import Output

OURS, PLAIN = "ours, compiled", "computed torque in NumPy and SciPy"
_BLOCK, _WARM_UP = 500, 50
_ROUND_S = 4.0
_NOISE_rad = 3e-4


def measure(name: str, cycles: int, out: Output) -> Figures:
    """Run both controllers for `cycles` updates, with the same set-points and noisy motor angles.

    Raises GeometryError for a robot without a platform, or one that the baseline cannot compute.
    """
    robot = load_robot(name)
    ours = control_of(robot)
    plain, motion = PlainControl(robot, ours), PeriodicMotion(robot, ours)
    out.note(f"{cycles} updates of each")
    rows = cost_rows(
        {
            OURS: with_nothing_open(updates(ours, motion, [])),
            PLAIN: with_nothing_open(updates(plain, motion, [])),
        },
        cycles, _BLOCK, _WARM_UP, (50.0, 99.0, 100.0),
    )  # fmt: skip
    return Figures(
        f"{name}: {len(robot.axes)} cables, {ours.model.size} directions, {cycles} updates of "
        "each: processor and wall time, us",
        rows,
        {
            "ratio": Target("NumPy / ours", rows[PLAIN]["times ours"], 20.0, True),
            "p99_us": Target("ours, processor time p99, us", rows[OURS]["CPU p99"], 100.0),
        },
        more={"robot": name, "cycles": cycles},
    )


def control_of(robot: Robot) -> CableControl:
    """Return the control of a robot whose platform stands in the middle of its box."""
    if robot.platform is None:
        raise GeometryError(f"{robot.path}: {NO_PLATFORM}")
    n = len(robot.axes)
    torque_Nm = np.broadcast_to(limits_of(robot).torque_Nm, (n,)).astype(float)
    model = platform_model_of(robot)
    control = CableControl(model, list(robot.axes), torque_Nm, robot.sync_period_s)
    feedback = AxisFeedback(n)
    control.take_lengths(model.kinematics.lengths(model.pose(_middle(control))), feedback)
    control.begin(feedback)
    control.stand_still()
    return control


class PeriodicMotion:
    """A closed motion from the middle of the box, repeated endlessly, as arrays over one round."""

    def __init__(self, robot: Robot, control: CableControl) -> None:
        model = control.model
        d, k = model.size, model.positions
        # a closed path that begins and ends at rest, with at most half the robot's acceleration
        pace = 2.0 * math.pi / _ROUND_S * np.array([1.0, 2.0, 1.0, 1.0, 2.0, 1.0])[:d]
        platform = model.platform
        box = np.subtract(platform.workspace_max_m, platform.workspace_min_m)
        most = np.concatenate([0.2 * box, np.full(d - k, 0.3 * model.angle_rad)])
        half = np.minimum(most, 0.5 * model.acceleration / pace**2)
        cycles = round(_ROUND_S / robot.sync_period_s)
        t = robot.sync_period_s * np.arange(1, cycles + 1)[:, None]
        self.position = _middle(control) + half * (1.0 - np.cos(pace * t))
        self.velocity = half * pace * np.sin(pace * t)
        self.acceleration = half * pace**2 * np.cos(pace * t)
        cable = np.array([axis.winch.cable_m_per_motor_rad for axis in robot.axes])
        noise = np.random.default_rng(1).normal(0.0, _NOISE_rad, (cycles, len(cable)))
        lengths = np.array([model.kinematics.lengths(model.pose(q)) for q in self.position])
        start = model.kinematics.lengths(model.pose(_middle(control)))
        self.angle_rad = (lengths - start) / cable + noise


def updates(
    control: CableControl | PlainControl, motion: PeriodicMotion, torques: list[FloatArray]
) -> Iterator[Work]:
    """Yield updates endlessly; add the torques (n,) of each to `torques`."""
    n = motion.angle_rad.shape[1]
    feedback, setpoint, torque = AxisFeedback(n), Setpoint(n), np.zeros(n)
    for row in cycle(range(len(motion.position))):
        control.position[:] = motion.position[row]
        control.velocity[:] = motion.velocity[row]
        control.acceleration[:] = motion.acceleration[row]
        feedback.position_rad[:] = motion.angle_rad[row]
        yield partial(control.update, feedback, setpoint, torque)
        torques.append(torque.copy())


def _middle(control: CableControl) -> FloatArray:
    platform = control.model.platform
    middle = 0.5 * np.add(platform.workspace_min_m, platform.workspace_max_m)
    return np.concatenate([middle, np.zeros(control.model.size - len(middle))])


_SMOOTHING, _DAMPING = 0.3, 0.7


class PlainControl:
    """Simple computed-torque control: pose by Gauss-Newton, PD, tensions of minimum norm.

    It assumes eyes as exit points and rigid cables. It learns nothing.
    """

    def __init__(self, robot: Robot, ours: CableControl) -> None:
        """Copy the bandwidth and the platform's pose from `ours`; raises GeometryError."""
        model, platform, axes = ours.model, ours.model.platform, robot.axes
        if any(platform.pulley_radius_m):
            raise GeometryError(f"{robot.path}: the NumPy baseline computes no pulleys")
        self.T, self.bandwidth_rad_s = robot.sync_period_s, ours.gains.bandwidth_rad_s
        self.a = np.array([in_space(point) for point in platform.exit_points_m])
        self.b = np.array([in_space(point) for point in platform.anchor_points_m])
        self.c = np.array([axis.winch.cable_m_per_motor_rad for axis in axes])
        self.rotor = np.array([axis.winch.motor.rotor_inertia_kg_m2 for axis in axes])
        self.torque_Nm = np.broadcast_to(limits_of(robot).torque_Nm, (len(axes),))
        self.low, self.high = model.low_N + model.reserve_N, model.high_N - model.reserve_N
        self.chosen, self.home = list(model.kinematics.directions), model.home_pose
        self.mass_kg, self.inertia = platform.mass_kg, inertia_kg_m2(platform)
        self.up = model.positions - 1
        self.centre = in_space(platform.centre_of_mass_m)
        start = model.pose(_middle(ours))
        self.p, self.Q = start.p.copy(), start.Q.copy()
        self.at_zero = model.kinematics.lengths(start).copy()
        self.theta, self.omega = np.zeros((2, len(axes)))
        self.position = _middle(ours)
        self.velocity, self.acceleration = np.zeros((2, model.size))

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write torques and the axes' set-points, (n,) each."""
        J = self._locate(feedback.position_rad)
        twist = np.linalg.lstsq(J, self.c * self.omega, rcond=None)[0]
        x = np.zeros(6)
        x[:3], x[self.chosen] = self.home.p, self.position
        Q = Rotation.from_rotvec(x[3:]).as_matrix() @ self.home.Q
        rho, J_d = self._cables(x[:3], Q)
        setpoint.position_rad[:] = (rho - self.at_zero) / self.c
        setpoint.velocity_rad_s[:] = J_d @ self.velocity / self.c
        setpoint.acceleration_rad_s2[:] = J_d @ self.acceleration / self.c
        turned = Rotation.from_matrix(Q @ self.Q.T).as_rotvec()
        error = np.concatenate([x[:3] - self.p, turned])[self.chosen]
        w = self.bandwidth_rad_s
        wanted = self.acceleration + 2.0 * _DAMPING * w * (self.velocity - twist) + w**2 * error
        M = np.zeros((6, 6))
        M[:3, :3] = self.mass_kg * np.eye(3)
        M[3:, 3:] = self.Q @ self.inertia @ self.Q.T
        weight = np.zeros(6)
        weight[self.up] = -self.mass_kg * G_m_s2
        weight[3:] = np.cross(self.Q @ self.centre, weight[:3])
        force = M[np.ix_(self.chosen, self.chosen)] @ wanted
        tension_N = self._tensions(-J.T, weight[self.chosen] - force)
        effort = self.rotor * setpoint.acceleration_rad_s2 - self.c * tension_N
        torque_Nm[:] = np.clip(effort, -self.torque_Nm, self.torque_Nm)

    def _cables(self, p: FloatArray, Q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return lengths (n,) and J (n, d), eqs. (3.2), (3.10)."""
        r = self.b @ Q.T
        way = p + r - self.a
        rho = np.linalg.norm(way, axis=1)
        u = way / rho[:, None]
        return np.asarray(rho), np.hstack([u, np.cross(r, u)])[:, self.chosen]

    def _locate(self, theta: FloatArray) -> FloatArray:
        """Smooth the speeds and find the pose by Gauss-Newton; return J (n, d) there."""
        self.omega = self.omega + _SMOOTHING * ((theta - self.theta) / self.T - self.omega)
        self.theta = theta.copy()
        measured = self.at_zero + self.c * theta
        for _ in range(10):
            rho, J = self._cables(self.p, self.Q)
            step = np.zeros(6)
            step[self.chosen] = np.linalg.lstsq(J, measured - rho, rcond=None)[0]
            self.p = self.p + step[:3]
            self.Q = Rotation.from_rotvec(step[3:]).as_matrix() @ self.Q
            if np.linalg.norm(step) < 1e-9:
                break
        return self._cables(self.p, self.Q)[1]

    def _tensions(self, W: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the tensions within bounds nearest to the lower bounds, with W t + wrench = 0.

        It is a least-distance problem, solved by non-negative least squares: Lawson and Hanson
        (1974), 23.4.
        """
        nearest = self.low - np.linalg.pinv(W) @ (W @ self.low + wrench)
        inside = np.concatenate([nearest - self.low, self.high - nearest])
        if inside.min() >= 0.0:
            return np.asarray(nearest)
        N = null_space(W)
        E = np.vstack([np.vstack([N, -N]).T, -inside])
        f = np.zeros(len(E))
        f[-1] = 1.0
        r = E @ nnls(E, f)[0] - f
        if abs(r[-1]) < 1e-9:  # no tensions within bounds carry the wrench
            return np.clip(nearest, self.low, self.high)
        return np.asarray(nearest - N @ (r[:-1] / r[-1]))
