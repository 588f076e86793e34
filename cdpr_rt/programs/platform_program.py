"""Base class of the programs that move a platform, and their shared parts."""

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
from cdpr_rt.model.free_rotation_kernel import SWINGS_m
from cdpr_rt.model.last_lengths import LastLengths
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.pose_tracking import pose_of_coordinates, write_quaternion
from cdpr_rt.model.robot_arrays import LEAST_REDUNDANCY, exit_point_diagonal_m
from cdpr_rt.motion.trajectory import approach, stopping_position
from cdpr_rt.platform.cable_control import CableControl
from cdpr_rt.programs.base import BumplessTransfer, CommandedProgram, ProgramError
from cdpr_rt.programs.path_store import PathStore
from cdpr_rt.refusal import CommandRefusal, RefusalCode

# Decision whether a platform has arrived at a set-point at rest.

NEAR_m, NEAR_SHARE = 5e-4, 1e-4
"""Distance within which a platform has arrived, unless friction keeps it farther away. On large
robots, whose long cables stretch and sag more, it is this share of the frame's diagonal.
"""
_NEAR_S = 0.2
_WAITED_S = 5.0


class Arrival:
    """Counts the cycles in which a set-point stands, and those in which the platform is near it.

    The wait is over when the platform has been within `near_m` for `near_s`, or when the set-point
    has stood for `waited_s`.
    """

    def __init__(
        self,
        period_s: float,
        near_m: float = NEAR_m,
        near_s: float = _NEAR_S,
        waited_s: float = _WAITED_S,
    ) -> None:
        self.near_m = near_m
        self._near_cycles, self._most_cycles = round(near_s / period_s), round(waited_s / period_s)
        self._near = self._standing = 0

    def restart(self) -> None:
        """Begin again, because the set-point is about to move."""
        self._near = self._standing = 0

    def update(self, standing: bool, off_m: float) -> None:
        """Count a cycle: is the set-point `standing`, and how far (`off_m`) is the platform."""
        self._standing = self._standing + 1 if standing else 0
        self._near = self._near + 1 if standing and off_m < self.near_m else 0

    @property
    def over(self) -> bool:
        """Whether the wait is over."""
        return self._near > self._near_cycles or self._standing > self._most_cycles

    @property
    def missed(self) -> bool:
        """Whether the wait is over although the platform is not near its set-point."""
        return self.over and self._near <= self._near_cycles


_SLOWED_m, _WAITING_m = 0.02, 0.05
_LEAST_PACE = 1e-3
_LEAST_SHARE = 1e-6
_TOLD_DIGITS = 3


@jit
def distance_m(here: FloatArray, there: FloatArray, scale: FloatArray) -> float:
    """Return the distance of two positions (d,), m; their entries are multiplied by `scale`."""
    square = 0.0
    for i in range(scale.size):
        square += (scale[i] * (here[i] - there[i])) ** 2
    return math.sqrt(square)


@jit
def along_velocity(velocity: FloatArray, most: FloatArray, acceleration: FloatArray) -> None:
    """Write accelerations, up to `most`, that stop all velocities in the same time; (n,) each."""
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
    """Reduce bounds `most` (d,) of speed or acceleration so that all directions end together."""
    longest = 0.0
    for i in range(most.size):
        longest = max(longest, abs(target[i] - position[i]) / most[i])
    if longest > 0.0:
        for i in range(most.size):
            share = abs(target[i] - position[i]) / most[i] / longest
            most[i] *= max(share, _LEAST_SHARE)


_TOLD_APART_m = 0.005
"""Smallest residual that shows whether a platform stood at home; geometry errors cause some mm."""


