"""What it costs to tell whether cables hold a pose, and what three ways say of the same volume."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
import osqp
import scipy.sparse as sp
from numpy.typing import NDArray

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.platform_model import PlatformModel, platform_model_of
from cdpr_rt.robots.statics import view_of
from cdpr_rt.robots.workspace import CableWorkspace
from cdpr_rt.robots.workspace_analysis.criterion import criterion_of
from cdpr_tools.bench.timing import verdict
from cdpr_tools.robots.workspace.search import Search, search

TARGET_s, TARGET_SHARE = 30.0, 0.02
"""For a million poses; of the volume."""
ROBOT = "spatial-8"
CELLS, RAYS = 60, 5000
_SEED = 14
_BLOCK = 50_000
_NEAR_N = 0.5
"""Margins nearer to 0 than this are left out where yes and no are compared: tolerances differ."""
_METHODS = {
    "margins": "ours: margins in closed form",
    "active set": "ours, before: active set, every corner",
    "osqp": "OSQP, every corner until one is not held",
    "pycapacity": "pycapacity: half-spaces, then every corner",
}

Held = NDArray[np.bool_]
Method = Callable[[FloatArray], Held]


def measure(poses: int, compared: int, out: Any) -> dict[str, Any]:
    """Check so many poses, `compared` of them by the other methods too; `out` says what goes on."""
    model = platform_model_of(load_robot(ROBOT))
    workspace = model.workspace(None, 0.0)
    drawn = _poses(model, poses)
    out.note(f"{poses} poses of {ROBOT}, {len(workspace.wrenches)} corners of wrenches")
    workspace.capacity_margins(drawn[:10])
    begun, held = time.process_time(), 0
    for k in range(0, poses, _BLOCK):
        held += int((workspace.capacity_margins(drawn[k : k + _BLOCK], 0.0) >= 0.0).sum())
    spent_s = time.process_time() - begun
    out.note(f"{compared} of them by others")
    figures: dict[str, Any] = {
        "robot": ROBOT,
        "poses": poses,
        "held_share": held / poses,
        "spent_s": spent_s,
        "million_s": 1e6 * spent_s / poses,
        "target_s": TARGET_s,
        "compared": compared,
        "others": _others(workspace, drawn[:compared]),
        "not_installed": [] if find_spec("pycapacity") else ["pycapacity"],
        "volume": _volume(model, poses, out),
    }
    figures["reached"] = {
        "cost": figures["million_s"] <= TARGET_s,
        "agreement": abs(figures["volume"]["rays_against_grid"]) <= TARGET_SHARE,
    }
    return figures


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as a table, a line for each method."""
    volume = figures["volume"]
    lines = [
        f"{figures['poses']} poses of {figures['robot']}, {100.0 * figures['held_share']:.0f} % of "
        f"them held: {figures['spent_s']:.1f} s of one core",
        f"a million takes {figures['million_s']:.1f} s, wanted at most {figures['target_s']:g}: "
        f"{verdict(figures['reached']['cost'])}",
        "",
        f"{figures['compared']:<46d}{'us a pose':>12}{'times ours':>12}{'otherwise':>11}",
    ]
    for name, other in figures["others"].items():
        lines.append(
            f"{_METHODS[name]:46}{other['us']:12.1f}{other['times']:12.1f}{other['otherwise']:11d}"
        )
    lines += [f"{_METHODS[name]}: not installed" for name in figures["not_installed"]]
    return [
        *lines,
        "",
        f"volume at home's orientation: grid {volume['grid_m3']:.3f} m3, rays "
        f"{volume['rays_m3']:.3f} m3, drawn places {volume['drawn_m3']:.3f} m3 (+- "
        f"{volume['drawn_std_m3']:.3f})",
        f"rays against grid: {100.0 * volume['rays_against_grid']:+.1f} %, wanted within 2 %: "
        f"{verdict(figures['reached']['agreement'])}",
    ]


def _poses(model: PlatformModel, count: int) -> FloatArray:
    """Return poses (count, 4, 3) all over the frame, turned as far as targets may be."""
    rng = np.random.default_rng(_SEED)
    exits = np.array(model.platform.exit_points_m)
    angle = model.angle_rad / math.sqrt(3.0)
    position = rng.uniform(exits.min(axis=0), exits.max(axis=0), (count, 3))
    return model.poses(np.hstack([position, rng.uniform(-angle, angle, (count, 3))]))


