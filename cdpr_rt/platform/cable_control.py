"""Control of a platform on n cables in d directions: its pose, and the torques that move it.

Tremblay (thesis), sections 2.4 and 3.6, eqs. (3.64) to (3.79), but with one velocity loop of the
platform instead of one of each motor. It commands a wrench, which tensions within their bounds
exert. So no cable is unwound, and the motors never pull against each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import BoolArray, FloatArray, read_only
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.errors import GeometryError
from cdpr_rt.jit import bound
from cdpr_rt.model import pose_tracking as tracking
from cdpr_rt.model.cable_kernel import (
    ANCHOR,
    ARC,
    CABLE_ROWS,
    FREE,
    RADIUS,
    run_cables,
    write_tension_rises,
)
from cdpr_rt.model.equilibrium_kernel import KNOWN, MOMENT, MOST_MOMENT, TENSIONS, WEIGHT, known_of
from cdpr_rt.model.free_rotation_kernel import SHAPING_s, rotation_of
from cdpr_rt.model.own_distribution import OwnDistribution, TensionDistribution
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.pose import Pose, place_text
from cdpr_rt.model.pose_search import DISTINCT
from cdpr_rt.model.rigid_body import in_space
from cdpr_rt.model.robot_arrays import LEAST_REDUNDANCY
from cdpr_rt.model.tension_distribution import TensionOutcome, TensionSolver
from cdpr_rt.model.tension_split import OK, split
from cdpr_rt.model.workspace import SHARES, infeasibility_text
from cdpr_rt.platform import loop_kernel as loop
from cdpr_rt.platform.body_kernel import body_of
from cdpr_rt.platform.cell_feedback import CellCheck, CellFeedback, balance_std_N
from cdpr_rt.platform.loop_design import designed_loop
from cdpr_rt.platform.loop_plant import DAMPING_RATIO, LoopGains, OBSERVER_rad_s
from cdpr_rt.platform.motor_learning import MotorLearning
from cdpr_rt.platform.oscillation import LEAST_COUNTS, RESERVE_SHARES, Oscillation
from cdpr_rt.platform.own_controller import (
    Controller,
    OwnController,
    State,
    Target,
)
from cdpr_rt.platform.pull_fit import PullFit

# Feasible positions and ways of a platform: its cables hold it, and it is free of contact.

_MOST_LOOKS = 200  # in the contact check of a way, between two cycles


class PlaceChecks:
    """Checks positions (d,), and ways from the set-point, between two cycles."""

    position: FloatArray
    """The set-point, (d,), kept up to date by the control."""

    def __init__(self, model: PlatformModel) -> None:
        self.model = model
        self.workspace = model.workspace().prepared()
        """The workspace of targets."""
        self._interference = model.interference
        self._directions = np.array(model.kinematics.directions)
        self._home, self._to, self._place_scratch = (
            model.home_pose,
            Pose(np.zeros(3)),
            np.zeros((4, 3)),
        )

    def is_feasible(self, position: FloatArray) -> bool:
        """Return whether the cables can hold and accelerate the platform at a position (d,)."""
        self._turn_to(position)
        return self.workspace.is_feasible(self._to)

    def contact_ahead(self, position: FloatArray) -> int:
        """Return a pair in contact on a short way from the set-point, -1 for none."""
        return self._interference.contact_ahead(self.position, position)

    def contact_at(self, position: FloatArray) -> int:
        """Return a pair in contact at a position (d,), -1 for none."""
        return self._interference.contact_at(self.position, position)

    def contact(self, pair: int) -> str:
        """Return a text that says which pair is in contact."""
        return self._interference.within_clearance(pair)

    def infeasibility(self, position: FloatArray) -> str:
        """Return the reason why the platform cannot be at a position (d,), or "".

        Tensions must keep a reserve from their bounds there while the platform accelerates in any
        direction.
        """
        self._turn_to(position)
        return self.workspace.infeasibility(self._to)

    def way_infeasibility(self, position: FloatArray, start: FloatArray | None = None) -> str:
        """Return as text why the straight line to a position (d,) is infeasible, or "".

        The way begins at `start` (d,), or at the set-point.
        """
        share, begin = SHARES[:, None], self.position if start is None else start
        poses = self.model.poses((1.0 - share) * begin + share * position)
        obstacle = self.workspace.first_infeasible(poses)
        if obstacle is None:
            contact = self._interference.first_contact(np.array([begin, position]), _MOST_LOOKS)
            return "" if contact is None else str(contact)
        there, why = obstacle
        k = self.model.positions
        return f"{place_text(there.p[:k], k)}: {why}"

    def _turn_to(self, position: FloatArray) -> None:
        tracking.pose_of_coordinates(
            position, self._directions, self._home.array, self._place_scratch, self._to.array
        )


# A platform's set-point: as programs write it, and averaged for the control.


class ShapedSetpoint:
    """Position, velocity and acceleration (d,) of a set-point, and their mean, (3, d)."""

    def __init__(self, home: FloatArray, period_s: float) -> None:
        self.rows, self.shaped = np.zeros((2, 3, home.size))
        """Position, velocity and acceleration, to be written; and their mean over `SHAPING_s`."""
        self._past, self._place = np.zeros((max(1, round(SHAPING_s / period_s)), 3, home.size)), 0
        self._shape = bound(loop.shape, self._past, then=(0, self.rows, self.shaped))
        self.stand_at(home)

    def stand_at(self, position: FloatArray) -> None:
        """Set the set-point at rest at a position (d,), with no earlier motion."""
        self.rows[:] = self._past[:] = self.shaped[:] = 0.0
        self.rows[0] = self.shaped[0] = self._past[:, 0] = position

    def shape(self) -> None:
        """Update the mean by one cycle."""
        self._place = self._shape(self._place, self.rows, self.shaped)


# Parameters of the platform controller, from the robot's file.

_REGULATOR_SHARE = 0.25
_INTEGRAL_SHARE = 0.3
_DEADBAND_m = 6e-5
_STICTION_GAIN = 20.0
_STICTION_m_s = 0.002
_SPATIAL, _YAW = 3, 5


def motor_rows(model: PlatformModel, axes: Sequence[RobotAxis]) -> FloatArray:
    """Return the constants of motors and cables, (MOTOR_ROWS, n); other entries are 0."""
    platform = model.platform
    rows = np.zeros((tracking.MOTOR_ROWS, len(axes)))
    rows[tracking.M_PER_RAD] = [axis.winch.cable_m_per_motor_rad for axis in axes]
    rows[tracking.INERTIA] = [axis.winch.motor.rotor_inertia_kg_m2 for axis in axes]
    if platform.cable_model != "rigid":
        rows[tracking.COMPLIANCE] = [1.0 / axis.winch.cable.stiffness_N for axis in axes]
    rows[tracking.WEIGHT] = platform.cable_weights_N_m
    rows[tracking.STRETCH] = 1.0
    return rows


def tracking_filters(gains: LoopGains, period_s: float) -> FloatArray:
    """Return the settings of the filters of the pose estimate, (FILTERS,)."""
    row = np.zeros(tracking.FILTERS)
    row[tracking.PERIOD], row[tracking.OBSERVER] = period_s, OBSERVER_rad_s
    row[tracking.SMOOTHER], row[tracking.LOWPASS_SHARE] = gains.smoother_rad_s, gains.smooth
    return row


def loop_settings(gains: LoopGains, span_N: float, period_s: float) -> FloatArray:
    """Return the settings of the loop's kernels for tensions of this span, (SETTINGS,)."""
    row = np.zeros(loop.SETTINGS)
    row[loop.PERIOD], row[loop.BANDWIDTH] = period_s, gains.bandwidth_rad_s
    row[loop.DAMPING], row[loop.RATIO] = gains.damping_N_s_m, DAMPING_RATIO
    row[loop.INTEGRAL], row[loop.NULL_DAMPING] = gains.integral_1_s, gains.null_damping_N_s_m
    row[loop.ROTOR] = gains.rotor_kg
    row[loop.REGULATOR_N], row[loop.MOST_N] = _REGULATOR_SHARE * span_N, _INTEGRAL_SHARE * span_N
    row[loop.STICTION_GAIN], row[loop.STICTION_SPEED], row[loop.DEADBAND] = (
        _STICTION_GAIN,
        _STICTION_m_s,
        _DEADBAND_m,
    )
    return row


