"""Compare with SciPy: the cost of a pose from cable lengths, and how far off its start may be."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from itertools import cycle

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of
from cdpr_rt.model.pose import Pose
from cdpr_tools.bench.harness import Figures, Row, Target, Work, cost_rows, with_nothing_open
from cdpr_tools.output import Output

ROBOT = "spatial-8"
ANGLES_deg = (10.0, 40.0)
RESTARTS = 9
_NEAR_m, _NEAR_rad = 1e-3, math.radians(0.1)
_NOISE_m, _STEP_S, _START_m = 1e-4, 1e-3, 0.5
_BLOCK, _WARM_UP = 200, 5

Search = Callable[[FloatArray, Pose], Pose]
Case = tuple[FloatArray, Pose, Pose]
"""Lengths (n,), the start of the search, and the true pose."""


def measure(poses: int, out: Output) -> Figures:
    """Search `poses` poses along a path, and as many from starts with each angle error."""
    model = platform_model_of(load_robot(ROBOT))
    out.note("following a path")
    rows = _compare(model, "along a path", _along_path(model, poses), 0)
    p99_us = rows["along a path, ours"]["CPU p99"]
    for angle in ANGLES_deg:
        out.note(f"starts off by {angle:g} deg")
        name = f"{angle:g} deg off"
        rows |= _compare(model, name, _bad_starts(model, poses, angle), RESTARTS)
    return Figures(
        f"{ROBOT}: {poses} poses from lengths along a path at 1 kHz, from the last pose, and from "
        f"starts off by {_START_m:g} m and an angle; processor and wall time, us",
        rows,
        {"tracking": Target("along a path, ours, processor time p99, us", p99_us, 15.0)},
        more={"poses": poses},
    )


def _compare(model: PlatformModel, name: str, cases: list[Case], restarts: int) -> dict[str, Row]:
    kinematics = model.kinematics
    searches: dict[str, Search] = {
        f"{name}, ours": lambda rho, start: (
            kinematics.pose_from_lengths(rho, start, restarts=restarts).pose
        ),
        f"{name}, SciPy": partial(_scipy, model),
    }
    right: dict[str, list[bool]] = {way: [] for way in searches}
    steps = {
        way: with_nothing_open(_steps(search, cases, right[way]))
        for way, search in searches.items()
    }
    rows = cost_rows(steps, len(cases), _BLOCK, _WARM_UP, (50.0, 99.0))
    for way, row in rows.items():
        row["found, %"] = 100.0 * float(np.mean(right[way]))
    return rows


def _steps(search: Search, cases: list[Case], right: list[bool]) -> Iterator[Work]:
    """Yield one search after the other; append to `right` whether each came near the truth."""
    found: list[Pose] = []
    for rho, start, truth in cycle(cases):
        yield lambda rho=rho, start=start: found.append(search(rho, start))  # type: ignore[misc]
        off = found.pop().minus(truth)
        near = np.linalg.norm(off[:3]) < _NEAR_m and np.linalg.norm(off[3:]) < _NEAR_rad
        right.append(bool(near))


def _along_path(model: PlatformModel, count: int) -> list[Case]:
    """Return a path at up to 0.5 m/s and 20 deg/s, with noisy lengths."""
    rng, home = np.random.default_rng(1), model.home_pose
    cases: list[Case] = []
    last = home
    for k in range(count + 1):
        s = 2.0 * math.pi / 5.0 * _STEP_S * k
        x = np.array([math.sin(s), math.sin(2.0 * s), math.cos(s), math.sin(s), math.cos(s), 0.5])
        truth = home.plus(x * [0.3, 0.2, 0.2, 0.25, 0.25, 0.25])
        rho = model.kinematics.lengths(truth) + rng.normal(0.0, _NOISE_m, model.kinematics.n)
        cases.append((rho, last, truth))
        last = truth
    return cases[1:]


def _bad_starts(model: PlatformModel, count: int, angle_deg: float) -> list[Case]:
    """Return exact lengths of poses in the box of targets, and starts that are off."""
    rng, platform, angle = np.random.default_rng(40), model.platform, math.radians(angle_deg)
    places = rng.uniform(-1.0, 1.0, (count, 6)) * model.angle_rad / math.sqrt(3.0)
    places[:, :3] = rng.uniform(platform.workspace_min_m, platform.workspace_max_m, (count, 3))
    offs = rng.uniform(-1.0, 1.0, (count, 6)) * np.repeat([_START_m, angle], 3)
    cases = []
    for place, off in zip(places, offs, strict=True):
        truth = model.pose(place)
        cases.append((model.kinematics.lengths(truth).copy(), truth.plus(off), truth))
    return cases


def _scipy(model: PlatformModel, rho: FloatArray, start: Pose) -> Pose:
    """Search in a simple way: Euler angles, NumPy, SciPy's Levenberg-Marquardt."""
    a, b = np.array(model.platform.exit_points_m), np.array(model.platform.anchor_points_m)

    def errors(x: FloatArray) -> FloatArray:
        Q = Rotation.from_euler("xyz", x[3:]).as_matrix()
        return np.asarray(np.linalg.norm(x[:3] + b @ Q.T - a, axis=1) - rho)

    first = np.concatenate([start.p, Rotation.from_matrix(start.Q).as_euler("xyz")])
    x = least_squares(errors, first, method="lm").x
    return Pose(x[:3], Rotation.from_euler("xyz", x[3:]).as_matrix())