class PlatformParts:
    """The parts that the programs of one platform share: control, estimator, bounds, state."""

    def __init__(
        self,
        model: PlatformModel,
        control: CableControl,
        estimator: Estimator,
        period_s: float,
        compensation: Compensation | None = None,
        lengths_disagree_m: float = math.inf,
        names: Sequence[str] = (),
    ) -> None:
        self.model, self.platform = model, model.platform
        self.lengths_allowed_m = lengths_disagree_m
        """Largest allowed disagreement of the cables' lengths."""
        self.home_lengths_allowed_m = min(model.platform.home_tolerance_m, lengths_disagree_m)
        """Largest allowed disagreement at home, where errors of the drums have no effect."""
        self.names = tuple(names) or tuple(map(default_name, range(control.torque_Nm.size)))
        """Names of the cables in messages, those of their axes."""
        self.near_m = max(NEAR_m, NEAR_SHARE * exit_point_diagonal_m(model.platform))
        """Distance from its set-point within which a platform has arrived."""
        self.compensation = compensation
        self.last_stop = LastLengths()
        """The lengths at the last stop."""
        self.paths = PathStore(model)
        """The planned paths."""
        self.control = control
        self.estimator = estimator
        self._origins_lost = estimator.origins_lost
        known = estimator.estimate
        control.measure_tensions(known.tension_N, known.tension_measured, known.upward)
        self.period_s = period_s
        self.speed, self.acceleration = model.speed, model.acceleration
        """Largest speed and acceleration along each direction, (d,)."""
        self.scale_m = model.wrench_scale
        """Motion of an anchor point per unit of each direction, (d,): 1 for coordinates, an arm for
        angles."""
        self.not_calibrated_reason = ""
        """Reason why the geometry is unreliable, for example that a rail has moved; else empty."""
        self.off_home = ""
        """Text that says how far the platform may stand from the pose that its lengths give. The
        lengths were taken at home."""
        self.off_home_by = np.zeros(model.size)
        """Difference (d,) of the pose from home if the lengths were taken at home; 0 if it is not
        the reason for `off_home`."""
        self.cycle = -2
        """The last cycle in which one of the programs moved the platform."""
        self.tight = False
        self.loop = BumplessTransfer(control, control.torque_Nm, period_s)
        """The platform's control, which keeps its state from program to program."""

    @property
    def tight(self) -> bool:
        """Whether all cables are tight and carry the platform at a known pose."""
        return not self.estimator.estimate.slack_allowed

    @tight.setter
    def tight(self, tight: bool) -> None:
        self.estimator.estimate.slack_allowed = not tight

    @property
    def pose_known(self) -> bool:
        """Whether the pose of the platform is known."""
        return bool(self.estimator.estimate.length_known.all())

    def speeds(self, most_m_s: float) -> FloatArray:
        """Return speeds (d,): of positions up to `most_m_s`, of angles reduced in proportion."""
        return self.speed * min(most_m_s / float(self.speed[0]), 1.0)

    def notices(self) -> list[str]:
        """Return notices to the operator."""
        broken = "; ".join(self.last_stop.broken.values())
        repair = f"{broken}: repair it, then `cdpr tighten --from home`" if broken else ""
        if self._shows_right_lengths():
            self.off_home = ""
        notices = (self.not_calibrated_reason, repair, *self.control.notices(), self.off_home)
        return [text for text in notices if text]

    def _shows_right_lengths(self) -> bool:
        """Return whether the lengths agree so well that `off_home` must be wrong.

        If the platform stood off home by δ when its lengths were taken, they are too long by J_h δ,
        and leave residuals (I - J J^+) J_h δ elsewhere.
        """
        if not self.off_home or not self.tight or not self.off_home_by.any():
            return False
        kinematics, model = self.model.kinematics, self.model
        J_home = kinematics.wrench_matrix(model.home_pose).T.copy()
        J = kinematics.wrench_matrix(model.pose(self.control.estimated)).T
        P = np.eye(len(J)) - J @ np.linalg.pinv(J)
        redundancy = np.maximum(np.diag(P), LEAST_REDUNDANCY)
        expected_m = np.abs(P @ J_home @ self.off_home_by) / np.sqrt(redundancy)
        return bool(max(2.0 * self.control.residual_m, _TOLD_APART_m) < expected_m.max())

    def lengths_disagree(self) -> tuple[float, int, float, int]:
        """Return how much the lengths disagree and the index of the worst cable; 0 while slack.

        Also returns the largest sudden change of a length, and the index of that cable.
        """
        control = self.control
        if not self.tight:
            return 0.0, -1, 0.0, -1
        return control.residual_m, control.suspect, control.jump_m, control.jumped

    def suspects_text(self) -> str:
        """Return the end of a message, which names the cable whose length is most likely wrong."""
        names = [self.names[i] for i in self.control.suspects()]
        which = "most likely that of" if len(names) == 1 else "one of"
        return f", {which} {', '.join(names)}" if names else ""

    def assume_at_home(self, feedback: AxisFeedback) -> None:
        """Assume for the warm-up that the platform is at home on tight cables."""
        lengths_m = self.control.lengths_at_home(self.control.least_N)
        self.control.take_lengths(lengths_m, feedback)
        self.control.begin(feedback)
        self.estimator.set_lengths(feedback.position_rad, self.control.free_lengths_m)
        self.tight = True

    def slacken(self) -> None:
        """Mark the cables as slack; the platform may have moved if they carried it."""
        self.last_stop.displaced = self.last_stop.displaced or self.tight
        self.tight = False

    def forget(self) -> None:
        """Discard the pose of the platform, as if it stood at home."""
        self.tight = self.last_stop.displaced = self.last_stop.fallen = False
        self.last_stop.contradicted = ""
        self.estimator.forget_lengths()
        self.control.reset()
        self.follow_origins()

    def follow_origins(self) -> None:
        """Discard the values learnt for motors whose angles have a new origin."""
        if self._origins_lost != self.estimator.origins_lost:
            self._origins_lost = self.estimator.origins_lost
            self.control.forget_motors()