def slides_on_stand(model: PlatformModel) -> FloatArray:
    """Return the lengthening (n, k) of each cable if the platform slides on its stand.

    It is in m per m of motion at the anchor points, along the horizontal directions and, in space,
    about the vertical axis if that is controlled.
    """
    horizontal = list(range(model.positions - 1))
    if model.positions == _SPATIAL:
        horizontal += [i for i, k in enumerate(model.kinematics.directions) if k == _YAW]
    J = -model.kinematics.wrench_matrix(model.home_pose).T
    return np.asarray((J / model.wrench_scale)[:, horizontal])


def oscillation(
    model: PlatformModel,
    axes: Sequence[RobotAxis],
    motors: FloatArray,
    count_rad: FloatArray,
    velocity: FloatArray,
    period_s: float,
) -> Oscillation:
    """Return the detector of oscillations that the loop causes; `motors` are rows as above.

    `count_rad` (n,) is the resolution of their encoders, `velocity` (d,) the set-point's.
    """
    m_per_rad, theta_rad = motors[tracking.M_PER_RAD], motors[tracking.THETA]
    stiffness_N_m = [a.winch.cable.stiffness_N for a in axes] / model.kinematics.lengths(
        model.home_pose
    )
    threshold_m = np.maximum(
        np.outer(RESERVE_SHARES, model.reserve_N / stiffness_N_m),
        LEAST_COUNTS * count_rad * np.abs(m_per_rad),
    )
    names = [axis.name for axis in axes]
    return Oscillation(names, threshold_m, m_per_rad, theta_rad, velocity, period_s)


