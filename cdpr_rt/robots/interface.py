"""Interface of a robot to the controller, whatever its cables and directions.

`PlatformControl` finds where the platform is and moves it; `RobotModel` says what its file allows,
by `Kinematics`, `TensionDistribution` and `Workspace`. Programs know these alone; the parts that
fulfil them for the robot of a file are made by `platform_of`.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Protocol

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.robots.kinematics.pose import Pose


class TensionOutcome(IntEnum):
    """Outcome of a tension distribution."""

    FEASIBLE = 0
    """They carry the wrench within their bounds."""
    SUBSTITUTED = 1
    """As FEASIBLE, but by minimum deviation, since the method itself found none."""
    NEAREST = 2
    """No tensions within the bounds carry the wrench; these leave the least of it out."""
    SINGULAR = 3
    """The wrench matrix has not full rank; these leave the least of the wrench out."""
    REFUSED = 4
    """An argument is not finite or of another size, or bounds are reversed: nothing is written."""


class Kinematics(Protocol):
    """Lengths and wrenches of n cables on a platform with d controlled directions.

    The pose that belongs to lengths is found by the `PlatformControl`, cycle by cycle.
    """

    @property
    def directions(self) -> tuple[int, ...]:
        """Controlled components of the twist (x, y, z, about x, about y, about z), (d,)."""

    def lengths(self, pose: Pose) -> FloatArray:
        """Return the cables' lengths (n,) without tension at a pose; raises GeometryError."""

    def wrench_matrix(self, pose: Pose, out: FloatArray | None = None) -> FloatArray:
        """Return W = -J^T (d, n) at a pose, about the platform's origin; raises GeometryError."""

    def hanging(self, pose: Pose) -> tuple[FloatArray, FloatArray]:
        """Return the wrench (d,) of the cables' weight at a pose, and the rise (n,) at the winches.

        Tensions there are by the rise above those in the middle of the cables, W being for these.
        """


class TensionDistribution(Protocol):
    """Tensions that carry a wrench within their bounds."""

    def solve(self, W: FloatArray, w_e: FloatArray, t_out: FloatArray) -> TensionOutcome:
        """Write tensions t (n,) with W t + w_e = 0, W (d, n) and w_e (d,), into `t_out`."""


class Workspace(Protocol):
    """Wrench-feasible workspace: the poses at which tensions within bounds hold the platform."""

    def capacity_margins(self, poses: FloatArray, least_N: float) -> FloatArray:
        """Return the capacity margins (m,), N, of poses (m, 4, 3).

        That is the greatest distance that all tensions can keep from their bounds, below 0 where
        some are outside. A margin below `least_N` may be less still.
        """


class RobotModel(Protocol):
    """Model of a robot's platform from its file, for the programs.

    A position (d,) has one entry for each controlled direction: the k coordinates of the origin, m,
    the last of them upward, then the rotation vector from the orientation at home, rad.
    """

    @property
    def platform(self) -> Platform:
        """Mass, box of targets and tolerances, as in the file."""

    @property
    def kinematics(self) -> Kinematics:
        """Kinematics about the platform's origin."""

    @property
    def low_N(self) -> FloatArray:
        """Lower bounds of the tensions, (n,)."""

    @property
    def high_N(self) -> FloatArray:
        """Upper bounds of the tensions, (n,)."""

    @property
    def torque_limited_N(self) -> FloatArray:
        """Upper bounds of the tensions, (n,), that motors can hold while rotors accelerate."""

    @property
    def positions(self) -> int:
        """Number of coordinates of the origin, k."""

    @property
    def size(self) -> int:
        """Number of controlled directions, d."""

    @property
    def home(self) -> FloatArray:
        """The position at home, (d,)."""

    @property
    def home_pose(self) -> Pose:
        """The pose at home."""

    @property
    def tips_at(self) -> float:
        """The horizontal pull over the weight at which it tips over on its stand, inf for never."""

    @property
    def speed(self) -> FloatArray:
        """The highest speeds, (d,), in m/s and rad/s."""

    @property
    def acceleration(self) -> FloatArray:
        """The highest accelerations, (d,), in m/s2 and rad/s2."""

    @property
    def jerk(self) -> FloatArray:
        """The highest jerks of paths, (d,), in m/s3 and rad/s3."""

    @property
    def angle_rad(self) -> float:
        """Largest angle from home's orientation in which targets may lie."""

    @property
    def wrench_scale(self) -> FloatArray:
        """Scale that makes forces and moments comparable, (d,): 1, and an arm in m for moments."""

    def weight(self) -> FloatArray:
        """Return the wrench of gravity on the platform at home's orientation, (d,)."""

    def pose(self, position: FloatArray) -> Pose:
        """Return the pose at a position (d,) or (k,)."""

    def poses(self, positions: FloatArray) -> FloatArray:
        """Return the arrays of the poses (m, 4, 3) at positions (m, d) or (m, k)."""

    def least_tensions(self, low_N: FloatArray, high_N: FloatArray) -> TensionDistribution:
        """Return the distribution that deviates least from the lower bounds (n,), in squares."""

    def workspace(self, acceleration_m_s2: float | None = None) -> Workspace:
        """Return the workspace under an acceleration, by default that of the robot's file."""

    def contact_on_way(self, positions: FloatArray, looks: int) -> str:
        """Return what is in contact straight from position to position (m, d), "" for nothing.

        What so many `looks` at a part of the way do not prove clear counts as in contact.
        """


