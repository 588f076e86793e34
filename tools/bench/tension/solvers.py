"""General solvers of quadratic programs, given the same problem: minimum norm, eq. (3.80)."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
import osqp
import scipy.sparse as sp

from cdpr_rt.arrays import FloatArray
from cdpr_tools.bench.geometries import CableRobot


class Osqp:
    """OSQP, as set up by default or, `tight`, as the reference of what is feasible."""

    def __init__(self, robot: CableRobot, W: FloatArray, tight: bool) -> None:
        """Set it up with a dense W (6, n)."""
        n = W.shape[1]
        self.t = np.zeros(n)
        self._scale = robot.wrench_scale
        b = -robot.wrench_N_Nm / self._scale
        rows = sp.csc_matrix(np.vstack([np.ones_like(W), np.eye(n)]))
        columns = np.repeat(np.arange(n), np.diff(rows.indptr))
        self._inner = rows.indices < W.shape[0]
        self._row, self._column = rows.indices[self._inner], columns[self._inner]
        self._values = np.array(rows.data)
        self._solver = osqp.OSQP()
        exact: dict[str, Any] = {
            "eps_abs": 1e-9, "eps_rel": 1e-9, "eps_prim_inf": 1e-9, "max_iter": 100_000,
        }  # fmt: skip
        self._fill(W)
        rows.data[:] = self._values
        self._solver.setup(
            sp.eye(n, format="csc"),
            np.zeros(n),
            rows,
            np.concatenate([b, np.full(n, robot.low_N)]),
            np.concatenate([b, np.full(n, robot.high_N)]),
            verbose=False,
            **(exact if tight else {}),
        )

    def _fill(self, W: FloatArray) -> None:
        self._values[self._inner] = (W / self._scale[:, None])[self._row, self._column]

    def solve(self, W: FloatArray) -> bool:
        """Solve for one W (6, n), from where the last one ended."""
        self._fill(W)
        self._solver.update(Ax=self._values)
        result = self._solver.solve(raise_error=False)
        self.t[:] = result.x
        return bool(result.info.status == "solved")


class Piqp:
    """PIQP's dense solver, as set up by default."""

    def __init__(self, robot: CableRobot, W: FloatArray) -> None:
        """Set it up with a W (6, n)."""
        import piqp  # noqa: PLC0415  # not everybody has it

        n = W.shape[1]
        self.t = np.zeros(n)
        self._scale = robot.wrench_scale[:, None]
        self._solver = piqp.DenseSolver()
        self._solved = piqp.PIQP_SOLVED
        self._solver.setup(
            np.asfortranarray(np.eye(n)), np.zeros(n),
            np.asfortranarray(W / self._scale), -robot.wrench_N_Nm / robot.wrench_scale,
            x_l=np.full(n, robot.low_N), x_u=np.full(n, robot.high_N),
        )  # fmt: skip

    def solve(self, W: FloatArray) -> bool:
        """Solve for one W (6, n)."""
        self._solver.update(A=np.asfortranarray(W / self._scale))
        status = self._solver.solve()
        self.t[:] = self._solver.result.x
        return bool(status == self._solved)


class Daqp:
    """DAQP, as set up by default."""

    def __init__(self, robot: CableRobot, W: FloatArray) -> None:
        """Set it up with a W (6, n)."""
        import daqp  # noqa: PLC0415  # not everybody has it

        d, n = W.shape
        self.t = np.zeros(n)
        self._scale = robot.wrench_scale[:, None]
        b = -robot.wrench_N_Nm / robot.wrench_scale
        self._problem = (
            np.eye(n), np.zeros(n), W / self._scale,
            np.concatenate([np.full(n, robot.high_N), b]),
            np.concatenate([np.full(n, robot.low_N), b]),
            np.array([0] * n + [5] * d, dtype=np.int32),
        )  # fmt: skip
        self._solve = daqp.solve

    def solve(self, W: FloatArray) -> bool:
        """Solve for one W (6, n)."""
        H, f, _, upper, lower, sense = self._problem
        x, _, flag, _ = self._solve(H, f, W / self._scale, upper, lower, sense)
        self.t[:] = x
        return bool(flag == 1)


Solver = Osqp | Piqp | Daqp
"""It is set up once and given one W after the other."""
_SOLVERS: dict[str, tuple[str, Callable[[CableRobot, FloatArray], Solver]]] = {
    "daqp": ("daqp", Daqp),
    "piqp": ("piqp", Piqp),
    "osqp": ("osqp", lambda robot, W: Osqp(robot, W, tight=False)),
    "osqp-tight": ("osqp", lambda robot, W: Osqp(robot, W, tight=True)),
}


def solvers(robot: CableRobot, W: FloatArray) -> tuple[dict[str, Solver], list[str]]:
    """Return the solvers that are installed, set up, and the names of those that are not."""
    absent = [name for name, (package, _) in _SOLVERS.items() if find_spec(package) is None]
    made = {name: make(robot, W) for name, (_, make) in _SOLVERS.items() if name not in absent}
    return made, absent