def cell_check(model: PlatformModel, axes: Sequence[RobotAxis], period_s: float) -> CellCheck:
    """Return the check of the load cells of these axes, one for each cable."""
    rated_N = np.array(
        [a.winch.motor.rated_torque_Nm / abs(a.winch.cable_m_per_motor_rad) for a in axes]
    )
    weight_N = float(np.abs(model.weight()[: model.positions]).max())
    std_N = balance_std_N(weight_N, model.positions - 1, model.wrench_scale)
    return CellCheck([axis.name for axis in axes], rated_N, std_N, model.wrench_scale, period_s)


_ON_STAND = 0.1  # share of the integral part
_NO_TILT = "the inclinometer gives no valid reading: the pose is less accurate"
_WRONG_TILT = (
    "check mounting_rad, angles, scale_rad and zero_rad of the inclinometer, and centre_of_mass_m "
    "of the platform; until then the pose is less accurate"
)
_LEVEL = np.cos(np.radians(5.0))
"""Cosine of the largest tilt that an inclinometer may show on the stand."""
_SETTLING_STEPS, _LIFT_S, _COMES_AFTER_S = 60, 0.05, 0.1


class CableControl(PlaceChecks):
    """A controller of a platform's set-point: position, velocity, acceleration, (d,) each.

    As a `Controller` it also writes the axes' set-points, so that other controllers can continue
    from them. The method in the robot's file determines the tensions that carry the platform;
    tensions for the loop's wrench are added. The gains are designed for the robot. If `learns` is
    set, the control learns friction and cogging of motors without `compensation`.
    """

    def __init__(
        self,
        model: PlatformModel,
        axes: Sequence[RobotAxis],
        torque_Nm: FloatArray,
        period_s: float,
        compensation: Compensation | None = None,
        *,
        learns: bool = True,
    ) -> None:
        """Take the highest torques of the motors, `torque_Nm` (n,).

        Raises GeometryError if the number of axes is not that of the cables.
        """
        n = model.kinematics.n
        if len(axes) != n:
            raise GeometryError(f"{len(axes)} axes; allowed: {n}, one for each cable")
        super().__init__(model)
        self._period_s, self._held = period_s, model.workspace(0.0).prepared()
        self.low_N, self.high_N = self.workspace.low, self.workspace.high
        """Bounds of planned tensions, (n,)."""
        self.least_N = model.low_N
        self.torque_Nm = np.array(torque_Nm, float)
        self.setpoint = ShapedSetpoint(model.home, period_s)
        self.position, self.velocity, self.acceleration = self.setpoint.rows
        self.shaped: FloatArray = self.setpoint.shaped[0]
        """Position (d,) that the control follows: the averaged set-point, some cycles late."""
        self.tension_N = np.array(self.low_N)
        self.outcome, self.share, self._limited = 0, 1.0, False
        self.effort_Nm, self.compensation_Nm, self.motor_loss_Nm = np.zeros((3, n))
        self.cogging_Nm = np.zeros(n) if compensation is None else compensation.cogging_Nm
        self.residual_m, self.suspect, self._rate_inconsistency_m_s = np.inf, -1, 0.0
        """Largest normalised residual of the lengths, m, and its cable, -1 if the cable is not
        known."""
        self.jump_m, self.jumped = 0.0, -1
        """The largest sudden change of a residual within some 0.2 s, and its cable."""
        self.estimated = np.array(model.home)
        """Estimated position of the platform, (d,)."""
        self._compensation = compensation
        self._design(axes)
        known = np.zeros(n, np.bool_) if compensation is None else compensation.available
        self.learning: MotorLearning | None = None
        """Learning of motors that were not identified."""
        if learns and not known.all():
            scale, reserve_N = model.wrench_scale, model.reserve_N
            self.learning = MotorLearning(axes, known, scale, reserve_N, period_s)
        self.pull_fit = PullFit(
            axes, known, self.lengths_at_home, self.learning, slides_on_stand(model)
        )
        self._cells: CellFeedback | None = None
        self._check = cell_check(model, axes, period_s)
        self._moves = moves = np.zeros((4, 6))
        self._own: OwnController | None = None
        self._own_distribution: OwnDistribution | None = None
        self._bind_pose(moves)
        self._bind_force(moves)
        self._bind_tensions()
        self._oscillation = oscillation(
            model, axes, self._motors, self.pull_fit.count_rad, self.velocity, period_s
        )

    def _design(self, axes: Sequence[RobotAxis]) -> None:
        """Design the loop for the platform and its motors."""
        model, period_s = self.model, self._period_s
        self._motors = motor_rows(model, axes)
        self._motors[tracking.TENSION] = self.low_N
        self.gains = designed_loop(model, axes, period_s).gains
        span_N = float((model.high_N - model.low_N).min())
        self._settings = loop_settings(self.gains, span_N, period_s)
        self._on_stand = False
        self._integral_N = float(self._settings[loop.MOST_N])

    def _bind_pose(self, moves: FloatArray) -> None:
        """Bind the arrays of the kernels that estimate and follow the pose; these write `moves`."""
        model, kinematics, motors = self.model, self.model.kinematics, self._motors
        n, self._up = kinematics.n, np.eye(3)[model.positions - 1]
        self._pose = Pose(np.zeros(3))
        self._pose.array[:] = self._home.array
        self._wanted = Pose(np.zeros(3))
        self._scratch, (found, wanted) = np.zeros((4, 3)), np.zeros((2, CABLE_ROWS, n))
        self._found, self._wanted_at = found, wanted
        follows = self.gains.follows_pose
        self._planned_at = (found, self._pose.array) if follows else (wanted, self._wanted.array)
        filters = tracking_filters(self.gains, self._period_s)
        self._swing, self._seven, position = np.zeros(tracking.SWING), np.zeros(7), np.zeros(n)
        arms = kinematics.geometry[ANCHOR:RADIUS].T - in_space(model.platform.centre_of_mass_m)
        reach_m = float(np.linalg.norm(arms, axis=1).max())
        self._hanging = tracking.Hanging(
            known_of(model.platform, model.reserve_N), np.zeros((TENSIONS, n)),
            np.zeros((6 + n, 6 + n)), np.zeros((8, 6 + n)), np.array([tracking.LAG_S, reach_m]),
            self._home.array, np.zeros((4, 3)), np.zeros(4), np.zeros(n), np.zeros(n, np.bool_),
            np.zeros(4),
        )  # fmt: skip
        self._hanging.tensions[0] = self.low_N

        def track_with(hanging: tracking.Hanging) -> Callable[..., Any]:
            return bound(
                tracking.track_pose, motors, filters, kinematics.geometry, self._up,
                self._pose.array, found, kinematics.solver, moves[loop.TWIST],
                rotation_of(model.platform), self._swing, freedom, hanging, then=(position,),
            )  # fmt: skip

        freedom = tracking.TURNS if kinematics.turns_freely else tracking.FIXED
        freedom = tracking.HANGS if kinematics.hangs_freely else freedom
        self._track_with, self._track = track_with, track_with(self._hanging)
        self._write_coordinates = bound(
            tracking.coordinates_of_pose,
            self._pose.array, self._directions, self._home.array, self._scratch, self.estimated,
        )  # fmt: skip
        self._motor_references = bound(
            tracking.motor_references, self.setpoint.shaped, self._directions,
            self._home.array, self._period_s, kinematics.geometry, motors, self._pose.array,
            self._scratch, self._wanted.array, wanted, moves[loop.WANTED_TWIST],
            moves[loop.WANTED_ACCELERATION], moves[loop.POSE_ERROR], then=(position,) * 3,
        )  # fmt: skip

    def _bind_force(self, moves: FloatArray) -> None:
        """Bind the arrays of the kernels that compute the platform's force from `moves` (4, 6)."""
        model, motors = self.model, self._motors
        n, d = model.kinematics.n, model.size
        self._state = np.zeros(3 * d + 1)
        self._W, self._wrench, self._force = np.zeros((d, n)), np.zeros(d), np.zeros(d)
        self._rise_N, self._length_m, self._rate_m_s, self._rotors_Nm = np.zeros((4, n))
        scratch, J = np.zeros((7, 7, 7)), np.zeros((n, d))
        self._correct = bound(
            loop.correct, self._settings, self._state, model.wrench_scale, body_of(model.platform),
            self._directions, model.kinematics.geometry, *self._planned_at, moves, scratch,
            J, self._W, self._rise_N, self._wrench, self._friction(), self._force, then=(1.0, 1.0),
        )  # fmt: skip
        if self.learning is not None:
            self.learning.bind(
                motors[tracking.THETA], motors[tracking.OMEGA], J, scratch[loop.MASS],
                scratch[loop.TWIST_ERROR][:d], self._force, self.compensation_Nm,
            )  # fmt: skip

    def _friction(self) -> loop.WinchFriction:
        """Return the compensated friction of the winches, as arrays that other parts keep up to
        date.
        """
        known, learning = self._compensation, self.learning
        n = self.model.kinematics.n
        nothing = np.zeros((n, 2))[
            :, 0
        ]  # same memory layout as the real arrays, so that one compilation serves both
        return loop.WinchFriction(
            np.zeros(n) if known is None else known.friction_Nm,
            nothing if known is None else known.faded_in,
            nothing if learning is None else learning.friction_Nm,
            1.0 / np.abs(self._motors[tracking.M_PER_RAD]),
        )

    def _bind_tensions(self) -> None:
        """Bind the arrays of the kernels that convert the force to tensions and torques."""
        model, motors, scale = self.model, self._motors, self.model.wrench_scale
        n, d, method = model.kinematics.n, model.size, model.platform.tension_method
        self._distribution: TensionSolver | None = None  # None: `split` computes the tensions
        if method != "minimum-deviation":
            self._distribution = TensionSolver(method, self.low_N, self.high_N, scale)
        plan, size = np.array([self.low_N, self.high_N]), max(n, 8)
        self._slow_N, self._feedforward_N = plan[0].copy(), plan[0].copy()
        space, position = np.zeros((n + 1, n)), np.zeros(n)
        scratch = (
            np.zeros(d), np.zeros((3, n)), np.zeros((2, n)), np.zeros((d, n + 1)), space,
            np.zeros((4, size, size)),
        )  # fmt: skip
        self._split, self._split_given = (
            bound(
                split, self._W, self._wrench, self._force, scale, plan, model.reserve_N,
                self._period_s / (self._period_s + _LIFT_S), given, self._slow_N,
                self._feedforward_N, self.tension_N, *scratch,
            )
            for given in (self._distribution is not None, True)
        )  # fmt: skip
        self._drive = bound(
            loop.drive, self._settings, motors[tracking.M_PER_RAD], motors[tracking.INERTIA],
            motors[tracking.OMEGA], motors[tracking.TENSION], self.tension_N, self._feedforward_N,
            self._rise_N, space[1:], self.compensation_Nm, self.torque_Nm, self.effort_Nm,
            then=(0, position, position),
        )  # fmt: skip

    # -- Controller

    def use_own(
        self, controller: Controller | None, distribution: TensionDistribution | None
    ) -> None:
        """Let the user's code choose the tensions while the platform is off its stand."""
        if distribution is not None:
            self._own_distribution = OwnDistribution(
                distribution, self.low_N, self.high_N, self.model.wrench_scale, self._period_s
            )
        if controller is not None:
            self._use(controller)

    def _use(self, controller: Controller) -> None:
        model, d, n = self.model, self.model.size, self.model.kinematics.n
        method, planned = model.platform.tension_method, self.low_N
        solver = TensionSolver(
            method, planned, self.high_N, model.wrench_scale,
            planned if method == "minimum-deviation" else None,
        )  # fmt: skip
        wrench, tension_N, self._velocity = np.zeros(d), np.zeros(n), np.zeros(d)
        motors, m_per_rad = self._motors, self._motors[tracking.M_PER_RAD]

        def distribute(force: FloatArray) -> FloatArray:
            given = np.asarray(force)
            if given.shape != (d,) or given.dtype.kind not in "iuf" or not np.isfinite(given.sum()):
                raise ValueError(f"distribute: force {given}; give {d} finite numbers, N and Nm")
            np.subtract(self._wrench, given, out=wrench)
            carried = solver.solve(self._W, wrench, tension_N) <= TensionOutcome.SUBSTITUTED
            if self._own_distribution is not None and carried:
                self._own_distribution.solve(self._W, wrench, last_N, tension_N)
            return tension_N.copy()  # two calls in a cycle may be compared

        def torques(tension_N: FloatArray) -> FloatArray:
            return np.asarray(self._rotors_Nm - m_per_rad * (tension_N + self._rise_N))

        def tensions_of(torque_Nm: FloatArray) -> FloatArray:
            return np.asarray((self._rotors_Nm - torque_Nm) / m_per_rad - self._rise_N)

        last_N = np.array(self.tension_N)
        state = State(
            read_only(self.estimated), read_only(self._velocity), read_only(self._W),
            read_only(self._wrench), read_only(motors[tracking.LENGTH]),
            read_only(motors[tracking.RATE]), read_only(last_N), read_only(model.low_N),
            read_only(model.high_N), self._period_s, distribute, torques,
        )  # fmt: skip
        target = Target(*map(read_only, (*self.setpoint.shaped, self._length_m, self._rate_m_s)))
        self._own = OwnController(controller, state, target, last_N, tensions_of)

    def _show_cables(self, setpoint: Setpoint) -> None:
        """Write what a user's controller reads about the cables' set-points."""
        np.add(self._wanted_at[FREE], self._wanted_at[ARC], out=self._length_m)
        m_per_rad, inertia = self._motors[tracking.M_PER_RAD], self._motors[tracking.INERTIA]
        np.multiply(m_per_rad, setpoint.velocity_rad_s, out=self._rate_m_s)
        np.multiply(inertia, setpoint.acceleration_rad_s2, out=self._rotors_Nm)

    def stand_in(self) -> None:
        """Control the platform without the user's code until the next `begin`."""
        for own in (self._own, self._own_distribution):
            if own is not None:
                own.stand_in()

    def reset(self) -> None:
        """Reset the integral part."""
        if self._own is not None:
            self._own.restart(self.tension_N)
        if self._own_distribution is not None:
            self._own_distribution.restart()
        self._state[:] = 0.0
        self._state[self.model.size] = 1.0
        self._slow_N[:] = self.low_N
        self.share = 1.0
        if self._compensation is not None:
            self._compensation.reset()
        if self.learning is not None:
            self.learning.restart()
        if self._cells is not None:
            self._cells.restart(self.tension_N)

    @property
    def learnt_Nm(self) -> FloatArray | None:
        """Learnt friction and amplitude of the cogging of each motor, (2, n)."""
        return None if self.learning is None else self.learning.learnt_Nm

    def forget_motors(self) -> None:
        """Discard what was learnt about the motors, for example after a change of encoder
        origins.
        """
        if self.learning is not None:
            self.learning.forget()

    def measure_tensions(
        self, tension_N: FloatArray, measured: BoolArray, upward: FloatArray
    ) -> None:
        """Correct the cable tensions by valid readings (n,), which other parts keep up to date.

        Without a valid reading, the control relies on the motor's torque constant and known losses.
        `upward` (4,) is the reading of an inclinometer, for a platform that hangs freely.
        """
        self._hanging = self._hanging._replace(
            measured_N=tension_N, measured=measured, upward=upward
        )
        self._track = self._track_with(self._hanging)
        learnt_Nm = np.zeros(len(tension_N)) if self.learning is None else self.learning.torque_Nm
        self._cells = CellFeedback(
            tension_N, measured, self._motors[tracking.M_PER_RAD], self.model.reserve_N,
            self._period_s, self._check, self._W, self._wrench, learnt_Nm, self._rise_N,
        )  # fmt: skip

    def notices(self) -> list[str]:
        """Return notices about wrong sensors and an oscillating loop, until `clear_notices`."""
        troubles = (self._check.trouble, self._oscillation.trouble, self._tilt_trouble())
        return [text for text in troubles if text]

    def _tilt_trouble(self) -> str:
        """Return why the inclinometer is of no use, "" if it is of use or missing."""
        hanging = self._hanging
        if hanging.upward[0] <= 0.0:
            return _NO_TILT * bool(hanging.upward[0] < 0.0)
        most_Nm = MOST_MOMENT * hanging.known[WEIGHT] * hanging.settings[tracking.REACH_m]
        if np.abs(hanging.known[MOMENT:KNOWN]).max() >= most_Nm:
            return f"the inclinometer contradicts lengths, tensions and weight: {_WRONG_TILT}"
        if self._on_stand and self._home.Q[2] @ hanging.upward[1:] < _LEVEL:
            return f"the inclinometer shows another orientation than that at home: {_WRONG_TILT}"
        return ""

    def clear_notices(self) -> None:
        """Clear the notices about load cells and loop."""
        self._check.clear()
        self._oscillation.clear()

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write torques and the axes' set-points for the platform's present set-point."""
        self.observe(feedback)
        self.setpoint.shape()
        slope = setpoint.acceleration_rad_s2
        self._motor_references(setpoint.position_rad, setpoint.velocity_rad_s, slope)
        if self.learning is not None:
            self.learning.learn(self._was_exerted())
        if self._on_stand and self.velocity.any():
            self._rest(on_stand=False)
        self._correct(self.share, self._rate_inconsistency_m_s)
        self._compensate(feedback, setpoint)
        carried = True
        if self._distribution is not None:
            outcome = self._distribution.solve(self._W, self._wrench, self._feedforward_N)
            carried = outcome <= TensionOutcome.SUBSTITUTED
        self.outcome, self.share, null_directions = self._split()
        if self._own_distribution is not None and self._distributes_own(carried):
            self._slow_N[:] = self._feedforward_N
            self.outcome, self.share, null_directions = self._split_given()
        if self._own is not None and self._on_stand:
            self._own.restart(self.tension_N)
        elif self._own is not None:
            self._moves[loop.TWIST].take(self._directions, out=self._velocity, mode="clip")
            self._show_cables(setpoint)
            if self._own.write(self.tension_N):
                self._feedforward_N[:] = self.tension_N
                null_directions *= not self._own.returns_torques
        self._limited = self._drive(null_directions, slope, torque_Nm)
        self._oscillation.update(setpoint.position_rad)

    def _distributes_own(self, carried: bool) -> bool:
        """Return whether the user's distribution has written the tensions that carry the platform.

        It is called when the platform is off the stand, the built-in tensions have `carried` it,
        and no user-written controller replaces them.
        """
        own = self._own_distribution
        assert own is not None
        replaced = self._own is not None and self._own.in_use
        if self._on_stand or not carried or self.outcome != OK or replaced:
            own.restart()
            return False
        return own.write(self._W, self._wrench, self._feedforward_N)

    def _was_exerted(self) -> bool:
        """Return whether the cables exerted the whole force of the last cycle."""
        plausible = self._rate_inconsistency_m_s <= loop.PLAUSIBLE_m_s
        if self._own is not None and self._own.in_use:
            return False
        return plausible and self.share >= 1.0 and self.outcome == OK and not self._limited

    def _compensate(self, feedback: AxisFeedback, setpoint: Setpoint) -> None:
        """Write the torques that compensate known, learnt and measured losses of the motors."""
        learning, cells, torque = self.learning, self._cells, self.compensation_Nm
        if self._compensation is not None:
            self._compensation.torque(feedback, setpoint, self.motor_loss_Nm)
        torque[:] = self.motor_loss_Nm
        if learning is not None:
            learning.write(setpoint.velocity_rad_s)
            torque += learning.torque_Nm
        if cells is not None:
            cells.update(self.tension_N)
            torque += cells.torque_Nm

    def clear_compensation(self) -> None:
        """Set the reported compensation to zero while a program drives the winches directly."""
        self.compensation_Nm[:] = self.motor_loss_Nm[:] = self.cogging_Nm[:] = 0.0

    # -- pose of the platform

    def begin(self, feedback: AxisFeedback, tension_N: FloatArray | None = None) -> None:
        """Assume that the motors are at rest, and the platform at the pose given by its cables.

        The cables have the tensions `tension_N` (n,) at their winches. These may be far from
        planned tensions.
        """
        for own in (self._own, self._own_distribution):
            if own is not None:
                own.revive()
        motors = self._motors
        motors[tracking.THETA] = feedback.position_rad
        motors[[tracking.OMEGA, tracking.LOWPASSED_ONCE, tracking.LOWPASSED]] = 0.0
        planned_N = np.maximum(motors[tracking.TENSION], self.low_N)
        motors[tracking.TENSION] = planned_N
        self._pose.array[:] = self._home.array
        self._hanging.settings[tracking.LAG] = 0.0
        for _ in range(_SETTLING_STEPS):
            if tension_N is not None:
                motors[tracking.TENSION] = tension_N - self._rises_N(self._found)
            self.observe(feedback)
        self._hanging.settings[tracking.LAG] = tracking.LAG_S
        self._swing[:] = 0.0
        motors[tracking.TENSION] = planned_N
        motors[tracking.SETTLED] = np.nan
        self._rest(on_stand=False)  # the last set-point belonged to the previous pose

    def stand_still(self, *, on_stand: bool = False) -> None:
        """Put the set-point at rest at the platform's pose; the platform may be `on_stand`.

        On the stand, the integral part is bounded until the set-point moves. Otherwise it would
        press the platform against the stand, and the first motion off the stand would start against
        this force. Tensions that are planned for the set-point do not hold the platform at another
        pose. With such tensions, if this method is called in every cycle, the set-point follows the
        platform slowly.
        """
        again = self._on_stand and on_stand and not self.gains.follows_pose
        share = self._period_s / (self._period_s + _COMES_AFTER_S) if again else 1.0
        self._rest(on_stand=on_stand)
        self.setpoint.stand_at(self.position + share * (self.estimated - self.position))

    def _rest(self, *, on_stand: bool) -> None:
        self._on_stand = on_stand
        self._settings[loop.MOST_N] = self._integral_N * (_ON_STAND if on_stand else 1.0)

    def observe(self, feedback: AxisFeedback) -> None:
        """Update the estimate of the platform's pose by one cycle."""
        found = self._track(feedback.position_rad)
        self.residual_m, self.suspect, self._rate_inconsistency_m_s, self.jump_m, self.jumped = (
            found
        )
        self._write_coordinates()

    def suspects(self, jump: bool = False) -> list[int]:
        """Return the cables whose length may be wrong, the most likely first.

        These are the cables whose normalised residual |r_i| / sqrt(p_ii) is near the largest. p_ii
        is the diagonal of P = I - J J^+. The list is empty if the lengths cannot contradict each
        other. With `jump`, it has the cables with nearly the largest sudden change of the residual.
        """
        J = self._found[list(self.model.kinematics.directions)].T
        if not np.isfinite(J).all():
            return []
        motors = self._motors
        redundancy = 1.0 - np.einsum("ij,ji->i", J, np.linalg.pinv(J))
        off_m = self._found[FREE] + self._found[ARC] - motors[tracking.LENGTH]
        seen = redundancy > LEAST_REDUNDANCY
        residual_m = np.where(seen, np.abs(off_m) / np.sqrt(np.where(seen, redundancy, 1.0)), 0.0)
        if jump:
            residual_m = np.abs(motors[tracking.RESIDUAL] - motors[tracking.SETTLED])
        near = np.flatnonzero(residual_m > DISTINCT * residual_m.max())
        return sorted(near.tolist(), key=lambda i: -residual_m[i])

    def lengths_at_home(self, tension_N: FloatArray) -> FloatArray:
        """Return the unstretched lengths (n,) at home for `tension_N` (n,) at the winches."""
        kinematics, motors = self.model.kinematics, np.array(self._motors)
        cables = np.zeros((CABLE_ROWS, kinematics.n))
        run_cables(kinematics.geometry, self._home.array, cables)
        motors[tracking.TENSION] = tension_N - self._rises_N(cables)
        motors[tracking.STRETCH] = 1.0
        tracking.stretch(motors, cables, self._up)
        return np.asarray(kinematics.lengths(self._home) / motors[tracking.STRETCH])

    def _rises_N(self, cables: FloatArray) -> FloatArray:
        """Return the excess (n,) of tensions at the winches over those in the middle; reused."""
        write_tension_rises(self.model.kinematics.geometry, cables, self._rise_N)
        return self._rise_N

    def take_lengths(self, length_m: FloatArray, feedback: AxisFeedback) -> None:
        """Set the unstretched lengths (n,) of the cables at the present motor angles.

        A cable whose entry is nan keeps its present length.
        """
        at_zero = length_m - self._motors[tracking.M_PER_RAD] * feedback.position_rad
        known = np.isfinite(at_zero)
        self._motors[tracking.AT_ZERO, known] = at_zero[known]
        self._motors[tracking.SETTLED] = np.nan

    @property
    def inertia_kg_m2(self) -> FloatArray:
        """Inertia of each motor, (n,)."""
        return np.asarray(self._motors[tracking.INERTIA])

    @property
    def free_lengths_m(self) -> FloatArray:
        """Unstretched lengths of the cables from the motor angles, (n,)."""
        turned = self._motors[tracking.M_PER_RAD] * self._motors[tracking.THETA]
        return np.asarray(self._motors[tracking.AT_ZERO] + turned)

    @property
    def pose(self) -> FloatArray:
        """Pose of the platform, (7,): x y z, quaternion w x y z; overwritten."""
        tracking.write_quaternion(self._pose.array, self._seven)
        return self._seven

    @property
    def swing_rad(self) -> float:
        """Amplitude of the swing of a platform that turns freely; 0 for others."""
        return float(self._swing[tracking.AMPLITUDE])

    @property
    def swing_m(self) -> float:
        """Amplitude of that swing at an anchor point; 0 for other platforms."""
        return float(self._swing[tracking.AMPLITUDE_m])

    # -- feasibility

    def tension_infeasibility(self) -> str:
        """Return the reason why the last cycle's tensions are infeasible, or ""."""
        if not self.outcome:
            return ""
        return self._held.infeasibility(self._wanted) or self._infeasibility_in_motion()

    def _infeasibility_in_motion(self) -> str:
        """Return the cable that limits the wanted motion, if the platform could stand still
        here.
        """
        W, t, low_N, high_N = self._W, self._feedforward_N, self.low_N, self.high_N
        needed_N = t - np.linalg.pinv(W) @ (W @ t + self._wrench)
        margin_N = float(np.minimum(needed_N - low_N, high_N - needed_N).min())
        return f"for this motion, {infeasibility_text(margin_N, needed_N, low_N, high_N)}"
