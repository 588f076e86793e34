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
from cdpr_rt.model import cable_kernel, pose_search
from cdpr_rt.model.cable_kernel import write_unstretched_lengths
from cdpr_rt.model.pose import Pose

PLANAR_POINT = (0, 1)
PLANAR = (0, 1, 5)
POINT = (0, 1, 2)
SPATIAL = (0, 1, 2, 3, 4, 5)
"""Controlled components of the twist (x, y, z, about x, about y, about z)."""

_ACCEPTED_SIGMAS = 3.0


@dataclass
class PoseSolution:
    """A pose from cable lengths; owned by the kinematics and overwritten by its next search."""

    pose: Pose
    converged: bool = False
    """Whether the search has converged; False also if the lengths do not determine a direction."""
    steps: int = 0
    residual_m: float = np.inf
    """Root mean square of the lengths' errors over the cables."""


class CableKinematics:
    """Lengths and Jacobian of n straight cables; pose from their lengths.

    Eqs. (3.1) to (3.15) for positions and rotations, with the lengths of all cables, as compiled
    kernels over (6, n). The methods write into arrays of the object and allocate nothing if `out`
    is given. An object must be used by one thread only.
    """

    def __init__(
        self,
        exit_points_m: FloatArray,
        anchor_points_m: FloatArray,
        directions: Sequence[int] = SPATIAL,
        *,
        pulley_radius_m: FloatArray | float = 0.0,
        swivel_axes: FloatArray | None = None,
        weights_N_m: FloatArray | float = 0.0,
        home: Pose | None = None,
        length_std_m: float = 1e-3,
    ) -> None:
        """Take exit points in the room, anchor points on the platform: (n, 3), in a plane (n, 2).

        The last coordinate points up. `swivel_axes` (n, 3) are unit vectors along which cables come
        up to their pulleys (default: up). `weights_N_m` are the weights of the cables per length,
        used in the equilibrium, see `hanging_wrenches`. `home` has the orientation at home, from
        which restarts of the search begin. `length_std_m` is the standard deviation of a length.
        """
        a, b = _points(exit_points_m), _points(anchor_points_m)
        self.n, self.directions = len(a), tuple(directions)
        self._up = np.eye(3)[np.shape(exit_points_m)[1] - 1]
        self.geometry = np.zeros((cable_kernel.GEOMETRY_ROWS, self.n))
        """Array `geometry` of `cable_kernel`; `solver` is that of `pose_search`."""
        self.geometry[: cable_kernel.ANCHOR] = a.T
        self.geometry[cable_kernel.ANCHOR : cable_kernel.RADIUS] = b.T
        self.geometry[cable_kernel.RADIUS] = pulley_radius_m
        axes = self._up if swivel_axes is None else np.asarray(swivel_axes, float)
        self.geometry[cable_kernel.AXIS : cable_kernel.WEIGHT] = np.broadcast_to(
            axes, (self.n, 3)
        ).T
        self.geometry[cable_kernel.WEIGHT :] = np.outer(-self._up, np.ones(self.n) * weights_N_m)
        self._hangs = bool(self.geometry[cable_kernel.WEIGHT :].any())
        redundant = max(self.n - len(self.directions), 1)
        self._chosen = np.array(self.directions)
        self._cables = np.zeros((cable_kernel.CABLE_ROWS, self.n))
        self.solver = np.zeros((pose_search.SOLVER_ROWS, 6))
        self.solver[pose_search.DIRECTIONS, self._chosen] = 1.0
        self.solver[pose_search.ACCEPTED] = (_ACCEPTED_SIGMAS * length_std_m) ** 2 * redundant
        kept = self.solver[pose_search.SAVED_POSES :].reshape(4, 4, 3)
        kept[pose_search.HOME] = (home or Pose(np.zeros(3))).array
        self._solution = PoseSolution(Pose(np.zeros(3)))
        self._no_tension = np.zeros(self.n)

    @property
    def turns_freely(self) -> bool:
        """Whether a platform in a plane has an orientation that no cable controls."""
        anchors = self.geometry[cable_kernel.ANCHOR : cable_kernel.RADIUS]
        return self.directions == PLANAR_POINT and bool(np.ptp(anchors, axis=1).any())

    @property
    def hangs_freely(self) -> bool:
        """Whether a platform in space has too few cables to control its orientation."""
        anchors = self.geometry[cable_kernel.ANCHOR : cable_kernel.RADIUS]
        in_space, free = bool(self._up[2]), len(self.directions) < len(SPATIAL)
        return in_space and free and self.n < len(SPATIAL) and bool(np.ptp(anchors, axis=1).any())

    def lengths(self, pose: Pose) -> FloatArray:
        """Return the lengths (n,) of straight cables without tension at `pose`.

        A length on a pulley begins at the point at which the cable comes in. Raises GeometryError
        if an anchor is in its exit point or pulley.
        """
        self._run(pose)
        cables, rho = self._cables, np.empty(self.n)
        write_unstretched_lengths(
            cables[:3], cables[cable_kernel.FREE], cables[cable_kernel.ARC], self._up,
            self._no_tension, 0.0, 0.0, rho,
        )  # fmt: skip
        return rho

    def jacobian(self, pose: Pose) -> FloatArray:
        """Return J (n, d), eqs. (3.10), (3.14): derivative of straight lengths by the twist.

        A cable's row is (u, Q b × u), u being the unit vector from exit to anchor. Raises
        GeometryError if an anchor is in its exit point or pulley.
        """
        self._run(pose)
        return np.asarray(self._cables[self._chosen].T)

    def wrench_matrix(self, pose: Pose, out: FloatArray | None = None) -> FloatArray:
        """Return W = -J^T (d, n): forces, then moments about the platform's origin, room's axes.

        Cables pull from anchor to exit: tensions t and the external wrench w_e are in equilibrium
        if W t + w_e = 0, eq. (3.80). Raises GeometryError as `jacobian` does.
        """
        self._run(pose)
        W = np.take(self._cables, self._chosen, axis=0, out=out, mode="clip")
        return np.negative(W, out=W)

    def wrench_matrices(self, poses: FloatArray, out: FloatArray) -> None:
        """Write W (m, d, n) at the arrays of m poses (m, 4, 3); nan if a cable has no length."""
        cable_kernel.wrench_matrices(self.geometry, poses, self._chosen, self._cables, out)

    def hanging_wrenches(self, poses: FloatArray) -> FloatArray:
        """Return the wrench (m, d) of the cables' weight on the platform at poses (m, 4, 3).

        It is half of the weight of each cable at its anchor point. If w_e includes it, W t + w_e =
        0 holds for the tensions t in the middle of the cables, see `cable_kernel.hang`.
        """
        out = np.zeros((len(poses), len(self.directions)))
        self.write_hanging_wrenches(poses, out)
        return out

    def hanging(self, pose: Pose) -> tuple[FloatArray, FloatArray]:
        """Return the wrench (d,) of the cables' weight at a pose, and the tension rises (n,), N.

        A rise is the excess of the tension at the exit point over that in the middle of the cable,
        see `cable_kernel.tension_rise`. Raises GeometryError as `jacobian` does.
        """
        self._run(pose)
        rise_N = np.empty(self.n)
        cable_kernel.write_tension_rises(self.geometry, self._cables, rise_N)
        return self.hanging_wrenches(pose.array[None])[0], rise_N

    def sag_N3_m(self, pose: Pose) -> FloatArray:
        """Return (w a)² ρ/12 of each cable, (n,); over t³ it is the change of length per newton.

        It follows from the sag of a flat parabola with weight w per length, free length ρ,
        horizontal extent a, and tension t. It is 0 for weightless cables.
        """
        self._run(pose)
        u, free = self._cables[:3], self._cables[cable_kernel.FREE]
        weight = self.geometry[cable_kernel.WEIGHT :]
        across = (weight**2).sum(axis=0) - (u * weight).sum(axis=0) ** 2
        return np.asarray(across * free**3 / 12.0)

    def write_hanging_wrenches(self, poses: FloatArray, out: FloatArray) -> None:
        """Write `hanging_wrenches` into `out` (m, d), unchanged if the cables are weightless."""
        if self._hangs:
            cable_kernel.hanging_wrenches(self.geometry, poses, self._chosen, self._cables, out)

    def geometric_stiffness(self, pose: Pose, tension_N: FloatArray) -> FloatArray:
        """Return ∂(J^T t)/∂(twist) (6, 6) at constant tensions t (n,), for all six directions.

        With b from the origin to an anchor, u the cable's direction, ρ its free length and n the
        unit vector across its pulley's plane, h from the swivel axis,

            Σ t B^T ((1 - u u^T - n n^T)/ρ + n n^T |axis × u|/h) B + t [u]× [b]×    B = (1, -[b]×)

        The last term is for rotations only. Without a pulley the bracket is (1 - u u^T)/ρ. Source:
        Behzadipour and Khajepour, Stiffness of Cable-based Parallel Manipulators, J. Mech. Des. 128
        (2006).
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
        """Return the pulley's term of the geometric stiffness, (3, 3): n n^T (|a×u|/h - 1/ρ).

        It is zero if the cable leaves along the swivel axis.
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
        self, lengths_m: FloatArray, start: Pose, restarts: int = 0
    ) -> PoseSolution:
        """Return the pose that minimises Σ (ρ - lengths)², searched from `start`, eq. (3.15).

        Cables are straight. Directions that are not controlled stay as in `start`. If the lengths
        do not agree within 3 length_std_m, the search starts again from up to `restarts` other
        poses, in case the start is far off. If it finds no pose, it raises nothing, see
        `converged`. Raises GeometryError if there are not n lengths.
        """
        found, lengths_m = self._solution, np.ascontiguousarray(lengths_m, float)
        if lengths_m.shape != (self.n,):  # compiled code would read past their end
            raise GeometryError(f"lengths {lengths_m.shape}; allowed: ({self.n},)")
        pose_search.copy_pose(start.array, found.pose.array)
        self._search(lengths_m, restarts)
        return found

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to pickle, without the machine code bound to this object's arrays."""
        return {name: value for name, value in self.__dict__.items() if name != "_find_pose"}

    @cached_property
    def _find_pose(self) -> Callable[[FloatArray, FloatArray, int], tuple[int, int, float]]:
        return bound(
            pose_search.find_pose, self.geometry, self._cables, self.solver,
            then=(self._no_tension, self._solution.pose.array, 0),
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
            raise GeometryError(
                f"cable {i + 1}: its anchor point lies at its exit point or inside its pulley"
            )


def _points(given: FloatArray) -> FloatArray:
    """Return points in a plane or in space as (n, 3)."""
    points = np.asarray(given, float)
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
