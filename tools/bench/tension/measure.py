"""What a tension distribution costs from Python, beside general solvers, and what each finds."""

from __future__ import annotations

import gc
import time
from dataclasses import asdict
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.interface import TensionOutcome
from cdpr_rt.robots.tension.tension_distribution import (
    METHODS,
    TensionSolver,
    tension_distribution,
)
from cdpr_tools.bench.geometries import ROBOTS, CableRobot
from cdpr_tools.bench.tension.smoothness import smoothness
from cdpr_tools.bench.tension.solvers import solvers
from cdpr_tools.bench.timing import verdict
from cdpr_tools.output import Output

TARGET_US = 10.0
"""What one of ours may cost at p99."""
IN_THE_CYCLE = "minimum-norm"
_BLOCK = 500
_SEED = 1
_OTHERS = {
    "daqp": "DAQP",
    "piqp": "PIQP",
    "osqp": "OSQP, its own tolerance",
    "osqp-tight": "OSQP, 1e-9",
}
_FOUND = (TensionOutcome.FEASIBLE, TensionOutcome.SUBSTITUTED)
_PERCENTILES = {"p50": 50.0, "p99": 99.0, "p99.9": 99.9}


class _Ours:
    """One of the project's methods, asked as the solvers are."""

    def __init__(self, robot: CableRobot, distribution: TensionSolver, n: int) -> None:
        self.t = np.zeros(n)
        self.distribution = distribution
        self._w_e = robot.wrench_N_Nm

    def solve(self, W: FloatArray) -> TensionOutcome:
        return self.distribution.solve(W, self._w_e, self.t)