class PlatformProgram(CommandedProgram):
    """Brakes and holds the platform on tight cables; subclasses override `_move`.

    The pose has to be known; the program `tighten` finds it.
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
        # this call compiles the kernel before the first pose is recorded
        self._write_setpoint(self._target)

    def start(self, feedback: AxisFeedback, _setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last set-point and torque; the platform brakes and holds."""
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
        """Begin to brake to a standstill, with the built-in controller."""
        super().stop()
        self._control.stand_in()
        self._brake()

    def _require_pose(self) -> None:
        """Raise ProgramError if the platform must not move to a pose."""
        parts = self._parts
        if doubt := parts.not_calibrated_reason or parts.last_stop.contradicted:
            why = {"why": doubt}
            raise ProgramError(CommandRefusal(RefusalCode.NOT_CALIBRATED, self.name, arguments=why))
        if not parts.tight:
            raise ProgramError(CommandRefusal(RefusalCode.NOT_TIGHT, self.name))

    @property
    def pose(self) -> FloatArray | None:
        """Return the pose of the platform, (7,)."""
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
        """Return position, target, tensions, and the reason if these are infeasible."""
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
            "trouble": self._off_text() or self._swing_text(),
        }

    def _off_text(self) -> str:
        """Return as text how far the platform stands from its target, "" if it has arrived."""
        if not self._arrival.missed:
            return ""
        control, k = self._control, self._k
        off = control.estimated - control.shaped
        turned = f" and {math.degrees(np.linalg.norm(off[k:])):.1f} deg" if off.size > k else ""
        return f"the platform stands {1e3 * np.linalg.norm(off[:k]):.1f} mm{turned} from its target"

    def _swing_text(self) -> str:
        """Return as text how far a platform that has arrived may swing, "" if only a little."""
        swing_rad, swing_m = self._control.swing_rad, self._control.swing_m
        if not self._arrival.over or swing_m < SWINGS_m:
            return ""
        return (
            f"the platform may still swing by {math.degrees(swing_rad):.1f} deg or more, "
            f"its anchor points by {1e3 * swing_m:.0f} mm, because no cable controls its angle"
        )

    def _held_back(self) -> str:
        """Return the reason why the set-point is slowed down, or ""."""
        lag_m = self._lag_m()
        if lag_m < _WAITING_m or not self._parts.pose_known:
            return ""
        return f"the platform is {1e3 * lag_m:.0f} mm behind: friction or an obstacle holds it back"

    def _move(self) -> bool:
        """Move the platform's set-point; return whether it has arrived."""
        return self._approach()

    def _lag_m(self) -> float:
        """Return the distance of the platform's anchor points from their set-points."""
        control = self._control
        return distance_m(control.shaped, control.estimated, self._parts.scale_m)

    def _pace(self) -> FloatArray:
        """Return the set-point's speed, which falls with the lag of the platform; overwritten.

        Otherwise a set-point would run away from a stuck platform and cause a following error.
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
        """Bring the set-point to rest on the straight line on which it moves."""
        along_velocity(self._control.velocity, self._parts.acceleration, self._acceleration)
        self._target[:] = self._stopping_position()

    def _stopping_position(self) -> FloatArray:
        """Return where the set-point comes to rest if it brakes from now on; overwritten."""
        control = self._control
        stopping_position(control.position, control.velocity, self._acceleration, self._rest)
        return self._rest
