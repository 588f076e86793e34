"""Control of a platform on n cables in d directions: where it is, and the torques that move it.

Tremblay (thesis), sections 2.4 and 3.6, eqs. (3.64) to (3.79), with the velocity loop of each motor
replaced by one of the platform: what it asks for is a wrench that the tensions exert within their
bounds, so that no cable is unwound and the motors never pull against each other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.core.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.errors import GeometryError
from cdpr_rt.jit import bound
from cdpr_rt.robots.kinematics import pose_setpoint
from cdpr_rt.robots.kinematics import pose_tracking as tracking
from cdpr_rt.robots.kinematics.cable_kernel import ANCHOR, CABLE_ROWS, RADIUS, run_cables
from cdpr_rt.robots.kinematics.kinematics import PLANAR_POINT
from cdpr_rt.robots.kinematics.pose import Pose
from cdpr_rt.robots.platform import loop_kernel as loop
from cdpr_rt.robots.platform.body_kernel import body_of
from cdpr_rt.robots.platform.loop_design import (
    DAMPING_RATIO,
    LoopGains,
    OBSERVER_rad_s,
    loop_model_of,
)
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.tension.tension_distribution import TensionDistribution, tension_distribution
from cdpr_rt.robots.tension.tension_split import split
from cdpr_rt.robots.workspace import SHARES

_REGULATOR_SHARE = 0.25
_INTEGRAL_SHARE = 0.3
_DEAD_m = 6e-5
_BREAKING = 20.0
_STUCK_m_s = 0.002
_SETTLING_STEPS = 60
_LIFT_S = 0.05
_SHAPING_S = 0.06


class CableControl:
    """A controller whose set-point is a platform's: position, velocity, acceleration, (d,) each.

    See `PlatformControl`. The tensions that carry the platform are those of the method that its
    file names; the loop's wrench goes on top. The gains are designed from the robot.
    """

    def __init__(
        self,
        model: PlatformModel,
        axes: Sequence[RobotAxis],
        torque_Nm: FloatArray,
        period_s: float,
        compensation: Compensation | None = None,
    ) -> None:
        """Take what the motors may be asked for, `torque_Nm` (n,).

        Raises GeometryError for as many axes as the platform has not cables.
        """
        n, d = model.kinematics.n, model.size
        if len(axes) != n:
            raise GeometryError(f"{len(axes)} axes; allowed: {n}, one for each cable")
        self.model, self._period_s = model, period_s
        self.workspace = model.workspace().prepared()
        """Where targets may lie."""
        self._held, self._interference = model.workspace(0.0).prepared(), model.interference
        self.low_N, self.high_N = self.workspace.low, self.workspace.high
        """Between which the tensions are planned, (n,)."""
        self.least_N = model.low_N
        self.torque_Nm = np.array(torque_Nm, float)
        self._setpoint, self._shaped = np.zeros((3, d)), np.zeros((3, d))
        self.position, self.velocity, self.acceleration = self._setpoint
        self.position[:] = model.home
        self.shaped: FloatArray = self._shaped[0]
        """The set-point's position as the control follows it: shaped, some cycles later, (d,)."""
        self._past = np.zeros((max(1, round(_SHAPING_S / period_s)), 3, d))
        self._place = 0
        self._shape_anew()
        self.tension_N = np.array(self.low_N)
        self.outcome, self.share = 0, 1.0
        self.effort_Nm, self.compensation_Nm = np.zeros(n), np.zeros(n)
        self.residual_m, self._apart_m_s = np.inf, 0.0
        self.estimated = np.array(model.home)
        """Where the platform is, (d,)."""
        self._compensation = compensation
        self._motors = self._motor_rows(axes)
        self.gains = loop_model_of(model, axes, period_s).design()
        span_N = float((model.high_N - model.low_N).min())
        self._settings = _settings(self.gains, span_N, period_s)
        self._distribution = self._chosen_distribution()
        self._bind(n, d)

    def _chosen_distribution(self) -> TensionDistribution | None:
        """Return the tension distribution of the robot's file; None for the split's own."""
        method = self.model.platform.tension_distribution
        if method == "minimum-deviation":
            return None
        scale = self.model.wrench_scale
        return tension_distribution(method, self.low_N, self.high_N, scale)

    def _motor_rows(self, axes: Sequence[RobotAxis]) -> FloatArray:
        platform = self.model.platform
        rows = np.zeros((tracking.MOTOR_ROWS, len(axes)))
        rows[tracking.M_PER_RAD] = [axis.winch.cable_m_per_motor_rad for axis in axes]
        rows[tracking.INERTIA] = [axis.winch.motor.rotor_inertia_kg_m2 for axis in axes]
        if platform.cable_model != "rigid":
            rows[tracking.COMPLIANCE] = [1.0 / axis.winch.cable.stiffness_N for axis in axes]
        if platform.cable_model == "catenary":
            rows[tracking.WEIGHT] = [axis.winch.cable.weight_per_length_N_m for axis in axes]
        rows[tracking.STRETCH] = 1.0
        rows[tracking.TENSION] = self.low_N
        return rows

    def _bind(self, n: int, d: int) -> None:
        """Fix the arrays of the kernels, which are compiled here."""
        model, kinematics, motors = self.model, self.model.kinematics, self._motors
        self._up = np.eye(3)[model.positions - 1]
        self._directions = np.array(kinematics.directions)
        self._home, self._pose = model.home_pose, Pose(np.zeros(3))
        self._pose.array[:] = self._home.array
        self._wanted, self._to = Pose(np.zeros(3)), Pose(np.zeros(3))
        self._room3, self._cables = np.zeros((4, 3)), np.zeros((CABLE_ROWS, n))
        filters = np.zeros(tracking.FILTERS)
        filters[tracking.PERIOD], filters[tracking.OBSERVER] = self._period_s, OBSERVER_rad_s
        filters[tracking.SMOOTHER] = self.gains.smoother_rad_s
        filters[tracking.SMOOTH] = self.gains.smooth
        moves, position = np.zeros((4, 6)), np.zeros(n)
        anchors = kinematics.geometry[ANCHOR:RADIUS]
        turns = kinematics.directions == PLANAR_POINT and bool(np.ptp(anchors, axis=1).any())
        self._track = bound(
            tracking.track_pose, motors, filters, kinematics.geometry, self._up, self._pose.array,
            self._cables, kinematics.solver, moves[3], turns, then=(position,),
        )  # fmt: skip
        self._locate = bound(
            pose_setpoint.locate,
            self._pose.array, self._directions, self._home.array, self._room3, self.estimated,
        )  # fmt: skip
        self._shape = bound(loop.shape, self._past, then=(0, self._setpoint, self._shaped))
        self._refer = bound(
            pose_setpoint.refer, self._shaped, self._directions, self._home.array, self._period_s,
            kinematics.geometry, motors, self._pose.array, self._room3, self._wanted.array,
            np.zeros((CABLE_ROWS, n)), moves[1], moves[2], moves[0],
            then=(position, position, position),
        )  # fmt: skip
        self._state = np.zeros(2 * d + 1)
        self._W, self._wrench, self._force = np.zeros((d, n)), np.zeros(d), np.zeros(d)
        self._carried, space = np.array(self.low_N), np.zeros((n + 1, n))
        scale = model.wrench_scale
        self._correct = bound(
            loop.correct, self._settings, self._state, scale, body_of(model.platform),
            self._directions, self._cables, self._pose.array, moves, np.zeros((7, 7, 7)),
            np.zeros((n, d)), self._W, self._wrench, self._force, then=(1.0, 1.0),
        )  # fmt: skip
        plan, size = np.array([self.low_N, self.high_N]), max(n, 8)
        self._slow = np.array(self.low_N)
        self._split = bound(
            split, self._W, self._wrench, self._force, scale, plan, model.reserve_N,
            self._period_s / (self._period_s + _LIFT_S), self._distribution is not None,
            self._slow, self._carried, self.tension_N, np.zeros(d), np.zeros((3, n)),
            np.zeros((2, n)), np.zeros((d, n + 1)), space, np.zeros((4, size, size)),
        )  # fmt: skip
        self._drive = bound(
            loop.drive, self._settings, motors[tracking.M_PER_RAD], motors[tracking.INERTIA],
            motors[tracking.OMEGA], motors[tracking.TENSION], self.tension_N, self._carried,
            space[1:], self.compensation_Nm, self.torque_Nm, self.effort_Nm,
            then=(0, position, position),
        )  # fmt: skip
        self._seven = np.zeros(7)

    # -- Controller

    def reset(self) -> None:
        """Forget what was integrated."""
        self._state[:] = 0.0
        self._state[self.model.size] = 1.0
        self._slow[:] = self.low_N
        self.share = 1.0
        if self._compensation is not None:
            self._compensation.reset()

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write torques and the axes' set-points for the platform's present set-point."""
        self.observe(feedback)
        self._place = self._shape(self._place, self._setpoint, self._shaped)
        slope = setpoint.acceleration_rad_s2
        self._refer(setpoint.position_rad, setpoint.velocity_rad_s, slope)
        if self._compensation is not None:
            self._compensation.torque(feedback, setpoint, self.compensation_Nm)
        self._correct(self.share, self._apart_m_s)
        if self._distribution is not None:
            self._distribution.solve(self._W, self._wrench, self._carried)
        self.outcome, self.share, null_directions = self._split()
        self._drive(null_directions, slope, torque_Nm)

    # -- where the platform is

    def begin(self, feedback: AxisFeedback) -> None:
        """Take the motors to stand where they are, and the platform where its cables have it."""
        motors = self._motors
        motors[tracking.THETA] = feedback.position_rad
        motors[[tracking.OMEGA, tracking.LAGGING, tracking.CALM]] = 0.0
        motors[tracking.TENSION] = np.maximum(motors[tracking.TENSION], self.low_N)
        self._pose.array[:] = self._home.array
        for _ in range(_SETTLING_STEPS):
            self.observe(feedback)

    def stand_still(self) -> None:
        """Have the set-point stand where the platform is."""
        self.position[:] = self.estimated
        self.velocity[:] = self.acceleration[:] = 0.0
        self._shape_anew()

    def _shape_anew(self) -> None:
        self._past[:] = self._shaped[:] = 0.0
        self._past[:, 0] = self._shaped[0] = self.position

    def observe(self, feedback: AxisFeedback) -> None:
        """Bring the estimate of the platform's pose up to date, by one cycle."""
        self.residual_m, self._apart_m_s = self._track(feedback.position_rad)
        self._locate()

    def lengths_at_home(self, tension_N: FloatArray) -> FloatArray:
        """Return the lengths (n,) without tension of cables that hold `tension_N` (n,) at home."""
        kinematics, motors = self.model.kinematics, np.array(self._motors)
        cables = np.zeros((CABLE_ROWS, kinematics.n))
        run_cables(kinematics.geometry, self._home.array, cables)
        motors[tracking.TENSION], motors[tracking.STRETCH] = tension_N, 1.0
        tracking.stretch(motors, cables, self._up)
        return np.asarray(kinematics.lengths(self._home) / motors[tracking.STRETCH])

    def take_lengths(self, length_m: FloatArray, feedback: AxisFeedback) -> None:
        """Take the cables to have these lengths without tension at the motors' angles, (n,).

        Those that are not a number, since this very cycle has set them, stay.
        """
        at_zero = length_m - self._motors[tracking.M_PER_RAD] * feedback.position_rad
        known = np.isfinite(at_zero)
        self._motors[tracking.AT_ZERO, known] = at_zero[known]

    @property
    def inertia_kg_m2(self) -> FloatArray:
        """Of each motor, (n,)."""
        return np.asarray(self._motors[tracking.INERTIA])

    @property
    def free_lengths_m(self) -> FloatArray:
        """Lengths of the cables without tension, as the motors' angles have them, (n,)."""
        motors = self._motors
        turned = motors[tracking.M_PER_RAD] * motors[tracking.THETA]
        return np.asarray(motors[tracking.AT_ZERO] + turned)

    @property
    def pose(self) -> FloatArray:
        """Where the platform is, (7,): x y z, quaternion w x y z; overwritten."""
        pose_setpoint.write_quaternion(self._pose.array, self._seven)
        return self._seven

    # -- where it can be

    def missing(self) -> str:
        """Return why the last cycle's tensions are not feasible, an empty text where they are."""
        return self._held.feasible(self._wanted) if self.outcome else ""

    def stands(self, position: FloatArray) -> bool:
        """Return whether the platform can be held, and accelerated, at a position (d,)."""
        self._turn_to(position)
        return self.workspace.stands(self._to)

    def feasible(self, position: FloatArray) -> str:
        """Return why the platform cannot stand at a position (d,), an empty text where it can.

        Tensions keep a reserve to their bounds there while it is accelerated in any direction.
        """
        self._turn_to(position)
        return self.workspace.feasible(self._to)

    def feasible_path(self, position: FloatArray, start: FloatArray | None = None) -> str:
        """Return what is in the straight way to a position (d,), an empty text for nothing.

        The way begins at `start` (d,), or where the set-point is.
        """
        share, begin = SHARES[:, None], self.position if start is None else start
        poses = self.model.poses((1.0 - share) * begin + share * np.asarray(position))
        obstacle = self.workspace.first_obstacle(poses)
        if obstacle is None:
            contact = self._interference.first_contact(np.array([begin, position]))
            return "" if contact is None else str(contact)
        there, why = obstacle
        place = ", ".join(f"{x:.3f}" for x in there.p[: self.model.positions])
        return f"at {place} m {why}"

    def _turn_to(self, position: FloatArray) -> None:
        pose_setpoint.place(
            position, self._directions, self._home.array, self._room3, self._to.array
        )


def _settings(gains: LoopGains, span_N: float, period_s: float) -> FloatArray:
    row = np.zeros(loop.SETTINGS)
    row[loop.PERIOD], row[loop.BANDWIDTH] = period_s, gains.bandwidth_rad_s
    row[loop.DAMPING], row[loop.RATIO] = gains.damping_N_s_m, DAMPING_RATIO
    row[loop.INTEGRAL], row[loop.LOOSE] = gains.integral_1_s, gains.loose_N_s_m
    row[loop.ROTOR] = gains.rotor_kg
    row[loop.REGULATOR_N], row[loop.MOST_N] = _REGULATOR_SHARE * span_N, _INTEGRAL_SHARE * span_N
    row[loop.BREAKING], row[loop.STUCK], row[loop.DEAD] = _BREAKING, _STUCK_m_s, _DEAD_m
    return row
