"""Kinematics of a platform on n cables with two to six controlled directions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.jit import bound
from cdpr_rt.robots.kinematics import cable_kernel, normal_equations, pose_search
from cdpr_rt.robots.kinematics.cable_model import CableModel, write_unstretched_lengths
from cdpr_rt.robots.kinematics.pose import Pose

PLANAR_POINT = (0, 1)
PLANAR = (0, 1, 5)
POINT = (0, 1, 2)
SPATIAL = (0, 1, 2, 3, 4, 5)
"""Controlled components of the twist (x, y, z, about x, about y, about z)."""

_ACCEPTED_SIGMAS = 3.0
_MOST_CORRECTIONS = 20
_CORRECTED_m = 1e-10


@dataclass
class PoseSolution:
    """A pose from cable lengths; it belongs to the kinematics and is overwritten by its next."""

    pose: Pose
    converged: bool = False
    """False too where the lengths leave a direction free."""
    steps: int = 0
    residual_m: float = np.inf
    """Root mean square over the cables of what their lengths are off."""


class CableKinematics:
    """Lengths, Jacobian and pose from lengths of n cables, each straight, elastic or sagging.

    Eqs. (3.1) to (3.15) on the group of positions and rotations, with every cable's length, as
    compiled kernels over (6, n). The methods write into what belongs to the object and allocate
    nothing where `out` is given; one object serves one thread.
    """

    def __init__(
        self,
        exit_points_m: FloatArray,
        anchor_points_m: FloatArray,
        directions: Sequence[int] = SPATIAL,
        *,
        model: CableModel | None = None,
        pulley_radius_m: FloatArray | float = 0.0,
        swivel_axes: FloatArray | None = None,
        weights_N_m: FloatArray | float = 0.0,
        home: Pose | None = None,
        length_std_m: float = 1e-3,
    ) -> None:
        """Take exit points in the room, anchor points on the platform: (n, 3), in a plane (n, 2).

        Up is the last coordinate. `swivel_axes` (n, 3) are unit vectors along which cables come up
        to their pulleys (default: up). `weights_N_m` are the cables' weights per length as far as
        they count in equilibrium, see `hanging_wrenches`. `home` has the rotation around which the
        platform is turned at all, which restarts make use of; `length_std_m` is the standard
        deviation of a length.
        Raises GeometryError for what is no robot.
        """
        a, b = _points(exit_points_m, "exit points"), _points(anchor_points_m, "anchor points")
        if a.shape != b.shape:
            raise GeometryError(f"{len(a)} exit points, {len(b)} anchor points; allowed: as many")
        self.n = len(a)
        self.directions = _checked_directions(directions, self.n)
        self.model = model or CableModel()
        self._up = np.eye(3)[np.shape(exit_points_m)[1] - 1]
        self.geometry = np.zeros((cable_kernel.GEOMETRY_ROWS, self.n))
        """Array `geometry` of `cable_kernel`; `solver` is that of `normal_equations`."""
        self.geometry[: cable_kernel.ANCHOR] = a.T
        self.geometry[cable_kernel.ANCHOR : cable_kernel.RADIUS] = b.T
        self.geometry[cable_kernel.RADIUS] = pulley_radius_m
        axes = self._up if swivel_axes is None else np.asarray(swivel_axes, float)
        self.geometry[cable_kernel.AXIS : cable_kernel.WEIGHT] = np.broadcast_to(
            axes, (self.n, 3)
        ).T
        self.geometry[cable_kernel.WEIGHT :] = np.outer(-self._up, np.ones(self.n) * weights_N_m)
        self._hangs = bool(self.geometry[cable_kernel.WEIGHT :].any())
        _check_pulleys(self.geometry)
        if not 0.0 < length_std_m < math.inf:
            raise GeometryError(f"length_std_m: value {length_std_m:g}; allowed: above 0")
        self.length_std_m = length_std_m
        redundant = max(self.n - len(self.directions), 1)
        self._chosen = np.array(self.directions)
        self._cables = np.zeros((cable_kernel.CABLE_ROWS, self.n))
        self.solver = np.zeros((normal_equations.SOLVER_ROWS, 6))
        self.solver[normal_equations.DIRECTIONS, self._chosen] = 1.0
        self.solver[normal_equations.ACCEPTED] = (_ACCEPTED_SIGMAS * length_std_m) ** 2 * redundant
        kept = self.solver[normal_equations.SAVED_POSES :].reshape(4, 4, 3)
        kept[pose_search.HOME] = (home or Pose(np.zeros(3))).array
        self._solution = PoseSolution(Pose(np.zeros(3)))
        self._target, self._slack_free = np.zeros(self.n), np.zeros(self.n)
        self._no_tension = np.zeros(self.n)

    @property
    def turns_freely(self) -> bool:
        """Whether a platform in a plane has an orientation that no cable controls."""
        anchors = self.geometry[cable_kernel.ANCHOR : cable_kernel.RADIUS]
        return self.directions == PLANAR_POINT and bool(np.ptp(anchors, axis=1).any())

    def lengths(self, pose: Pose, tension_N: FloatArray | None = None) -> FloatArray:
        """Return the lengths (n,) without tension of cables that hold `tension_N` (n,) at `pose`.

        Tensions act at the platform; without them they are 0. Lengths on pulleys are counted from
        where a cable comes in. Raises GeometryError where an anchor is in its exit point or
        pulley, or a cable under that tension does not carry itself.
        """
        self._run(pose)
        rho = np.empty(self.n)
        self._unstretch(self._no_tension if tension_N is None else tension_N, rho)
        if not np.isfinite(rho).all():
            i = int(np.argmin(np.isfinite(rho)))
            raise GeometryError(f"cable {i + 1}: does not carry itself under the tension given")
        return rho

    def jacobian(self, pose: Pose) -> FloatArray:
        """Return J (n, d), eqs. (3.10), (3.14): derivative of straight lengths by the twist.

        A cable's row is (u, Q b × u), u being the unit vector from exit to anchor. Raises
        GeometryError where an anchor is in its exit point or pulley.
        """
        self._run(pose)
        return np.asarray(self._cables[self._chosen].T)

    def wrench_matrix(self, pose: Pose, out: FloatArray | None = None) -> FloatArray:
        """Return W = -J^T (d, n): forces, then moments about the platform's origin, room's axes.

        Cables pull from anchor to exit: tensions t and the external wrench w_e are in equilibrium
        where W t + w_e = 0, eq. (3.80). Raises GeometryError as `jacobian` does.
        """
        self._run(pose)
        W = np.take(self._cables, self._chosen, axis=0, out=out, mode="clip")
        return np.negative(W, out=W)

    def wrench_matrices(self, poses: FloatArray, out: FloatArray) -> None:
        """Write W (m, d, n) at the arrays of m poses (m, 4, 3); nan where a cable has no length."""
        cable_kernel.wrench_matrices(self.geometry, poses, self._chosen, self._cables, out)

    def hanging_wrenches(self, poses: FloatArray) -> FloatArray:
        """Return the wrench (m, d) of the cables' weight on the platform at poses (m, 4, 3).

        Half of each cable's, at its anchor point; then W t + w_e = 0 holds for the tensions t in
        the middle of the cables where w_e has it, see `cable_kernel.hang`.
        """
        out = np.zeros((len(poses), len(self.directions)))
        self.write_hanging_wrenches(poses, out)
        return out

    def hanging(self, pose: Pose) -> tuple[FloatArray, FloatArray]:
        """Return the wrench (d,) of the cables' weight at a pose, and the winches' rise (n,), N.

        That is by how much tensions at the exits are above those in the middle of the cables, see
        `cable_kernel.tension_rise`. Raises GeometryError as `jacobian` does.
        """
        self._run(pose)
        rise_N = np.empty(self.n)
        cable_kernel.write_tension_rises(self.geometry, self._cables, rise_N)
        return self.hanging_wrenches(pose.array[None])[0], rise_N

    def sag_N3_m(self, pose: Pose) -> FloatArray:
        """Return (w a)² ρ/12 of each cable, (n,): by that over t³ it becomes shorter for a newton.

        By what the sag of a flat parabola of weight w per length and free length ρ, a of it across,
        changes with its tension t. 0 of weightless cables.
        """
        self._run(pose)
        u, free = self._cables[:3], self._cables[cable_kernel.FREE]
        weight = self.geometry[cable_kernel.WEIGHT :]
        across = (weight**2).sum(axis=0) - (u * weight).sum(axis=0) ** 2
        return np.asarray(across * free**3 / 12.0)

    def write_hanging_wrenches(self, poses: FloatArray, out: FloatArray) -> None:
        """Write these into `out` (m, d), which stays as it is where the cables are weightless."""
        if self._hangs:
            cable_kernel.hanging_wrenches(self.geometry, poses, self._chosen, self._cables, out)

    def geometric_stiffness(self, pose: Pose, tension_N: FloatArray) -> FloatArray:
        """Return ∂(J^T t)/∂(twist) (6, 6) of cables that hold tensions t (n,), all directions.

        With b from the origin to an anchor, u the cable's direction, ρ its free length and n the
        unit vector across its pulley's plane, h from the swivel axis,

            Σ t B^T ((1 - u u^T - n n^T)/ρ + n n^T |axis × u|/h) B + t [u]× [b]×    B = (1, -[b]×)

        the last about the axes alone; without a pulley the bracket is (1 - u u^T)/ρ. Behzadipour
        and Khajepour, Stiffness of Cable-based Parallel Manipulators, J. Mech. Des. 128 (2006).
        """
        self._run(pose)
        stiffness = np.zeros((6, 6))
        for i, t in enumerate(tension_N):
            u, free = self._cables[:3, i], self._cables[cable_kernel.FREE, i]
            b = pose.Q @ self.geometry[cable_kernel.ANCHOR : cable_kernel.RADIUS, i]
            bends = (np.eye(3) - np.outer(u, u)) / free
            if self.geometry[cable_kernel.RADIUS, i] > 0.0:
                bends += self._swivels(pose, b, i)
            X = np.array([[0.0, -b[2], b[1]], [b[2], 0.0, -b[0]], [-b[1], b[0], 0.0]])
            moved = np.hstack([np.eye(3), -X])
            stiffness += t * moved.T @ bends @ moved
            stiffness[3:, 3:] += t * (np.outer(b, u) - (u @ b) * np.eye(3))
        return stiffness

    def _swivels(self, pose: Pose, b: FloatArray, i: int) -> FloatArray:
        """Return what a pulley adds to a cable's turn by its anchor, (3, 3): n n^T (|a×u|/h - 1/ρ).

        Nothing where the cable leaves along the swivel axis.
        """
        axis = self.geometry[cable_kernel.AXIS : cable_kernel.WEIGHT, i]
        exit_m = self.geometry[:3, i]
        across = np.cross(axis, self._cables[:3, i])
        size, h = np.linalg.norm(across), np.linalg.norm(np.cross(axis, pose.p + b - exit_m))
        if not min(size, h) > 0.0:
            return np.zeros((3, 3))
        n = across / size
        return np.asarray(np.outer(n, n) * (size / h - 1.0 / self._cables[cable_kernel.FREE, i]))

    def pose_from_lengths(
        self,
        lengths_m: FloatArray,
        start: Pose,
        tension_N: FloatArray | None = None,
        restarts: int = 0,
    ) -> PoseSolution:
        """Return the pose that minimises Σ (ρ - lengths)², searched from `start`, eq. (3.15).

        Directions that are not controlled stay as in `start`. With `restarts` above 0 it is tried
        from so many other poses as well where the lengths do not agree within 3 length_std_m, for
        a start that is not known well; in a cycle, 0. That none is found raises nothing: see
        `converged`. Raises GeometryError for what are not n lengths.
        """
        found, lengths_m = self._solution, np.ascontiguousarray(lengths_m, float)
        if lengths_m.shape != (self.n,):  # compiled code would read on behind them
            raise GeometryError(f"lengths {lengths_m.shape}; allowed: ({self.n},)")
        pose_search.copy_pose(start.array, found.pose.array)
        if self.model.is_rigid:
            self._search(lengths_m, restarts)
            return found
        tension = self._no_tension if tension_N is None else tension_N
        self._target[:] = 0.0
        for _ in range(_MOST_CORRECTIONS):
            cable_kernel.run_cables(self.geometry, found.pose.array, self._cables)
            self._unstretch(tension, self._slack_free)
            straight = self._cables[cable_kernel.FREE] + self._cables[cable_kernel.ARC]
            target = lengths_m * straight / self._slack_free
            done = bool(np.abs(target - self._target).max() < _CORRECTED_m)
            if done:
                return found
            self._target[:] = target
            self._search(self._target, restarts)
        found.converged = False
        return found

    def covariance(self, pose: Pose, out: FloatArray | None = None) -> FloatArray:
        """Return σ² (J^T J)^-1 (6, 6) of a pose found from lengths whose deviation is σ.

        In m² and rad²; 0 for directions that are not controlled, nan where one is free.
        """
        covariance = np.empty((6, 6)) if out is None else out
        cable_kernel.run_cables(self.geometry, pose.array, self._cables)
        normal_equations.covariance(self._cables, self.solver, self.length_std_m**2, covariance)
        return covariance

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: all but machine code that is bound to this object's arrays."""
        return {name: value for name, value in self.__dict__.items() if name != "_find_pose"}

    @cached_property
    def _find_pose(self) -> Callable[[FloatArray, FloatArray, int], tuple[int, int, float]]:
        return bound(
            pose_search.find_pose, self.geometry, self._cables, self.solver,
            then=(self._target, self._solution.pose.array, 0),
        )  # fmt: skip

    def _search(self, lengths_m: FloatArray, restarts: int) -> None:
        found = self._solution
        status, found.steps, cost = self._find_pose(lengths_m, found.pose.array, restarts)
        found.converged = status == pose_search.CONVERGED
        found.residual_m = math.sqrt(cost / self.n)

    def _run(self, pose: Pose) -> None:
        cable_kernel.run_cables(self.geometry, pose.array, self._cables)
        if not self._cables[cable_kernel.FREE].min() > 0.0:
            i = int(np.argmin(self._cables[cable_kernel.FREE] > 0.0))
            raise GeometryError(f"cable {i + 1}: its anchor point is in its exit point or pulley")

    def _unstretch(self, tension_N: FloatArray, rho: FloatArray) -> None:
        cables = self._cables
        write_unstretched_lengths(
            cables[:3], cables[cable_kernel.FREE], cables[cable_kernel.ARC], self._up, tension_N,
            1.0 / self.model.stiffness_N, self.model.weight_N_m, rho,
        )  # fmt: skip


