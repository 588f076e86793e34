"""Base class of the programs that move a platform, and what they share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from cdpr_profiles.robot import default_name
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.jit import jit
from cdpr_rt.motion.approach import approach, stopping_position
from cdpr_rt.programs.arguments import ProgramError
from cdpr_rt.programs.base import CommandedProgram
from cdpr_rt.programs.bumpless_transfer import BumplessTransfer
from cdpr_rt.programs.platform.arrival import NEAR_SHARE, Arrival, NEAR_m
from cdpr_rt.programs.platform.paths.path_store import PathStore
from cdpr_rt.refusal import CommandRefusal, RefusalCode
from cdpr_rt.robots.interface import PlatformControl, RobotModel
from cdpr_rt.robots.kinematics.free_rotation_kernel import SWINGS_m
from cdpr_rt.robots.kinematics.pose_setpoint import pose_of_coordinates, write_quaternion
from cdpr_rt.robots.length_disagreement import exit_point_diagonal_m
from cdpr_rt.robots.persistence.last_lengths import LastLengths

_SLOWED_m, _WAITING_m = 0.02, 0.05
_LEAST_PACE = 1e-3
_LEAST_SHARE = 1e-6
_TOLD_DIGITS = 3


@jit
def distance_m(here: FloatArray, there: FloatArray, scale: FloatArray) -> float:
    """Return the distance of two positions (d,), whose entries count for `scale` metres."""
    square = 0.0
    for i in range(scale.size):
        square += (scale[i] * (here[i] - there[i])) ** 2
    return math.sqrt(square)


@jit
def along_velocity(velocity: FloatArray, most: FloatArray, acceleration: FloatArray) -> None:
    """Write accelerations, up to `most`, that end all velocities in the same time; all are (n,)."""
    longest = 0.0
    for i in range(most.size):
        longest = max(longest, abs(velocity[i]) / most[i])
    for i in range(most.size):
        share = 1.0
        if longest > 0.0:
            share = max(abs(velocity[i]) / most[i] / longest, _LEAST_SHARE)
        acceleration[i] = share * most[i]


@jit
def synchronise(position: FloatArray, target: FloatArray, most: FloatArray) -> None:
    """Lower bounds `most` of speed or acceleration so that all ways take the same time; (d,)."""
    longest = 0.0
    for i in range(most.size):
        longest = max(longest, abs(target[i] - position[i]) / most[i])
    if longest > 0.0:
        for i in range(most.size):
            share = abs(target[i] - position[i]) / most[i] / longest
            most[i] *= max(share, _LEAST_SHARE)


class PlatformParts:
    """The parts that the programs of one platform share: control, estimator, bounds, state."""

    def __init__(
        self,
        model: RobotModel,
        control: PlatformControl,
        estimator: Estimator,
        period_s: float,
        compensation: Compensation | None = None,
        lengths_disagree_m: float = math.inf,
        names: Sequence[str] = (),
    ) -> None:
        self.model, self.platform = model, model.platform
        self.lengths_allowed_m = lengths_disagree_m
        """By how much the cables' lengths may disagree."""
        self.home_lengths_allowed_m = min(model.platform.home_tolerance_m, lengths_disagree_m)
        """The same at home, where drums cannot have made them differ."""
        self.names = tuple(names) or tuple(map(default_name, range(control.torque_Nm.size)))
        """What messages call the cables, by their axes."""
        self.near_m = max(NEAR_m, NEAR_SHARE * exit_point_diagonal_m(model.platform))
        """How far from its set-point a platform has arrived."""
        self.compensation = compensation
        self.last_stop = LastLengths()
        """The lengths at which it was stopped."""
        self.paths = PathStore(model)
        """The planned paths."""
        self.control = control
        self.estimator = estimator
        self._origins_lost = estimator.origins_lost
        known = estimator.estimate
        control.measure_tensions(known.tension_N, known.tension_measured)
        self.period_s = period_s
        self.speed, self.acceleration = model.speed, model.acceleration
        """The most along each direction, (d,)."""
        self.scale_m = model.wrench_scale
        """How far an anchor point moves with each direction, (d,): 1, and for angles an arm."""
        self.not_calibrated_reason = ""
        """Why the geometry may not be believed, as after a rail has moved; else empty."""
        self.off_home = ""
        """How far it may stand from where its lengths say, as it was taken for at home."""
        self.cycle = -2
        """The last cycle in which one of the programs moved the platform."""
        self.tight = False
        self.loop = BumplessTransfer(control, control.torque_Nm, period_s)
        """The platform's control, which keeps its state from one program to the next."""

    @property
    def tight(self) -> bool:
        """Whether all cables are tight and carry the platform, where it is known to be."""
        return not self.estimator.estimate.slack_allowed

    @tight.setter
    def tight(self, tight: bool) -> None:
        self.estimator.estimate.slack_allowed = not tight

    @property
    def pose_known(self) -> bool:
        """Whether it is known where the platform is."""
        return bool(self.estimator.estimate.length_known.all())

    def speeds(self, most_m_s: float) -> FloatArray:
        """Return speeds (d,) of positions up to `most_m_s`, of angles less in the same measure."""
        return self.speed * min(most_m_s / float(self.speed[0]), 1.0)

    def notices(self) -> list[str]:
        """Return what an operator should know of the robot."""
        broken = self.last_stop.broken
        mend = f"{broken}: mend the cable, then `cdpr tighten --from home`" if broken else ""
        told = (self.not_calibrated_reason, mend, *self.control.notices(), self.off_home)
        return [text for text in told if text]

    def lengths_disagree(self) -> tuple[float, int]:
        """Return how far the lengths are from agreeing, and which cable's is off; 0 while slack."""
        return (self.control.residual_m, self.control.suspect) if self.tight else (0.0, -1)

    def assume_at_home(self, feedback: AxisFeedback) -> None:
        """Take the platform to be at home on tight cables, for the warm-up."""
        lengths_m = self.control.lengths_at_home(self.control.least_N)
        self.control.take_lengths(lengths_m, feedback)
        self.control.begin(feedback)
        self.estimator.set_lengths(feedback.position_rad, self.control.free_lengths_m)
        self.tight = True

    def slacken(self) -> None:
        """Mark the cables as slack; a platform that they carried may have moved."""
        self.last_stop.displaced = self.last_stop.displaced or self.tight
        self.tight = False

    def forget(self) -> None:
        """Forget where the platform is, as if it stood at home."""
        self.tight = self.last_stop.displaced = self.last_stop.fallen = False
        self.last_stop.contradicted = ""
        self.estimator.forget_lengths()
        self.control.reset()
        self.follow_origins()

    def follow_origins(self) -> None:
        """Forget what was learnt of the motors where their angles count from elsewhere since."""
        if self._origins_lost != self.estimator.origins_lost:
            self._origins_lost = self.estimator.origins_lost
            self.control.forget_motors()


