"""Wrench-feasible workspace of n cables."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import bound
from cdpr_rt.model.kinematics import CableKinematics
from cdpr_rt.model.null_space import (
    MOST_NULL_DIRECTIONS,
    WrenchSets,
    null_spaces,
    write_circuit_margins,
)
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.rigid_body import G_m_s2
from cdpr_rt.model.tension_qp import write_margins

SHARES = np.linspace(0.0, 1.0, 33)


class CableWorkspace:
    """Wrench-feasible workspace: poses at which tensions within bounds carry given wrenches.

    The margin of a pose is the greatest distance, N, that all tensions can keep from both their
    bounds while they carry the worst of the wrenches: W t + w_e = 0, eq. (3.80). If it is negative,
    some tension must be outside its bounds by that much.
    """

    def __init__(
        self,
        kinematics: CableKinematics,
        wrenches: FloatArray,
        low_N: FloatArray,
        high_N: FloatArray,
        wrench_scale: FloatArray,
        reserve_N: float = 0.0,
        centre_m: FloatArray | None = None,
        generators: FloatArray | None = None,
    ) -> None:
        """Take wrenches (k, d) on the platform without the cables, and the tensions' bounds (n,).

        Any sum of a_k g_k, with |a_k| <= 1 and the `generators` g (j, d), may be added to each
        wrench.

        If the wrenches are about another point than the platform's origin, `centre_m` (3,) is that
        point in the platform's frame, and the kinematics are about that point. If it is the centre
        of mass, the wrench of the weight does not depend on the orientation. Poses are still those
        of the origin.

        The tensions keep `reserve_N` from both bounds, for effects that planning omits;
        `wrench_scale` (d,) is that of `TensionDistribution`.
        """
        self.kinematics, self.reserve_N = kinematics, reserve_N
        first = np.atleast_2d(np.asarray(wrenches, float))
        added = np.zeros((0, first.shape[1])) if generators is None else generators
        self.wrenches = corners(first, added)
        """The corners of the set of all wrenches with generators, (c, d)."""
        low, high = np.asarray(low_N, float) + reserve_N, np.asarray(high_N, float) - reserve_N
        self.sets = WrenchSets(
            np.zeros(3) if centre_m is None else np.array(centre_m, float),
            np.ascontiguousarray(np.vstack([first, added])),
            len(added),
            np.array(wrench_scale, float),
            np.array([low, high, 0.5 * (low + high)]),
        )
        self.low, self.high, _ = self.sets.bounds
        self._there = Pose(np.zeros(3))

    def prepared(self) -> CableWorkspace:
        """Prepare all arrays and kernels that cycles need; return this object."""
        self._one, self._way  # noqa: B018
        return self

    @cached_property
    def _one(self) -> _Pass:
        return _Pass(self, 1, 0.0)

    @cached_property
    def _way(self) -> _Pass:
        return _Pass(self, len(SHARES), 0.0)

    def margins(self, poses: FloatArray, most_N: float = math.inf) -> tuple[FloatArray, FloatArray]:
        """Return margins (m,), at most `most_N`, and the worst wrenches' tensions (m, n).

        `poses` (m, 4, 3) are `Pose.array` of each. Tensions are nan, and a margin -inf, if the
        cables cannot hold some direction.
        """
        tried = _Pass(self, len(poses), most_N)
        tried.poses[:] = poses
        tried.run()
        return tried.margins, tried.tensions

    def capacity_margins(self, poses: FloatArray, least_N: float = -math.inf) -> FloatArray:
        """Return the margins (m,) of `margins` alone, in closed form up to d + 2 cables.

        This is about ten times as fast. If a returned margin is below `least_N`, the true one may
        be lower still. If only feasibility matters, set `least_N` to the required margin.
        """
        if self.kinematics.n - len(self.kinematics.directions) > MOST_NULL_DIRECTIONS:
            return self.margins(poses)[0]
        matrices, margins = self.wrench_matrices(poses), np.zeros(len(poses))
        hanging = self.hanging_wrenches(poses)
        (d, n), k = matrices.shape[1:], len(self.sets.wrenches)
        side = max(n, 8)
        write_circuit_margins(
            matrices, hanging, self.sets, least_N, margins, np.zeros((k, n)), np.zeros((n + 1, n)),
            np.zeros((d, n + 1)), np.zeros((4, side, side)),
        )  # fmt: skip
        return margins

    def wrench_matrices(self, poses: FloatArray) -> FloatArray:
        """Return W (m, d, n) at the poses, about the point of the wrenches."""
        d, n = len(self.kinematics.directions), self.kinematics.n
        matrices = np.zeros((len(poses), d, n))
        self.kinematics.wrench_matrices(self._centred(poses), matrices)
        return matrices

    def hanging_wrenches(self, poses: FloatArray) -> FloatArray:
        """Return the wrenches (m, d) of the cables' weight at the poses."""
        return self.kinematics.hanging_wrenches(self._centred(poses))

    def _centred(self, poses: FloatArray) -> FloatArray:
        """Return the poses (m, 4, 3) of the point of the wrenches."""
        centred = np.array(poses, float)
        if self.sets.centre.any():
            centred[:, 0] += centred[:, 1:] @ self.sets.centre
        return centred

    def is_feasible(self, pose: Pose) -> bool:
        """Return whether the cables hold the platform; if `prepared`, allocate no arrays."""
        self._one.poses[0] = pose.array
        self._one.run_margins()
        return bool(self._one.margins[0] >= 0.0)

    def infeasibility(self, pose: Pose) -> str:
        """Return why the cables cannot hold the platform at a pose, "" if they can."""
        if self.is_feasible(pose):
            return ""
        self._one.run()
        margin_N = float(self._one.margins[0])
        why = infeasibility_text(margin_N, self._one.tensions[0], self.low, self.high)
        return f"{why} (with a reserve of {self.reserve_N:.1f} N)" if self.reserve_N else why

    def first_infeasible(self, poses: FloatArray) -> tuple[Pose, str] | None:
        """Return the first infeasible pose among `poses` (33, 4, 3) of a way, and why; or None.

        A way may begin at an infeasible pose and leave it. The pose is overwritten by the next
        call.
        """
        self._way.poses[:] = poses
        self._way.run_margins()
        held = self._way.margins >= 0.0
        first = int(held.argmax()) if held.any() else len(held) - 1
        if held[first:].all():
            return None
        k = first + int(held[first:].argmin())
        self._there.array[:] = poses[k]
        return self._there, self.infeasibility(self._there)