class MotorFit(Protocol):
    """Identification of motors' friction and cogging while cables are pulled tight at home."""

    taken_up_N: FloatArray
    """What winches usually take up of their cables' tensions at most, (n,)."""
    count_rad: FloatArray
    """Resolution of each motor's encoder, (n,)."""

    def prepare(self, tension_N: FloatArray) -> None:
        """Take the pretension (n,) that is pulled around."""

    def begin(self, position_rad: FloatArray) -> None:
        """Begin anew, at these angles (n,)."""

    def take(self, position_rad: FloatArray, tension_N: FloatArray) -> None:
        """Take in a cycle's angles (n,) and the tensions asked for, (n,)."""

    def end(self) -> FloatArray:
        """Return the angles (n,) at which the cables have the pretension, nan where not known."""

    def begin_learning(self) -> None:
        """Begin the learning anew with what was found last, where there is such."""


class PlatformControl(Controller, Protocol):
    """A controller whose set-point is a platform's, in the coordinates of its robot's file.

    As a `Controller` it writes the axes' set-points itself, so that others may go on from there.
    Positions, velocities and accelerations are (d,), one for each controlled direction: coordinates
    of the origin, m, and the rotation vector from the orientation at home, rad. Tensions and
    lengths are (n,).
    """

    position: FloatArray
    """The set-point, to be written along with its derivatives."""
    velocity: FloatArray
    acceleration: FloatArray
    shaped: FloatArray
    """The set-point's position as the control follows it."""
    tension_N: FloatArray
    """Commanded tensions of the last cycle."""
    least_N: FloatArray
    """The lowest tensions allowed."""
    low_N: FloatArray
    """The lowest tensions that are planned with."""
    torque_Nm: FloatArray
    """Highest motor torques that may be commanded, (n,)."""
    estimated: FloatArray
    """Estimated position, (d,)."""
    residual_m: float
    """Largest normalised residual of the cables' lengths at the estimated pose."""
    suspect: int
    """Cable with that residual, -1 where the lengths do not tell which of them is wrong."""

    @property
    def inertia_kg_m2(self) -> FloatArray:
        """Inertia of each motor, (n,)."""

    @property
    def pull_fit(self) -> MotorFit:
        """Identification of motors that were not commissioned; learning begins with its result."""

    @property
    def pose(self) -> FloatArray:
        """Estimated pose, (7,): x y z, quaternion w x y z."""

    @property
    def swing_rad(self) -> float:
        """Amplitude of the rotation that no cable controls, 0 where there is none."""

    @property
    def swing_m(self) -> float:
        """Amplitude of an anchor point in that rotation, 0 where there is none."""

    @property
    def free_lengths_m(self) -> FloatArray:
        """Lengths of the cables without tension, as the motors' angles have them."""

    @property
    def learnt_Nm(self) -> FloatArray | None:
        """Friction and cogging of each motor learnt in motion, (2, n); None without learning."""

    def forget_motors(self) -> None:
        """Forget what was learnt of the motors, as where their encoders have begun anew."""

    def measure_tensions(self, tension_N: FloatArray, measured: BoolArray) -> None:
        """Hold the cables' tensions by readings (n,), kept up to date by others, where valid."""

    def notices(self) -> list[str]:
        """Return what an operator should know of load cells and loop, in words. Latched."""

    def clear_notices(self) -> None:
        """Clear the latched notices."""

    def begin(self, feedback: AxisFeedback, tension_N: FloatArray | None = None) -> None:
        """Take the motors to stand where they are, and the platform where its cables have it.

        Cables that stand with `tension_N` (n,) at their winches, which may be far from what is
        planned with.
        """

    def observe(self, feedback: AxisFeedback) -> None:
        """Bring the estimate of the platform's pose up to date, by one cycle."""

    def clear_compensation(self) -> None:
        """Set the recorded compensation to 0, while a program drives the winches itself."""

    def stand_still(self, *, on_stand: bool = False) -> None:
        """Have the set-point stand where the platform is, which may rest `on_stand`."""

    def lengths_at_home(self, tension_N: FloatArray) -> FloatArray:
        """Return lengths without tension at home, with `tension_N` at the winches."""

    def take_lengths(self, length_m: FloatArray, feedback: AxisFeedback) -> None:
        """Take the cables to have these lengths without tension at the motors' angles."""

    def tension_infeasibility(self) -> str:
        """Return why the last cycle's tensions are not feasible, an empty text where they are."""

    def is_feasible(self, position: FloatArray) -> bool:
        """Return whether the platform can be held, and accelerated, at a position."""

    def contact_ahead(self, position: FloatArray) -> int:
        """Return a pair of things in contact on a short straight way from the set-point, -1: none.

        Cables, platform and boxes of the frame, by the clearance of the robot's file; what is in
        contact at the set-point already may leave.
        """

    def contact_at(self, position: FloatArray) -> int:
        """Return a pair of things in contact at a position, nearer than at the set-point."""

    def contact(self, pair: int) -> str:
        """Return in words that a pair is in contact."""

    def infeasibility(self, position: FloatArray) -> str:
        """Return why the platform cannot stand at a position, an empty text where it can."""

    def way_infeasibility(self, position: FloatArray, start: FloatArray | None = None) -> str:
        """Return why the straight way to a position, from here or `start`, is infeasible, or ""."""
