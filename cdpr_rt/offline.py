"""The model of a robot for offline work: kinematics, statics and workspace of whole arrays."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from cdpr_profiles import load_robot
from cdpr_profiles.errors import ProfileError
from cdpr_rt.arrays import BoolArray, FloatArray, real_array
from cdpr_rt.code_loader import CodeError
from cdpr_rt.errors import ControlError
from cdpr_rt.model.hanging import HangingSearch, upward
from cdpr_rt.model.own_distribution import (
    TensionDistribution,
    TensionDistributionError,
    checked_distribution,
    named_distribution,
    require_code_allowed,
)
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.pose_tracking import write_quaternion
from cdpr_rt.model.rigid_body import in_space
from cdpr_rt.robot import InvalidArgument, InvalidRobot


def load(
    robot: str | Path,
    *,
    tension_distribution: TensionDistribution | None = None,
    allow_code: bool = False,
) -> Model:
    """Return the model of a robot from its name or file. Nothing is started.

    `tension_distribution` replaces the distribution in the robot's file. If the file names the
    user's own code, `allow_code` permits that code from now on; `Model.tensions` runs it. Raises
    InvalidRobot if the robot is unknown, if its file cannot be used, or if it has no platform.
    """
    try:
        profile = load_robot(robot)
        if profile.platform is None:
            raise InvalidRobot(f"{profile.path}: the robot has no platform; add a [platform] table")
        if allow_code:
            require_code_allowed(profile, allow_code=True)
        model, cables = platform_model_of(profile), [axis.name for axis in profile.axes]
        made = Model(model, cables, partial(named_distribution, profile))
        if tension_distribution is not None:
            made._distribution = checked_distribution("tension_distribution", tension_distribution)
        return made
    except CodeError as error:
        raise InvalidArgument(str(error)) from None
    except (ProfileError, ControlError) as error:
        raise InvalidRobot(str(error)) from None


class Model:
    """Kinematics, statics and workspace of a robot with n cables; made by `load`.

    A position (d,) has one entry for each controlled direction: the coordinates of the platform's
    origin, m, then the rotation vector from the orientation at home, rad. Each method takes one
    position or an array of positions (..., d), and returns an array with the same leading shape. A
    position without rotation has the orientation at home. Twists and wrenches have the same
    directions, along the axes of the room; moments are about the platform's origin. Methods raise
    InvalidArgument for a wrong shape and for nan.
    """

    def __init__(
        self,
        model: PlatformModel,
        cables: list[str],
        own_distribution: Callable[[], TensionDistribution | None] = lambda: None,
    ) -> None:
        """Take the platform's model, the cable names, and a loader of the distribution."""
        self._model = model
        self._own_distribution = own_distribution
        self.cables = cables
        """Names of the n cables."""

    def __repr__(self) -> str:
        return f"<Model of {self.n} cables, {self.d} controlled directions>"

    @property
    def n(self) -> int:
        """Number of cables."""
        return self._model.kinematics.n

    @property
    def d(self) -> int:
        """Number of controlled directions."""
        return self._model.size

    @property
    def hangs_freely(self) -> bool:
        """Whether the platform hangs in space on too few cables to control its rotation."""
        return self._model.kinematics.hangs_freely

    @property
    def home(self) -> FloatArray:
        """The position on the stand, (d,)."""
        return self._model.home.copy()

    @property
    def low_N(self) -> FloatArray:
        """Lower bounds of the tensions, (n,)."""
        return self._model.low_N.copy()

    @property
    def high_N(self) -> FloatArray:
        """Upper bounds of the tensions, (n,).

        They are the limits, or less if the motors' torque is also needed to accelerate the rotors.
        """
        return self._model.torque_limited_N.copy()

    @property
    def box_m(self) -> FloatArray:
        """Lowest and highest coordinates of the targets that the robot's file allows, (2, k)."""
        platform = self._model.platform
        return np.array([platform.workspace_min_m, platform.workspace_max_m])

    def lengths(self, position: ArrayLike) -> FloatArray:
        """Return the lengths (..., n), m, of unloaded cables, including the part on the pulleys."""
        kinematics = self._model.kinematics
        rows, shape = self._rows(position)
        lengths = [kinematics.lengths(Pose(pose[0], pose[1:])) for pose in self._model.poses(rows)]
        return np.array(lengths).reshape(*shape, self.n)

    def jacobian(self, position: ArrayLike) -> FloatArray:
        """Return the Jacobian J (..., n, d): the rates of the lengths are J times the twist."""
        return -np.swapaxes(self.wrench_matrix(position), -1, -2)

    def wrench_matrix(self, position: ArrayLike) -> FloatArray:
        """Return the wrench matrix W = -J^T (..., d, n): tensions t exert the wrench W t.

        Tensions and the other wrenches w are in equilibrium if W t + w = 0. The columns are nan if
        an anchor is in its exit point.
        """
        rows, shape = self._rows(position)
        W = np.zeros((len(rows), self.d, self.n))
        self._model.kinematics.wrench_matrices(self._model.poses(rows), W)
        return W.reshape(*shape, self.d, self.n)

    def gravity(self, position: ArrayLike) -> FloatArray:
        """Return the wrench of gravity on the platform, (..., d), N and Nm, without cables."""
        rows, shape = self._rows(position)
        force, moment_arms_m = self._weight_N(), self._centres_m(rows)
        return self._reduced(force, np.cross(moment_arms_m, force)).reshape(*shape, self.d)

    def position(self, lengths_m: ArrayLike, start: ArrayLike | None = None) -> FloatArray:
        """Return the positions (..., d) at which the cables have these lengths (..., n).

        This is `pose` reduced to the controlled directions.
        """
        unturned = Pose(np.zeros(3), self._model.home_pose.Q)
        directions = list(self._model.kinematics.directions)
        given, poses = self._found(lengths_m, start)
        found = [np.full(6, np.nan) if pose is None else pose.minus(unturned) for pose in poses]
        return np.reshape(found, (-1, 6))[:, directions].reshape(*given.shape[:-1], self.d)

    def pose(
        self,
        lengths_m: ArrayLike,
        start: ArrayLike | None = None,
        *,
        tension_N: ArrayLike | None = None,
        tilt_rad: ArrayLike | None = None,
    ) -> FloatArray:
        """Return the poses (..., 7), x y z w x y z, at which cables have these lengths (..., n).

        A least-squares search starts at the position `start` (d,), by default home. Poses are nan
        if the search fails. If the cables do not control the rotation of a platform in space, it
        hangs in equilibrium. Readings of load cells at the winches, `tension_N` (..., n), and of an
        inclinometer, `tilt_rad` (..., 2), then make the pose more accurate. `tilt_rad` is roll and
        pitch of the platform's frame, which is turned by roll about x, pitch about y and yaw about
        z.
        """
        given, poses = self._found(lengths_m, start, tension_N, tilt_rad)
        found = np.full((len(poses), 7), np.nan)
        for row, pose in zip(found, poses, strict=True):
            if pose is not None:
                write_quaternion(pose.array, row)
        return found.reshape(*given.shape[:-1], 7)

    def _found(
        self,
        lengths_m: ArrayLike,
        start: ArrayLike | None,
        tension_N: ArrayLike | None = None,
        tilt_rad: ArrayLike | None = None,
    ) -> tuple[FloatArray, list[Pose | None]]:
        """Return the lengths as an array, and a pose per row, None if the search fails."""
        kinematics = self._model.kinematics
        begin = self._model.pose(self.home if start is None else self._one(start))
        given = self._readings("lengths_m", lengths_m, self.n)
        rows = given.reshape(-1, self.n)
        sensed: list[FloatArray | None] = [None] * len(rows)
        pulled = list(sensed)
        if not kinematics.hangs_freely:
            if tension_N is not None or tilt_rad is not None:
                why = "allowed only for a platform on fewer than 6 cables that hangs freely"
                raise InvalidArgument(f"tension_N, tilt_rad: {why}")
            found = (kinematics.pose_from_lengths(row, begin, restarts=8) for row in rows)
            return given, [Pose(s.pose.p, s.pose.Q) if s.converged else None for s in found]
        if tension_N is not None:
            pulled = list(self._readings("tension_N", tension_N, self.n, given.shape[:-1]))
        if tilt_rad is not None:
            tilts = self._readings("tilt_rad", tilt_rad, 2, given.shape[:-1])
            sensed = [upward(tilt) for tilt in tilts]
        search = HangingSearch(self._model)
        of_rows = zip(rows, pulled, sensed, strict=True)
        return given, [search.find(row, begin, *seen) for row, *seen in of_rows]

    def _readings(
        self, name: str, given: ArrayLike, size: int, shape: tuple[int, ...] | None = None
    ) -> FloatArray:
        """Return sensor readings as an array (..., size), or (m, size) if `shape` is given."""
        values = _numbers(name, given)
        fits = values.ndim > 0 and values.shape[-1] == size and np.isfinite(values).all()
        if not fits or shape not in (None, values.shape[:-1]):
            wanted = f"(..., {size})" if shape is None else f"{(*shape, size)}"
            raise _unfit(name, values, wanted)
        return values if shape is None else values.reshape(-1, size)

    def tensions(self, position: ArrayLike, wrench: ArrayLike | None = None) -> FloatArray:
        """Return the tensions (..., n), N, at rest, by the distribution of the robot's file.

        `wrench` (d,) or (..., d) acts on the platform besides gravity. Tensions apply to the middle
        of each cable. They keep the controller's reserve from both bounds; they are nan if that is
        impossible. A user-written distribution receives the tensions of the built-in one as
        `previous`. Raises InvalidRobot if the user has not allowed the code in the file, and
        InvalidArgument if that code fails.
        """
        rows, shape = self._rows(position)
        acting = np.zeros((len(rows), 6))
        acting[:, list(self._model.kinematics.directions)] = self._wrenches(wrench, shape)
        force = acting[:, :3] + self._weight_N()
        # about the centre of mass, where gravity has no moment
        moment = acting[:, 3:] - np.cross(self._centres_m(rows), acting[:, :3])
        try:
            found, carried = self._model.planned_tensions(
                self._model.poses(rows), self._reduced(force, moment), self._distribution
            )
        except ProfileError as error:
            raise InvalidRobot(str(error)) from None
        except TensionDistributionError as error:
            raise InvalidArgument(str(error)) from None
        found[~carried] = np.nan
        return found.reshape(*shape, self.n)

    def capacity_margin(self, position: ArrayLike, acceleration_m_s2: float = 0.0) -> FloatArray:
        """Return the margin of all tensions to their bounds, (...), N; below 0: infeasible.

        With an acceleration, it is the smallest margin over all combinations of acceleration
        directions. It is -inf if the cables do not control a direction.
        """
        rows, shape = self._rows(position)
        acceleration = _numbers("acceleration_m_s2", acceleration_m_s2)
        if acceleration.shape or not 0.0 <= acceleration < np.inf:
            raise InvalidArgument(f"acceleration_m_s2: {acceleration_m_s2!r}; want a number from 0")
        workspace = self._model.workspace(float(acceleration), 0.0)
        return workspace.capacity_margins(self._model.poses(rows)).reshape(shape)

    def is_feasible(self, position: ArrayLike, acceleration_m_s2: float = 0.0) -> BoolArray:
        """Return whether tensions within the bounds can hold the platform, (...)."""
        return np.asarray(self.capacity_margin(position, acceleration_m_s2) >= 0.0)

    @cached_property
    def _distribution(self) -> TensionDistribution | None:
        return self._own_distribution()

    def _weight_N(self) -> FloatArray:
        weight = np.zeros(3)
        weight[self._model.positions - 1] = self._model.weight()[self._model.positions - 1]
        return weight

    def _centres_m(self, rows: FloatArray) -> FloatArray:
        """Return the vectors (m, 3) from the platform's origin to its centre of mass."""
        centre_m = in_space(self._model.platform.centre_of_mass_m)
        return np.asarray(self._model.poses(rows)[:, 1:] @ centre_m)

    def _reduced(self, force: FloatArray, moment: FloatArray) -> FloatArray:
        """Return the controlled directions (m, d) of forces and moments (m, 3) or (3,)."""
        wrench = np.concatenate(np.broadcast_arrays(force, moment), axis=-1)
        return np.asarray(wrench[..., list(self._model.kinematics.directions)])

    def _wrenches(self, wrench: ArrayLike | None, shape: tuple[int, ...]) -> FloatArray:
        given = np.zeros(self.d) if wrench is None else _numbers("wrench", wrench)
        if given.shape not in ((self.d,), (*shape, self.d)) or not np.isfinite(given).all():
            raise _unfit("wrench", given, f"({self.d},) or {(*shape, self.d)}")
        return np.broadcast_to(given, (*shape, self.d)).reshape(-1, self.d)

    def _one(self, position: ArrayLike) -> FloatArray:
        rows, shape = self._rows(position)
        if shape:
            raise InvalidArgument(f"start: {len(rows)} positions; want one, ({self.d},)")
        return np.asarray(rows[0])

    def _rows(self, position: ArrayLike) -> tuple[FloatArray, tuple[int, ...]]:
        """Return the positions as rows (m, d), and their leading shape."""
        given, k = _numbers("position", position), self._model.positions
        if given.ndim == 0 or given.shape[-1] not in (k, self.d) or not np.isfinite(given).all():
            wanted = f"(..., {k})" + (f" or (..., {self.d})" if self.d > k else "")
            raise _unfit("position", given, wanted)
        rows = np.zeros((int(np.prod(given.shape[:-1])), self.d))
        rows[:, : given.shape[-1]] = given.reshape(-1, given.shape[-1])
        return rows, given.shape[:-1]


def _unfit(name: str, values: FloatArray, wanted: str) -> InvalidArgument:
    """Return the error for an array that is not finite, or not of the shape `wanted`."""
    found = f"shape {values.shape}" if np.isfinite(values).all() else "contains nan or infinity"
    return InvalidArgument(f"{name}: {found}; want finite numbers of shape {wanted}")


def _numbers(name: str, given: ArrayLike) -> FloatArray:
    """Convert the argument `name` to an array; raises InvalidArgument."""
    try:
        return real_array(given)
    except (TypeError, ValueError):
        raise InvalidArgument(f"{name}: {given!r}; want an array of numbers") from None
