"""Measure cost and results of tension distribution from Python, compared with general solvers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from itertools import cycle, repeat
from typing import Any

import numpy as np
import osqp
import scipy.sparse as sp

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of
from cdpr_rt.model.tension_distribution import METHODS, TensionOutcome, TensionSolver
from cdpr_tools.bench.harness import Figures, Target, cost_rows, with_nothing_open
from cdpr_tools.output import Output

ROBOTS = ("spatial-8", "suspended-8")
IN_THE_CYCLE = "minimum-norm"
_BLOCK, _WARM_UP, _SEED = 500, 20, 1
_STRETCHED = 3.0
_FOUND = (TensionOutcome.FEASIBLE, TensionOutcome.SUBSTITUTED)

Solve = Callable[[FloatArray], tuple[bool, FloatArray]]
"""Takes W (d, n); returns whether tensions exist, and the tensions (n,)."""


def measure(poses: int, out: Output) -> Figures:
    """Solve `poses` poses of each robot by every method and solver."""
    figures = Figures(
        f"weight of the platform at {poses} poses of each robot, feasible or not: processor and "
        "wall time of a call from Python, us",
        {},
        more={"poses": poses},
    )
    for name in ROBOTS:
        model = platform_model_of(load_robot(name))
        matrices = _matrices(model, poses)
        ways = {method: _ours(model, method) for method in METHODS}
        if find_spec("daqp") is None:
            figures.notes = ["DAQP: not installed; it comes with: pip install daqp"]
        else:
            ways["DAQP"] = _daqp(model)
        ways["OSQP"] = _osqp(model, matrices[0])
        out.note(f"{name}: {poses} poses by {', '.join(ways)}")
        steps = {
            way: with_nothing_open(map(partial, repeat(solve), cycle(matrices)))
            for way, solve in ways.items()
        }
        rows = cost_rows(steps, poses, _BLOCK, _WARM_UP, (50.0, 99.0))
        for way, solve in ways.items():
            rows[way]["found, %"] = 100.0 * float(np.mean([solve(W)[0] for W in matrices]))
            figures.rows[f"{name}, {way}"] = rows[way]
        figures.targets[name] = Target(
            f"{name}, {IN_THE_CYCLE}, processor time p99, us", rows[IN_THE_CYCLE]["CPU p99"], 10.0
        )
    return figures


def _matrices(model: PlatformModel, count: int) -> list[FloatArray]:
    """Return W (d, n) at poses in the box of targets and far around it."""
    rng, platform = np.random.default_rng(_SEED), model.platform
    box = np.array([platform.workspace_min_m, platform.workspace_max_m])
    middle, half = box.mean(axis=0), 0.5 * _STRETCHED * (box[1] - box[0])
    places = rng.uniform(-1.0, 1.0, (count, model.size)) * 2.0 * model.angle_rad
    places[:, : model.positions] = middle + half * rng.uniform(-1.0, 1.0, (count, len(half)))
    return [model.kinematics.wrench_matrix(model.pose(q)).copy() for q in places]


def _ours(model: PlatformModel, method: str) -> Solve:
    """Return one of the project's methods, with the interface of the solvers."""
    low, high, t, w_e = model.low_N, model.high_N, np.zeros(model.kinematics.n), model.weight()
    reference = 0.5 * (low + high) if method == "minimum-deviation" else None
    distribution = TensionSolver(method, low, high, model.wrench_scale, reference)
    return lambda W: (distribution.solve(W, w_e, t) in _FOUND, t)


# General solvers for quadratic programs, with the same problem: minimum norm, eq. (3.80). Each is
# set up once and then gets one W after the other.


def _osqp(model: PlatformModel, W: FloatArray) -> Solve:
    """Return OSQP with its default settings, set up with a dense W (d, n)."""
    d, n = W.shape
    scale, b = model.wrench_scale[:, None], -model.weight() / model.wrench_scale
    # every column of the constraint matrix holds a column of W and one bound
    index = np.vstack([np.tile(np.arange(d)[:, None], n), d + np.arange(n)]).ravel("F")
    start = np.arange(0, n * (d + 1) + 1, d + 1)

    def values(W: FloatArray) -> FloatArray:
        return np.vstack([W / scale, np.ones(n)]).ravel("F")

    solver: Any = osqp.OSQP()
    rows = sp.csc_matrix((values(W), index, start), (d + n, n))
    low, high = np.concatenate([b, model.low_N]), np.concatenate([b, model.high_N])
    solver.setup(sp.eye(n, format="csc"), np.zeros(n), rows, low, high, verbose=False)

    def solve(W: FloatArray) -> tuple[bool, FloatArray]:
        solver.update(Ax=values(W))
        result = solver.solve(raise_error=False)
        return result.info.status == "solved", result.x

    return solve


def _daqp(model: PlatformModel) -> Solve:
    """Return DAQP with its default settings."""
    import daqp  # noqa: PLC0415  # an optional package

    n, d = model.kinematics.n, model.size
    scale, b = model.wrench_scale[:, None], -model.weight() / model.wrench_scale
    H, f, sense = np.eye(n), np.zeros(n), np.array([0] * n + [5] * d, dtype=np.int32)
    upper, lower = (np.concatenate([of, b]) for of in (model.high_N, model.low_N))

    def solve(W: FloatArray) -> tuple[bool, FloatArray]:
        t, _, flag, _ = daqp.solve(H, f, W / scale, upper, lower, sense)
        return flag == 1, t

    return solve