def _points(given: FloatArray, what: str) -> FloatArray:
    points = np.asarray(given, float)
    if points.ndim != 2 or points.shape[1] not in {2, 3}:
        raise GeometryError(f"{what} {points.shape}; allowed: (n, 3), or (n, 2) in a plane")
    if not np.isfinite(points).all():
        raise GeometryError(f"{what}: cable {_first(points)}; allowed: finite numbers")
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))


def _first(points: FloatArray) -> int:
    return int(np.argmin(np.isfinite(points).all(axis=1))) + 1


def _checked_directions(given: Sequence[int], n: int) -> tuple[int, ...]:
    directions = tuple(given)
    if sorted(set(directions) & set(range(6))) != list(directions) or len(directions) < 2:
        raise GeometryError(
            f"controlled directions {directions}; allowed: two to six of 0 to 5, ascending"
        )
    if n < len(directions):
        raise GeometryError(
            f"{n} cables for {len(directions)} directions; allowed: at least as many cables"
        )
    return directions


def _check_pulleys(geometry: FloatArray) -> None:
    radius = geometry[cable_kernel.RADIUS]
    axes = geometry[cable_kernel.AXIS : cable_kernel.WEIGHT]
    if not (radius >= 0.0).all() or not np.isfinite(radius).all():
        raise GeometryError(f"pulley radius {radius.min():g} m; allowed: 0 and above")
    size = np.linalg.norm(axes, axis=0)
    if not (np.abs(size - 1.0) < 1e-6).all():
        raise GeometryError(f"swivel axis of length {size[0]:g}; allowed: unit vectors")
