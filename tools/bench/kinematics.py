"""What a pose from cable lengths costs, and how bad a start may be, beside plain methods."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import cached_property
from operator import ge, le
from typing import Any

import numba
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import bound
from cdpr_rt.robots.kinematics import cable_kernel, normal_equations, pose_search
from cdpr_rt.robots.kinematics.cable_model import CableModel
from cdpr_rt.robots.kinematics.kinematics import CableKinematics
from cdpr_rt.robots.kinematics.pose import Pose
from cdpr_tools.bench.geometries import COGIRO, SPATIAL_8, Geometry, held_tensions
from cdpr_tools.bench.timing import verdict

TARGET_us = 15.0
"""From the last pose, 99th percentile."""
ANGLES_deg = tuple(float(angle) for angle in np.linspace(2.0, 40.0, 10))
RESTARTS = 9
_NEAR_m, _NEAR_rad = 0.1, math.radians(1.0)
_REPEATS = 5
_SCIPY_POSES = 100
_PAYLOAD_kg, _TENSIONS_N, _EA_N = 100.0, (10.0, 6000.0), 35e9 * 8.205e-6
_NOISE_m = 5e-3
_LOW_m, _HIGH_m, _TURN_deg = (-6.75, -4.75, 0.0), (6.75, 4.75, 4.75), 30.0

Search = Callable[[FloatArray, Pose], Pose]


@numba.njit
def _plain_levenberg_marquardt(  # type: ignore[no-untyped-def]
    geometry, cables, solver, lengths, pose
):
    """Search as it is published: damping 1e-6, at most 30 steps, done at a step below 1e-9."""
    cost = cable_kernel.compare(geometry, lengths, pose, cables)
    for k in range(1, 31):
        normal_equations.assemble(cables, solver)
        for j in range(6):
            solver[j, j] += 1e-6
        if not normal_equations.factorise(solver, 0.0):
            return pose_search.SINGULAR, k, cost
        size, _ = normal_equations.find_step(solver)
        pose_search.move(pose, solver[normal_equations.STEP])
        cost = cable_kernel.compare(geometry, lengths, pose, cables)
        if size < 1e-9:
            return pose_search.CONVERGED, k, cost
    return pose_search.UNFINISHED, 30, cost


class PlainKinematics(CableKinematics):
    """The same kinematics with plain Levenberg-Marquardt, compiled of the same parts."""

    @cached_property
    def _plain(self) -> Callable[[FloatArray, FloatArray], tuple[int, int, float]]:
        return bound(
            _plain_levenberg_marquardt, self.geometry, self._cables, self.solver,
            then=(self._target, self._solution.pose.array),
        )  # fmt: skip

    def _search(self, lengths_m: FloatArray, restarts: int) -> None:  # noqa: ARG002
        found = self._solution
        status, found.steps, cost = self._plain(lengths_m, found.pose.array)
        found.converged = status == pose_search.CONVERGED
        found.residual_m = math.sqrt(cost / self.n)


def measure(poses: int, out: Any) -> dict[str, Any]:
    """Measure both figures with so many poses each; `out` says what goes on."""
    out.note("following a path on spatial-8")
    tracking = _track(poses)
    figures: dict[str, Any] = {"tracking": tracking, "target_us": TARGET_us, "poses": poses}
    out.note(f"looking for {poses} poses that CoGiRo can hold")
    held = _held_poses(poses)
    for name, noisy in (("exact", False), ("noisy", True)):
        out.note(f"bad starts, {name} lengths")
        figures[name] = _bad_starts(held, noisy)
    figures["reached"] = {
        "tracking": tracking["p99"] <= TARGET_us,
        **{
            f"{name}_{key}": all(
                compare(row["ours"][key], row["plain"][key]) for row in figures[name]
            )
            for name in ("exact", "noisy")
            for key, compare in (("success", ge), ("p50", le), ("p99", le))
        },
    }
    return figures


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as a table, a line for each angle of the starting error."""
    verdicts = {name: verdict(reached) for name, reached in figures["reached"].items()}
    us = figures["tracking"]
    lines = [
        f"spatial-8, from the last pose, {figures['poses']} poses: p50 {us['p50']:.1f} us, p99 "
        f"{us['p99']:.1f} us, p99.9 {us['p99.9']:.1f} us",
        f"p99 wanted at most {figures['target_us']:g} us: {verdicts['tracking']}",
    ]
    searches = {"ours": "ours", "plain": "plain LM, compiled", "scipy": "plain LM, SciPy"}
    for name, text in (
        ("exact", "exact lengths"),
        ("noisy", "cables that stretch, 5 mm of noise"),
    ):
        lines += [
            f"CoGiRo, {figures['poses']} poses, start off by 1 m and the angle, {text}",
            f"{'':8}" + "".join(f"{search:^32}" for search in searches.values()),
            f"{'deg':8}" + f"{'success':>10}{'p50, us':>11}{'p99, us':>11}" * len(searches),
        ]
        for row in figures[name]:
            cells = "".join(
                f"{100 * one['success']:8.2f} %{one['p50']:11.1f}{one['p99']:11.1f}"
                for one in map(row.get, searches)
            )
            lines.append(f"{row['angle_deg']:<8.1f}{cells}")
        lines.append(
            "at every angle, against plain LM, compiled: success at least "
            f"{verdicts[name + '_success']}, p50 at most {verdicts[name + '_p50']}, p99 at most "
            f"{verdicts[name + '_p99']}"
        )
    return lines