class PlatformProgram(CommandedProgram):
    """Brakes and holds the platform on tight cables; subclasses override `_move`.

    The pose has to be known: `tighten` finds it.
    """

    name = "platform"
    needs_lease = False

    def __init__(self, parts: PlatformParts, _torque_Nm: FloatArray) -> None:
        self._parts = parts
        self.controller: Controller = parts.control
        self._control = parts.control
        self._loop = parts.loop
        model = parts.model
        self._k = model.positions
        self._about = np.array(model.kinematics.directions[self._k :], np.int64) - 3
        self._target, self._rest, self._paced = np.zeros((3, model.size))
        self._speed, self._acceleration = np.array(parts.speed), np.array(parts.acceleration)
        self._directions = np.array(model.kinematics.directions)
        self._wanted, self._scratch, self._seen = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros(7)
        self._arrival = Arrival(parts.period_s, parts.near_m)
        # compiled here, not when the first pose is recorded
        self._write_setpoint(self._target)

    def start(self, feedback: AxisFeedback, _setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; the platform brakes and stays."""
        parts, control = self._parts, self._control
        self._stopping = False
        self._at_rest = False
        self._arrival.restart()
        if feedback.cycle - parts.cycle not in (0, 1):
            if parts.pose_known:
                control.take_lengths(parts.estimator.estimate.cable_length_m, feedback)
            control.begin(feedback)
            control.stand_still()
            self._loop.take_over(feedback, torque_Nm)
        self._speed[:] = parts.speed
        self._brake()

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        self._parts.cycle = feedback.cycle
        if self._stopping:
            self._at_rest = self._approach()
        else:
            self._at_rest = self._move()
        self._loop.update(feedback, setpoint, torque_Nm)
        self._arrival.update(self._at_rest, self._lag_m())

    def stop(self) -> None:
        """Begin to brake to a standstill."""
        super().stop()
        self._brake()

    def _require_pose(self) -> None:
        """Raise ProgramError where the platform is not to be moved to a pose."""
        parts = self._parts
        if doubt := parts.not_calibrated_reason or parts.last_stop.contradicted:
            why = {"why": doubt}
            raise ProgramError(CommandRefusal(RefusalCode.NOT_CALIBRATED, self.name, arguments=why))
        if not parts.tight:
            raise ProgramError(CommandRefusal(RefusalCode.NOT_TIGHT, self.name))

    @property
    def pose(self) -> FloatArray | None:
        """Return where the platform is, (7,)."""
        return self._control.pose if self._parts.pose_known else None

    @property
    def pose_setpoint(self) -> FloatArray | None:
        """Return the commanded pose, (7,)."""
        if not self._parts.pose_known:
            return None
        self._write_setpoint(self._control.shaped)
        return self._seen

    def _write_setpoint(self, position: FloatArray) -> None:
        home = self._parts.model.home_pose.array
        pose_of_coordinates(position, self._directions, home, self._scratch, self._wanted)
        write_quaternion(self._wanted, self._seen)

    def progress(self) -> dict[str, Any]:
        """Return position, target, tensions and what makes them infeasible."""
        control, k = self._control, self._k
        turned = {
            "rotation_rad": control.estimated[k:].tolist(),
            "target_rotation_rad": self._target[k:].tolist(),
        }
        learnt = control.learnt_Nm
        friction, cogging = ([], []) if learnt is None else learnt.round(_TOLD_DIGITS).tolist()
        return {
            "learnt_friction_Nm": friction,
            "learnt_cogging_Nm": cogging,
            "position_m": control.estimated[:k].tolist(),
            "target_m": self._target[:k].tolist(),
            **(turned if self._about.size else {}),
            "tension_N": control.tension_N.tolist(),
            "missing": control.tension_infeasibility(),
            "held_back": self._held_back(),
            "done": float(self._at_rest and self._arrival.over),
            "trouble": self._arrival.text() or self._swing_text(),
        }

    def _swing_text(self) -> str:
        """Return how far a platform that has arrived may still swing, an empty text for little."""
        swing_rad, swing_m = self._control.swing_rad, self._control.swing_m
        if not self._arrival.over or swing_m < SWINGS_m:
            return ""
        return (
            f"the platform may still turn to and fro by {math.degrees(swing_rad):.1f} deg or more, "
            f"its anchor points by {1e3 * swing_m:.0f} mm: no cable keeps it from turning"
        )

    def _held_back(self) -> str:
        """Return why the set-point is slowed down, an empty text where it is not."""
        lag_m = self._lag_m()
        if lag_m < _WAITING_m or not self._parts.pose_known:
            return ""
        return f"the platform is {1e3 * lag_m:.0f} mm behind: friction, or something in its way"

    def _move(self) -> bool:
        """Move the platform's set-point; return whether nothing is left to do."""
        return self._approach()

    def _lag_m(self) -> float:
        """Return how far the platform is from its set-point, at its anchor points."""
        control = self._control
        return distance_m(control.shaped, control.estimated, self._parts.scale_m)

    def _pace(self) -> FloatArray:
        """Return the set-point's speed, less the further the platform lags; overwritten.

        A set-point that ran on from a stuck platform would end in a following error.
        """
        share = 1.0
        if not self._stopping:
            share = (_WAITING_m - self._lag_m()) / (_WAITING_m - _SLOWED_m)
        np.multiply(self._speed, min(max(share, _LEAST_PACE), 1.0), out=self._paced)
        return self._paced

    def _approach(self) -> bool:
        return self._go_towards(self._target)

    def _go_towards(self, goal: FloatArray) -> bool:
        control = self._control
        return approach(
            goal, self._pace(), self._acceleration, self._parts.period_s, control.position,
            control.velocity, control.acceleration,
        )  # fmt: skip

    def _brake(self) -> None:
        """Have the set-point come to rest on the straight line on which it moves."""
        along_velocity(self._control.velocity, self._parts.acceleration, self._acceleration)
        self._target[:] = self._stopping_position()

    def _stopping_position(self) -> FloatArray:
        """Return the position at which it comes to rest if it brakes from now on; overwritten."""
        control = self._control
        stopping_position(control.position, control.velocity, self._acceleration, self._rest)
        return self._rest