def measure(poses: int, out: Output) -> dict[str, Any]:
    """Solve `poses` poses of each robot by every method and solver; return the figures."""
    robots = {robot.name: _measure_robot(robot, poses, out) for robot in ROBOTS}
    return {
        "poses": poses,
        "target_us": TARGET_US,
        "in_the_cycle": IN_THE_CYCLE,
        "robots": robots,
        "reached": all(all(figures["reached"].values()) for figures in robots.values()),
    }


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as tables, two for each robot."""
    return [
        line
        for name, robot in figures["robots"].items()
        for line in _robot_report(name, robot, figures)
    ]


def _robot_report(name: str, robot: dict[str, Any], figures: dict[str, Any]) -> list[str]:
    lines = [
        "",
        f"{name}, {figures['poses']} poses",
        f"{'':26}{'processor time, us':^27}{'wall, us':^18}{'found':>9}",
        f"{'':26}{'p50':>9}{'p99':>9}{'p99.9':>9}{'p50':>9}{'p99':>9}{'%':>9}",
    ]
    for method, cpu in robot["cpu_us"].items():
        wall = robot["wall_us"][method]
        lines.append(
            f"{_OTHERS.get(method, method):26}{cpu['p50']:9.1f}{cpu['p99']:9.1f}{cpu['p99.9']:9.1f}"
            f"{wall['p50']:9.1f}{wall['p99']:9.1f}{100.0 * robot['found'][method]:9.2f}"
        )
    lines += [f"{_OTHERS[method]}: not installed" for method in robot["not_installed"]]
    lines += [
        f"{'change, where carried':30}{'N per mm of path':^27}{'steps':^20}",
        f"{'':30}{'p50':>9}{'p99':>9}{'most':>9}{'paths':>11}{'largest, N':>12}",
    ]
    for method, smooth in robot["smoothness"].items():
        steps = f"{smooth['paths_with_steps']} of {smooth['paths']}"
        lines.append(
            f"{method:30}{smooth['p50_N_mm']:9.3f}{smooth['p99_N_mm']:9.2f}"
            f"{smooth['most_N_mm']:9.1f}{steps:>11}{smooth['largest_step_N']:12.2g}"
        )
    nearest = robot["smoothness_of_the_nearest"]
    helped = 100.0 * robot["substituted"]["closed-form"]
    method = figures["in_the_cycle"]
    return [
        *lines,
        f"beyond what can be carried tensions step on {nearest['paths_with_steps']} of "
        f"{nearest['paths']} paths, by {nearest['largest_step_N']:.2g} N at most; the wrench by "
        f"{nearest['largest_step_of_the_wrench_N']:.1g} N",
        f"closed form: in {helped:.2f} % of the poses it found none where there were some",
        f"called feasible, within bounds, and missing of the wrench at most "
        f"{robot['wrench_missing_N']:.1e} N",
        f"{method}: p99 {robot['cpu_us'][method]['p99']:.1f} us of processor time, wanted at most "
        f"{figures['target_us']:g}: {verdict(robot['reached']['cost'])}",
        f"feasible for OSQP at 1e-9, not for {method}: {robot['only_osqp']} poses, wanted 0: "
        f"{verdict(robot['reached']['feasible_wherever_osqp'])}; the other way round "
        f"{robot['only_ours']}",
    ]


def _measure_robot(robot: CableRobot, poses: int, out: Output) -> dict[str, Any]:
    matrices = robot.wrench_matrix(*robot.poses(poses, _SEED))
    distributions = {name: _distribution(robot, name) for name in METHODS}
    n = matrices.shape[2]
    methods: dict[str, Any] = {name: _Ours(robot, d, n) for name, d in distributions.items()}
    others, absent = solvers(robot, matrices[0])
    methods |= others
    out.say(f"{robot.name}: {poses} poses by {', '.join(methods)}")
    cpu, wall, found, tensions = _interleaved(matrices, methods)
    out.say(f"{robot.name}: paths")
    smooth = {name: smoothness(robot, d, poses, _SEED) for name, d in distributions.items()}
    ours, reference = found[IN_THE_CYCLE] < TensionOutcome.NEAREST, found["osqp-tight"] == 1
    p99 = float(np.percentile(cpu[IN_THE_CYCLE], 99.0))
    return {
        "not_installed": absent,
        "cpu_us": {name: _percentiles(us) for name, us in cpu.items()},
        "wall_us": {name: _percentiles(us) for name, us in wall.items()},
        "found": {name: _share(name, outcome) for name, outcome in found.items()},
        "substituted": {
            name: float(np.mean(found[name] == TensionOutcome.SUBSTITUTED)) for name in METHODS
        },
        "only_ours": int(np.sum(ours & ~reference)),
        "only_osqp": int(np.sum(reference & ~ours)),
        "wrench_missing_N": max(
            _missing(robot, matrices, tensions[name], found[name]) for name in METHODS
        ),
        "smoothness": {name: asdict(carried) for name, (carried, _) in smooth.items()},
        "smoothness_of_the_nearest": asdict(smooth[IN_THE_CYCLE][1]),
        "reached": {
            "cost": p99 <= TARGET_US,
            "feasible_wherever_osqp": not bool((reference & ~ours).any()),
        },
    }


def _distribution(robot: CableRobot, method: str) -> TensionSolver:
    n = robot.exit_points.shape[0]
    low, high = np.full(n, robot.low_N), np.full(n, robot.high_N)
    reference = 0.5 * (low + high) if method == "minimum-deviation" else None
    return tension_distribution(method, low, high, robot.wrench_scale, reference)


def _interleaved(matrices: FloatArray, methods: dict[str, Any]) -> tuple[dict[str, Any], ...]:
    """Give all the same poses, in blocks that take turns: times, us, what was found, tensions.

    Processor time of this thread is what a call costs, whatever else the machine does; what it
    costs to read that clock is taken off.
    """
    count, _, n = matrices.shape
    cpu = {name: np.zeros(count) for name in methods}
    wall = {name: np.zeros(count) for name in methods}
    found = {name: np.zeros(count, int) for name in methods}
    tensions = {name: np.zeros((count, n)) for name in methods}
    thread_ns, clock_ns = time.thread_time_ns, time.perf_counter_ns
    reading = float(np.median([-(thread_ns() - thread_ns()) for _ in range(10_000)]))
    gc.collect()
    gc.disable()
    try:
        for first in range(0, count, _BLOCK):
            for name, method in methods.items():
                for W in matrices[first : first + 20]:  # warms it up
                    method.solve(W)
                for k in range(first, min(first + _BLOCK, count)):
                    W = matrices[k]
                    begun = clock_ns()
                    begun_cpu = thread_ns()
                    outcome = method.solve(W)
                    ended_cpu = thread_ns()
                    wall[name][k] = clock_ns() - begun
                    cpu[name][k] = ended_cpu - begun_cpu - reading
                    found[name][k] = outcome
                    tensions[name][k] = method.t
    finally:
        gc.enable()
    for name in methods:
        cpu[name] /= 1e3
        wall[name] = (wall[name] - 2.0 * reading) / 1e3
    return cpu, wall, found, tensions


def _percentiles(us: FloatArray) -> dict[str, float]:
    return {key: float(np.percentile(us, q)) for key, q in _PERCENTILES.items()}


def _share(name: str, outcome: FloatArray) -> float:
    return float(np.mean(np.isin(outcome, _FOUND) if name in METHODS else outcome == 1))


def _missing(
    robot: CableRobot, matrices: FloatArray, tensions: FloatArray, outcome: FloatArray
) -> float:
    """Return by how much tensions that were called feasible miss the wrench at most, by NumPy.

    Infinite where one is outside its bounds.
    """
    feasible = np.isin(outcome, _FOUND)
    t = tensions[feasible]
    if (t < robot.low_N).any() or (t > robot.high_N).any():
        return float("inf")
    exerted = np.einsum("kij,kj->ki", matrices[feasible], t)
    return float(np.abs((exerted + robot.wrench_N_Nm) / robot.wrench_scale).max(initial=0.0))
