"""Control of a platform on n cables in d directions: where it is, and the torques that move it.

Tremblay (thesis), sections 2.4 and 3.6, eqs. (3.64) to (3.79), with the velocity loop of each motor
replaced by one of the platform: what it asks for is a wrench that the tensions exert within their
bounds, so that no cable is unwound and the motors never pull against each other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.errors import GeometryError
from cdpr_rt.jit import bound
from cdpr_rt.robots.free_rotation import rotation_of
from cdpr_rt.robots.kinematics import pose_setpoint
from cdpr_rt.robots.kinematics import pose_tracking as tracking
from cdpr_rt.robots.kinematics.cable_kernel import CABLE_ROWS, run_cables, write_tension_rises
from cdpr_rt.robots.kinematics.pose import Pose
from cdpr_rt.robots.platform import loop_kernel as loop
from cdpr_rt.robots.platform.body_kernel import body_of
from cdpr_rt.robots.platform.cell_feedback import CellFeedback
from cdpr_rt.robots.platform.control_rows import (
    cell_check,
    loop_settings,
    motor_rows,
    oscillation,
    slides_on_stand,
    tracking_filters,
)
from cdpr_rt.robots.platform.design.designed_loop import designed_loop
from cdpr_rt.robots.platform.learning.motor_learning import MotorLearning
from cdpr_rt.robots.platform.learning.pull_fit import PullFit
from cdpr_rt.robots.platform.place_checks import PlaceChecks
from cdpr_rt.robots.platform.shaped_setpoint import ShapedSetpoint
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.tension.tension_distribution import TensionSolver, tension_distribution
from cdpr_rt.robots.tension.tension_split import OK, split
from cdpr_rt.robots.workspace import infeasibility_text

_ON_STAND = 0.1  # of the integral part
_SETTLING_STEPS, _LIFT_S, _COMES_AFTER_S = 60, 0.05, 0.1


class CableControl(PlaceChecks):
    """A controller whose set-point is a platform's: position, velocity, acceleration, (d,) each.

    See `PlatformControl`. The tensions that carry the platform are those of the method that its
    file names; the loop's wrench goes on top. The gains are designed from the robot. Of motors
    that `compensation` does not know it learns friction and cogging, where it `learns`.
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
        """Take what the motors may be asked for, `torque_Nm` (n,).

        Raises GeometryError for as many axes as the platform has not cables.
        """
        n = model.kinematics.n
        if len(axes) != n:
            raise GeometryError(f"{len(axes)} axes; allowed: {n}, one for each cable")
        super().__init__(model)
        self._period_s, self._held = period_s, model.workspace(0.0).prepared()
        self.low_N, self.high_N = self.workspace.low, self.workspace.high
        """Between which the tensions are planned, (n,)."""
        self.least_N = model.low_N
        self.torque_Nm = np.array(torque_Nm, float)
        self.setpoint = ShapedSetpoint(model.home, period_s)
        self.position, self.velocity, self.acceleration = self.setpoint.rows
        self.shaped: FloatArray = self.setpoint.shaped[0]
        """The set-point's position as the control follows it: shaped, some cycles later, (d,)."""
        self.tension_N = np.array(self.low_N)
        self.outcome, self.share, self._limited = 0, 1.0, False
        self.effort_Nm, self.compensation_Nm, self.motor_loss_Nm = np.zeros((3, n))
        self.cogging_Nm = np.zeros(n) if compensation is None else compensation.cogging_Nm
        self.residual_m, self.suspect, self._rate_inconsistency_m_s = np.inf, -1, 0.0
        self.estimated = np.array(model.home)
        """Where the platform is, (d,)."""
        self._compensation = compensation
        self._design(axes)
        known = np.zeros(n, np.bool_) if compensation is None else compensation.available
        self.learning: MotorLearning | None = None
        """What is learnt of the motors that nothing is known of."""
        if learns and not known.all():
            scale, reserve_N = model.wrench_scale, model.reserve_N
            self.learning = MotorLearning(axes, known, scale, reserve_N, period_s)
        self.pull_fit = PullFit(
            axes, known, self.lengths_at_home, self.learning, slides_on_stand(model)
        )
        self._cells: CellFeedback | None = None
        self._check = cell_check(model, axes, period_s)
        moves = np.zeros((4, 6))
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
        """Fix the arrays of the kernels that find the pose and follow it, which write `moves`."""
        model, kinematics, motors = self.model, self.model.kinematics, self._motors
        n, self._up = kinematics.n, np.eye(3)[model.positions - 1]
        self._pose = Pose(np.zeros(3))
        self._pose.array[:] = self._home.array
        self._wanted = Pose(np.zeros(3))
        self._scratch, (found, wanted) = np.zeros((4, 3)), np.zeros((2, CABLE_ROWS, n))
        self._found, self._rise_N = found, np.zeros(n)
        follows = self.gains.follows_pose
        self._planned_at = (found, self._pose.array) if follows else (wanted, self._wanted.array)
        filters = tracking_filters(self.gains, self._period_s)
        self._swing, self._seven, position = np.zeros(tracking.SWING), np.zeros(7), np.zeros(n)
        self._track = bound(
            tracking.track_pose, motors, filters, kinematics.geometry, self._up, self._pose.array,
            found, kinematics.solver, moves[loop.TWIST], rotation_of(model.platform),
            self._swing, kinematics.turns_freely, then=(position,),
        )  # fmt: skip
        self._write_coordinates = bound(
            pose_setpoint.coordinates_of_pose,
            self._pose.array, self._directions, self._home.array, self._scratch, self.estimated,
        )  # fmt: skip
        self._motor_references = bound(
            pose_setpoint.motor_references, self.setpoint.shaped, self._directions,
            self._home.array, self._period_s, kinematics.geometry, motors, self._pose.array,
            self._scratch, self._wanted.array, wanted, moves[loop.WANTED_TWIST],
            moves[loop.WANTED_ACCELERATION], moves[loop.POSE_ERROR], then=(position,) * 3,
        )  # fmt: skip

    def _bind_force(self, moves: FloatArray) -> None:
        """Fix the arrays of the kernels that find the platform's force by its `moves` (4, 6)."""
        model, motors = self.model, self._motors
        n, d = model.kinematics.n, model.size
        self._state = np.zeros(3 * d + 1)
        self._W, self._wrench, self._force = np.zeros((d, n)), np.zeros(d), np.zeros(d)
        self._rise_N = np.zeros(n)
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
        """Return what is made up for of the winches' friction, which its owners keep up to date."""
        known, learning = self._compensation, self.learning
        n = self.model.kinematics.n
        nothing = np.zeros((n, 2))[:, 0]  # with gaps, as theirs have: one machine code serves all
        return loop.WinchFriction(
            np.zeros(n) if known is None else known.friction_Nm,
            nothing if known is None else known.faded_in,
            nothing if learning is None else learning.friction_Nm,
            1.0 / np.abs(self._motors[tracking.M_PER_RAD]),
        )

    def _bind_tensions(self) -> None:
        """Fix the arrays of the kernels that have the cables exert the force, and the motors."""
        model, motors, scale = self.model, self._motors, self.model.wrench_scale
        n, d, method = model.kinematics.n, model.size, model.platform.tension_distribution
        self._distribution: TensionSolver | None = None  # the split's own
        if method != "minimum-deviation":
            self._distribution = tension_distribution(method, self.low_N, self.high_N, scale)
        plan, size = np.array([self.low_N, self.high_N]), max(n, 8)
        self._slow_N, self._feedforward_N = plan[0].copy(), plan[0].copy()
        space, position = np.zeros((n + 1, n)), np.zeros(n)
        self._split = bound(
            split, self._W, self._wrench, self._force, scale, plan, model.reserve_N,
            self._period_s / (self._period_s + _LIFT_S), self._distribution is not None,
            self._slow_N, self._feedforward_N, self.tension_N, np.zeros(d), np.zeros((3, n)),
            np.zeros((2, n)), np.zeros((d, n + 1)), space, np.zeros((4, size, size)),
        )  # fmt: skip
        self._drive = bound(
            loop.drive, self._settings, motors[tracking.M_PER_RAD], motors[tracking.INERTIA],
            motors[tracking.OMEGA], motors[tracking.TENSION], self.tension_N, self._feedforward_N,
            self._rise_N, space[1:], self.compensation_Nm, self.torque_Nm, self.effort_Nm,
            then=(0, position, position),
        )  # fmt: skip

    # -- Controller

    def reset(self) -> None:
        """Forget what was integrated."""
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
        """Friction and amplitude of the cogging that each motor was learnt to have, (2, n)."""
        return None if self.learning is None else self.learning.learnt_Nm

    def forget_motors(self) -> None:
        """Forget what was learnt of the motors, as where their encoders have begun anew."""
        if self.learning is not None:
            self.learning.forget()

    def measure_tensions(self, tension_N: FloatArray, measured: BoolArray) -> None:
        """Hold the cables' tensions by readings (n,) that others keep up to date, where they hold.

        Without a reading a motor is believed its torque constant, and what is known of it.
        """
        learnt_Nm = np.zeros(len(tension_N)) if self.learning is None else self.learning.torque_Nm
        self._cells = CellFeedback(
            tension_N, measured, self._motors[tracking.M_PER_RAD], self.model.reserve_N,
            self._period_s, self._check, self._W, self._wrench, learnt_Nm, self._rise_N,
        )  # fmt: skip

    def notices(self) -> list[str]:
        """Return which load cell is off, and whether the loop oscillates; until `clear_notices`."""
        return [text for text in (self._check.trouble, self._oscillation.trouble) if text]

    def clear_notices(self) -> None:
        """Forget what was found of load cells and loop."""
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
        if self._distribution is not None:
            self._distribution.solve(self._W, self._wrench, self._feedforward_N)
        self.outcome, self.share, null_directions = self._split()
        self._limited = self._drive(null_directions, slope, torque_Nm)
        self._oscillation.update(setpoint.position_rad)

    def _was_exerted(self) -> bool:
        """Return whether the last cycle's force was had from the cables, all of it."""
        plausible = self._rate_inconsistency_m_s <= loop.PLAUSIBLE_m_s
        return plausible and self.share >= 1.0 and self.outcome == OK and not self._limited

    def _compensate(self, feedback: AxisFeedback, setpoint: Setpoint) -> None:
        """Write the torques against what is known, or learnt, or measured of the motors."""
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
        """Have it said that nothing is added, while a program drives the winches itself."""
        self.compensation_Nm[:] = self.motor_loss_Nm[:] = self.cogging_Nm[:] = 0.0

    # -- where the platform is

    def begin(self, feedback: AxisFeedback, tension_N: FloatArray | None = None) -> None:
        """Take the motors to stand where they are, and the platform where its cables have it.

        Cables that stand with `tension_N` (n,) at their winches, which may be far from what is
        planned with.
        """
        motors = self._motors
        motors[tracking.THETA] = feedback.position_rad
        motors[[tracking.OMEGA, tracking.LOWPASSED_ONCE, tracking.LOWPASSED]] = 0.0
        planned_N = np.maximum(motors[tracking.TENSION], self.low_N)
        motors[tracking.TENSION] = planned_N
        self._pose.array[:] = self._home.array
        for _ in range(_SETTLING_STEPS):
            if tension_N is not None:
                motors[tracking.TENSION] = tension_N - self._rises_N(self._found)
            self.observe(feedback)
        self._swing[:] = 0.0
        motors[tracking.TENSION] = planned_N
        self._rest(on_stand=False)  # the set-point is of where it stood before

    def stand_still(self, *, on_stand: bool = False) -> None:
        """Have the set-point stand where the platform is, which may rest `on_stand`.

        Until it moves, the integral part of one `on_stand` is bounded: it would press, and the
        first way off the stand would begin against that. Asked for again in every cycle, the
        set-point comes after it where tensions may not turn with the platform: they would not hold
        it.
        """
        again = self._on_stand and on_stand and not self.gains.follows_pose
        share = self._period_s / (self._period_s + _COMES_AFTER_S) if again else 1.0
        self._rest(on_stand=on_stand)
        self.setpoint.stand_at(self.position + share * (self.estimated - self.position))

    def _rest(self, *, on_stand: bool) -> None:
        self._on_stand = on_stand
        self._settings[loop.MOST_N] = self._integral_N * (_ON_STAND if on_stand else 1.0)

    def observe(self, feedback: AxisFeedback) -> None:
        """Bring the estimate of the platform's pose up to date, by one cycle."""
        found = self._track(feedback.position_rad)
        self.residual_m, self.suspect, self._rate_inconsistency_m_s = found
        self._write_coordinates()

    def lengths_at_home(self, tension_N: FloatArray) -> FloatArray:
        """Return lengths (n,) without tension at home, with `tension_N` (n,) at the winches."""
        kinematics, motors = self.model.kinematics, np.array(self._motors)
        cables = np.zeros((CABLE_ROWS, kinematics.n))
        run_cables(kinematics.geometry, self._home.array, cables)
        motors[tracking.TENSION] = tension_N - self._rises_N(cables)
        motors[tracking.STRETCH] = 1.0
        tracking.stretch(motors, cables, self._up)
        return np.asarray(kinematics.lengths(self._home) / motors[tracking.STRETCH])

    def _rises_N(self, cables: FloatArray) -> FloatArray:
        """Return by how much tensions at winches are above those in the middle, (n,); reused."""
        write_tension_rises(self.model.kinematics.geometry, cables, self._rise_N)
        return self._rise_N

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
        turned = self._motors[tracking.M_PER_RAD] * self._motors[tracking.THETA]
        return np.asarray(self._motors[tracking.AT_ZERO] + turned)

    @property
    def pose(self) -> FloatArray:
        """Where the platform is, (7,): x y z, quaternion w x y z; overwritten."""
        pose_setpoint.write_quaternion(self._pose.array, self._seven)
        return self._seven

    @property
    def swing_rad(self) -> float:
        """By how much a platform that no cable keeps from turning may swing to and fro; else 0."""
        return float(self._swing[tracking.AMPLITUDE])

    @property
    def swing_m(self) -> float:
        """By how much an anchor point of such a platform may swing to and fro; else 0."""
        return float(self._swing[tracking.AMPLITUDE_m])

    # -- where it can be

    def tension_infeasibility(self) -> str:
        """Return why the last cycle's tensions are not feasible, an empty text where they are."""
        if not self.outcome:
            return ""
        return self._held.infeasibility(self._wanted) or self._infeasibility_in_motion()

    def _infeasibility_in_motion(self) -> str:
        """Return which cable limits the wanted motion where the platform could stand."""
        W, t, low_N, high_N = self._W, self._feedforward_N, self.low_N, self.high_N
        needed_N = t - np.linalg.pinv(W) @ (W @ t + self._wrench)
        margin_N = float(np.minimum(needed_N - low_N, high_N - needed_N).min())
        return f"for this motion, {infeasibility_text(margin_N, needed_N, low_N, high_N)}"