class _Pass:
    """Margins and tensions of m poses in one pass, with the arrays for their computation."""

    def __init__(self, workspace: CableWorkspace, m: int, most_N: float) -> None:
        kinematics, wrenches = workspace.kinematics, workspace.wrenches
        centre, _, _, scale, bounds = sets = workspace.sets
        (k, d), n = wrenches.shape, kinematics.n
        self.poses = np.zeros((m, 4, 3))
        self._centre, self._aside, self._centred = centre, np.zeros((m, 3)), self.poses
        if centre.any():
            self._centred = np.zeros((m, 4, 3))
        self.margins, self.tensions = np.zeros(m), np.zeros((m, n))
        self._kinematics, self.matrices = kinematics, np.zeros((m, d, n))
        self._hanging = np.zeros((m, d))
        spaces, particular = np.zeros((m, n + 1, n)), np.zeros((m, k, n))
        null_directions, scratch = np.zeros(m, np.int64), np.zeros((4, max(n, 8), max(n, 8)))
        self._null_spaces = bound(
            null_spaces, self.matrices, self._hanging, wrenches, scale, bounds,
            spaces, particular, null_directions, np.zeros((d, n + 1)), scratch,
        )  # fmt: skip
        self._write_margins = bound(
            write_margins, spaces, particular, null_directions, bounds, most_N,
            self.margins, self.tensions, np.zeros((4, n)), scratch,
        )  # fmt: skip
        self._circuits = None
        if n - d <= MOST_NULL_DIRECTIONS:
            self._circuits = bound(
                write_circuit_margins, self.matrices, self._hanging, sets, 0.0, self.margins,
                np.zeros((len(sets.wrenches), n)), spaces[0], np.zeros((d, n + 1)), scratch,
            )  # fmt: skip

    def run(self) -> None:
        """Write margins and tensions of `poses`."""
        self._write_matrices()
        self._null_spaces()
        self._write_margins()

    def run_margins(self) -> None:
        """Write margins of `poses` whose signs are exact; in closed form up to d + 2 cables."""
        if self._circuits is None:
            self.run()
            return
        self._write_matrices()
        self._circuits()

    def _write_matrices(self) -> None:
        if self._centred is not self.poses:
            self._centred[:] = self.poses
            np.matmul(self.poses[:, 1:], self._centre, out=self._aside)
            self._centred[:, 0] += self._aside
        self._kinematics.wrench_matrices(self._centred, self.matrices)
        self._kinematics.write_hanging_wrenches(self._centred, self._hanging)


def infeasibility_text(
    margin_N: float, tension_N: FloatArray, low_N: FloatArray, high_N: FloatArray
) -> str:
    """Return a text that says why tensions (n,) with a negative margin are infeasible."""
    if not math.isfinite(margin_N):
        return "the cables cannot hold one direction with any tensions"
    i = int(np.argmax(np.maximum(low_N - tension_N, tension_N - high_N)))
    return (
        f"cable {i + 1} would need {tension_N[i]:.1f} N, {low_N[i]:g} to {high_N[i]:g} N allowed: "
        f"{-margin_N:.1f} N outside"
    )


def corners(wrenches: FloatArray, generators: FloatArray) -> FloatArray:
    """Return the corners (k 2^j, d) of the sets w + sum a_k g_k, |a_k| <= 1."""
    signs = np.array(list(itertools.product((1.0, -1.0), repeat=len(generators))))
    added = signs.reshape(len(signs), len(generators)) @ np.asarray(generators)
    return np.ascontiguousarray((wrenches[:, None] + added).reshape(-1, wrenches.shape[1]))


def wrenches_in_motion(
    mass_kg: float,
    acceleration_m_s2: float,
    up: int,
    directions: Sequence[int],
    turning_Nm: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return the wrenches on a platform accelerated along all directions: w (1, d), g (j, d).

    w is the weight, which acts against coordinate `up`. The generators g are the forces that
    accelerate along each controlled coordinate, and the moments `turning_Nm` (3, 3), whose rows
    belong to the angular acceleration about each axis. The set includes rest. All wrenches are
    about the centre of mass.
    """
    motions = [np.eye(6)[i] * mass_kg * acceleration_m_s2 for i in directions if i < 3]
    if turning_Nm is not None and turning_Nm.any():
        motions += [np.concatenate([np.zeros(3), turning_Nm[i - 3]]) for i in directions if i >= 3]
    if not acceleration_m_s2:
        motions = []
    weight = np.zeros((1, 6))
    weight[0, up] = -mass_kg * G_m_s2
    chosen = list(directions)
    return weight[:, chosen], np.reshape(motions, (-1, 6))[:, chosen]