def _track(cycles: int) -> dict[str, float]:
    """Follow a path at 1 kHz and up to 0.5 m/s and 20 deg/s with noise of 0.1 mm."""
    robot = _robot(SPATIAL_8, CableKinematics, 1e-3)
    rng, spent, worst = np.random.default_rng(1), np.zeros(cycles), 0.0
    pose, off = SPATIAL_8.home, np.zeros(6)
    for k in range(-100, cycles):
        s = 2e-3 * math.pi / 5.0 * k
        x = np.array([math.sin(s), math.sin(2.0 * s), math.cos(s), math.sin(s), math.cos(s), 0.5])
        truth = SPATIAL_8.home.plus(x * [0.3, 0.2, 0.2, 0.25, 0.25, 0.25])
        rho = robot.lengths(truth) + rng.normal(0.0, 1e-4, robot.n)
        start = truth if k == -100 else pose
        begun = time.perf_counter_ns()
        found = robot.pose_from_lengths(rho, start)
        taken = time.perf_counter_ns() - begun
        pose = found.pose
        if k >= 0:
            spent[k] = 1e-3 * taken
            off = pose.minus(truth)
            worst = max(worst, float(np.linalg.norm(off[:3])))
            if not found.converged:
                worst = math.inf
    p50, p99, p999 = np.percentile(spent, (50.0, 99.0, 99.9))
    return {"p50": float(p50), "p99": float(p99), "p99.9": float(p999), "worst_off_m": worst}


def _robot(geometry: Geometry, kind: type[CableKinematics], std_m: float) -> CableKinematics:
    return kind(
        geometry.exit_points_m, geometry.anchor_points_m, home=geometry.home, length_std_m=std_m
    )


def _held_poses(count: int) -> list[tuple[FloatArray, FloatArray, Pose, FloatArray]]:
    """Return (position, angles in deg, pose, tensions) of poses that the robot can stand in."""
    robot, rng = _robot(COGIRO, CableKinematics, 1e-6), np.random.default_rng(2025)
    weight = np.array([0.0, 0.0, -_PAYLOAD_kg * 9.81, 0.0, 0.0, 0.0])
    held: list[tuple[FloatArray, FloatArray, Pose, FloatArray]] = []
    while len(held) < count:
        p, angles = rng.uniform(_LOW_m, _HIGH_m), rng.uniform(-_TURN_deg, _TURN_deg, 3)
        pose = Pose(p, Rotation.from_euler("xyz", angles, degrees=True).as_matrix())
        t = held_tensions(robot.wrench_matrix(pose), weight, *_TENSIONS_N)
        if t is not None:
            held.append((p, angles, pose, t))
    return held