def _others(workspace: CableWorkspace, poses: FloatArray) -> dict[str, dict[str, float]]:
    """Return for each method its processor time for a pose, us, and how often it says otherwise."""
    methods: dict[str, Method] = {
        "margins": lambda p: workspace.capacity_margins(p) >= 0.0,
        "active set": lambda p: workspace.margins(p, 0.0)[0] >= 0.0,
        "osqp": lambda p: _by_osqp(workspace, p),
    }
    if find_spec("pycapacity"):
        methods["pycapacity"] = lambda p: _by_pycapacity(workspace, p)
    margins = workspace.capacity_margins(poses)
    clear, ours_us = np.abs(margins) > _NEAR_N, 0.0
    others = {}
    for name, method in methods.items():
        method(poses[:2])
        begun = time.process_time()
        held = method(poses)
        us = 1e6 * (time.process_time() - begun) / len(poses)
        ours_us = ours_us or us
        otherwise = int(((held != (margins >= 0.0)) & clear).sum())
        others[name] = {"us": us, "times": us / ours_us, "otherwise": otherwise}
    return others


def _by_osqp(workspace: CableWorkspace, poses: FloatArray) -> Held:
    """Ask OSQP for the least tensions, eq. (3.80), under one corner after the other."""
    matrices, corners = workspace.wrench_matrices(poses), workspace.wrenches
    scale = np.abs(matrices[0]).max(axis=1)
    d, n = matrices.shape[1:]
    rows = sp.csc_matrix(np.vstack([np.ones((d, n)), np.eye(n)]))
    inner = rows.indices < d
    row, column = rows.indices[inner], np.repeat(np.arange(n), np.diff(rows.indptr))[inner]
    solver, held = osqp.OSQP(), np.zeros(len(poses), bool)

    def bounds(w_e: FloatArray) -> tuple[FloatArray, FloatArray]:
        b = -w_e / scale
        return np.concatenate([b, workspace.low]), np.concatenate([b, workspace.high])

    low, high = bounds(corners[0])
    solver.setup(
        sp.eye(n, format="csc"), np.zeros(n), rows, low, high,
        verbose=False, eps_abs=1e-6, eps_rel=1e-6, eps_prim_inf=1e-6, max_iter=20_000,
    )  # fmt: skip
    values = np.array(rows.data)
    for k, W in enumerate(matrices):
        values[inner] = (W / scale[:, None])[row, column]
        solver.update(Ax=values)
        held[k] = True
        for w_e in corners:
            low, high = bounds(w_e)
            solver.update(l=low, u=high)
            if solver.solve(raise_error=False).info.status != "solved":
                held[k] = False
                break
    return held


def _by_pycapacity(workspace: CableWorkspace, poses: FloatArray) -> Held:
    """Ask pycapacity for the half-spaces of the wrenches that tensions exert, for every pose."""
    from pycapacity.algorithms import hyper_plane_shift_method  # noqa: PLC0415 # not everybody has

    held = np.zeros(len(poses), bool)
    for k, W in enumerate(workspace.wrench_matrices(poses)):
        H, most = hyper_plane_shift_method(W, workspace.low, workspace.high)
        held[k] = bool((-workspace.wrenches @ H.T <= np.ravel(most) + 1e-9).all())
    return held


def _volume(model: PlatformModel, poses: int, out: Any) -> dict[str, float]:
    """Return the volume, m3, of the workspace at home's orientation, by three ways."""
    robot = load_robot(ROBOT)
    criterion = criterion_of(robot, model.platform.acceleration_m_s2, np.zeros((1, 3)), 0.0)
    box = view_of(model.platform)
    found = search(Search(criterion, box, CELLS, RAYS, None, 1, None), out)
    rng, held = np.random.default_rng(_SEED), 0
    for k in range(0, poses, _BLOCK):
        points = rng.uniform(box.low_m, box.high_m, (min(_BLOCK, poses - k), 3))
        held += int((criterion.depths(points) >= 0.0).sum())
    drawn = float(np.prod(np.subtract(box.high_m, box.low_m))) * held / poses
    return {
        "grid_m3": found.grid.size,
        "rays_m3": found.rays.size,
        "drawn_m3": drawn,
        "drawn_std_m3": drawn * math.sqrt((1.0 - held / poses) / max(held, 1)),
        "rays_against_grid": found.rays.size / found.grid.size - 1.0,
    }