def _bad_starts(
    held: list[tuple[FloatArray, FloatArray, Pose, FloatArray]], noisy: bool
) -> list[dict[str, Any]]:
    """Return a row of figures for each angle of the starting error.

    Noisy: cables stretch, and what they are without tension is known with noise; all methods are
    given those lengths, stretched again by tensions that are known.
    """
    std = _NOISE_m if noisy else 1e-6
    plain = _robot(COGIRO, PlainKinematics, std)
    robot = _robot(COGIRO, CableKinematics, std)
    cables = CableKinematics(COGIRO.exit_points_m, COGIRO.anchor_points_m, model=CableModel(_EA_N))
    rng = np.random.default_rng(40)
    lengths = []
    for _, _, pose, t in held:
        noise = rng.normal(0.0, _NOISE_m, plain.n) if noisy else 0.0
        lengths.append((cables.lengths(pose, t) + noise) * (1.0 + t / _EA_N))
    searches: dict[str, Search] = {
        "ours": lambda rho, start: robot.pose_from_lengths(rho, start, restarts=RESTARTS).pose,
        "plain": lambda rho, start: plain.pose_from_lengths(rho, start).pose,
        "scipy": _scipy,
    }
    for search in searches.values():
        search(lengths[0], held[0][2])
    rows = []
    for angle in ANGLES_deg:
        spent: dict[str, list[float]] = {name: [] for name in searches}
        right = dict.fromkeys(searches, 0)
        for i, ((p, angles, truth, _), rho) in enumerate(zip(held, lengths, strict=True)):
            start = Pose(
                p + rng.uniform(-1.0, 1.0, 3),
                Rotation.from_euler(
                    "xyz", angles + rng.uniform(-angle, angle, 3), degrees=True
                ).as_matrix(),
            )
            for name, (taken, found) in _in_turns(searches, rho, start, i < _SCIPY_POSES).items():
                spent[name].append(taken)
                right[name] += _is_near(found, truth)
        rows.append({"angle_deg": angle} | {n: _row(spent[n], right[n]) for n in searches})
    return rows


def _row(spent_us: list[float], right: int) -> dict[str, float]:
    p50, p99 = np.percentile(spent_us, (50.0, 99.0))
    return {"success": right / len(spent_us), "p50": float(p50), "p99": float(p99)}


def _in_turns(
    searches: dict[str, Search], rho: FloatArray, start: Pose, slow_too: bool
) -> dict[str, tuple[float, Pose]]:
    """Return the least time of some repetitions in turns, in us, and the pose of each search.

    In turns, as a machine's speed changes while it is measured; SciPy's is done once, if at all.
    """
    done: dict[str, tuple[float, Pose]] = {}
    for k in range(_REPEATS):
        for name, search in searches.items():
            if name == "scipy" and (k > 0 or not slow_too):
                continue
            begun = time.perf_counter_ns()
            found = search(rho, start)
            taken = 1e-3 * (time.perf_counter_ns() - begun)
            done[name] = (min(taken, done.get(name, (taken, found))[0]), found)
    return done


def _is_near(found: Pose, truth: Pose) -> bool:
    off = found.minus(truth)
    return bool(np.linalg.norm(off[:3]) < _NEAR_m and np.linalg.norm(off[3:]) < _NEAR_rad)


def _scipy(rho: FloatArray, start: Pose) -> Pose:
    """Search as one writes it first: Euler angles, NumPy, SciPy's Levenberg-Marquardt."""
    a, b = COGIRO.exit_points_m, COGIRO.anchor_points_m

    def errors(x: FloatArray) -> FloatArray:
        Q = Rotation.from_euler("xyz", x[3:]).as_matrix()
        return np.asarray(np.linalg.norm(x[:3] + b @ Q.T - a, axis=1) - rho)

    first = np.concatenate([start.p, Rotation.from_matrix(start.Q).as_euler("xyz")])
    x = least_squares(errors, first, method="lm").x
    return Pose(x[:3], Rotation.from_euler("xyz", x[3:]).as_matrix())
